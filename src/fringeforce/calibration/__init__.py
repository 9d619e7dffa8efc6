"""Frames with known loads against a model: fit it to them, or check it on them."""
