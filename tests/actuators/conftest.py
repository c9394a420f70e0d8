"""Hypothesis without a deadline: the tests hold no clock, and a slow machine is no failure."""

from hypothesis import settings

settings.register_profile("actuators", deadline=None)
settings.load_profile("actuators")
