"""Friction by the closed form of each of its terms; the named laws are choices of them."""

import math

import numpy as np
import pytest

from actuators.elements.element import Friction
from tests.actuators.motions import constant

STRIBECK = Friction("s", excess=2.0, stribeck_speed=0.1)
SIDED = Friction("d", coulomb=1.25, skew=0.75)
QUADRANT = Friction("q", when_driving=0.2, when_driven=0.05)
E = math.e


@pytest.mark.parametrize(
    ("law", "velocity", "torque", "expected"),
    [
        (Friction("f", coulomb=2.0), [3.0, -3.0], 5.0, [2.0, -2.0]),
        (Friction("f", viscous=2.0), [3.0, -3.0], 5.0, [6.0, -6.0]),
        (Friction("f", load=0.1), [3.0, -3.0, 3.0], [5.0, 5.0, -5.0], [0.5, -0.5, 0.5]),
        (STRIBECK, [0.1, -0.1, 10.0], 0.0, [2 / E, -2 / E, 0.0]),
        (SIDED, [1.0, -1.0], 0.0, [2.0, -0.5]),  # Coulomb and a constant torque
        (QUADRANT, [1, 1, -1, -1], [10, -10, 10, -10], [2.0, 0.5, -0.5, -2.0]),
        (QUADRANT, [1.0, -1.0], 0.0, [0.0, 0.0]),  # no load, no friction
        (Friction("f", quadratic=0.5), [2.0, -2.0], 1.0, [2.0, -2.0]),
        (Friction("f", viscous=1.0, asymmetry=0.25), [2.0, -2.0], 1.0, [2.5, -1.5]),
        (Friction("f", saturating=3.0, saturation_speed=0.5), [0.5, -50], 0.0, [2.284782, -3.0]),
        # Over a transition velocity: one standard deviation of the Gaussian at it, whole beyond.
        (Friction("f", coulomb=2.0, rise=0.1), [0.1, -0.1, 1.0], 0.0, [1.365379, -1.365379, 2.0]),
        # Whole laws at rest take nothing: what holds is another question.
        *((law, [0.0], 3.0, [0.0]) for law in (STRIBECK, SIDED, QUADRANT)),
    ],
)
def test_each_term_in_closed_form(law, velocity, torque, expected):
    np.testing.assert_allclose(law.added(constant(velocity, torque))[0], expected, atol=1e-6)


@pytest.mark.parametrize(
    ("law", "load", "interval"),
    [
        (Friction("f", coulomb=2.0, load=0.1, viscous=1.0), 10.0, (7.0, 13.0)),
        (STRIBECK, 1.0, (-1.0, 3.0)),  # the excess is whole at standstill
        (SIDED, 1.0, (0.5, 3.0)),
        (QUADRANT, 10.0, (9.5, 12.0)),
        (QUADRANT, -10.0, (-12.0, -9.5)),
        (Friction("f", coulomb=2.0, rise=0.1), 0.0, (-2.0, 2.0)),
    ],
)
def test_at_rest_friction_holds_an_interval(law, load, interval):
    np.testing.assert_allclose(law.holding(np.array(load), np.array(load)), interval)
