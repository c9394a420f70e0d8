"""Figures of the robot and its gait."""
