"""Stresses of a layered block in three dimensions; knows no light."""
