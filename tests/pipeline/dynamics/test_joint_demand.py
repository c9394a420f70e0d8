"""The demand of any gait against the rate of mechanical energy, and as walking slows down."""

from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from pipeline.dynamics.joint_demand import MotionDemand, motion_demand
from pipeline.motion.motion import Motion
from pipeline.motion.walking import walking_motion
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file

GAITS: dict[str, tuple[str, dict[str, Any]]] = {
    "tripod": ("hexapod", {}),
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
    spec = load_robot_file(root / "urdf" / f"{name}.toml")
    robot = load_robot(spec.with_gait(transfer_path="cycloid", **gait))  # no jump to difference
    motion = walking_motion(robot, samples=401)
    return robot, motion, motion_demand(robot, motion)


def test_joint_power_is_the_rate_of_energy_since_standing_feet_rest(walked: Walked) -> None:
    robot, motion, demand = walked
    model, data = robot.model, robot.model.createData()
    for segment, part in zip(motion.segments, demand.segments, strict=True):
        energy = np.array(
            [
                pin.computeKineticEnergy(model, data, q, v)
                + pin.computePotentialEnergy(model, data, q)
                for q, v in zip(segment.configuration, segment.velocity, strict=True)
            ]
        )
        dt = segment.time[1] - segment.time[0]
        rate = (energy[:-4] - 8 * energy[1:-3] + 8 * energy[3:-1] - energy[4:]) / (12 * dt)
        power = (part.torque * part.velocity).sum(axis=1)
        scale = np.abs(part.torque * part.velocity).max()
        np.testing.assert_allclose(power[2:-2], rate, atol=2e-5 * scale)


def test_quasi_static_is_the_limit_of_slow_walking(hexapod: Robot) -> None:
    """At a hundredth of the speed full inverse dynamics comes down to gravity and contact."""
    slow = load_robot(hexapod.spec.with_parameters({"gait_period": 300.0, "walking_speed": 0.0016}))
    motion = walking_motion(slow, samples=101)
    full = motion_demand(slow, motion)
    static = motion_demand(hexapod, walking_motion(hexapod, samples=101), quasi_static=True)
    for a, b in zip(full.segments, static.segments, strict=True):
        np.testing.assert_allclose(a.torque, b.torque, atol=1e-3)
