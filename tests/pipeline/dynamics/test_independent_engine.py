"""Joint torque against MuJoCo's inverse dynamics: same URDF, motion and ground forces."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipeline.dynamics.force_rules import LEAST_TORQUE, PAPER, GroundForces
from pipeline.dynamics.joint_demand import segment_demand
from pipeline.motion.motion import Motion, Segment
from pipeline.motion.support import standing_posture
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file

pytest.importorskip("mujoco")
from tests.pipeline.dynamics.mujoco_engine import joint_torque, model_of

ROBOTS = ("hexapod", "solo12", "anymal_c", "go2")


def go2_text() -> str:
    """A quadruped of which the project ships no file."""
    lines = ['[robot]\nname = "go2"\nurdf = "example-robot-data:go2"\nbase_link = "base"']
    for leg in ("FL", "FR", "RL", "RR"):
        side = "left" if leg.endswith("L") else "right"
        sign = 1 if side == "left" else -1
        foot = [0.172597 if leg.startswith("F") else -0.214203, sign * 0.163495, -0.312365]
        lines.append(
            f'[legs.{leg}]\njoints = ["{leg}_hip_joint", "{leg}_thigh_joint", "{leg}_calf_joint"]\n'
            f'foot = "{leg}_foot"\nside = "{side}"\nneutral_foot = {json.dumps(foot)}\n'
            f"start_posture = [{sign * 0.068}, 0.785, -1.44]"
        )
    lines.append('[gait]\ntransfer_path = "harmonic"\n[parameters]')
    for name, value, unit in (
        ("total_mass", 15.019, "kg"),
        *(("foot_stroke", 0.1, "m"), ("foot_lift", 0.05, "m"), ("walking_speed", 0.1, "m/s")),
        *(("gait_period", 2, "s"), ("gravity", 9.81, "m/s^2")),
    ):
        basis = 'basis = "datasheet", source = "a test"'
        lines.append(f'{name} = {{value = {value}, unit = "{unit}", {basis}}}')
    return "\n".join(lines)


def loaded(name: str, root: Path, folder: Path) -> Robot:
    file = root / "urdf" / f"{name}.toml"
    if not file.is_file():
        file = folder / f"{name}.toml"
        file.write_text(go2_text(), encoding="utf-8")
    return load_robot(load_robot_file(file))


def moving(robot: Robot, samples: int = 12) -> Segment:
    """States drawn at random about standing on all feet of a slope, the base turning, too."""
    rng = np.random.default_rng(7)
    still = standing_posture(robot, robot.leg_names)
    q = np.repeat(still.configuration, samples, axis=0)
    q[:, robot.position_index] += rng.uniform(-0.1, 0.1, (samples, len(robot.joints)))
    quaternion = rng.normal(size=(samples, 4)) * 0.05 + [0, 0, 0, 1]
    q[:, 3:7] = quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)
    v = rng.uniform(-0.5, 0.5, (samples, robot.model.nv))
    a = rng.uniform(-0.5, 0.5, (samples, robot.model.nv))
    normal = np.array([0.05, -0.03, 1.0])
    return replace(
        still,
        time=np.arange(samples) * 0.1,
        configuration=q,
        velocity=v,
        acceleration=a,
        ground_normal=normal / np.linalg.norm(normal),
    )


@pytest.mark.parametrize("rule", [PAPER, GroundForces(LEAST_TORQUE, 0.7)], ids=["paper", "torque"])
@pytest.mark.parametrize("name", ROBOTS)
def test_torque_agrees_with_mujoco(
    name: str, rule: GroundForces, root: Path, tmp_path: Path
) -> None:
    robot = loaded(name, root, tmp_path)
    segment = moving(robot)
    demand, ground = segment_demand(robot, segment, forces=rule)
    assert ground is not None
    torque, base = joint_torque(robot, segment, ground)
    scale = np.abs(demand.torque).max()
    assert np.abs(torque - demand.torque).max() < 1e-6 * scale
    assert np.abs(base).max() < 1e-6 * robot.mass * 9.81


def test_torque_of_the_gait_agrees_with_mujoco(hexapod: Robot, walk: Motion) -> None:
    for segment in walk.segments:
        rows = slice(None, None, 25)
        part = replace(
            segment,
            time=segment.time[rows],
            configuration=segment.configuration[rows],
            velocity=segment.velocity[rows],
            acceleration=segment.acceleration[rows],
        )
        demand, ground = segment_demand(hexapod, part)
        assert ground is not None
        torque, _ = joint_torque(hexapod, part, ground)
        assert np.abs(torque - demand.torque).max() < 1e-6 * np.abs(demand.torque).max()


def test_both_engines_weigh_the_same(hexapod: Robot) -> None:
    assert model_of(hexapod).body_mass.sum() == pytest.approx(hexapod.mass)
