"""What to press to calibrate a sensor."""
