"""The stored calibration: it belongs to the files, its sets are admissible, its rows reproduce."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from actuators.build import CATALOG, load_catalog
from pipeline.calibration import search
from pipeline.calibration.judge import (
    crossing,
    headline,
    judge,
    leave_one_out,
    reading_rows,
    sensitivity_rows,
)
from pipeline.calibration.prior import load_prior
from pipeline.calibration.published import load_published
from pipeline.calibration.quantities import DIMENSIONS, IDS
from pipeline.calibration.readings import readings, supported, verdict
from pipeline.calibration.store import calibrated_numbers, load_results, save
from pipeline.errors import PipelineError
from pipeline.robot import load_robot
from pipeline.robot_file import load_robot_file

LEAST_SETS = 200


@pytest.fixture(scope="module")
def results() -> dict[str, Any]:
    return load_results()


@pytest.fixture(scope="module")
def robot_file(root: Path) -> str:
    return str(root / "urdf" / "hexapod.toml")


@pytest.fixture(scope="module")
def judgement(results: dict[str, Any], robot_file: str):  # type: ignore[no-untyped-def]
    return judge(load_robot(load_robot_file(Path(robot_file))), load_catalog(), results)


@pytest.mark.parametrize("name", IDS)
def test_every_printed_value_is_reproduced(judgement, name: str) -> None:  # type: ignore[no-untyped-def]
    row = next(row for row in judgement.reproduction if row.published.id == name)
    assert row.verdict == "reproduced", f"{row.computed} against {row.published.value}"
    assert row.low <= row.computed <= row.high


def test_the_headline_counts_by_role(judgement) -> None:  # type: ignore[no-untyped-def]
    counts = headline(judgement.reproduction)
    assert sum(total for _, total in counts.values()) == 46
    assert all(good == total for good, total in counts.values())


def test_the_ensemble_is_large_and_admissible(results: dict[str, Any]) -> None:
    members = results["ensemble"]
    assert len(members) >= LEAST_SETS
    published = load_published(IDS, DIMENSIONS)
    for member in members:
        assert max(abs(e) for e in member["errors"].values()) <= 1 + 1e-6
        assert max(member["excess"].values()) <= 0
        for row in published.values():
            if row.role == "target" and row.unit == "1":
                assert row.reproduced(member["values"][row.id])


@pytest.mark.parametrize("index", [0, 57, 133])
def test_stored_members_come_out_again(
    results: dict[str, Any], robot_file: str, index: int
) -> None:
    member = results["ensemble"][index]
    task = search.problem(robot_file, member["path"], 0.0, 1, None)
    again = task.evaluate(np.array(member["z"])).values
    for name, value in member["values"].items():
        if value is not None and not math.isnan(again[name]):
            assert again[name] == pytest.approx(value, rel=1e-5, abs=1e-9), name


def test_the_files_hold_the_nearest_point(results: dict[str, Any], robot_file: str) -> None:
    spec, catalog = load_robot_file(Path(robot_file)), load_catalog()
    prior = load_prior()
    for key, value in prior.values(np.array(results["nearest"]["z"])).items():
        owner, name = key.split(".")
        entry = spec.parameters.parameter(name) if owner == "robot" else catalog.parameter(key)
        assert entry.value == pytest.approx(value, rel=1e-6), key
        assert entry.basis == "calibrated"
        assert entry.interval is not None
    assert spec.transfer_path == results["nearest"]["path"]


def test_every_start_of_a_path_ends_in_the_same_point(results: dict[str, Any]) -> None:
    """Several random starts, one optimum: the nearest point is not a local accident."""
    best = results["nearest"]
    distance = [s["prior_distance"] for s in results["starts"] if s["path"] == best["path"]]
    assert len(distance) >= 4
    assert max(distance) - min(distance) < 0.05 * min(distance)
    assert best["prior_distance"] == min(distance)


def test_numbers_after_calibration_are_judged(results: dict[str, Any]) -> None:
    numbers = calibrated_numbers(results, load_prior())
    assert {n.verdict for n in numbers} <= {"determined", "narrowed", "not determined"}
    assert any(n.verdict == "not determined" for n in numbers)  # nine figures, thirty numbers
    for n in numbers:
        assert n.low <= n.value <= n.high


def test_readings_name_what_they_miss(results: dict[str, Any]) -> None:
    found = readings(results)
    assert len(found) == 10
    best = supported(found)
    assert best is not None
    assert (best.axis_deg, best.legs) == (0.0, 1)
    text = verdict(found)
    assert "objection" in text
    rows = reading_rows(results)
    assert {row["id"] for row in rows} >= set(IDS)


def test_leave_one_out_and_sensitivities_are_complete(results: dict[str, Any]) -> None:
    assert len(leave_one_out(results)) == 12
    for row in sensitivity_rows(results):
        assert row["total"] >= -0.05
        assert row["first_order"] <= row["total"] + row["first_order_95"] + row["total_95"] + 0.02


def test_no_break_even_is_said(judgement) -> None:  # type: ignore[no-untyped-def]
    for row in judgement.break_even:
        assert math.isnan(row.fraction) == row.note.startswith("no break-even")
    nothing = {
        "reversible": {"c": 1.0, "s": 0.0},
        "irreversible": {"c": 2.0, "s": 0.0},
    }
    assert math.isnan(crossing(nothing, "c", "s"))


def test_an_interrupted_save_leaves_the_old_files(
    results: dict[str, Any], tmp_path: Path, robot_file: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = tmp_path / "hexapod.toml"
    robot.write_bytes(Path(robot_file).read_bytes())
    catalog = tmp_path / "catalog"
    catalog.mkdir()
    for path in CATALOG.glob("*.toml"):
        (catalog / path.name).write_bytes(path.read_bytes())
    before = {p: p.read_bytes() for p in [robot, *catalog.iterdir()]}
    monkeypatch.setattr("pipeline.calibration.store.RESULTS_FILE", tmp_path / "results.json")
    written: list[Path] = []
    write_text = Path.write_text

    def failing(self: Path, *args: Any, **options: Any) -> int:
        if len(written) > 3:
            raise KeyboardInterrupt
        written.append(self)
        return write_text(self, *args, **options)

    monkeypatch.setattr(Path, "write_text", failing)
    with pytest.raises(KeyboardInterrupt):
        save(results, robot, catalog)
    assert {p: p.read_bytes() for p in [robot, *catalog.iterdir()]} == before
    assert not list(tmp_path.rglob("*.tmp"))
    monkeypatch.setattr(Path, "write_text", write_text)
    save(results, robot, catalog)
    assert load_robot_file(robot).parameters.parameter("coxa_length").basis == "calibrated"
    load_catalog(catalog)


def test_missing_results_are_one_line(tmp_path: Path) -> None:
    with pytest.raises(PipelineError, match="make calibrate"):
        load_results(tmp_path / "none.json")
