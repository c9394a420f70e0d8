"""Positions of the joint, of the motor, or of both, with and without a gear ratio."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from actuators.errors import LegwattError
from pipeline.logs.log_format import Expected
from pipeline.logs.reading.log import sides_of
from tests.pipeline.logs.made import motion

_, Q, _, _ = motion()
RATIO = np.array([100.0, -100.0])


@pytest.fixture
def bare(two_joints: Expected) -> Expected:
    """The same robot without an actuator."""
    return replace(two_joints, ratio=None)


def test_the_mappings_ratio_stands_in_for_an_actuator(bare: Expected) -> None:
    sides = sides_of(None, Q * RATIO, bare, {"a": 100.0, "b": -100.0}, "log")
    assert np.allclose(sides.position, Q)


def test_both_positions_tell_their_ratio(bare: Expected) -> None:
    sides = sides_of(Q, Q * RATIO + 7.0, bare, {}, "log")
    assert sides.source == "joint"
    assert sides.motor is not None
    assert np.allclose(np.diff(sides.motor, axis=0), np.diff(Q, axis=0))
    assert "gear ratio -100" in sides.remarks["b"]


def test_a_ratio_that_the_two_positions_contradict_is_told(two_joints: Expected) -> None:
    sides = sides_of(Q, Q * RATIO * 0.8, two_joints, {}, "log")
    assert "80 by the two positions, 100 by the files" in sides.remarks["a"]


def test_a_motor_that_was_divided_already_is_taken_as_it_is(
    two_joints: Expected, bare: Expected
) -> None:
    sides = sides_of(Q, Q.copy(), two_joints, {}, "log")
    assert sides.motor is not None
    assert np.allclose(sides.motor, Q)
    assert "divided" in sides.remarks["a"]
    alone = sides_of(None, Q.copy(), bare, {}, "log")
    assert np.allclose(alone.position, Q)
    assert "no gear ratio is known" in alone.remarks["a"]


def test_a_motor_alone_that_leaves_the_limits_needs_a_ratio(bare: Expected) -> None:
    with pytest.raises(LegwattError, match=r"a__motor_position_rad .*\[gear_ratio\]"):
        sides_of(None, Q * RATIO, bare, {}, "log")


def test_one_joint_with_its_motor_alone_is_told_among_others(two_joints: Expected) -> None:
    own, motor = Q.copy(), Q * RATIO
    own[:, 1] = np.nan
    motor[:, 0] = np.nan
    sides = sides_of(own, motor, two_joints, {}, "log")
    assert np.allclose(sides.position, Q)
    assert list(sides.remarks) == ["b"]
