"""The hexapod's gait against its definition, and the numbers that make none."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from pipeline.errors import GaitError, OutOfReachError
from pipeline.motion.footfall import TRANSFER_PATHS, transfer_path
from pipeline.motion.motion import Motion
from pipeline.motion.support import standing_posture
from pipeline.motion.walking import walking_motion
from pipeline.robot.kinematics import foot_jacobians, foot_positions
from pipeline.robot.robot import Robot, load_robot


@pytest.mark.parametrize("name", TRANSFER_PATHS)
def test_transfer_paths_go_from_rest_to_rest_by_their_own_derivatives(name: str) -> None:
    path, s, h = transfer_path(name), np.linspace(0.01, 0.99, 50), 1e-6
    for profile in (path.advance, path.lift):
        for order, atol in ((0, 1e-8), (1, 1e-6)):
            slope = (profile(s + h)[order] - profile(s - h)[order]) / (2 * h)
            np.testing.assert_allclose(slope, profile(s)[order + 1], atol=atol)
    ends, middle = np.array([0.0, 1.0]), np.array([0.5])
    (advance, rate, _), (lift, lift_rate, _) = path.advance(ends), path.lift(ends)
    np.testing.assert_allclose(advance, [0, 1], atol=1e-12)
    np.testing.assert_allclose([lift, rate, lift_rate], 0, atol=1e-12)
    assert path.lift(middle)[0] == pytest.approx(1)
    assert path.advance(middle)[0] == pytest.approx(0.5)


def test_feet_rest_on_the_ground_and_the_body_moves_on(hexapod: Robot, walk: Motion) -> None:
    """Also on both sides of lift-off and touch-down; the first set supports first."""
    speed = hexapod.spec.parameters["walking_speed"]
    assert [s.stance for s in walk.segments] == [("lf", "lr", "rm"), ("rf", "rr", "lm")]
    for segment in walk.segments:
        q = hexapod.leg_positions(segment.configuration)
        rate = segment.velocity[:, hexapod.velocity_index].reshape(q.shape)
        foot = np.einsum("nlij,nlj->nli", foot_jacobians(hexapod.chains, q)[1], rate)
        foot += [speed, 0, 0]
        stance = [hexapod.leg_names.index(leg) for leg in segment.stance]
        np.testing.assert_allclose(foot[[0, -1]], 0, atol=1e-9)
        np.testing.assert_allclose(foot[:, stance], 0, atol=1e-9)
        base, velocity = segment.configuration[:, :3], segment.velocity[:, :6]
        np.testing.assert_allclose(base[:, 0], speed * segment.time, atol=1e-12)
        np.testing.assert_allclose(velocity, np.tile([speed, 0, 0, 0, 0, 0], (len(base), 1)))
        assert not base[:, 1:].any()
        assert not segment.acceleration[:, :6].any()


def test_stroke_and_lift_are_those_of_table_ii(hexapod: Robot, walk: Motion) -> None:
    middle = hexapod.leg_names.index("rm")
    support, transfer = (
        foot_positions(hexapod.chains, hexapod.leg_positions(s.configuration))[:, middle]
        for s in walk.segments
    )
    assert support[0, 0] - support[-1, 0] == pytest.approx(0.240)
    assert np.ptp(transfer[:, 2]) == pytest.approx(0.075)
    assert np.ptp(support[:, 2]) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("feet", [("lf", "lr", "rm"), ("lf", "lm", "lr", "rf", "rr")])
def test_standing_lifts_the_other_feet(hexapod: Robot, feet: tuple[str, ...]) -> None:
    segment = standing_posture(hexapod, feet)
    found = foot_positions(hexapod.chains, hexapod.leg_positions(segment.configuration))[0]
    expected = np.array([leg.neutral_foot for leg in hexapod.spec.legs])
    expected[[leg not in feet for leg in hexapod.leg_names], 2] += 0.075
    np.testing.assert_allclose(found, expected, atol=1e-9)
    assert not segment.velocity.any()
    assert not segment.acceleration.any()
    assert segment.name == f"standing on {', '.join(feet)}"


@pytest.mark.parametrize(
    ("numbers", "gait", "message"),
    [
        ({"foot_stroke": 1.2, "walking_speed": 0.8}, {}, r"leg '\w+' at t = .* beyond its reach"),
        ({"walking_speed": 0.16 * (1 + 2e-6)}, {}, "change one"),
    ],
)
def test_numbers_that_cannot_be_walked_are_refused(
    hexapod: Robot, numbers: dict[str, float], gait: dict[str, Any], message: str
) -> None:
    robot = load_robot(hexapod.spec.with_parameters(numbers).with_gait(**gait))
    with pytest.raises((GaitError, OutOfReachError), match=message):
        walking_motion(robot, samples=51)


def test_stroke_and_speed_may_differ_by_less_than_a_millionth(hexapod: Robot) -> None:
    spec = hexapod.spec.with_parameters({"walking_speed": 0.16 * (1 + 5e-7)})
    walking_motion(load_robot(spec), samples=2)
    with pytest.raises(GaitError, match="at least 2"):
        walking_motion(hexapod, samples=1)
