"""Tables IV, V and VI of the paper from the joint torques of Table III, by name."""

import numpy as np
import pytest

from actuators.loading.build import load_catalog
from tests.actuators.motions import CHAINS

JOINT_TORQUES = np.array([0.0, -30.71, 1.46])  # Table III [N*m]

# quantity, joint, value, half of the printed precision. Table V's motor torque of joint 2 and its
# energy are missing: the other entries exclude them, see ERRATA.md.
PRINTED = [
    ("ideal", "motor_torque", 2, -0.0768, 0.00005),  # Table IV
    ("ideal", "motor_torque", 3, 0.00365, 0.000005),
    ("ideal", "current", 2, -2.54, 0.005),
    ("ideal", "current", 3, 0.121, 0.0005),
    ("ideal", "voltage", 2, -0.803, 0.0005),
    ("ideal", "voltage", 3, 0.038, 0.0005),
    ("ideal", "power", 2, 2.04, 0.005),
    ("ideal", "power", 3, 0.005, 0.0005),
    ("rotor", "motor_torque", 3, 0.00003, 0.000005),  # Table V
    ("rotor", "current", 2, -2.42, 0.005),
    ("rotor", "current", 3, 0.0, 0.005),
    ("rotor", "voltage", 2, -0.766, 0.0005),
    ("rotor", "voltage", 3, 0.0, 0.0005),
    ("rotor", "power", 2, 1.86, 0.005),
    ("rotor", "power", 3, 0.0, 0.0005),
    ("reversible", "motor_torque", 2, -0.04998, 0.000005),  # Table VI
    ("reversible", "motor_torque", 3, 0.0, 0.000005),
    ("reversible", "current", 2, -1.66, 0.005),
    ("reversible", "current", 3, 0.0, 0.0005),
    ("reversible", "voltage", 2, -0.523, 0.0005),
    ("reversible", "voltage", 3, 0.0, 0.0005),
    ("reversible", "power", 2, 0.866, 0.0005),
    ("reversible", "power", 3, 0.0, 0.0005),
]


@pytest.mark.parametrize("row", PRINTED, ids=lambda r: f"{r[0]}_{r[1]}_{r[2]}")
def test_tables_iv_v_and_vi(row):
    alternative, quantity, joint, value, half_width = row
    held = CHAINS[alternative].holding(JOINT_TORQUES)
    assert abs(getattr(held, quantity)[joint - 1] - value) <= half_width * (1 + 1e-9)


@pytest.mark.parametrize(
    ("alternative", "energy", "half_width"),
    [("ideal", 6.14, 0.005), ("reversible", 2.60, 0.005)],
)
def test_energy_of_the_leg_in_three_seconds(alternative, energy, half_width):
    power = CHAINS[alternative].holding(JOINT_TORQUES).power.sum()
    assert abs(3.0 * power - energy) <= half_width


def test_irreversible_stands_for_nothing():
    held = CHAINS["irreversible"].holding(JOINT_TORQUES)
    for values in (held.motor_torque, held.current, held.voltage, held.power):
        assert not values.any()


@pytest.mark.parametrize("alternative", CHAINS)
def test_joint_1_needs_nothing(alternative):
    assert CHAINS[alternative].holding(JOINT_TORQUES).power[0] == 0.0


def test_belt_friction_follows_its_stated_formula():
    p = load_catalog().parameter
    x = (30.71 * (1 - p("harmonic_drive.load").value) - p("harmonic_drive.coulomb").value) / p(
        "harmonic_drive.ratio"
    ).value
    coulomb = x * (1 - p("timing_belt.load").value) - 49.98e-3 * p("timing_belt.ratio").value
    assert p("timing_belt.coulomb").value == pytest.approx(coulomb, abs=1e-7)
