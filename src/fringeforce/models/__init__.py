"""A characterised sensor, strip or pad: from forces to phases and frames."""
