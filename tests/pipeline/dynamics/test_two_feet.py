"""A trot: two feet carry all but the moment about their line; a surge takes the hips' torque."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pipeline as lw
from pipeline.dynamics.contact_forces import least_tangential_forces
from pipeline.motion.walking import walking_motion

TROT = {
    "gait.phase": "{LF = 0.0, RH = 0.0, RF = 0.5, LH = 0.5}",
    "gait.duty_factor": 0.55,
    "gait.speed": "0.8 m/s",
    "gait.period": "0.7 s",
}


def test_two_feet_meet_all_of_a_wrench_but_the_moment_about_their_line() -> None:
    rng = np.random.default_rng(1)
    feet = rng.normal(size=(20, 2, 3))
    wrench = rng.normal(size=(20, 6)) + [0, 0, 50, 0, 0, 0]
    feet[..., 2] = -0.5  # on level ground
    force = least_tangential_forces(wrench, feet)
    assert np.allclose(force.sum(axis=1), wrench[:, :3])
    left = wrench[:, 3:] - np.cross(feet, force).sum(axis=1)
    along = feet[:, 1] - feet[:, 0]
    along /= np.linalg.norm(along, axis=1)[:, None]
    assert np.allclose(left, np.einsum("ni,ni->n", left, along)[:, None] * along, atol=1e-9)
    assert np.abs(left).max() > 0.1


def test_a_surge_makes_the_ground_push_towards_the_hips(root: Path) -> None:
    """Impulse over a period is nothing, and the hips' torque falls towards its least."""
    torque = {}
    for surge in (0.0, 1.0):
        changes = TROT | {"gait.least_feet": 2, "gait.surge": surge}
        machine = lw.load(root / "urdf" / "tytan.toml", changes=changes)
        walked = lw.demand(machine, samples=51)
        hips = [k for k, name in enumerate(walked.joints.joints) if name.endswith("joint_2")]
        values = np.concatenate([part.torque[:, hips] for part in walked.joints.segments])
        torque[surge] = float(np.sqrt(np.mean(values**2)))
        motion = walking_motion(machine.robot, samples=51)
        first, last = motion.segments[0], motion.segments[-1]
        gone = last.configuration[-1, 0] - first.configuration[0, 0]
        assert gone == pytest.approx(0.8 * 0.7, rel=1e-9)
        assert last.velocity[-1, 0] == pytest.approx(first.velocity[0, 0], rel=1e-9)
        fastest = max(
            np.abs(np.gradient(s.configuration[:, 0], s.time)).max() for s in motion.segments
        )
        assert (fastest > 0.81) == bool(surge)
    assert torque[1.0] < 0.8 * torque[0.0]
