"""A robot as data: file, URDF, Pinocchio model, kinematics, checks."""
