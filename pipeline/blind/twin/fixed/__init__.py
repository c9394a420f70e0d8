"""Fixed-base machines of the standard matrix: a pendulum, a leg and an arm, each a bare URDF.

Their links move as planned and everything else follows: torque from bodies that are not the URDF's,
friction of a law of its own at every joint stepped along the motion by bristles, gears that wind up
or play, and sensors that are late, rounded and noisy in colour. No step needs a controller, so that
a trial takes a second.
"""
