"""Corrections of the influence matrix, column by column."""
