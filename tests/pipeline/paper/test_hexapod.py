"""The hexapod at a set of numbers against the general functions, and its own pieces."""

from __future__ import annotations

import numpy as np
import pytest

from actuators.energy.energy import stage_energies
from actuators.loading.build import Catalog
from pipeline.paper.hexapod import (
    PRINTED,
    SAMPLES,
    outcomes,
    printed_leg,
    robot_part,
    solve_posture,
    standing_state,
)
from pipeline.robot.robot import Robot
from pipeline.robot.robot_file import RobotSpec
from pipeline.simulation.machine import read_machine


def test_the_middle_legs_agree_with_a_whole_walk(hexapod: Robot, catalog: Catalog) -> None:
    """At the same sampling the middle legs' energies are those of `walk`; at 81 within 0.2 %."""
    walking = read_machine().walking(samples=751).walk(catalog.chains())
    for samples, tolerance in ((751, 1e-9), (SAMPLES, 2e-3)):
        found = outcomes(robot_part(hexapod.spec, samples).demand, catalog)
        for name, supply in walking.supplies.items():
            energy = dict(zip(supply.accounts, supply.supplied_energy, strict=True))
            leg = sum(energy[f"rm_joint_{k}"] for k in (1, 2, 3))
            assert found[name].drawn[0, PRINTED] == pytest.approx(leg, rel=tolerance)


def test_posture_is_solved_from_elsewhere(spec: RobotSpec) -> None:
    other = spec.with_parameters(
        {"femur_mass": 1.0, "trunk_com_left": 0.0, "joint_2_lateral": 0.1, "body_height": 0.29}
    )
    target = np.array([192.6, -30.71, 1.46])
    _, reaction, torque = standing_state(solve_posture(other, target))
    (torque,) = printed_leg(torque)
    np.testing.assert_allclose([reaction, *torque[1:]], target, atol=1e-6)
    assert torque[0] == pytest.approx(0, abs=1e-9)


def test_section_iv_a_1_gives_a_reason_that_binds_only_a_sum(catalog: Catalog) -> None:
    walking = read_machine().walking(samples=201).walk({"ideal": catalog.chain("ideal")})
    result = walking.results["ideal"]
    forward, reverse = stage_energies(result)["out"]
    net = dict(zip(result.joint.joints, forward - reverse, strict=True))
    assert sum(net.values()) == pytest.approx(0, abs=1e-9)
    for joint in (1, 2, 3):
        for leg in ("lm", "rm"):
            assert net[f"{leg}_joint_{joint}"] == pytest.approx(0, abs=1e-6)
        for side in ("l", "r"):  # backwards in time, front and rear change places
            front, rear = net[f"{side}f_joint_{joint}"], net[f"{side}r_joint_{joint}"]
            assert front == pytest.approx(-rear, abs=1e-6)
            assert abs(front) > 0.01
    index = result.joint.joints.index("lf_joint_3")
    assert forward[index] == pytest.approx(0.07, abs=0.005)
    assert reverse[index] == pytest.approx(0.24, abs=0.005)
