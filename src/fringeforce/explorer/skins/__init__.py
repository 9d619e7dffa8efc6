"""The page of a skin: what it may ask, and who answers."""
