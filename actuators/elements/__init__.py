"""Elements of an actuator: one law between two neighbouring shafts each.

A new one is a file here and its name in `LAWS` of `actuators.loading.build`.
"""
