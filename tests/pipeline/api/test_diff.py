"""Two finished runs side by side: numbers that meet by name, and folders that are no runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.atomic import write_text
from reports.folder import staged
from reports.table import Table
from reports.writer import write_table
from tests.command_line import Refused, exit_code, rows_of
from tests.conftest import SKETCH

ENERGY = {
    "alternative": ("name", ""),
    "leg": ("name", ""),
    "energy_J": ("energy drawn", "J"),
    "share": ("of all", "1"),
}
LIMITS = {"rank": ("order", "1"), "joint": ("name", ""), "peak": ("value", "see unit")}
LIMITS |= {"unit": ("of peak", "")}
SERIES = {"time_s": ("time", "s"), "height_m": ("of the base", "m")}
INPUTS = {"group": ("file", ""), "parameter": ("name", ""), "value": ("number", "see unit")}
INPUTS |= {"unit": ("of value", "")}


def made(folder: Path, robot: str, scale: float, *legs: str, verb: str = "walk") -> Path:
    """A folder as a run leaves it."""
    energy = [
        {"alternative": a, "leg": leg, "energy_J": scale * k, "share": 0.0}
        for k, a in enumerate(("ideal", "rotor"), 1)
        for leg in legs
    ]
    units = "A" if scale > 1 else "V"
    limits = [
        {"rank": n, "joint": joint, "peak": n * scale, "unit": unit}
        for n, (joint, unit) in enumerate((("hip", "N*m"), ("hip", "N*m"), ("knee", units)), 1)
    ]
    mass = [{"group": robot, "parameter": "total_mass", "value": 40 * scale, "unit": "kg"}]
    tables: list[tuple[str, list[dict[str, Any]], dict[str, Any]]] = [
        ("parameters", mass, INPUTS),
        ("robot_energy", energy, ENERGY),
        ("motor_limits", limits, LIMITS),
        ("walking_base", [{"time_s": 0.0, "height_m": scale}], SERIES),
    ]
    meta = {"inputs_sha256": {f"{robot}.toml": "00"}, "options": {"set": [], "samples": scale}}
    with staged(folder, verb) as out:
        for name, rows, meanings in tables:
            columns = {header: [row[header] for row in rows] for header in meanings}
            write_table(Table(name, columns, meanings), out, meta=meta)
        write_text(out / "gait.svg", SKETCH.replace("1 1", f"1 {scale}"))
        write_text(out / "same.svg", SKETCH)
    return folder


@pytest.fixture
def runs(tmp_path: Path) -> tuple[Path, Path]:
    first = made(tmp_path / "one" / "out", "hexapod", 1.0, "lf", "robot")
    return first, made(tmp_path / "two" / "out", "solo", 2.0, "FL", "robot", verb="reports")


def test_numbers_meet_by_name(
    runs: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "diff"
    assert exit_code(["diff", *map(str, runs), "--out", str(out)]) == 0
    found = rows_of(out / "side_by_side.csv")
    rows = {(r["table"], r["row"], r["quantity"], r["unit"]): r for r in found}
    both = rows["robot_energy", "rotor, robot", "energy_J", "J"]
    assert [both[key] for key in ("a", "b", "difference", "ratio")] == ["2", "4", "2", "2"]
    alone = rows["robot_energy", "rotor, lf", "energy_J", "J"]
    assert [alone[key] for key in ("a", "b", "difference", "ratio")] == ["2", "", "", ""]
    # A row of a name that another has before it is the second of that name; whatever the robot is
    # called, its numbers are the robot's; of zero there is no ratio.
    assert rows["motor_limits", "hip, no. 2", "peak", "N*m"]["b"] == "4"
    assert rows["parameters", "robot, total_mass", "value", "kg"]["ratio"] == "2"
    assert rows["robot_energy", "rotor, robot", "share", "1"]["ratio"] == ""
    # The same name in another unit is another number, and what runs over time is drawn.
    assert not [key for key in rows if key[1] == "knee" or key[0] == "walking_base"]
    page = (out / "index.html").read_text(encoding="utf-8")
    assert "A is one/out, B is two/out" in page
    assert "file hexapod.toml" in page
    assert "<script" not in page
    assert sorted(p.name for p in (out / "a").iterdir()) == ["gait.svg"]
    said = capsys.readouterr().out
    assert "option samples (1.0; 2.0)" in said
    assert "rotor, robot 2 and 4 J (× 2)" in said
    written = {p.name: p.read_bytes() for p in out.iterdir() if p.is_file()}
    assert exit_code(["diff", *map(str, runs), "--out", str(out)]) == 0
    assert {p.name: p.read_bytes() for p in out.iterdir() if p.is_file()} == written


def test_a_run_against_its_copy_differs_in_nothing(
    runs: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    again = made(tmp_path / "again", "hexapod", 1.0, "lf", "robot")
    assert exit_code(["diff", str(runs[0]), str(again), "--out", str(tmp_path / "diff")]) == 0
    said = capsys.readouterr().out
    assert "differs in: nothing that the runs state." in said
    assert "0 of " in said
    assert np.all([r["difference"] == "0" for r in rows_of(tmp_path / "diff" / "side_by_side.csv")])


def test_a_table_that_a_person_changed_is_noted(
    runs: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table = runs[1] / "robot_energy.csv"
    table.write_text(table.read_text(encoding="utf-8").replace("4,0", "5,0"), encoding="utf-8")
    assert exit_code(["diff", *map(str, runs), "--out", str(tmp_path / "diff")]) == 0
    assert "robot_energy.csv of B is not as its run wrote it" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("second", "out", "says"),
    [
        ("one/out", "diff", "the same folder"),
        ("gap", "diff", "no table in common"),
        ("choose", "diff", "holds a run of 'choose'"),
        ("empty", "diff", "holds no run"),
        ("nowhere", "diff", "no such folder"),
        ("file", "diff", "is a file"),
        ("damaged", "diff", "damaged"),
        ("other", "diff", "its columns are not those of its .meta.json"),
        ("two/out", "two/out", "holds a run that is compared"),
    ],
)
def test_what_cannot_be_compared_is_one_line(
    runs: tuple[Path, Path],
    tmp_path: Path,
    refused: Refused,
    second: str,
    out: str,
    says: str,
) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "file").write_text("x", encoding="utf-8")
    for verb in ("gap", "choose"):
        made(tmp_path / verb, "hexapod", 1.0, "lf", verb=verb)
    sidecar = made(tmp_path / "damaged", "hexapod", 1.0, "lf") / "robot_energy.meta.json"
    sidecar.write_text("{", encoding="utf-8")
    table = made(tmp_path / "other", "hexapod", 1.0, "lf") / "robot_energy.csv"
    table.write_text("a,b\n1,2\n", encoding="utf-8")
    arguments = [str(runs[0]), str(tmp_path / second), "--out", str(tmp_path / out)]
    before = sorted(tmp_path.rglob("*"))
    assert says in refused(["diff", *arguments])
    assert sorted(tmp_path.rglob("*")) == before
