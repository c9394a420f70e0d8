"""The blind trials' simulator: machines with something hidden, and the logs they leave.

It shares no code with the workflow that reads the logs; its friction is a bristle model (LuGre). In
the first matrix joints turn by forward dynamics under a position controller, and every machine
differs from its data sheet within tolerances. In the standard matrix (`fixed`) torques follow from
a planned motion by inverse dynamics, as the workflow computes them.
"""
