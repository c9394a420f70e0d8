"""The demand of any gait against mechanical energy and momentum, and Pinocchio sample by sample."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from pipeline.dynamics.joint_demand import MotionDemand, motion_demand
from pipeline.motion.gait import gait_of, with_payload
from pipeline.motion.motion import Motion, Segment
from pipeline.motion.walking import walking_motion
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file

#: The cycloid's acceleration has no jump, so that sums over samples converge quickly.
SMOOTH = {"transfer_path": "cycloid"}
GAITS: dict[str, tuple[str, dict[str, Any]]] = {
    "tripod": ("hexapod", {}),
    "ripple uphill with a payload": (
        "hexapod",
        {"name": "ripple", "slope_forward": "8 deg", "payload_mass": "6 kg", "payload_z": "12 cm"},
    ),
    "tetrapod in a bend on a slope": (
        "hexapod",
        {"name": "tetrapod", "speed": "0.05 m/s", "yaw_rate": "9 deg/s", "slope_left": "4 deg"},
    ),
    "crawl uphill with sway": ("solo12", {"slope_forward": "7 deg", "slope_left": "3 deg"}),
}

Walked = tuple[Robot, Motion, MotionDemand]


@pytest.fixture(scope="module", params=GAITS)
def walked(request: pytest.FixtureRequest, root: Path) -> Walked:
    name, gait = GAITS[request.param]
    spec = load_robot_file(root / "urdf" / f"{name}.toml").with_gait(**SMOOTH, **gait)
    robot = with_payload(load_robot(spec))
    motion = walking_motion(robot, samples=401)
    return robot, motion, motion_demand(robot, motion)


def energies(robot: Robot, segment: Segment) -> tuple[np.ndarray, np.ndarray]:
    """Kinetic and potential, each (N,) [J]."""
    data = robot.model.createData()
    kinetic, potential = [], []
    for q, v in zip(segment.configuration, segment.velocity, strict=True):
        kinetic.append(pin.computeKineticEnergy(robot.model, data, q, v))
        potential.append(pin.computePotentialEnergy(robot.model, data, q))
    return np.array(kinetic), np.array(potential)


def test_joint_power_is_the_rate_of_energy_since_standing_feet_rest(walked: Walked) -> None:
    robot, motion, demand = walked
    for segment, part in zip(motion.segments, demand.segments, strict=True):
        energy = sum(energies(robot, segment))
        dt = segment.time[1] - segment.time[0]
        rate = (energy[:-4] - 8 * energy[1:-3] + 8 * energy[3:-1] - energy[4:]) / (12 * dt)
        power = (part.torque * part.velocity).sum(axis=1)
        scale = np.abs(part.torque * part.velocity).max()
        np.testing.assert_allclose(power[2:-2], rate, atol=2e-5 * scale)


def test_over_a_cycle_the_joints_do_the_work_of_lifting_the_robot(walked: Walked) -> None:
    robot, motion, demand = walked
    work = given = 0.0
    for part in demand.segments:
        power = part.torque * part.velocity
        work += float(np.trapezoid(power.sum(axis=1), part.time))
        given += float(np.trapezoid(np.abs(power).sum(axis=1), part.time))
    first, last = motion.segments[0], motion.segments[-1]
    gained = energies(robot, last)[1][-1] - energies(robot, first)[1][0]
    assert work == pytest.approx(gained, abs=2e-5 * given)
    if not gait_of(robot.spec).twist[2]:  # a turn on a slope lifts a centre that is off the middle
        rise = last.configuration[-1, 2] - first.configuration[0, 2]
        weight = robot.mass * robot.spec.parameters["gravity"]
        assert gained == pytest.approx(weight * rise, abs=1e-9 * given)


def test_quasi_static_is_the_limit_of_slow_walking(hexapod: Robot) -> None:
    """At a hundredth of the speed full inverse dynamics comes down to gravity and contact."""
    slow = load_robot(hexapod.spec.with_parameters({"gait_period": 300.0, "walking_speed": 0.0016}))
    motion = walking_motion(slow, samples=101)
    full = motion_demand(slow, motion)
    static = motion_demand(hexapod, walking_motion(hexapod, samples=101), quasi_static=True)
    for a, b in zip(full.segments, static.segments, strict=True):
        np.testing.assert_allclose(a.torque, b.torque, atol=1e-3)
