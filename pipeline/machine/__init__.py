"""A machine: robot, one drivetrain per joint, sensors."""
