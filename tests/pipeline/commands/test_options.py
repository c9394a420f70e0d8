"""Options change what they say they change, and `--set` takes every number of every file."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import pipeline as lw
from actuators.loading.build import load_catalog
from pipeline.commands.robots import changes_of
from pipeline.robot.robot_file import load_robot_file
from tests.command_line import Command, record_of

ROBOT = Path(__file__).parents[3] / "urdf" / "hexapod.toml"
SPEC, CATALOG = load_robot_file(ROBOT), load_catalog()
MACHINE = lw.load(ROBOT)


def written(name: str) -> Any:
    return SPEC.parameters.parameter(name) if name in SPEC.parameters else CATALOG.parameter(name)


def test_every_number_can_be_set_to_itself() -> None:
    """In the unit its file writes, and nothing else changes."""
    names = [*SPEC.parameters, *(f"{component}.{p.name}" for component, p in CATALOG.rows())]
    changes = changes_of([f"{name}={written(name).value_as_written!r}" for name in names])
    for name, value in changes.items():
        changed = MACHINE.with_values({name: value})
        assert {**changed.robot.spec.parameters} == {**SPEC.parameters}
        for component, p in CATALOG.rows():
            assert changed.catalog.parameter(f"{component}.{p.name}").value == p.value


def test_a_change_reaches_the_files(tmp_path: Path, command: Command, out: Path) -> None:
    """1.2 times the winding's resistance heats 1.2 times at rest."""
    resistance = written("motor_re40_24v.resistance").value_as_written
    change = f"motor_re40_24v.resistance={1.2 * resistance!r}"
    assert command("stand", tmp_path, "--set", change) == 0
    new, old = (pd.read_csv(folder / "standing.csv") for folder in (tmp_path, out))
    assert new["power_W"].to_numpy() == pytest.approx(1.2 * old["power_W"].to_numpy(), rel=1e-12)
    assert new["current_A"].equals(old["current_A"])
    assert record_of(tmp_path / "standing.csv")["options"]["set"] == [change]
    numbers = pd.read_csv(tmp_path / "parameters.csv").set_index(["group", "parameter"])
    row = numbers.loc["motor_re40_24v", "resistance"]
    assert row["basis"] == "assumed"
    assert f"replaces {resistance:g} ohm (calibrated)" in row["reason"]


def test_the_command_line_starts_without_what_computes(root: Path) -> None:
    """`--help` and a wrong option answer at once."""
    code = "import sys, pipeline.commands.main; print(*{m.split('.')[0] for m in sys.modules})"
    done = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True)
    assert "pipeline" in done.stdout
    assert not {"numpy", "scipy", "pandas", "pinocchio", "matplotlib"} & {*done.stdout.split()}
