"""The least electrical power: read off the chain, found, and never more than other rules cost."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from actuators.loading.build import load_catalog
from pipeline.dynamics.force_rules import GroundForces, JointDemand, LeastTorque
from pipeline.dynamics.internal_forces import internal_basis
from pipeline.dynamics.joint_demand import segment_demand
from pipeline.motion.motion import Segment
from pipeline.motion.support import standing_posture
from pipeline.motion.walking import walking_motion
from pipeline.robot.robot import Robot
from pipeline.simulation.force_choice import LEAST_POWER, RULES
from pipeline.simulation.least_power import LeastPower, PowerOfJoints
from pipeline.simulation.walk_stand import Regeneration, compare_rules
from tests.pipeline.dynamics.test_force_rules import shown, swinging

CHAINS = load_catalog().chains()


@pytest.fixture(scope="module")
def step(hexapod: Robot) -> Segment:
    return walking_motion(hexapod, samples=41).segments[0]


@pytest.mark.parametrize("standing", [False, True], ids=["walking", "standing"])
@pytest.mark.parametrize("name", CHAINS)
def test_the_law_gives_the_power_of_the_chain(
    hexapod: Robot, step: Segment, name: str, standing: bool
) -> None:
    """At torques drawn at random, across every kink, in motion and at rest."""
    segment = standing_posture(hexapod) if standing else step
    stance = shown(hexapod, segment, None)
    power = PowerOfJoints(LeastPower(CHAINS[name], 0.3), stance)
    rows = np.arange(segment.time.size)
    reach = 80.0 * np.ones((rows.size, 1))
    law = power.law(rows, reach)
    rng = np.random.default_rng(1)
    for scale in (80.0, 1.0, 0.01):
        torque = rng.uniform(-scale, scale, (rows.size, 9))
        exact = power.at(rows, torque)
        np.testing.assert_allclose(
            law.smoothed(torque, 1e-12 * reach)[0], exact, atol=1e-7 * np.abs(exact).max() + 1e-12
        )


def test_derivatives_of_the_rounded_power_are_those_of_differences(
    hexapod: Robot, step: Segment
) -> None:
    stance = shown(hexapod, step, None)
    rows = np.arange(step.time.size)
    law = PowerOfJoints(LeastPower(CHAINS["irreversible"]), stance).law(
        rows, 80.0 * np.ones((rows.size, 1))
    )
    torque = np.random.default_rng(2).uniform(-20, 20, (rows.size, 9))
    width, h = np.ones((rows.size, 1)), 1e-4
    lost = 1e3 * width  # a fixed rounding of the power itself, so that differences see the same
    here, above, below = (law.smoothed(torque + d, width, lost) for d in (0.0, h, -h))
    np.testing.assert_allclose(here[1], (above[0] - below[0]) / (2 * h), atol=1e-6)
    np.testing.assert_allclose(here[2], (above[1] - below[1]) / (2 * h), atol=1e-6)


@pytest.mark.parametrize(
    ("name", "limit"),
    [("ideal", 0.3), ("rotor", None), ("reversible", 0.3), ("irreversible", None)],
)
def test_no_general_solver_finds_less_power(
    hexapod: Robot, step: Segment, name: str, limit: float | None
) -> None:
    """Nelder and Mead's method on the chain itself, at an instant, with bounds as penalties."""
    stance = shown(hexapod, step, limit)
    rule = LeastPower(CHAINS[name])
    force, basis = rule.forces(stance), internal_basis(stance.feet)
    power = PowerOfJoints(rule, stance)
    row = 30
    rows = np.array([row])

    def cost(z: np.ndarray) -> float:
        tried = stance.force[row] + basis[row] @ z
        beyond = np.maximum(-tried[:, 2], 0.0).sum()
        if limit is not None:
            beyond += np.maximum(np.hypot(*tried.T[:2]) - limit * tried[:, 2], 0.0).sum()
        return float(power.total(rows, tried[None])[0] + 1e3 * beyond)

    options = {"xatol": 1e-4, "fatol": 1e-6}
    found = minimize(cost, np.zeros(3), method="Nelder-Mead", options=options)
    own = power.total(rows, force[row][None])[0]
    assert own <= power.total(rows, stance.force[row][None])[0]
    assert own <= found.fun * (1 + 1e-4)


@pytest.mark.parametrize("regeneration", [("none", 0.0), ("fraction", 0.6), ("bus", 0.0)])
def test_of_all_rules_least_power_costs_the_least_energy(
    hexapod: Robot, regeneration: tuple[str, float]
) -> None:
    chains = {name: CHAINS[name] for name in ("ideal", "irreversible")}
    costs = compare_rules(
        hexapod,
        chains,
        walking_motion(hexapod, samples=51),
        regeneration=Regeneration(*regeneration),
    )
    energy = {(cost.alternative, cost.rule): cost.energy for cost in costs}
    assert set(energy) == {(name, rule) for name in chains for rule in RULES}
    for name in chains:
        least = min(energy[name, rule] for rule in RULES)
        assert energy[name, LEAST_POWER] <= least * (1 + 1e-9)  # the rule, down to round-off


def test_on_a_bus_without_friction_least_power_is_least_torque(
    hexapod: Robot, step: Segment
) -> None:
    """sum(tau q_dot) is the motion's, whatever the forces are: what is left is R I^2."""
    stance = shown(hexapod, step, None)
    power = LeastPower(CHAINS["ideal"], Regeneration("bus").recovered).forces(stance)
    torque = LeastTorque().forces(stance)
    np.testing.assert_allclose(power, torque, atol=1e-3 * np.abs(torque).max())
    of = [stance.loaded_torque(force) for force in (power, torque)]
    np.testing.assert_allclose(*((part**2).sum(axis=1) for part in of), rtol=1e-7)


@pytest.mark.parametrize("limit", [None, 0.6])
def test_with_more_feet_than_three_power_goes_down_within_the_bounds(
    hexapod: Robot, limit: float | None
) -> None:
    segment = swinging(hexapod)
    stance = shown(hexapod, segment, limit)
    rule = LeastPower(CHAINS["reversible"])
    power, rows = PowerOfJoints(rule, stance), np.arange(segment.time.size)
    force = rule.forces(stance)
    assert np.all(power.total(rows, force) < power.total(rows, stance.force))
    assert force[..., 2].min() >= -1e-7
    if limit is not None:
        assert np.all(np.hypot(force[..., 0], force[..., 1]) <= limit * force[..., 2] + 1e-6)


def test_who_stands_without_current_is_left_as_the_paper_has_it(hexapod: Robot) -> None:
    """Self-locking gears hold whatever the forces are: nothing is to be gained."""
    segment = standing_posture(hexapod)
    rule = GroundForces(LeastPower(CHAINS["irreversible"]))
    one, other = (segment_demand(hexapod, segment, forces=f)[0] for f in (GroundForces(), rule))
    np.testing.assert_allclose(one.torque, other.torque, atol=1e-9)


def test_the_power_counts_what_effects_add_beside_the_motor(hexapod: Robot) -> None:
    """A spring that holds joint 2 makes torque there cheap: forces move that way."""
    segment = standing_posture(hexapod)
    columns = [k for k, name in enumerate(hexapod.joints) if name.endswith("joint_2")]

    def spring(_: Segment, demand: JointDemand) -> JointDemand:
        torque = np.array(demand.torque)
        torque[:, columns] += 40.0
        return replace(demand, torque=torque)

    plain, sprung = (
        segment_demand(
            hexapod, segment, forces=GroundForces(LeastPower(CHAINS["rotor"], 0.0, adjust))
        )[0].torque[0, columns]
        for adjust in (None, spring)
    )
    standing = [k for k, leg in enumerate(hexapod.leg_names) if leg in segment.stance]
    assert np.all(plain[standing] < 0)
    assert np.abs(sprung + 40.0)[standing].sum() < np.abs(plain + 40.0)[standing].sum()
