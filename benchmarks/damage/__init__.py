"""Bad input of every kind, and what may become of it."""
