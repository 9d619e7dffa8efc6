"""Displacements and stresses of the strip; knows no light."""
