"""From grey levels to loads, on plain arrays: likelihood, least squares, tests and bounds."""
