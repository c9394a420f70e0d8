"""Rules for the ground's forces: what they minimise, and what none of them may change."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import null_space

from pipeline.dynamics.contact_forces import FeetOnGround
from pipeline.dynamics.force_rules import (
    LEAST_TANGENTIAL,
    LEAST_TORQUE,
    GroundForces,
    out_of_bounds,
)
from pipeline.dynamics.joint_demand import segment_demand
from pipeline.motion.motion import Segment
from pipeline.robot.robot import Robot
from tests.pipeline.robot.walkers import MIXED, walker


def internal(feet: np.ndarray) -> np.ndarray:
    """Forces on F feet (F, 3) that add up to no force and no moment, shape (F, 3, D)."""
    unit = np.eye(feet.size).reshape(-1, *feet.shape)
    wrench = np.hstack([unit.sum(axis=1), np.cross(feet, unit).sum(axis=1)])
    return null_space(wrench.T, rcond=1e-9).reshape(*feet.shape, -1)


def swinging(robot: Robot, samples: int = 9) -> Segment:
    """All feet down, joints moving: four feet or six, so that normal forces are open, too."""
    rng = np.random.default_rng(3)
    angle = rng.uniform(-0.05, 0.05, (samples, len(robot.joints)))
    return Segment(
        name="swinging",
        time=np.arange(samples) / 10,
        configuration=robot.configuration(angle, np.zeros((samples, 3))),
        velocity=rng.uniform(-0.2, 0.2, (samples, robot.model.nv)),
        acceleration=rng.uniform(-0.2, 0.2, (samples, robot.model.nv)),
        stance=robot.leg_names,
    )


@pytest.fixture(scope="module", params=["hexapod", "mixed legs"])
def robot(
    request: pytest.FixtureRequest, hexapod: Robot, tmp_path_factory: pytest.TempPathFactory
) -> Robot:
    """Six legs of three joints; four legs of two to seven that turn and slide."""
    if request.param == "hexapod":
        return hexapod
    return walker(Path(tmp_path_factory.mktemp("walker")), MIXED, arm=True)


@pytest.mark.parametrize("limit", [None, 0.15])
def test_no_forces_of_the_same_wrench_within_bounds_have_less_torque_squared(
    robot: Robot, limit: float | None
) -> None:
    segment = swinging(robot)  # upright on level ground: the base's axes are the ground's
    paper, others = (GroundForces(rule, limit) for rule in (LEAST_TANGENTIAL, LEAST_TORQUE))
    _, start = segment_demand(robot, segment, forces=paper)
    demand, contacts = segment_demand(robot, segment, forces=others)
    assert start is not None
    assert contacts is not None
    wrenches = [
        (c.force_world.sum(axis=1), np.cross(c.position, c.force_world).sum(axis=1))
        for c in (contacts, start)
    ]
    np.testing.assert_allclose(*wrenches, atol=1e-7)
    feet = FeetOnGround(
        robot.chains,
        robot.leg_positions(segment.configuration),
        robot.base_rotation(segment.configuration),
    )
    loaded = robot.chains.columns[robot.chains.real]

    def squares(force: np.ndarray) -> np.ndarray:
        less = robot.chains.by_joint(feet.torque(force - contacts.force_world))
        return ((demand.torque - less)[:, loaded] ** 2).sum(axis=1)

    least = squares(contacts.force_world)
    assert np.all(least <= squares(start.force_world) * (1 + 1e-9))
    assert not out_of_bounds(contacts.force_world, limit).any()
    basis = np.stack([internal(feet) for feet in contacts.position])
    rng = np.random.default_rng(4)
    tried = 0
    for _ in range(120):
        step = rng.normal(size=basis.shape[-1]) * 10.0 ** rng.uniform(-3, 2)
        other = contacts.force_world + basis @ step
        inside = ~out_of_bounds(other, limit)
        tried += int(inside.sum())
        assert np.all(squares(other)[inside] >= least[inside] * (1 - 1e-6))
    assert tried > 40
