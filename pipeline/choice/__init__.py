"""Which actuator to build: a robot's day, every combination of parts, and how sure."""
