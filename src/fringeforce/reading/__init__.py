"""From a frame to a reading: search, follow, judge, and say how sure."""
