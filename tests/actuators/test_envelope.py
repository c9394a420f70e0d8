"""The drawn region and the checked limits are the same limits."""

from __future__ import annotations

import math

import numpy as np
import pytest

from actuators.chain import ChainResult
from actuators.elements.motor import DCMotor
from actuators.energy.envelope import operating_region
from actuators.energy.limits import limit_rows
from actuators.shaft import ShaftSeries

RE40 = DCMotor("m", 0.0302, 0.316, 858.7, 24.0, 5.77, 75.7)


def inside(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Left of every edge of a counterclockwise polygon."""
    edges = np.roll(corners, -1, axis=0) - corners
    away = points[:, None, :] - corners
    return np.all(edges[:, 0] * away[..., 1] - edges[:, 1] * away[..., 0] >= 0, axis=1)


@pytest.mark.parametrize(
    "motor",
    [
        RE40,
        DCMotor("weak supply", 0.05, 1.0, 900.0, 12.0, 2.0, 30.0),
        DCMotor("low peak", 0.05, 1.0, 100.0, 48.0, 2.0, 4.0),
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


def test_limit_rows_breach_exactly_where_the_motion_leaves_the_region() -> None:
    time = np.linspace(0.0, 1.0, 200)
    zero = np.zeros((200, 1))
    for top in (300.0, 700.0, 1000.0):
        speed = top * np.sin(2 * np.pi * time)[:, None]
        torque = 0.2 * np.cos(2 * np.pi * time)[:, None]
        shaft = ShaftSeries.at_joint(("a",), time, zero, speed, zero, torque)
        current = RE40.current(torque)
        voltage = RE40.voltage(current, speed)
        result = ChainResult(
            "c", {"out": shaft, "m": shaft}, {}, {}, current, voltage, current * voltage, (RE40,)
        )
        breach = any(r.breach for r in limit_rows(result) if r.quantity != "rms_current")
        corners = operating_region(RE40, reach=(2e3, 5.0))
        points = np.column_stack([speed[:, 0], torque[:, 0]])
        assert breach == (not inside(corners, points).all())
