"""Robots come with their own motors where these are public, and no other robot gets them."""

from __future__ import annotations

import pytest

import pipeline as lw
from actuators.checked import read_toml
from actuators.loading.build import load_catalog
from pipeline.robot.guess.motors import KNOWN, TABLE, known_motors

SOLO = [f"{leg}_{joint}" for leg in ("FL", "FR", "HL", "HR") for joint in ("HAA", "HFE", "KFE")]


def test_a_robot_is_known_by_its_name_and_all_of_its_joints() -> None:
    found = known_motors(("solo12",), SOLO)
    assert found is not None
    assert found["folder"] == "known:solo12"
    assert known_motors(("mine", "solo"), SOLO) is not None  # by the URDF's own name
    assert known_motors(("mine", "yours"), SOLO) is None
    assert known_motors(("solo12",), [*SOLO, "arm"]) is None
    assert known_motors(("solo12",), [j for j in SOLO if not j.endswith("HAA")]) is None  # Solo8


def test_every_known_folder_loads_is_in_the_table_and_states_where_numbers_come_from() -> None:
    folders = sorted(path.name for path in KNOWN.iterdir() if path.is_dir())
    table = read_toml(TABLE)
    assert sorted(table) == folders
    for name in folders:
        catalog = load_catalog(KNOWN / name)
        joints = table[name].get("joint", ())
        own = {table[name]["alternative"]}
        own |= {joint["alternative"] for joint in joints if "alternative" in joint}
        assert set(catalog.alternatives) == {"ideal"} | own
        assert all(number.source for _, number in catalog.rows())


def test_solo12s_copper_loss_while_standing_is_its_torque_over_its_motor_constant() -> None:
    """Closed form: joule heat is sum (tau / n - friction)^2 R / k^2, within what friction holds."""
    machine = lw.load("solo12")
    standing = lw.stand(machine, actuator="solo12").result
    torque = standing.demand.torque[0]
    motor = machine.catalog.components["motor"].parameters
    per_watt = motor["resistance"] / (9 * motor["torque_constant"]) ** 2  # [W/(N*m)^2]
    most = per_watt * float((torque**2).sum())
    power = float(standing.holding["solo12"].power.sum())
    assert 0.5 * most < power < most
    assert per_watt == pytest.approx(6.89, rel=1e-3)
