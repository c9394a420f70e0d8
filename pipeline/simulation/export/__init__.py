"""What was found, as other tools write it: MJCF, URDF, ROS 2 control; and what they cannot hold."""
