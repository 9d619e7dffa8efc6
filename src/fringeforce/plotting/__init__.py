"""Figures on axes, and figures in files."""
