"""What is particular to the calibration of pads: the model of a frame, and where it is fitted."""
