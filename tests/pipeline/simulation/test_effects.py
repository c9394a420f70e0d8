"""Effects in standing and walking, held against closed forms."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from actuators.loading.build import Catalog, load_catalog
from pipeline.effects.registry import effect_named
from pipeline.machine.drivetrains import Actuators, Drivetrains, drivetrains_of
from pipeline.machine.machine import MachineModel
from pipeline.robot.robot import Robot
from pipeline.simulation.edited import Effects, effects
from pipeline.simulation.energy_change import Cost, crossing, energy_change
from pipeline.simulation.walk_stand import stand, walk
from reports.pages.gap_words import energy_words

JOINT = "rm_joint_2"
SAMPLES = 151


@pytest.fixture(scope="module")
def catalog() -> Catalog:
    return load_catalog()


def with_effect(
    robot: Robot,
    catalog: Catalog,
    name: str,
    place: str,
    values: Mapping[str, float],
    against: str = "reversible",
) -> Effects:
    def apply(model: MachineModel) -> MachineModel:
        return effect_named(name).apply(model, (place,), values)

    return effects(robot, catalog.chain(against), apply, (name,))


def test_a_friction_of_nothing_changes_nothing(hexapod: Robot, catalog: Catalog) -> None:
    chain = catalog.chain("irreversible")
    friction = ("coulomb_friction", JOINT, {"torque": 0.0}, "irreversible")
    edit = with_effect(hexapod, catalog, *friction)
    edited = edit.chain(chain)
    assert isinstance(edited, Drivetrains)
    walking = walk(hexapod, {"as it was": chain, "edited": edited}, samples=SAMPLES)
    before, after = (walking.results[k] for k in ("as it was", "edited"))
    assert list(after.shafts) == list(before.shafts)
    assert list(after.losses)[-1] == list(before.losses)[-1]
    for stage, shaft in before.shafts.items():
        np.testing.assert_array_equal(after.shafts[stage].torque, shaft.torque)
    np.testing.assert_array_equal(after.electrical_power, before.electrical_power)


def test_drivetrains_that_are_all_alike_answer_as_their_chain(
    hexapod: Robot, catalog: Catalog
) -> None:
    chain = catalog.chain("reversible")
    alike = drivetrains_of(chain, hexapod.joints)
    both: dict[str, Actuators] = {"one": chain, "each": alike}
    walking, standing = walk(hexapod, both, samples=SAMPLES), stand(hexapod, both)
    one, each = (walking.results[k] for k in both)
    np.testing.assert_array_equal(each.electrical_power, one.electrical_power)
    assert list(each.losses) == list(one.losses)
    np.testing.assert_array_equal(*(standing.holding[k].power for k in both))


def test_coulomb_friction_loses_torque_times_travel(hexapod: Robot, catalog: Catalog) -> None:
    edit = with_effect(hexapod, catalog, "coulomb_friction", JOINT, {"torque": 2.0})
    chain = edit.chain(catalog.chain("reversible"))
    result = walk(hexapod, {"x": chain}, samples=SAMPLES).results["x"]
    column = hexapod.joints.index(JOINT)
    loss = result.losses["coulomb_friction"]
    assert not loss[:, [k for k in range(18) if k != column]].any()
    energy = np.trapezoid(loss[:, column], result.joint.time)
    travel = np.abs(np.diff(result.joint.position[:, column])).sum()
    assert energy == pytest.approx(2.0 * travel, rel=1e-3)


def test_friction_helps_to_hold(hexapod: Robot, catalog: Catalog) -> None:
    edit = with_effect(hexapod, catalog, "coulomb_friction", JOINT, {"torque": 3.0})
    chain = catalog.chain("reversible")
    standing = stand(hexapod, {"before": chain, "after": edit.chain(chain)})
    column = hexapod.joints.index(JOINT)
    before, after = (np.abs(standing.holding[k].motor_torque) for k in ("before", "after"))
    assert after[column] < before[column]
    np.testing.assert_array_equal(np.delete(after, column), np.delete(before, column))


def test_the_ideal_actuator_stays_ideal(hexapod: Robot, catalog: Catalog) -> None:
    edit = with_effect(hexapod, catalog, "coulomb_friction", JOINT, {"torque": 3.0})
    ideal = catalog.chain("ideal")
    assert edit.chain(ideal) is ideal


def test_a_payload_weighs_on_the_feet(hexapod: Robot, catalog: Catalog) -> None:
    edit = with_effect(hexapod, catalog, "link_mass", "base_link", {"mass": 5.0})
    weight = [
        stand(robot, {}, adjust=adjust).contacts.force[0, :, 2].sum()
        for robot, adjust in ((hexapod, None), (edit.robot, edit.demand))
    ]
    assert weight[1] - weight[0] == pytest.approx(5.0 * 9.81, rel=1e-3)


def test_a_spring_adds_to_the_demand(hexapod: Robot, catalog: Catalog) -> None:
    edit = with_effect(hexapod, catalog, "parallel_spring", JOINT, {"stiffness": 4.0, "rest": 0.1})
    before, after = stand(hexapod, {}), stand(edit.robot, {}, adjust=edit.demand)
    column = hexapod.joints.index(JOINT)
    added = after.demand.torque[0] - before.demand.torque[0]
    assert added[column] == pytest.approx(4.0 * (before.demand.position[0, column] - 0.1))
    assert not np.delete(added, column).any()


def test_feet_that_squeeze_the_ground_load_the_legs_alike(hexapod: Robot, catalog: Catalog) -> None:
    edit = with_effect(hexapod, catalog, "internal_foot_force", "ground", {"lateral": 30.0})
    legs = hexapod.leg_names
    before = stand(hexapod, {}, feet=legs)
    after = stand(edit.robot, {}, feet=legs, adjust=edit.demand)
    added = (after.demand.torque - before.demand.torque)[0].reshape(6, 3)
    left, right = added[:3], added[3:]
    # Mirrored legs at mirrored poses: equal coordinates are mirrored poses.
    np.testing.assert_allclose(np.abs(left), np.abs(right), atol=1e-9)
    assert np.abs(added).max() > 0.5


def test_sensors_cost_nothing_and_say_so(hexapod: Robot, catalog: Catalog) -> None:
    edit = with_effect(hexapod, catalog, "position_offset", JOINT, {"angle": 0.02})
    chain = catalog.chain("reversible")
    assert edit.chain(chain) is chain
    assert "sensor" in edit.remarks[0]


def test_a_found_friction_costs_in_the_actuator_it_was_found_against(
    hexapod: Robot, catalog: Catalog
) -> None:
    friction = ("coulomb_friction", JOINT, {"torque": 4.0})
    edit = with_effect(hexapod, catalog, *friction, against="reversible")
    change = energy_change(hexapod, catalog.chains(), edit)
    assert set(change.after) == {"ideal", "reversible"}
    assert change.after["ideal"].cycle == change.before["ideal"].cycle
    assert change.after["reversible"].cycle > change.before["reversible"].cycle
    assert change.after["reversible"].standing < change.before["reversible"].standing
    assert change.after["reversible"].middle_cycle > change.before["reversible"].middle_cycle
    assert np.isnan(change.break_even_after)
    words = energy_words(change, "reversible")
    assert "No number is given for irreversible, nor a break-even" in words


@pytest.mark.parametrize("against", ["rotor", ""])
def test_gears_with_losses_of_their_own_do_not_get_a_found_friction_besides(
    hexapod: Robot, catalog: Catalog, against: str
) -> None:
    def apply(model: MachineModel) -> MachineModel:
        return effect_named("coulomb_friction").apply(model, (JOINT,), {"torque": 4.0})

    chains = catalog.chains()
    edit = effects(hexapod, chains["rotor"], apply, ("coulomb_friction",), found_with=against)
    for name, chain in chains.items():
        assert (edit.chain(chain) is chain) == (name != against)
    assert edit.of_drivetrain == (JOINT,)
    assert "counts there alone" in edit.remarks[-1]


def test_bodies_and_motors_count_in_every_alternative(hexapod: Robot, catalog: Catalog) -> None:
    payload = ("link_mass", "base_link", {"mass": 5.0}, "rotor")
    change = energy_change(hexapod, catalog.chains(), with_effect(hexapod, catalog, *payload))
    assert set(change.after) == set(catalog.chains())
    weak = ("torque_constant_error", JOINT, {"relative": -0.2}, "rotor")
    edit = with_effect(hexapod, catalog, *weak)
    assert not edit.of_drivetrain
    change = energy_change(hexapod, catalog.chains(), edit)
    for name in ("rotor", "reversible", "irreversible"):
        assert change.after[name].cycle > change.before[name].cycle


def test_energies_count_what_springs_add_to_the_demand(hexapod: Robot, catalog: Catalog) -> None:
    """Before with what is known already, after with all of it; the actuators are the same."""
    chains = {name: catalog.chain(name) for name in ("reversible", "irreversible")}
    values = {"stiffness": 40.0, "rest": 0.1}
    spring = with_effect(hexapod, catalog, "parallel_spring", JOINT, values)
    change = energy_change(hexapod, chains, spring)
    for name, chain in chains.items():
        assert spring.chain(chain) is chain
        expected = walk(hexapod, chains, samples=SAMPLES, adjust=spring.demand).supplies[name]
        held = stand(hexapod, chains, adjust=spring.demand).holding[name]
        assert change.after[name].cycle == pytest.approx(expected.supplied_energy.sum())
        assert change.after[name].standing == pytest.approx(held.power.sum())
        assert change.after[name].cycle != pytest.approx(change.before[name].cycle, rel=1e-3)
    again = energy_change(hexapod, chains, spring, known=spring)
    assert again.before == again.after == change.after
    assert again.break_even_before == pytest.approx(change.break_even_after, nan_ok=True)


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
