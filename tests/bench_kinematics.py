"""CPU time of inverse kinematics: positions by damped least squares, velocities, accelerations."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from pipeline.robot.inverse.inverse_kinematics import reach, solve_rates
from pipeline.robot.inverse.start_posture import neutral_postures
from pipeline.robot.kinematics import foot_positions
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import load_robot_file

ROBOTS = ("hexapod", "solo12", "anymal_c")
SAMPLES = 1501
Call = Callable[[], object]


def inverse_kinematics(root: Path, timed: Callable[..., dict[str, list[float]]]) -> None:
    """Print the times for a closed path of every foot, a tenth of the leg's reach wide.

    Args:
        root: Of the project.
        timed: Takes calls by name, returns CPU seconds of each, taking turns.
    """
    print(f"inverse kinematics, {SAMPLES} samples, us per sample and leg: median")
    for name in ROBOTS:
        robot = load_robot(load_robot_file(root / "urdf" / f"{name}.toml"))
        chains, start = robot.chains, neutral_postures(robot)
        time = np.linspace(0.0, 1.0, SAMPLES)
        angle = 2 * np.pi * time[:, None, None]
        size = 0.1 * chains.reach[:, None] * np.array([0.5, 0.1, 0.25])
        shift = np.concatenate([np.sin(angle), np.sin(angle), 1 - np.cos(angle)], axis=-1)
        speed = np.concatenate([np.cos(angle), np.cos(angle), np.sin(angle)], axis=-1)
        target = foot_positions(chains, start[None]) + size * shift
        velocity = 2 * np.pi * size * speed
        still = np.zeros_like(velocity)
        q, _ = reach(chains, target, start)
        calls: dict[str, Call] = {
            "positions": lambda c=chains, t=target, s=start: reach(c, t, s),  # type: ignore[misc]
            "rates": lambda c=chains, p=q, v=velocity, a=still, t=time: solve_rates(c, p, v, a, t),  # type: ignore[misc]
        }
        seconds = timed(calls)
        cost = {k: 1e6 * float(np.median(v)) / target[..., 0].size for k, v in seconds.items()}
        print(
            f"  {name:9s} positions {cost['positions']:.2f}, velocities and accelerations "
            f"{cost['rates']:.2f}"
        )
