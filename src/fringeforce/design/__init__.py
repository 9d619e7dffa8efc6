"""What a person decides about a sensor: strip or pad, layers, light and camera, with units."""
