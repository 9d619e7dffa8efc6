"""The live loop between a camera, a reader and its sinks."""
