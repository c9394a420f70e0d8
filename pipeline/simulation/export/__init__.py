"""What was found, as other tools write it: MJCF and URDF; and what they cannot hold."""
