"""From a phase or a frame to forces and their covariance; knows arrays only."""
