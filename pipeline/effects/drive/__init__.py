"""Effects of motor and transmission."""
