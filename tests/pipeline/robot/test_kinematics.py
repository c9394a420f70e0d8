"""The batched kinematics against Pinocchio, yourdfpy and finite differences."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from pipeline.robot.kinematics import (
    foot_force_torques,
    foot_jacobian_rates,
    foot_jacobians,
    foot_positions,
    leg_posture,
)
from pipeline.robot.robot import Robot, load_robot, parse_urdf
from pipeline.robot.robot_file import load_robot_file

N = 20


@pytest.fixture(scope="module", params=["hexapod", "tilted", "hexapod_axis90", "leg"])
def robot(request: pytest.FixtureRequest, root: Path) -> Robot:
    if request.param != "tilted":
        return load_robot(load_robot_file(root / "urdf" / f"{request.param}.toml"))
    spec = load_robot_file(root / "urdf" / "hexapod.toml")
    return load_robot(spec.with_parameters({"joint_1_axis_angle": 0.6}))


def random_positions(robot: Robot, seed: int = 3) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.uniform(-1.0, 1.0, (N, len(robot.leg_names), 3))


def pinocchio_feet(robot: Robot, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    data = robot.model.createData()
    feet = np.empty((N, len(robot.leg_names), 3))
    jacobian = np.empty((*feet.shape, 3))
    for n, row in enumerate(robot.configuration(q.reshape(N, -1), np.zeros((N, 3)))):
        pin.computeJointJacobians(robot.model, data, row)
        pin.updateFramePlacements(robot.model, data)
        for i, leg in enumerate(robot.spec.legs):
            frame = robot.model.getFrameId(leg.foot)
            feet[n, i] = data.oMf[frame].translation
            full = pin.getFrameJacobian(
                robot.model, data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
            )
            jacobian[n, i] = full[:3, robot.velocity_index[robot.leg_columns[i]]]
    return feet, jacobian


def test_positions_and_jacobians_agree_with_pinocchio(robot: Robot) -> None:
    q = random_positions(robot)
    feet, jacobian = pinocchio_feet(robot, q)
    np.testing.assert_allclose(foot_positions(robot.chains, q), feet, atol=1e-12)
    ours, ours_jacobian = foot_jacobians(robot.chains, q)
    np.testing.assert_allclose(ours, feet, atol=1e-12)
    np.testing.assert_allclose(ours_jacobian, jacobian, atol=1e-12)


def test_force_torques_are_the_jacobian_transposed(robot: Robot) -> None:
    q = random_positions(robot)
    force = np.random.default_rng(5).normal(size=q.shape)
    _, jacobian = foot_jacobians(robot.chains, q)
    expected = np.einsum("nlij,nli->nlj", jacobian, force)
    np.testing.assert_allclose(foot_force_torques(robot.chains, q, force), expected, atol=1e-12)


def test_posture_of_some_legs_in_another_order(robot: Robot) -> None:
    """Torques of the leading legs are those of all legs; the given positions are left alone."""
    q = random_positions(robot)
    kept = q.copy()
    order = list(reversed(range(q.shape[1])))
    posture = leg_posture(robot.chains.of(order), q[:, order])
    np.testing.assert_allclose(posture.feet[:, order], foot_positions(robot.chains, q), atol=1e-15)
    force = np.random.default_rng(7).normal(size=q.shape)
    some = order[: max(1, len(order) // 2)]
    np.testing.assert_allclose(
        posture.force_torques(force[:, some]),
        foot_force_torques(robot.chains, q, force)[:, some],
        atol=1e-14,
    )
    leg_posture(robot.chains, q[:1])
    np.testing.assert_array_equal(q, kept)


def test_rotated_joint_placements_agree_with_pinocchio(root: Path) -> None:
    """A URDF whose joint frames are turned against their parents, as CAD exports are."""
    spec = load_robot_file(root / "urdf" / "leg.toml")
    text = re.sub(
        r'(<joint name="rm_joint_[23]" type="revolute">\s*<origin xyz="[^"]*" rpy=)"0 0 0"',
        r'\1"0.3 -0.4 1.1"',
        load_robot(spec).urdf,
    )
    turned = Robot(spec, text, parse_urdf(text, "turned", floating=False))
    assert turned.chains.turned == (False, True, True)
    q = random_positions(turned)
    feet, jacobian = pinocchio_feet(turned, q)
    np.testing.assert_allclose(foot_positions(turned.chains, q), feet, atol=1e-12)
    force = np.random.default_rng(8).normal(size=q.shape)
    expected = np.einsum("nlij,nli->nlj", jacobian, force)
    np.testing.assert_allclose(foot_force_torques(turned.chains, q, force), expected, atol=1e-12)


def test_jacobian_rate_is_a_finite_difference(robot: Robot) -> None:
    q = random_positions(robot)
    rate = random_positions(robot, seed=4)
    h = 1e-6
    _, after = foot_jacobians(robot.chains, q + h * rate)
    _, before = foot_jacobians(robot.chains, q - h * rate)
    expected = np.einsum("nlij,nlj->nli", (after - before) / (2 * h), rate)
    np.testing.assert_allclose(
        foot_jacobian_rates(robot.chains, q, rate), expected, atol=1e-8, rtol=1e-7
    )


def test_feet_agree_with_yourdfpy(robot: Robot) -> None:
    """An independent reader of the same URDF puts every foot in the same place."""
    import yourdfpy

    urdf = yourdfpy.URDF.load(
        io.BytesIO(robot.urdf.encode()), load_meshes=False, build_scene_graph=True
    )
    q = random_positions(robot)
    feet = foot_positions(robot.chains, q)
    for n in range(3):
        urdf.update_cfg(dict(zip(robot.joints, q[n].ravel(), strict=True)))
        for i, leg in enumerate(robot.spec.legs):
            place = urdf.get_transform(leg.foot, robot.spec.base_link)
            np.testing.assert_allclose(place[:3, 3], feet[n, i], atol=1e-12)
