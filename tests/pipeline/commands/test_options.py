"""Options change what they say they change, and `--set` takes every number of every file."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import pipeline as lw
from actuators.loading.build import load_catalog
from actuators.units import to_si
from pipeline.commands.robots import changes_of
from pipeline.robot.robot_file import load_robot_file
from pipeline.simulation.machine import Machine
from tests.command_line import Command, record_of, rows_of, stand_and_walk

ROBOT = Path(__file__).parents[3] / "urdf" / "hexapod.toml"
SPEC = load_robot_file(ROBOT)
CATALOG = load_catalog()
MACHINE = lw.load(ROBOT)
NUMBERS = [*SPEC.parameters, *(f"{component}.{p.name}" for component, p in CATALOG.rows())]


def with_changes(*changes: str) -> Machine:
    return MACHINE.with_values(changes_of(changes))


def written(name: str) -> Any:
    return SPEC.parameters.parameter(name) if name in SPEC.parameters else CATALOG.parameter(name)


@pytest.mark.parametrize("name", NUMBERS)
def test_every_number_can_be_set_to_itself(name: str) -> None:
    """In the unit its file writes, and nothing else changes."""
    parameter = written(name)
    given_ = with_changes(f"{name}={parameter.value_as_written!r}")
    for other in SPEC.parameters:
        assert given_.robot.spec.parameters[other] == SPEC.parameters[other]
    for component, p in CATALOG.rows():
        assert given_.catalog.parameter(f"{component}.{p.name}").value == p.value


@pytest.mark.parametrize(
    ("key", "text"),
    [("femur_mass", "{} kg"), ("femur_mass", "{} "), ("gait_period", "{}s"), ("foot_lift", "{}mm")],
)
def test_a_number_may_be_followed_by_its_unit(key: str, text: str) -> None:
    one, other = written(key), 1.01 * written(key).value_as_written
    changed = with_changes(f" {key} = {text.format(other)}").robot.spec.parameters
    assert changed[key] == pytest.approx(to_si(other, one.unit), rel=1e-12)
    assert changed.parameter(key).unit == one.unit
    longer = with_changes("gait_period=3100 ms").robot.spec.parameters
    assert longer["gait_period"] == pytest.approx(3.1)


def test_numbers_that_bind_each_other_change_together() -> None:
    given_ = with_changes("gait_period=6", "walking_speed=4.8")
    assert given_.robot.spec.parameters["gait_period"] == 6
    given_ = with_changes("harmonic_drive.ratio=80", "timing_belt.ratio=5")
    assert given_.catalog.chain("reversible").ratio == pytest.approx(400)


def test_a_change_reaches_the_files(tmp_path: Path, command: Command, out: Path) -> None:
    """Twice the winding's resistance is not allowed; 1.2 times it heats 1.2 times at rest."""
    resistance = written("motor_re40_24v.resistance").value_as_written
    change = f"motor_re40_24v.resistance={1.2 * resistance!r}"
    assert command("stand", tmp_path, "--set", change) == 0
    for new, old in zip(
        rows_of(tmp_path / "standing.csv"), rows_of(out / "standing.csv"), strict=True
    ):
        assert float(new["power_W"]) == pytest.approx(1.2 * float(old["power_W"]), rel=1e-12)
        assert new["current_A"] == old["current_A"]
    assert record_of(tmp_path / "standing.csv")["options"]["set"] == [change]
    (row,) = (
        r
        for r in rows_of(tmp_path / "parameters.csv")
        if (r["group"], r["parameter"]) == ("motor_re40_24v", "resistance")
    )
    assert row["basis"] == "assumed"
    assert f"replaces {resistance:g} ohm (calibrated)" in row["reason"]


def total(folder: Path, alternative: str = "rotor") -> float:
    (row,) = (r for r in rows_of(folder / "robot_energy.csv") if r["alternative"] == alternative)
    return float(row["energy_per_cycle_J"])


def test_regeneration_is_ordered_and_recorded(tmp_path: Path, command: Command, out: Path) -> None:
    drawn = {"none": total(out)}
    for policy in ("0.5", "bus"):
        assert command("walk", tmp_path / policy, "--regeneration", policy) == 0
        drawn[policy] = total(tmp_path / policy)
    assert drawn["none"] > drawn["0.5"]
    assert drawn["none"] > drawn["bus"]
    recorded = record_of(tmp_path / "0.5" / "robot_energy.csv")["options"]
    assert recorded["regeneration"] == "0.5"
    # On a shared bus a leg has no energy of its own.
    legs = {row["leg"] for row in rows_of(tmp_path / "bus" / "walking_energy.csv")}
    assert legs == {"robot"}


def test_quasi_static_leaves_inertia_out(tmp_path: Path, command: Command, out: Path) -> None:
    assert command("walk", tmp_path, "--quasi-static") == 0
    full, static = (
        [float(row["electrical_J"]) for row in rows_of(folder / "walking_energy.csv")]
        for folder in (out, tmp_path)
    )
    assert static != full
    assert static == pytest.approx(full, rel=0.2)
    assert record_of(tmp_path / "walking_energy.csv")["options"]["quasi_static"] is True


def test_the_order_of_legs_changes_rows_not_numbers(
    root: Path, tmp_path: Path, command: Command, out: Path
) -> None:
    """Joints are addressed by name: with a leg listed last, its rows come last, all else equal."""
    text = (root / "urdf" / "hexapod.toml").read_text(encoding="utf-8")
    block = re.search(r"\[legs\.lf\].*?\n\n", text, flags=re.S)
    assert block
    moved = text.replace(block[0], "").replace("[gait]\n", f"{block[0]}[gait]\n")
    (tmp_path / "moved.toml").write_text(moved, encoding="utf-8")
    stand_and_walk(tmp_path, command, robot=tmp_path / "moved.toml")
    new, old = rows_of(tmp_path / "standing.csv"), rows_of(out / "standing.csv")
    assert new[17]["joint"] == "lf_joint_3"
    key = {(r["alternative"], r["joint"]): r for r in new}
    for row in old:
        other = key[row["alternative"], row["joint"]]
        assert float(other["joint_torque_Nm"]) == pytest.approx(
            float(row["joint_torque_Nm"]), abs=1e-9
        )
    energy = {(r["alternative"], r["leg"]): r for r in rows_of(tmp_path / "walking_energy.csv")}
    for row in rows_of(out / "walking_energy.csv"):
        assert float(energy[row["alternative"], row["leg"]]["electrical_J"]) == pytest.approx(
            float(row["electrical_J"]), rel=1e-9
        )


def test_the_command_line_starts_without_what_computes(root: Path) -> None:
    """`--help` and a wrong option answer at once."""
    code = "import sys, pipeline.commands.main; print(*{m.split('.')[0] for m in sys.modules})"
    done = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True)
    assert "pipeline" in done.stdout
    assert not {"numpy", "scipy", "pandas", "pinocchio", "matplotlib"} & {*done.stdout.split()}
