"""The verb `init-actuator`: a folder of actuator files from a data sheet."""
