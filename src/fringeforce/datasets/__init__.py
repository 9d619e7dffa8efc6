"""Simulated images of a pad under random contacts, with the forces that made them."""
