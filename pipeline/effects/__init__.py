"""The effects a model may lack, by where they act, and the model file that lists them."""

from pipeline.effects import base, bodies, drivetrain, motor_sensors

__all__ = ["base", "bodies", "drivetrain", "motor_sensors"]
base.enter()
