"""Tables III to VI and the energies of section IV.B, read from the files a run leaves.

Two numbers of Table V contradict the others, so no actuator gives them: they are held apart and
must come out as their table's other entries ask.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from pipeline.paper.published import ALTERNATIVES, load_published
from tests.command_line import rows_of

CONTRADICTED = ("rotor_motor_torque_2", "rotor_leg_energy_3s")
COLUMNS = {
    "motor_torque": "motor_torque_Nm",
    "current": "current_A",
    "voltage": "voltage_V",
    "power": "power_W",
}


def standing(out: Path, alternative: str, joint: int, column: str) -> float:
    (row,) = (
        row
        for row in rows_of(out / "standing.csv")
        if (row["alternative"], row["joint"]) == (alternative, f"rm_joint_{joint}")
    )
    return float(row[column])


def energy(out: Path, alternative: str) -> float:
    (row,) = (
        row
        for row in rows_of(out / "standing_energy.csv")
        if (row["alternative"], row["leg"]) == (alternative, "rm")
    )
    return float(row["energy_J"])


@pytest.mark.parametrize("alternative", ALTERNATIVES)
def test_standing_on_three_feet(out: Path, alternative: str) -> None:
    """Table III; nothing is asked of joint 1; the irreversible actuator draws nothing at all."""
    published = load_published()
    for joint in (1, 2, 3):
        torque = standing(out, alternative, joint, "joint_torque_Nm")
        assert published[f"standing_torque_{joint}"].reproduced(torque)
        for kind, column in COLUMNS.items():
            if row := published.get(f"{alternative}_{kind}_{joint}"):
                value = standing(out, alternative, joint, column)
                assert row.reproduced(value) == (row.id not in CONTRADICTED), row.id
        if joint == 1 or alternative == "irreversible":
            assert {standing(out, alternative, joint, c) for c in COLUMNS.values()} == {0.0}
    row = published[f"{alternative}_leg_energy_3s"]
    assert row.reproduced(energy(out, alternative)) == (row.id not in CONTRADICTED)


def test_reaction_of_the_middle_right_foot(out: Path) -> None:
    rows = {row["foot"]: float(row["force_z_N"]) for row in rows_of(out / "standing_contacts.csv")}
    assert rows["rm"] == pytest.approx(192.6, abs=0.05)  # section II.C [N]
    assert sum(rows.values()) == pytest.approx(40 * 9.81)
    assert all(rows[leg] == 0 for leg in ("lm", "rf", "rr"))


def test_two_numbers_of_table_v_cannot_be_met_in_addition_to_the_others(out: Path) -> None:
    """The torque that joint 3 leaves joint 2, and 3 s of an unrounded power."""
    friction = 30.71 / 400 - abs(standing(out, "rotor", 2, "motor_torque_Nm"))
    assert friction == pytest.approx(1.46 / 400 - 3e-5, abs=0.5e-5)  # as joint 3 asks
    assert 0.005 < 3 * 1.86 - energy(out, "rotor") < 0.02  # 1.86 W is rounded
