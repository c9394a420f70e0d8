"""Entries of `actuators/ERRATA.md` that take the robot: one test for each."""

from __future__ import annotations

import pytest

from actuators.energy.energy import StageEnergy, stage_energy
from actuators.loading.build import load_catalog
from pipeline.robot.robot import Robot
from pipeline.simulation.walk_stand import walk


@pytest.fixture(scope="module")
def at_the_joints(hexapod: Robot) -> StageEnergy:
    result = walk(hexapod, {"ideal": load_catalog().chain("ideal")}, samples=201).results["ideal"]
    return stage_energy(result, "out")


def test_section_iv_a_1_gives_a_reason_that_binds_only_a_sum(at_the_joints: StageEnergy) -> None:
    assert float(at_the_joints.net.sum()) == pytest.approx(0, abs=1e-9)
    net = dict(zip(at_the_joints.joints, at_the_joints.net, strict=True))
    for joint in (1, 2, 3):
        for leg in ("lm", "rm"):
            assert net[f"{leg}_joint_{joint}"] == pytest.approx(0, abs=1e-6)
        for side in ("l", "r"):  # backwards in time, front and rear change places
            front, rear = net[f"{side}f_joint_{joint}"], net[f"{side}r_joint_{joint}"]
            assert front == pytest.approx(-rear, abs=1e-6)
            assert abs(front) > 0.01
    index = at_the_joints.joints.index("lf_joint_3")
    assert at_the_joints.forward[index] == pytest.approx(0.07, abs=0.005)
    assert at_the_joints.reverse[index] == pytest.approx(0.24, abs=0.005)
