"""The hypoid gear in closed form, and what locks itself."""

import numpy as np
import pytest

from actuators.elements.hypoid import Hypoid
from tests.actuators.motions import constant

B1, B2, MU, N, R2 = np.radians(80.0), np.radians(25.0), 0.1, 30.0, 0.0315
LOCKING = 0.2


def hypoid(mu=MU):
    return Hypoid("h", N, B1, B2, R2, mu)


@pytest.mark.parametrize(("velocity", "sign"), [(1.0, 1.0), (-1.0, -1.0)])
def test_efficiency_driving_and_driven_in_closed_form(velocity, sign):
    s = constant(velocity, 30.0)
    loss_of_power = hypoid().inverse(s).power / s.power
    expected = (1 + sign * MU * np.tan(B1)) / (1 + sign * MU * np.tan(B2))
    np.testing.assert_allclose(loss_of_power, expected, rtol=1e-13)


def test_a_self_locking_gear_holds_any_load():
    h = hypoid(LOCKING)
    assert h.factors[1] < 0.0
    low, high = h.holding(np.array([-30.0, 30.0]), np.array([-30.0, 30.0]))
    assert (low < 0).all()
    assert (high > 0).all()


def test_sliding_speed_is_the_difference_along_the_teeth():
    # Independent of the loss law: pitch-point velocities of both gears as vectors in the common
    # tangent plane, each at its spiral angle to the tooth trace.
    h, s = hypoid(), constant(1.0, 30.0)
    v2, v1 = R2 * 1.0, h.pinion_radius * N * 1.0
    assert v1 * np.cos(B1) == pytest.approx(v2 * np.cos(B2))  # normal to the teeth: equal
    slip = v1 * np.sin(B1) - v2 * np.sin(B2)
    assert h.loss(s)[0, 0] == pytest.approx(MU * h.normal_force(s)[0, 0] * slip)
