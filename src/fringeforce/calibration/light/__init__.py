"""Light and pixels as they are: reference frames, drift, fixed-pattern noise."""
