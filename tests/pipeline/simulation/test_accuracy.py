"""Energies of the real walking cycle: balance, sampling, regeneration, reversals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from actuators.chain import Chain
from actuators.energy.balance import balance_residual
from actuators.energy.energy import stage_energies
from actuators.energy.regeneration import supply
from actuators.loading.build import load_catalog
from pipeline.robot.robot import Robot
from pipeline.simulation.walk_stand import Walking, walk

ALTERNATIVES = ("ideal", "rotor", "reversible", "irreversible")
POLICIES = (("none", 0.0), ("fraction", 0.5), ("fraction", 1.0), ("bus", 0.0))
SAMPLES = 751


@pytest.fixture(scope="module")
def chains() -> dict[str, Chain]:
    return load_catalog().chains()


@pytest.fixture(scope="module")
def cycle(hexapod: Robot, chains: dict[str, Chain]) -> Walking:
    return walk(hexapod, chains, samples=SAMPLES)


@pytest.fixture(scope="module")
def fine_cycle(hexapod: Robot, chains: dict[str, Chain]) -> Walking:
    return walk(hexapod, chains, samples=20 * (SAMPLES - 1) + 1)


@pytest.mark.parametrize("alternative", ALTERNATIVES)
@pytest.mark.parametrize("policy", POLICIES, ids=lambda p: f"{p[0]}-{p[1]}")
def test_power_balances_at_every_sample(
    cycle: Walking, alternative: str, policy: tuple[str, float]
) -> None:
    """Supplied - dumped - joint - losses - stored, relative to the terms: below 1e-9."""
    result = cycle.results[alternative]
    account = supply(result, *policy)
    assert np.abs(balance_residual(result, account)).max() < 1e-9


def test_the_balance_can_fail(cycle: Walking) -> None:
    """A winding loss of a thousandth too much shows."""
    result = cycle.results["reversible"]
    losses = dict(result.losses)
    losses["winding"] = losses["winding"] * 1.001
    assert np.abs(balance_residual(replace(result, losses=losses))).max() > 1e-6


@pytest.mark.parametrize("alternative", ALTERNATIVES)
def test_no_element_gives_energy_away(cycle: Walking, alternative: str) -> None:
    for name, loss in cycle.results[alternative].losses.items():
        assert loss.min() >= 0, name


@pytest.mark.parametrize("alternative", ALTERNATIVES)
def test_within_a_thousandth_of_twenty_times_finer_sampling(
    cycle: Walking, fine_cycle: Walking, alternative: str
) -> None:
    """Every stage and joint, E(+) and E(-), relative to itself.

    Where an energy is less than a thousandth of what flows through its stage (E_el(-) of a joint
    that hardly regenerates), 0.1 % of that thousandth counts.
    """
    coarse = stage_energies(cycle.results[alternative])
    fine = stage_energies(fine_cycle.results[alternative])
    for a, b in zip(coarse, fine, strict=True):
        floor = 1e-3 * (b.forward + b.reverse)
        assert (np.abs(a.forward - b.forward) <= 1e-3 * np.maximum(b.forward, floor)).all()
        assert (np.abs(a.reverse - b.reverse) <= 1e-3 * np.maximum(b.reverse, floor)).all()
    drawn = [w.supplies[alternative].supplied_energy for w in (cycle, fine_cycle)]
    np.testing.assert_allclose(drawn[0], drawn[1], rtol=1e-3)


@pytest.mark.parametrize("alternative", ALTERNATIVES)
def test_policies_are_in_order(cycle: Walking, alternative: str) -> None:
    """The more is used again the less is drawn; what is drawn less what is dumped is the same."""
    accounts = [supply(cycle.results[alternative], *policy) for policy in POLICIES]
    none, half, full, bus = (float(a.supplied_energy.sum()) for a in accounts)
    assert none > half > full
    assert half == pytest.approx((none + full) / 2)
    # A bus uses what others need at that instant: no better than a supply that takes all back,
    # no worse than one that takes nothing.
    assert full <= bus * (1 + 1e-9)
    assert bus < none
    net = [float(a.supplied_energy.sum() - a.dumped_energy.sum()) for a in accounts]
    np.testing.assert_allclose(net, net[0], rtol=1e-9)


def test_the_more_ideal_the_less_energy(cycle: Walking) -> None:
    """Section V: "the more ideal are the actuator components the lower is the consumption"."""
    energy = {name: float(s.supplied_energy.sum()) for name, s in cycle.supplies.items()}
    assert energy["ideal"] < energy["rotor"] < min(energy["reversible"], energy["irreversible"])


def test_middle_legs_give_back_at_the_joint_what_they_take(cycle: Walking) -> None:
    """Section IV.A.1, per joint of the fore-aft symmetric middle leg, within 1e-4."""
    stage = stage_energies(cycle.results["ideal"])[0]
    for joint in (f"{leg}_joint_{k}" for leg in ("lm", "rm") for k in (1, 2, 3)):
        column = stage.joints.index(joint)
        assert stage.reverse[column] == pytest.approx(stage.forward[column], rel=1e-4)


def test_an_ideal_transmission_passes_energy_on(cycle: Walking) -> None:
    """Section IV.A.1: the energy is the same at the transmission's input and output."""
    out, motor, _ = stage_energies(cycle.results["ideal"])
    np.testing.assert_allclose(motor.forward, out.forward, rtol=1e-12)
    np.testing.assert_allclose(motor.reverse, out.reverse, rtol=1e-12)
