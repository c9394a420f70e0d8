"""The hexapod at a set of numbers against the general functions, and its own pieces."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from actuators.energy.energy import StageEnergy, stage_energy
from actuators.loading.build import Catalog
from pipeline.paper.hexapod import (
    SAMPLES,
    RobotPart,
    outcome,
    outcomes,
    printed_leg,
    robot_part,
    solve_posture,
    standing_state,
)
from pipeline.paper.judgement.evidence import per_minute
from pipeline.paper.published import CYCLE, PAIR
from pipeline.paper.quantities import pair_break_even, pair_costs
from pipeline.robot.robot import Robot
from pipeline.robot.robot_file import RobotSpec
from pipeline.simulation.walk_stand import walk


def test_the_middle_legs_agree_with_a_whole_walk(hexapod: Robot, catalog: Catalog) -> None:
    """At the same sampling the middle legs' energies are those of `walk`; at 81 within 0.2 %."""
    walking = walk(hexapod, catalog.chains(), samples=751)
    for samples, tolerance in ((751, 1e-9), (SAMPLES, 2e-3)):
        found = outcomes(robot_part(hexapod.spec, samples).demand, catalog)
        for name, supply in walking.supplies.items():
            energy = dict(zip(supply.accounts, supply.supplied_energy, strict=True))
            leg = sum(energy[f"rm_joint_{k}"] for k in (1, 2, 3))
            assert found[name].consumed("rm") == pytest.approx(leg, rel=tolerance)


@pytest.mark.parametrize(
    ("quantity", "limit"),
    [
        ("speed", "max_speed"),
        ("voltage", "supply_voltage"),
        ("current", "peak_current"),
        ("rms_current", "continuous_current"),
    ],
)
def test_a_limit_is_kept_up_to_the_limit(
    part: RobotPart, catalog: Catalog, quantity: str, limit: str
) -> None:
    chain = catalog.chain("reversible")
    peak = (1 + outcome(part.demand, chain).excess[quantity][0]) * getattr(chain.motor, limit)
    for factor in (1.001, 0.999):
        limits = {"continuous_current": 1e-3, limit: factor * peak}
        other = replace(chain, motor=replace(chain.motor, **limits))
        assert (outcome(part.demand, other).excess[quantity][0] <= 0) == (factor > 1)


def test_posture_is_solved_from_elsewhere(spec: RobotSpec) -> None:
    other = spec.with_parameters(
        {"femur_mass": 1.0, "trunk_com_left": 0.0, "joint_2_lateral": 0.1, "body_height": 0.29}
    )
    target = np.array([192.6, -30.71, 1.46])
    _, reaction, torque = standing_state(solve_posture(other, target))
    (torque,) = printed_leg(torque)
    np.testing.assert_allclose([reaction, *torque[1:]], target, atol=1e-6)
    assert torque[0] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("extra", [70.0, 10.0])
def test_the_papers_break_even_adds_up_both_middle_legs(extra: float) -> None:
    """Fig. 21: walking both draw, standing one of them, the irreversible actuator nothing."""
    energy = {
        "reversible": {"lm": 100.0, "rm": 110.0},
        "irreversible": {"lm": 100.0 + extra, "rm": 110.0},
    }
    power = 0.9  # of the loaded leg [W]
    f = pair_break_even(energy, power)
    walking = {name: (1 - f) * sum(e.values()) for name, e in energy.items()}  # [J] per period
    standing = f * power * CYCLE
    assert walking["irreversible"] == pytest.approx(walking["reversible"] + standing, rel=1e-12)
    swapped = dict(zip(energy, reversed(energy.values()), strict=True))
    assert math.isnan(pair_break_even(swapped, power))  # one actuator is better at both


def test_the_lines_of_fig_21_cross_where_both_pairs_draw_the_same(
    part: RobotPart, catalog: Catalog
) -> None:
    found = outcomes(part.demand, catalog)
    costs = pair_costs(found)
    lines = per_minute(costs, found, with_bands=False)
    energy = {line.alternative: line.energy for line in lines}
    share = lines[0].fraction
    at = [np.interp(costs["middle_legs"], share, energy[name]) for name in PAIR]
    assert at[0] == pytest.approx(at[1], rel=1e-9)
    assert energy["irreversible"][-1] == 0.0
    assert energy["ideal"][0] == pytest.approx(20 * costs["ideal cycle_J"])  # cycles a minute


@pytest.fixture(scope="module")
def at_the_joints(hexapod: Robot, catalog: Catalog) -> StageEnergy:
    result = walk(hexapod, {"ideal": catalog.chain("ideal")}, samples=201).results["ideal"]
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
