"""Effects of friction at a joint."""
