"""Effects of sensors."""
