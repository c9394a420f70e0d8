"""The effects a model may lack, by where they act, and the model file that lists them."""

# They enter the catalogue in this order.
# isort: off
from pipeline.effects import drivetrain as drivetrain
from pipeline.effects import bodies as bodies
from pipeline.effects import motor_sensors as motor_sensors
