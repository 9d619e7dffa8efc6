"""Stress to phase to intensity to grey levels; knows no elements."""
