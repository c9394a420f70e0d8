"""Effects in standing and walking, held against closed forms."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from actuators.loading.build import load_catalog
from pipeline.effects.registry import effect_named
from pipeline.machine.joint import drivetrains_of
from pipeline.machine.machine import MachineModel
from pipeline.robot.robot import Robot
from pipeline.simulation.cycle_energy import SAMPLES, Cost, crossing, energy_change
from pipeline.simulation.walk_stand import Effects, effects_on, stand, walk

JOINT = "rm_joint_2"
CHAINS = load_catalog().chains()
Edit = tuple[str, str, Mapping[str, float]]
FRICTION: Edit = ("coulomb_friction", JOINT, {"torque": 4.0})
SPRING: Edit = ("parallel_spring", JOINT, {"stiffness": 40.0, "rest": 0.1})


def with_effect(robot: Robot, edit: Edit, found_with: str = "reversible") -> Effects:
    name, place, values = edit

    def apply(model: MachineModel) -> MachineModel:
        return effect_named(name).apply(model, (place,), values)

    chain = CHAINS[found_with or "rotor"]
    return effects_on(robot, chain, apply, (name,), found_with=found_with)


@pytest.fixture
def column(hexapod: Robot) -> int:
    return hexapod.joints.index(JOINT)


def test_drivetrains_of_joints_answer_as_their_chain_and_a_friction_of_nothing_changes_nothing(
    hexapod: Robot,
) -> None:
    chain = CHAINS["irreversible"]
    nothing = with_effect(hexapod, (*FRICTION[:2], {"torque": 0.0}), "irreversible").chain(chain)
    each = {"one": chain, "alike": drivetrains_of(chain, hexapod.joints), "nothing": nothing}
    walking, standing = walk(hexapod, each, samples=51), stand(hexapod, each)
    one = walking.results["one"]
    for name in ("alike", "nothing"):
        other = walking.results[name]
        assert (list(other.shafts), list(other.losses)[-1]) == (list(one.shafts), "winding")
        for stage, shaft in one.shafts.items():
            np.testing.assert_array_equal(other.shafts[stage].torque, shaft.torque)
        np.testing.assert_array_equal(other.electrical_power, one.electrical_power)
        np.testing.assert_array_equal(standing.holding[name].power, standing.holding["one"].power)


def test_coulomb_friction_loses_torque_times_travel_and_helps_to_hold(
    hexapod: Robot, column: int
) -> None:
    before = CHAINS["reversible"]
    after = with_effect(hexapod, FRICTION).chain(before)
    result = walk(hexapod, {"x": after}, samples=SAMPLES).results["x"]
    loss = result.losses["coulomb_friction"]
    assert not np.delete(loss, column, axis=1).any()
    travel = np.abs(np.diff(result.joint.position[:, column])).sum()
    energy = np.trapezoid(loss[:, column], result.joint.time)
    assert energy == pytest.approx(4.0 * travel, rel=1e-3)
    holding = stand(hexapod, {"before": before, "after": after}).holding
    held = np.abs(holding["after"].motor_torque) - np.abs(holding["before"].motor_torque)
    assert held[column] < 0.0
    assert not np.delete(held, column).any()


def test_a_payload_weighs_on_the_feet_and_a_spring_adds_to_the_demand(
    hexapod: Robot, column: int
) -> None:
    loaded = with_effect(hexapod, ("link_mass", "base_link", {"mass": 5.0}))
    sprung = with_effect(hexapod, SPRING)
    plain, heavy, held = (
        stand(robot, {}, adjust=adjust)
        for robot, adjust in (
            (hexapod, None),
            (loaded.robot, loaded.demand),
            (sprung.robot, sprung.demand),
        )
    )
    weight = (heavy.contacts.force - plain.contacts.force)[0, :, 2].sum()
    assert weight == pytest.approx(5.0 * 9.81, rel=1e-3)
    added = (held.demand.torque - plain.demand.torque)[0]
    assert added[column] == pytest.approx(40.0 * (plain.demand.position[0, column] - 0.1))
    assert not np.delete(added, column).any()


def test_a_found_friction_costs_in_the_actuator_it_was_found_against(hexapod: Robot) -> None:
    edit = with_effect(hexapod, FRICTION)
    changed = {name for name, chain in CHAINS.items() if edit.chain(chain) is not chain}
    assert changed == {"reversible"}
    assert edit.of_drivetrain == (JOINT,)
    change = energy_change(hexapod, CHAINS, edit)
    assert set(change.after) == {"ideal", "reversible"}
    assert change.after["ideal"].cycle == change.before["ideal"].cycle
    before, after = (costs["reversible"] for costs in (change.before, change.after))
    assert after.cycle > before.cycle
    assert after.standing < before.standing
    assert after.middle_cycle > before.middle_cycle
    assert np.isnan(change.break_even_after)


def test_motors_count_in_every_alternative(hexapod: Robot) -> None:
    weak = with_effect(hexapod, ("torque_constant_error", JOINT, {"relative": -0.2}), "rotor")
    assert not weak.of_drivetrain
    change = energy_change(hexapod, CHAINS, weak)
    assert set(change.after) == set(CHAINS)
    for name in ("rotor", "reversible", "irreversible"):
        assert change.after[name].cycle > change.before[name].cycle


def test_energies_count_what_springs_add_to_the_demand(hexapod: Robot) -> None:
    """Before with what is known already, after with all of it; the actuators are the same."""
    chains = {name: CHAINS[name] for name in ("reversible", "irreversible")}
    spring = with_effect(hexapod, SPRING)
    change = energy_change(hexapod, chains, spring)
    walking = walk(hexapod, chains, samples=SAMPLES, adjust=spring.demand)
    standing = stand(hexapod, chains, adjust=spring.demand)
    for name in chains:
        expected = walking.supplies[name].supplied_energy.sum()
        assert change.after[name].cycle == pytest.approx(expected)
        assert change.after[name].standing == pytest.approx(standing.holding[name].power.sum())
        assert change.after[name].cycle != pytest.approx(change.before[name].cycle, rel=1e-3)
    again = energy_change(hexapod, chains, spring, known=spring)
    assert again.before == again.after == change.after


def test_at_the_break_even_both_cost_the_same() -> None:
    costs = {
        "reversible": Cost(300.0, 20.0, 120.0, 9.0),
        "irreversible": Cost(400.0, 3.0, 200.0, 1.0),
    }
    f = crossing(costs, 3.0)
    power = [(1 - f) * c.middle_cycle / 3.0 + f * c.middle_standing for c in costs.values()]
    assert power[0] == pytest.approx(power[1])
    swapped = {"reversible": costs["irreversible"], "irreversible": costs["reversible"]}
    assert np.isnan(crossing(swapped, 3.0))
