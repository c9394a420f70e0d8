"""The batched kinematics against Pinocchio and finite differences.

Legs of two to seven joints that turn or slide, some in frames turned against their parents, as CAD
exports are, and those of the project's robots.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from pipeline.robot.kinematics import (
    foot_jacobian_rates,
    foot_jacobians,
    foot_positions,
    leg_posture,
)
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from tests.pipeline.robot.walkers import MIXED, walker

N = 12


@pytest.fixture(scope="module", params=["mixed", "hexapod", "leg"])
def robot(
    request: pytest.FixtureRequest, root: Path, tmp_path_factory: pytest.TempPathFactory
) -> Robot:
    if request.param == "mixed":
        return walker(tmp_path_factory.mktemp("mixed"), MIXED, arm=True)
    return load_robot(load_robot_file(root / "urdf" / f"{request.param}.toml"))


def random_legs(robot: Robot, seed: int) -> np.ndarray:
    values = np.random.default_rng(seed).uniform(-1, 1, (N, *robot.chains.columns.shape))
    return np.where(robot.chains.real, values, 0.0)


def test_feet_and_jacobians_agree_with_pinocchio(robot: Robot) -> None:
    q = random_legs(robot, 1)
    feet, jacobian = foot_jacobians(robot.chains, q)
    np.testing.assert_allclose(foot_positions(robot.chains, q), feet, atol=1e-14)
    model, data = robot.model, robot.model.createData()
    rows = robot.configuration(robot.joint_positions(q), np.zeros((N, 3)))
    for n, row in enumerate(rows):
        pin.computeJointJacobians(model, data, row)
        pin.updateFramePlacements(model, data)
        for i, leg in enumerate(robot.spec.legs):
            frame = model.getFrameId(leg.foot)
            np.testing.assert_allclose(feet[n, i], data.oMf[frame].translation, atol=1e-12)
            full = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)[:3]
            columns = robot.velocity_index[robot.chains.of(i)]
            np.testing.assert_allclose(
                jacobian[n, i, :, : columns.size], full[:, columns], atol=1e-12
            )
            assert not jacobian[n, i, :, columns.size :].any()


def test_torques_are_the_jacobian_transposed_and_rates_its_derivative(robot: Robot) -> None:
    q, rate = random_legs(robot, 2), random_legs(robot, 3)
    force = np.random.default_rng(4).normal(size=(*q.shape[:2], 3))
    _, jacobian = foot_jacobians(robot.chains, q)
    np.testing.assert_allclose(
        leg_posture(robot.chains, q).force_torques(force),
        np.einsum("nlij,nli->nlj", jacobian, force),
        atol=1e-12,
    )
    h = 1e-6
    ahead, behind = (foot_jacobians(robot.chains, q + s * h * rate)[1] for s in (1, -1))
    expected = np.einsum("nlij,nlj->nli", (ahead - behind) / (2 * h), rate)
    np.testing.assert_allclose(foot_jacobian_rates(robot.chains, q, rate), expected, atol=1e-8)
