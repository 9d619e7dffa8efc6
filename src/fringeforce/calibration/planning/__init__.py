"""Which loads to calibrate a sensor with."""
