"""The verb `init-actuator`, from a data sheet to a walk."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipeline.commands.main import main
from tests.command_line import rows_of

#: CubeMars AK80-9 V3.0, KV100: what its product page prints; speeds and torques at the output. It
#: prints no efficiency: single stages of planetary gears of maxon's (GP 22 HP to GP 42 HD) have
#: 0.84 to 0.95.
AK80_9 = {
    "source": "CubeMars, product page of the AK80-9 V3.0 KV100",
    "torque-constant": "0.095 N*m/A",
    "speed-constant": "100 rpm/V",
    "motor-constant": "0.2387 N*m/sqrt(W)",
    "current-of": "dc",
    "resistance": "0.16 ohm",
    "resistance-of": "phase-to-phase",
    "supply-voltage": "48 V",
    "no-load-speed": "570 rpm",
    "rotor-inertia": "579 g*cm^2",
    "continuous-current": "12 A",
    "continuous-torque": "9 N*m",
    "peak-current": "28 A",
    "peak-torque": "22 N*m",
    "gear-ratio": "9",
    "gear-efficiency": "0.84 to 0.95",
    "back-drive-torque": "0.51 N*m",
    "shaft": "output",
    "mass": "0.49 kg",
}


def options(**changes: str | None) -> list[str]:
    sheet = AK80_9 | {name.replace("_", "-"): text for name, text in changes.items()}
    return [word for name, text in sheet.items() if text for word in (f"--{name}", text)]


def test_an_ak80_9_from_its_data_sheet_to_a_walk_in_three_commands(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["init", "solo12"]) == 0
    capsys.readouterr()
    assert main(["init-actuator", "ak80_9", *options()]) == 0
    said = capsys.readouterr().out
    assert "\nmotor: torque_constant 0.095 N*m/A, resistance 0.16 ohm, " in said
    assert "\ngear: ratio 9, load 0.117318 (assumed)\n" in said
    assert said.endswith("reports --robot ROBOT.toml --actuators ak80_9\n")
    parts = (f"ak80_9_{part}.toml" for part in ("gear", "motor", "rotor"))
    files = {"alternatives.toml", *parts}
    assert {path.name for path in (tmp_path / "ak80_9").iterdir()} == files
    run = ["--robot", "solo12.toml", "--actuators", "ak80_9", "--samples", "51", "--out", "walk"]
    assert main(["walk", *run]) == 0
    energy = {r["alternative"]: r for r in rows_of(tmp_path / "walk" / "robot_energy.csv")}
    assert list(energy) == ["ideal", "ak80_9"]
    assert float(energy["ak80_9"]["energy_per_cycle_J"]) > float(
        energy["ideal"]["energy_per_cycle_J"]
    )
    numbers = {
        f"{r['group']}.{r['parameter']}": r for r in rows_of(tmp_path / "walk" / "parameters.csv")
    }
    assert numbers["ak80_9_motor.mass"]["basis"] == "datasheet"
    assert numbers["ak80_9_rotor.coulomb"]["basis"] == "assumed"
