"""Pictures of area cameras to the lines that a strip's model expects."""
