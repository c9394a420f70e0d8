"""A robot file from a URDF: what can be found is guessed with its reason, the rest asked for."""
