"""Planar pads: a soft clear layered block, read from below by an area camera."""
