"""Least tangential foot forces against linear algebra on the definition, balance and push-only."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import null_space

from pipeline.dynamics.contact_forces import ContactForces, least_tangential_forces
from pipeline.dynamics.joint_demand import contact_forces, inverse_dynamics, motion_demand
from pipeline.dynamics.stability import stability_margins
from pipeline.errors import TippingError
from pipeline.motion.motion import Motion
from pipeline.motion.support import support_margin
from pipeline.motion.walking import walking_motion
from pipeline.robot.robot import Robot, load_robot

TRIPOD = np.array([[0.30, 0.25, -0.31], [-0.24, 0.26, -0.31], [0.02, -0.27, -0.31]])
SIX = np.array([[x, y, -0.3] for x in (-0.27, 0.0, 0.27) for y in (-0.26, 0.26)])


def wrench_of(feet: np.ndarray, force: np.ndarray) -> np.ndarray:
    return np.concatenate([force.sum(axis=0), np.cross(feet, force).sum(axis=0)])


def random_wrench(feet: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    force = rng.normal(size=feet.shape) * [5, 5, 10] + [0, 0, 100]
    return wrench_of(feet, force)


@pytest.mark.parametrize("feet", [TRIPOD, SIX, SIX[:4]], ids=["three", "six", "four"])
def test_forces_add_up_to_the_wrench(feet: np.ndarray) -> None:
    rng = np.random.default_rng(1)
    wrench = np.array([random_wrench(feet, rng) for _ in range(50)])
    force = least_tangential_forces(wrench, np.repeat(feet[None], 50, axis=0))
    for row in range(50):
        np.testing.assert_allclose(wrench_of(feet, force[row]), wrench[row], atol=1e-9)


@pytest.mark.parametrize("feet", [TRIPOD, SIX, SIX[:4]], ids=["three", "six", "four"])
def test_no_other_distribution_has_less_tangential_force(feet: np.ndarray) -> None:
    """Held against the definition: all forces that meet the wrench are one of them plus the null
    space of the six equations, and among those a linear least-squares problem has the answer.
    """
    rng = np.random.default_rng(2)
    unit = np.eye(feet.size).reshape(-1, *feet.shape)
    meets = np.array([wrench_of(feet, force) for force in unit]).T  # (6, 3 F)
    other = null_space(meets)
    tangential = np.array([k for k in range(feet.size) if k % 3 < 2])
    for _ in range(20):
        wrench = random_wrench(feet, rng)
        ours = least_tangential_forces(wrench[None], feet[None])[0]
        one = np.linalg.lstsq(meets, wrench)[0]
        step = np.linalg.lstsq(other[tangential], -one[tangential])[0]
        least = one[tangential] + other[tangential] @ step
        np.testing.assert_allclose(ours[:, :2].ravel(), least, atol=1e-9)


def test_unequal_heights_are_balanced() -> None:
    feet = TRIPOD + np.array([[0, 0, 0.02], [0, 0, -0.01], [0, 0, 0]])
    wrench = random_wrench(feet, np.random.default_rng(3))
    force = least_tangential_forces(wrench[None], feet[None])[0]
    np.testing.assert_allclose(wrench_of(feet, force), wrench, atol=1e-9)


def test_feet_that_would_pull_are_released() -> None:
    """Weight over a corner of six feet: no normal force is negative, the wrench is met."""
    weight = np.array([0.0, 0.0, 400.0])
    point = np.array([0.26, 0.2, 0.0])
    wrench = np.concatenate([weight, np.cross(point, weight)])
    force = least_tangential_forces(wrench[None], SIX[None])[0]
    assert force[:, 2].min() >= 0
    np.testing.assert_allclose(wrench_of(SIX, force), wrench, atol=1e-9)


def test_of_forces_that_meet_the_wrench_normals_have_the_least_squares() -> None:
    """Where all feet press: the null space of what the ground leaves open adds to the sum."""
    rng = np.random.default_rng(8)
    for feet in (SIX, SIX[:4], SIX + [[0.1, -0.05, 0.0]]):
        force = least_tangential_forces(random_wrench(feet, rng)[None], feet[None])[0]
        assert force[:, 2].min() > 0
        lift = np.vstack([np.ones(len(feet)), feet[:, 1], feet[:, 0]])
        np.testing.assert_allclose(null_space(lift).T @ force[:, 2], 0.0, atol=1e-9)


def test_released_feet_bear_nothing_and_the_rest_share_anew() -> None:
    """Weight beyond the inner row of a tilted load: the far corner is let go first."""
    weight = np.array([0.0, 0.0, 400.0])
    for x, y in ((0.26, 0.2), (-0.26, 0.2), (0.26, -0.25), (-0.2, -0.25)):
        wrench = np.concatenate([weight, np.cross([x, y, 0.0], weight)])
        force = least_tangential_forces(wrench[None], SIX[None])[0]
        np.testing.assert_allclose(wrench_of(SIX, force), wrench, atol=1e-9)
        kept = force[:, 2] > 0
        assert 3 <= kept.sum() < 6
        assert not force[~kept, 2].any()
        near = np.argmin(np.hypot(SIX[:, 0] - x, SIX[:, 1] - y))
        assert force[:, 2].argmax() == near
        lift = np.vstack([np.ones(kept.sum()), SIX[kept, 1], SIX[kept, 0]])
        np.testing.assert_allclose(null_space(lift).T @ force[kept, 2], 0.0, atol=1e-9)


def test_weight_beside_the_feet_leaves_three_and_one_of_them_would_pull() -> None:
    """It is for the caller to refuse; the wrench is met all the same."""
    weight = np.array([0.0, 0.0, 400.0])
    wrench = np.concatenate([weight, np.cross([0.35, 0.1, 0.0], weight)])
    force = least_tangential_forces(wrench[None], SIX[None])[0]
    np.testing.assert_allclose(wrench_of(SIX, force), wrench, atol=1e-9)
    assert (force[:, 2] != 0).sum() == 3
    assert force[:, 2].min() < 0


def test_rows_of_a_batch_are_released_on_their_own() -> None:
    weight = np.array([0.0, 0.0, 400.0])
    points = ((0.26, 0.2), (0.0, 0.0), (-0.26, -0.2))
    wrench = np.array([[*weight, *np.cross([x, y, 0.0], weight)] for x, y in points])
    together = least_tangential_forces(wrench, np.repeat(SIX[None], 3, axis=0))
    for row in range(3):
        alone = least_tangential_forces(wrench[row : row + 1], SIX[None])[0]
        np.testing.assert_allclose(together[row], alone, atol=1e-12)


def test_friction_needed_is_tangential_over_normal_where_a_foot_is_loaded() -> None:
    force = np.array([[[3.0, 4.0, 10.0], [0.0, 0.0, 0.0], [1.0, 0.0, -2.0], [0.0, 0.5, 0.25]]])
    contacts = ContactForces(("a", "b", "c", "d"), ("a",), np.zeros(1), force, 0 * force, force)
    np.testing.assert_allclose(contacts.friction_needed, [[0.5, np.nan, np.nan, 2.0]])


def test_margin_is_the_distance_to_the_nearest_edge() -> None:
    square = np.array([[[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]], dtype=float)
    for point, margin in (((0, 0), 1.0), ((0.5, 0.2), 0.5), ((1.25, 0), -0.25)):
        assert support_margin(square, np.array([point], dtype=float))[0] == pytest.approx(margin)
    shuffled = square[:, [2, 0, 3, 1]]
    assert support_margin(shuffled, np.array([[0.5, 0.2]]))[0] == pytest.approx(0.5)


def test_walking_needs_little_friction_and_stays_stable(hexapod: Robot, walk: Motion) -> None:
    for segment in walk.segments:
        contacts = contact_forces(hexapod, segment, inverse_dynamics(hexapod, segment))
        assert contacts.force_world[..., 2].min() >= 0
        assert np.nanmax(contacts.friction_needed) < 0.3
        assert stability_margins(hexapod, segment).min() > 0


def test_a_robot_that_tips_says_where_and_when(hexapod: Robot) -> None:
    robot = load_robot(hexapod.spec.with_parameters({"hip_spacing": 0.20}))
    motion = walking_motion(robot, samples=51)
    with pytest.raises(TippingError, match=r"tips at t = .* leg '\w+' would have to pull"):
        motion_demand(robot, motion)
