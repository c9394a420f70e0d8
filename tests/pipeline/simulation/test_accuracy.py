"""Energies of the walking cycle: balance, sampling, regeneration, reversals, support's share."""

import numpy as np
import pandas as pd
import pytest

from actuators.energy.energy import Supply, stage_energies
from actuators.loading.build import load_catalog
from actuators.loading.parts import PARTS
from pipeline.dynamics.contact_forces import ContactForces
from pipeline.dynamics.joint_demand import JointDemand, MotionDemand
from pipeline.simulation.machine import read_machine
from pipeline.simulation.tables import DRIVER_IDLE
from pipeline.simulation.walk_stand import LEAST_SAMPLES, Walking, leg_energies, support_energy

CHAINS = load_catalog().chains()
SAMPLES = 751


def walked(samples: int) -> Walking:
    return read_machine().walking(samples=samples).walk(CHAINS)


@pytest.fixture(scope="module")
def cycle() -> Walking:
    return walked(SAMPLES)


@pytest.fixture(scope="module")
def fine_cycle() -> Walking:
    return walked(8 * (SAMPLES - 1) + 1)


def test_within_a_thousandth_of_eight_times_finer_sampling(
    cycle: Walking, fine_cycle: Walking
) -> None:
    """Every stage and joint, E(+) and E(-), relative to itself or a thousandth of its stage's."""
    for name, own in cycle.results.items():
        finer = stage_energies(fine_cycle.results[name])
        for stage, energies in stage_energies(own).items():
            floor = 1e-3 * np.add(*finer[stage])
            for coarse, fine in zip(energies, finer[stage], strict=True):
                assert (np.abs(coarse - fine) <= 1e-3 * np.maximum(fine, floor)).all()
        drawn = [w.supplies[name].supplied_energy for w in (cycle, fine_cycle)]
        np.testing.assert_allclose(drawn[0], drawn[1], rtol=1e-3)


def test_the_least_samples_are_enough_and_few(fine_cycle: Walking) -> None:
    """Every joint's energy within the 0.7 % that the option promises, a third of it not."""
    least = walked(LEAST_SAMPLES)
    pairs = [(least.supplies[n], fine_cycle.supplies[n]) for n in CHAINS]
    apart = max(np.abs(a.supplied_energy / b.supplied_energy - 1.0).max() for a, b in pairs)
    assert 0.0023 < apart < 0.007


LEGS = {"a": ("a1", "a2"), "b": ("b1",)}
JOINTS = ("a1", "a2", "b1")


@pytest.mark.parametrize("recovered", [0.0, 0.5], ids=["dissipated", "half comes back"])
def test_support_is_the_energy_of_joints_whose_foot_stands(recovered: float) -> None:
    """Leg a stands for one second, then leg b for two, in which joint a1 returns 4 J."""
    first, second = [10.0, 5.0, 1.0], [-2.0, 3.0, 20.0]  # [W]
    power = np.array([first, first, second, second])
    drawn = Supply(JOINTS, np.array([0.0, 1.0, 1.0, 3.0]), power, recovered)
    segments, contacts = [], []
    for stance, start, end in (("a", 0.0, 1.0), ("b", 1.0, 3.0)):
        time, still, force = np.array([start, end]), np.zeros((2, 3)), np.zeros((2, 2, 3))
        segments.append(JointDemand(JOINTS, time, still, still, still, still, f"{stance} stands"))
        contacts.append(ContactForces(("a", "b"), (stance,), time, force, force))
    demand = MotionDemand(tuple(segments), tuple(contacts))
    transfer = 1.0 * 1.0 + 3.0 * 2.0 - recovered * 4.0  # [J]
    assert support_energy(demand, drawn, LEGS) == pytest.approx(15.0 * 1.0 + 20.0 * 2.0)
    assert leg_energies(drawn, LEGS)["robot"] == pytest.approx(55.0 + transfer)


def test_the_range_of_drivers_is_that_of_the_parts() -> None:
    """What `walk` says beside its watts is what `choose` draws."""
    drivers = pd.read_csv(PARTS / "driver.csv")
    ends = drivers["idle_power_low_W"].min(), drivers["idle_power_high_W"].max()
    assert ends == pytest.approx(DRIVER_IDLE)
