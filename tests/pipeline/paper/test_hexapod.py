"""The hexapod at a set of numbers, what the paper leaves out, and its motor by brute force."""

import csv
from typing import Any

import numpy as np
import pytest

from actuators.energy import stage_energies
from actuators.loading.build import Catalog
from pipeline.paper.hexapod import (
    PRINTED,
    SAMPLES,
    RobotPart,
    outcomes,
    printed_leg,
    robot_part,
    solve_posture,
    standing_state,
)
from pipeline.paper.judgement import STUDY, costs_of, omissions
from pipeline.paper.published import KEYS, UNMET, Published, draws, middle
from pipeline.simulation.machine import read_machine


def test_the_middle_legs_agree_with_a_whole_walk(hexapod, catalog):
    """At the same sampling the middle legs' energies are those of `walk`; at 81 within 0.2 %."""
    walking = read_machine().walking(samples=751).walk(catalog.chains())
    for samples, tolerance in ((751, 1e-9), (SAMPLES, 2e-3)):
        found = outcomes(robot_part(hexapod.spec, samples).demand, catalog)
        for name, supply in walking.supplies.items():
            energy = dict(zip(supply.accounts, supply.supplied_energy, strict=True))
            leg = sum(energy[f"rm_joint_{k}"] for k in (1, 2, 3))
            assert found[name].drawn[0, PRINTED] == pytest.approx(leg, rel=tolerance)


def test_posture_is_solved_from_elsewhere(spec):
    other = spec.with_parameters(
        {"femur_mass": 1.0, "trunk_com_left": 0.0, "joint_2_lateral": 0.1, "body_height": 0.29}
    )
    target = np.array([192.6, -30.71, 1.46])
    _, reaction, torque = standing_state(solve_posture(other, target))
    (torque,) = printed_leg(torque)
    np.testing.assert_allclose([reaction, *torque[1:]], target, atol=1e-6)
    assert torque[0] == pytest.approx(0, abs=1e-9)


def test_section_iv_a_1_gives_a_reason_that_binds_only_a_sum(catalog):
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


Rows = list[Any]
HELD = 0.866  # of the reversible actuators, Table VI [W]


@pytest.fixture(scope="module")
def rows(part: RobotPart, catalog: Catalog) -> Rows:
    return list(omissions(part.demand, catalog).itertuples())


def of(rows: Rows, word: str) -> Rows:
    return [row for row in rows if word in row.left_out]


def idle_break_even(even: float, holding: float, idle: float) -> float:
    """Break-even with drivers that idle [W, all together], in closed form."""
    return even * holding / (even * holding + (1 - even) * (holding + idle))


def test_idle_drivers_agree_with_the_closed_form(rows, part, catalog):
    """The paper's 94 % and 0.866 W alone say what walking costs more, so the rest follows."""
    for watts, share in ((0.0, 0.94), (0.67, 0.735), (2.0, 0.513)):
        assert idle_break_even(0.94, HELD, 6 * watts) == pytest.approx(share, abs=1e-3)
    held = costs_of(outcomes(part.demand, catalog))[2, 2]
    found = of(rows, "drivers")
    assert len(found) == 2
    for row in found:
        closed = idle_break_even(rows[0].break_even, held, 6 * row.value)
        assert row.break_even == pytest.approx(closed, rel=1e-9)
        assert row.break_even_change == pytest.approx(closed - rows[0].break_even, rel=1e-9)


def test_a_brake_leaves_no_break_even_and_costs_its_power_while_walking(rows, part, catalog):
    ideal = outcomes(part.demand, catalog)["ideal"].drawn[0, 1]  # [J]
    for row in of(rows, "brakes"):
        assert np.isnan(row.break_even)
        more = row.value * 3 * 3.0 / ideal  # of three joints in 3 s
        assert row.ratio_reversible == pytest.approx(rows[0].ratio_reversible + more)
        assert row.ratio_irreversible == rows[0].ratio_irreversible


def test_holding_elsewhere_in_the_friction_band_moves_the_break_even(rows, part, catalog):
    """In closed form, of the motor torques that hold the reversible joints (ratio f0 : 1 - f0)."""
    reversible = outcomes(part.demand, catalog)["reversible"]
    held, motor = reversible.holding, reversible.chain.motor
    most = np.maximum(np.abs(held.low), np.abs(held.high))
    even = rows[0].break_even
    extra = even / (1 - even) * printed_leg(held.power).sum()
    for row, torque in zip(
        of(rows, "friction band"), (np.abs(held.low + held.high) / 2, most), strict=True
    ):
        watts = printed_leg((torque / motor.torque_constant) ** 2 * motor.resistance).sum()
        assert row.break_even == pytest.approx(extra / (extra + watts), rel=1e-2)
        assert row.break_even < even
        assert row.ratio_reversible == rows[0].ratio_reversible


def frictions() -> list[tuple[float, float, list[str]]]:
    """The study's: lowest and highest [mN*m], and the entries they leave unmet."""
    with (STUDY / "rotor_friction.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return [(float(r["from_mNm"]), float(r["to_mNm"]), r["which"].split()) for r in rows]


def standing(k: float, r: float, friction: float, held: float) -> dict[str, float]:
    """Tables IV to VI by hand: Eq. 1, Ohm's law, P = U I, E = 3 P."""
    ideal = {2: 30.71 / 400, 3: 1.46 / 400}
    motor = {
        "ideal": ideal,
        "rotor": {j: max(g - friction, 0.0) for j, g in ideal.items()},
        "reversible": {2: held, 3: 0.0},
    }
    out: dict[str, float] = {}
    for name, torques in motor.items():
        energy = 0.0
        for joint, torque in torques.items():
            current = torque / k
            out |= {
                f"{name}_motor_torque_{joint}": torque,
                f"{name}_current_{joint}": current,
                f"{name}_voltage_{joint}": r * current,
                f"{name}_power_{joint}": r * current**2,
            }
            energy += 3 * r * current**2
        out[f"{name}_leg_energy_3s"] = energy
    return out


def unmet(published: dict[str, Published], values: dict[str, float]) -> set[str]:
    return {
        name
        for name, value in values.items()
        if abs(value - abs(published[name].value)) > published[name].half_width * (1 + 1e-6) + 1e-12
    }


@pytest.mark.parametrize("friction", [3.50, 3.575, 3.62])
def test_no_torque_constant_and_resistance_on_a_fine_grid_do_better(published, friction):
    """By brute force, with a calculation of its own."""
    (*_, (_, _, stated)) = (row for row in frictions() if row[0] <= friction + 1e-6)
    k, r = np.meshgrid(np.linspace(30.1, 30.3, 201) * 1e-3, np.linspace(0.314, 0.318, 201))
    count = np.zeros(k.shape)
    values = standing(k, r, friction * 1e-3, 0.04998)
    for name, value in values.items():
        row = published[name]
        count += np.abs(value - abs(row.value)) > row.half_width * (1 + 1e-9)
    assert count.min() >= len(stated)


def test_every_draw_gives_every_entry_but_the_contradicted(published):
    """What they make of the contradicted ones are the numbers that ERRATA.md quotes."""
    k, r, friction = (middle(published)[key] for key in KEYS)
    assert unmet(published, standing(k, r, friction, 0.04998)) == set(UNMET)
    rows = [standing(*own) for own in draws(published, np.random.default_rng(7), 1000)]
    assert all(unmet(published, row) == set(UNMET) for row in rows)
    torque = [1e3 * row["rotor_motor_torque_2"] for row in rows]
    energy = [row["rotor_leg_energy_3s"] for row in rows]
    assert 73.15 <= min(torque) <= max(torque) <= 73.16
    assert 5.565 <= min(energy) <= max(energy) <= 5.568
