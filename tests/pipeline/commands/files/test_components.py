"""`components` as a user calls it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.actuators.test_parts import own_motor
from tests.command_line import exit_code


def test_listed_and_shown(capsys: pytest.CaptureFixture[str]) -> None:
    assert exit_code(["components"]) == 0
    every = capsys.readouterr().out
    assert "maxon_148867" in every
    assert "hd_csg_17_80" in every
    assert exit_code(["components", "maxon_148867"]) == 0
    shown = capsys.readouterr().out
    assert "torque_constant = 0.0302 N*m/A" in shown
    assert "coulomb_share = 0.8 to 1  (range)" in shown


def test_a_contradiction_of_ones_own_part_is_a_finding(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own_motor(tmp_path, speed_constant_rpm_V="100")
    assert exit_code(["components", "--parts", str(tmp_path)]) == 1
    assert "motor.csv: maxon_148867: torque_constant" in capsys.readouterr().out
