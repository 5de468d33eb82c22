"""Roads: height maps made, measured, read and described."""
