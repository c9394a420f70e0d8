"""Effects of bodies, ground and stance."""
