"""A public benchmark of readers: frames of the richest simulations, and scores of what is read."""
