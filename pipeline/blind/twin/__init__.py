"""The blind trials' simulator: machines with something hidden, and the logs they leave.

It shares no law with the workflow that reads the logs: friction is a bristle model (LuGre), joints
turn by forward dynamics under a position controller, and every machine differs from its data sheet
within tolerances.
"""
