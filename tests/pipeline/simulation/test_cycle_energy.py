"""How support and transfer share the energy of a cycle, on numbers one can add up by hand."""

from __future__ import annotations

import numpy as np
import pytest

from actuators.energy.energy import Supply
from pipeline.dynamics.contact_forces import ContactForces
from pipeline.dynamics.joint_demand import JointDemand, MotionDemand
from pipeline.simulation.cycle_energy import (
    robot_energies,
    walking_energies,
)

LEGS = {"a": ("a1", "a2"), "b": ("b1",)}
JOINTS = ("a1", "a2", "b1")


def demand() -> MotionDemand:
    """Leg a stands for one second, then leg b for two."""
    segments, contacts = [], []
    for stance, start, end in (("a", 0.0, 1.0), ("b", 1.0, 3.0)):
        time, still, force = np.array([start, end]), np.zeros((2, 3)), np.zeros((2, 2, 3))
        segments.append(JointDemand(JOINTS, time, still, still, still, still, f"{stance} stands"))
        contacts.append(ContactForces(("a", "b"), (stance,), time, force, force, force))
    return MotionDemand(tuple(segments), tuple(contacts), 3.0)


def supply(recovered: float) -> Supply:
    """Powers [W] of a1, a2, b1 while leg a stands, then while leg b stands."""
    first, second = [10.0, 5.0, 1.0], [-2.0, 3.0, 20.0]
    policy = "fraction" if recovered else "none"
    time = np.array([0.0, 1.0, 1.0, 3.0])
    return Supply(policy, JOINTS, time, np.array([first, first, second, second]), recovered)


@pytest.mark.parametrize(
    ("recovered", "returned"), [(0.0, 0.0), (0.5, 0.5 * 4.0)], ids=["dumped", "half comes back"]
)
def test_support_is_the_share_of_joints_whose_foot_stands(
    recovered: float, returned: float
) -> None:
    (row,) = robot_energies(demand(), {"x": supply(recovered)}, LEGS, weight=100.0, speed=0.5)
    support = 15.0 * 1.0 + 20.0 * 2.0  # [J]
    transfer = 1.0 * 1.0 + 3.0 * 2.0 - returned
    assert row.energy_per_cycle_J == pytest.approx(support + transfer)
    assert row.support_share == pytest.approx(support / (support + transfer))
    assert row.transfer_share == pytest.approx(transfer / (support + transfer))
    assert row.average_power_W == pytest.approx((support + transfer) / 3.0)
    assert row.cost_of_transport == pytest.approx((support + transfer) / 3.0 / 50.0)
    assert row.dumped_J == pytest.approx(4.0 - returned)


def test_legs_add_up_to_the_robot_and_are_held_against_the_ideal_actuator() -> None:
    supplies = {"ideal": supply(0.0), "x": supply(0.5)}
    rows = walking_energies(supplies, LEGS, "ideal")
    by = {(row.alternative, row.leg): row for row in rows}
    assert by["ideal", "a"].electrical_J == pytest.approx(15.0 + 6.0)
    assert by["x", "a"].electrical_J == pytest.approx(15.0 + 6.0 - 2.0)
    assert by["x", "a"].ratio_to_ideal == pytest.approx(19.0 / 21.0)
    for name in supplies:
        legs = sum(by[name, leg].electrical_J for leg in LEGS)
        assert by[name, "robot"].electrical_J == pytest.approx(legs)
    assert all(row.ratio_to_ideal is None for row in walking_energies(supplies, LEGS, "none"))
