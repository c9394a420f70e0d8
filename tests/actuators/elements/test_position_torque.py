"""A parallel spring and a ripple, in an alternative of its own."""

import numpy as np
import pytest

from actuators.chain import Chain
from actuators.elements.element import Ratio
from actuators.elements.position_torque import PositionTorque
from actuators.energy.energy import integral
from actuators.errors import LegwattError
from actuators.shaft import DCMotor
from tests.actuators.motions import balance_residual, harmonic, split

K, R, N = 0.03, 0.3, 100.0


def chain(*elements):
    row = (*elements, Ratio("gear", N))
    return Chain("c", row, DCMotor("winding", K, R), {"m": "gear"})


def test_a_spring_supplies_what_hookes_law_says_and_a_ripple_repeats():
    spring, q = PositionTorque("s", stiffness=2.0, rest=0.1), np.array([0.3, 0.1, -0.2])
    np.testing.assert_allclose(spring.torque(q), [0.4, 0.0, -0.6], atol=1e-15)
    ripple = PositionTorque("r", amplitude=0.5, order=4.0, phase=0.2)
    np.testing.assert_allclose(ripple.torque(q), 0.5 * np.sin(4 * q + 0.2))
    np.testing.assert_allclose(ripple.torque(q + np.pi / 2), ripple.torque(q))


@pytest.mark.parametrize(
    "law",
    [
        PositionTorque("s", stiffness=40.0, rest=0.3),
        PositionTorque("s", amplitude=5.0, order=3.0, phase=0.4),
    ],
    ids=["spring", "ripple"],
)
def test_a_position_torque_stores_no_net_energy_over_a_cycle(law):
    s = split(harmonic(4001, joints=2, seed=3))
    result = chain(law).inverse(s)
    rate = result.stored["s"]
    assert np.abs(integral(s.time, np.abs(rate))).min() > 1.0  # it does take and give
    np.testing.assert_allclose(integral(s.time, rate), 0.0, atol=1e-4)
    assert "s" not in result.losses
    assert np.abs(balance_residual(result)).max() < 1e-9


def test_a_spring_that_carries_the_load_holds_without_current():
    spring = PositionTorque("s", stiffness=20.0, rest=0.5)
    torque, position = np.array([10.0, 10.0, 10.0]), np.array([0.0, 0.5, 1.0])
    held = chain(spring).holding(torque, position)
    # The drive supplies the load and k (q - rest).
    np.testing.assert_allclose(held.motor_torque * N, [0.0, 10.0, 20.0], atol=1e-12)
    np.testing.assert_allclose(held.power, R * (held.motor_torque / K) ** 2)
    with pytest.raises(LegwattError, match=r"element 's': what holds depends on the position"):
        chain(spring).holding(torque)
