"""Feet that squeeze the ground: positive spreads them, and both ways of asking agree.

Held against virtual work with Pinocchio's own foot frames: a force f on a foot that moves by dp
does f . dp, which the joints need not supply.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

from actuators.loading.build import load_catalog
from pipeline.effects.base import effect_named
from pipeline.logs.log import TRAIN, Log
from pipeline.machine.drivetrains import drivetrains_of
from pipeline.machine.machine import MachineModel
from pipeline.motion.support import standing_posture
from pipeline.robot.robot import Robot
from pipeline.simulation.on_ground import RigidBodies

Array = NDArray[np.float64]
PUSH = 30.0  # of all feet on one side [N]
FIVE = ("lf", "lm", "lr", "rf", "rr")


def squeezed(model: MachineModel) -> MachineModel:
    return effect_named("internal_foot_force").apply(model, ("ground",), {"lateral": PUSH})


def expected(robot: Robot, position: Array, stance: tuple[str, ...]) -> Array:
    """What the joints need less of it, (J,) [N*m]: -sum f . dp/dq by Pinocchio's Jacobians."""
    model, data = robot.model, robot.model.createData()
    pin.computeJointJacobians(model, data, robot.configuration(position[None])[0])
    out = np.zeros(position.size)
    for leg in robot.spec.legs:
        if leg.name in stance:
            frame = model.getFrameId(leg.foot)
            moved = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)[1]
            outward = 1.0 if leg.side == "left" else -1.0  # y points left
            mates = sum(name[0] == leg.name[0] for name in stance)
            out -= outward * PUSH / mates * moved[robot.velocity_index]
    return out


@pytest.mark.parametrize("stance", [FIVE, ("lf", "lr", "rm")], ids=["five", "tripod"])
def test_ground_that_pushes_feet_outward_saves_what_the_joints_would_do(
    hexapod: Robot, stance: tuple[str, ...]
) -> None:
    """As the log's own model predicts it, standing with every leg a little differently."""
    position = standing_posture(hexapod).configuration[0, hexapod.position_index]
    position = position + np.random.default_rng(4).normal(scale=0.05, size=position.size)
    machine = MachineModel(hexapod, drivetrains_of(load_catalog().chain("rotor"), hexapod.joints))
    n = 3
    still = np.zeros((n, 18))
    log = Log(
        name="standing",
        time=np.arange(n) / 100.0,
        joints=machine.joints,
        q=np.tile(position, (n, 1)),
        v=still,
        a=still,
        channels=("current",),
        effort=still[..., None],
        noise=np.ones((18, 1)),
        mask=np.ones((n, 18), dtype=bool),
        part=np.full(n, TRAIN, dtype=np.int8),
        block=np.zeros(n, dtype=np.intp),
        pieces=(slice(0, n),),
        standing=np.tile([leg in stance for leg in hexapod.leg_names], (n, 1)),
        base_roll=np.zeros(n),
        base_pitch=np.zeros(n),
    )
    # Measured forces are the ground's without the squeeze that no sensor sees.
    for m in (log, replace(log, foot_force=np.zeros((n, 6, 3)))):
        bodies = RigidBodies(m)
        before, after = (bodies.torque(x, (m.q, m.v, m.a)) for x in (machine, squeezed(machine)))
        saved = expected(hexapod, position, stance)
        np.testing.assert_allclose((after - before)[0], saved, atol=1e-9)
        assert np.abs(saved).max() > 0.5
