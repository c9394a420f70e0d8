"""A cycle of the gait in 3D, in a browser."""
