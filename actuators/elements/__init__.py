"""Elements of an actuator: one law between two neighbouring shafts each."""
