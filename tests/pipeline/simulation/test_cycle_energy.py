"""How support and transfer share the energy of a cycle, on numbers one can add up by hand."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from actuators.energy.energy import Supply
from actuators.loading.parts import PARTS
from pipeline.dynamics.contact_forces import ContactForces
from pipeline.dynamics.joint_demand import JointDemand, MotionDemand
from pipeline.simulation.tables import DRIVER_IDLE
from pipeline.simulation.walk_stand import leg_energies, support_energy

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
