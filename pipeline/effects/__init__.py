"""The effects a model may lack, by where they act, and the model file that lists them."""

# They enter the catalogue in this order.
# isort: off
from pipeline.effects import friction as friction
from pipeline.effects import transmission as transmission
from pipeline.effects import bodies as bodies
from pipeline.effects import motor as motor
from pipeline.effects import sensors as sensors
