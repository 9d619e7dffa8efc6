"""What is particular to the frames of a pad: its search, fit and mirror images."""
