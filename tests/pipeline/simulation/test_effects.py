"""Effects in standing and walking, held against closed forms."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from actuators.loading.build import load_catalog
from pipeline.effects.model_file import ModelFile, assumed, new_model_file
from pipeline.machine.drivetrains import drivetrains_of
from pipeline.robot.robot import Robot
from pipeline.robot.robot_file import DEFAULT_ROBOT
from pipeline.simulation.cycle_energy import SAMPLES, break_even, energy_change
from pipeline.simulation.effects import Effects, effects_on
from pipeline.simulation.machine import Machine, read_machine
from pipeline.simulation.options import WalkOptions
from pipeline.simulation.walk_stand import stand, walk

JOINT = "rm_joint_2"
CHAINS = load_catalog().chains()
Given = tuple[str, str, Mapping[str, float]]
FRICTION: Given = ("coulomb_friction", JOINT, {"torque": 4.0})
SPRING: Given = ("parallel_spring", JOINT, {"stiffness": 40.0, "rest": 0.1})


def model_file(edit: Given, found_with: str) -> ModelFile:
    effect, place, values = edit
    own = assumed(effect, (place,), values, "a test")
    return new_model_file(DEFAULT_ROBOT, found_with).with_edits([own])


def with_effect(robot: Robot, edit: Given, found_with: str = "reversible") -> Effects:
    return effects_on(robot, CHAINS[found_with], model_file(edit, found_with))


@pytest.fixture(scope="module")
def machine(root: Path) -> Machine:
    return read_machine(root / DEFAULT_ROBOT)


@pytest.fixture
def column(hexapod: Robot) -> int:
    return hexapod.joints.index(JOINT)


def test_drivetrains_of_joints_answer_as_their_chain_and_a_friction_of_nothing_changes_nothing(
    hexapod: Robot,
) -> None:
    chain = CHAINS["irreversible"]
    nothing = with_effect(hexapod, (*FRICTION[:2], {"torque": 0.0}), "irreversible").chain(chain)
    each = {"one": chain, "alike": drivetrains_of(chain, hexapod.joints), "nothing": nothing}
    walking, standing = walk(hexapod, each, WalkOptions(samples=51)), stand(hexapod, each)
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
    result = walk(hexapod, {"x": after}, WalkOptions(samples=SAMPLES)).results["x"]
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


def test_a_found_friction_costs_in_the_actuator_it_was_found_against(machine: Machine) -> None:
    rubbing = machine.with_model(model_file(FRICTION, "reversible"))
    assert rubbing.effects is not None
    own = rubbing.own.every()
    changed = {name for name, chain in own.items() if rubbing.chains()[name] is not chain}
    assert changed == {"reversible"}
    assert rubbing.effects.of_drivetrain == (JOINT,)
    change = energy_change(machine, rubbing)
    known = change.dropna()
    assert set(known.index) == {"ideal", "reversible"}
    assert known.loc["ideal", "cycle_J"] == known.loc["ideal", "cycle_J_after"]
    row = known.loc["reversible"]
    assert row["cycle_J_after"] > row["cycle_J"]
    assert row["standing_W_after"] < row["standing_W"]


def test_motors_count_in_every_alternative(machine: Machine) -> None:
    weak = ("torque_constant_error", JOINT, {"relative": -0.2})
    change = energy_change(machine, machine.with_model(model_file(weak, "rotor")))
    geared = change.drop(index="ideal")
    assert (geared["cycle_J_after"] > geared["cycle_J"]).all()


def test_at_the_break_even_both_cost_the_same() -> None:
    extra, saved = 80.0 / 3.0, 8.0  # [W]
    f = break_even(extra, saved)
    assert (1 - f) * extra == pytest.approx(f * saved)
    assert np.isnan(break_even(saved, -extra))
