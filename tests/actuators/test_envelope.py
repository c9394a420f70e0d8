"""The drawn region and the checked limits are the same limits."""

from __future__ import annotations

import math

import numpy as np
import pytest

from actuators.energy.limits import operating_region
from actuators.shaft import DCMotor


def inside(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Left of every edge of a counterclockwise polygon."""
    edges = np.roll(corners, -1, axis=0) - corners
    away = points[:, None, :] - corners
    return np.all(edges[:, 0] * away[..., 1] - edges[:, 1] * away[..., 0] >= 0, axis=1)


@pytest.mark.parametrize(
    "motor",
    [
        DCMotor("RE 40", 0.0302, 0.316, 858.7, 24.0, 5.77, 75.7),
        DCMotor("weak supply", 0.05, 1.0, 900.0, 12.0, 2.0, 30.0),
        DCMotor("no limits", 0.05, 1.0),
        DCMotor("speed only", 0.05, 1.0, max_speed=200.0),
    ],
)
def test_inside_is_where_no_limit_is_exceeded(motor: DCMotor) -> None:
    """Against what `limits` checks, at random points of the plane."""
    reach = (1500.0, 3.0)
    points = np.random.default_rng(1).uniform(-1, 1, (4000, 2)) * reach
    corners = operating_region(motor, reach=reach)
    speed, torque = points.T
    current = motor.current(torque)
    allowed = (
        (np.abs(speed) <= motor.max_speed)
        & (np.abs(current) <= motor.peak_current)
        & (np.abs(motor.voltage(current, speed)) <= motor.supply_voltage)
    )
    np.testing.assert_array_equal(inside(corners, points), allowed)
    assert allowed.sum() > 0
    assert allowed.all() == math.isinf(motor.max_speed)


def test_constants_may_differ_by_joint() -> None:
    motor = DCMotor("m", np.array([0.03, 0.06]), np.array([0.3, 0.6]), supply_voltage=24.0)
    for joint, constant in enumerate((0.03, 0.06)):
        corners = operating_region(motor, joint=joint, reach=(1e6, 1e-9))
        assert corners[:, 0].max() == pytest.approx(24.0 / constant)
