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
from pipeline.effects.registry import effect_named
from pipeline.logs.prepared.measurement import TRAIN, Measurement
from pipeline.machine.machine import MachineModel, machine_of_robot
from pipeline.robot.robot import Robot
from pipeline.simulation.edited import effects
from pipeline.simulation.rigid_bodies import RigidBodies
from pipeline.simulation.walk_stand import stand

Array = NDArray[np.float64]
PUSH = 30.0  # of all feet on one side [N]
STANCES = {
    "all": ("lf", "lm", "lr", "rf", "rm", "rr"),
    "five": ("lf", "lm", "lr", "rf", "rr"),
    "tripod": ("lf", "lr", "rm"),
}


def squeezed(model: MachineModel) -> MachineModel:
    return effect_named("internal_foot_force").apply(model, ("ground",), {"lateral": PUSH})


def expected(robot: Robot, position: Array, stance: tuple[str, ...]) -> Array:
    """What the joints need less of it, (J,) [N*m]: -sum f . dp/dq by central differences."""
    model, data = robot.model, robot.model.createData()
    index = [model.joints[model.getJointId(j)].idx_q for j in robot.joints]

    def feet(q: Array) -> dict[str, Array]:
        whole = pin.neutral(model)
        whole[index] = q
        pin.framesForwardKinematics(model, data, whole)
        return {
            leg.name: data.oMf[model.getFrameId(leg.foot)].translation.copy()
            for leg in robot.spec.legs
        }

    out = np.zeros(position.size)
    step = 1e-6
    for k in range(position.size):
        ahead, behind = position.copy(), position.copy()
        ahead[k] += step
        behind[k] -= step
        high, low = feet(ahead), feet(behind)
        for leg in robot.spec.legs:
            mates = [n for n in stance if n[0] == leg.name[0]]
            if leg.name in stance:
                outward = 1.0 if leg.side == "left" else -1.0  # y points left
                moved = (high[leg.name] - low[leg.name])[1] / (2 * step)
                out[k] -= outward * PUSH / len(mates) * moved
    return out


@pytest.fixture(scope="module")
def position(hexapod: Robot) -> Array:
    """Standing, every leg a little differently."""
    q = stand(hexapod, {}).demand.position[0]
    return np.asarray(q + np.random.default_rng(4).normal(scale=0.05, size=q.size))


@pytest.mark.parametrize("name", STANCES)
def test_ground_that_pushes_feet_outward_saves_what_the_joints_would_do(
    hexapod: Robot, position: Array, name: str
) -> None:
    """As the log's own model predicts it."""
    stance, n = STANCES[name], 3
    machine = machine_of_robot(hexapod, load_catalog().chain("rotor"))
    still = np.zeros((n, 18))
    standing = np.tile([leg in stance for leg in hexapod.leg_names], (n, 1))
    log = Measurement(
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
        standing=standing,
    )
    before, after = (
        RigidBodies(log).torque(m, (log.q, log.v, log.a)) for m in (machine, squeezed(machine))
    )
    np.testing.assert_allclose((after - before)[0], expected(hexapod, position, stance), atol=1e-6)
    assert np.abs(after - before).max() > 0.5
    # Measured forces are the ground's without the squeeze that no sensor sees.
    measured = replace(log, foot_force=np.zeros((n, 6, 3)))
    bodies = RigidBodies(measured)
    change = [bodies.torque(m, (log.q, log.v, log.a)) for m in (machine, squeezed(machine))]
    np.testing.assert_allclose(change[1] - change[0], after - before, atol=1e-9)


@pytest.mark.parametrize("name", ["all", "five"])
def test_standing_and_walking_squeeze_in_the_same_sense(hexapod: Robot, name: str) -> None:
    """As `stand` and `walk` demand it of the actuators."""
    stance = STANCES[name]
    edit = effects(hexapod, load_catalog().chain("rotor"), squeezed, ("internal_foot_force",))
    before = stand(hexapod, {}, feet=stance).demand
    after = stand(edit.robot, {}, feet=stance, adjust=edit.demand).demand
    np.testing.assert_allclose(
        (after.torque - before.torque)[0],
        expected(hexapod, before.position[0], stance),
        atol=1e-6,
    )
