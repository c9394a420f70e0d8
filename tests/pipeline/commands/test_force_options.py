"""Options of the ground's forces, from the command line and from Python."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.command_line import Command, record_of, rows_of


def test_a_rule_is_in_the_tables_and_in_their_sidecars(
    tmp_path: Path, command: Command, out: Path
) -> None:
    options = ["--forces", "least_torque", "--friction-coefficient", "0.4", "--samples", "51"]
    assert command("walk", tmp_path, *options) == 0
    rows = rows_of(tmp_path / "walking_stability.csv")
    assert 0.3 < max(float(row["greatest_friction_needed"]) for row in rows) <= 0.4 + 1e-9
    told = record_of(tmp_path / "walking_contact_forces.csv")
    assert told["options"]["forces"] == "least_torque"
    assert told["options"]["friction_coefficient"] == 0.4
    usual = record_of(out / "walking_contact_forces.csv")["options"]
    assert usual["forces"] == "least_tangential"


def test_friction_of_the_ground_may_stand_with_the_gait_and_an_option_outdoes_it(
    tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str]
) -> None:
    slippery = ["--samples", "51", "--set", "gait.friction_coefficient=0.003"]
    assert command("walk", tmp_path, *slippery) == 1
    assert "the robot slides at t = " in capsys.readouterr().err
    assert command("walk", tmp_path, *slippery, "--friction-coefficient", "0.4") == 0
    told = record_of(tmp_path / "walking_contact_forces.csv")
    assert told["options"]["friction_coefficient"] == 0.4
    assert command("walk", tmp_path, "--samples", "51", "--set", "gait.friction_coefficient=0") == 2
    assert "0: must be above 0 to 1000" in capsys.readouterr().err
