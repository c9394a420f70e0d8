"""`gap` on unusable input: one line, exit 2, nothing written."""

from __future__ import annotations

import csv
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from pipeline.app.demo import DEMO
from pipeline.gap.twin.trial import make_trial
from tests.app.conftest import exit_code, rows_of

Columns = dict[str, np.ndarray]


def write_log(path: Path, columns: Columns) -> Path:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(zip(*(v.tolist() for v in columns.values()), strict=True))
    return path


def leg_columns(rows: int = 1500) -> Columns:
    t = np.arange(rows) / 250.0
    columns: Columns = {"time_s": t}
    rng = np.random.default_rng(1)
    for k in (1, 2, 3):
        columns[f"rm_joint_{k}__position_rad"] = 0.3 * np.sin(2 * np.pi * (0.3 + 0.11 * k) * t)
    for k in (1, 2, 3):
        columns[f"rm_joint_{k}__current_A"] = 0.1 * np.sin(t) + 0.01 * rng.standard_normal(rows)
    return columns


def _short(c: Columns) -> Columns:
    return {name: values[:10] for name, values in c.items()}


def _backwards(c: Columns) -> Columns:
    c["time_s"][7] = c["time_s"][3]
    return c


def _missing(c: Columns) -> Columns:
    del c["rm_joint_2__position_rad"]
    return c


def _degrees(c: Columns) -> Columns:
    for name in c:
        if name.endswith("position_rad"):
            c[name] = np.degrees(c[name])
    return c


def _empty(c: Columns) -> Columns:
    c["rm_joint_1__current_A"] = np.full_like(c["time_s"], np.nan)
    return c


def _other_robot(c: Columns) -> Columns:
    return {name.replace("rm_joint", "elbow"): values for name, values in c.items()}


@pytest.mark.parametrize("spoil", [_short, _backwards, _missing, _degrees, _empty, _other_robot])
def test_a_bad_log_is_refused_in_one_line(
    tmp_path: Path,
    root: Path,
    capsys: pytest.CaptureFixture[str],
    spoil: Callable[[Columns], Columns],
) -> None:
    log = write_log(tmp_path / "bad.csv", spoil(leg_columns()))
    out = tmp_path / "out"
    robot = root / "urdf" / "leg.toml"
    assert exit_code(["gap", str(log), "--robot", str(robot), "--out", str(out)]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "bad" in err
    assert not out.exists()


@pytest.fixture(scope="module")
def simulated_leg() -> Columns:
    """A log that the model explains: only its model can tell that its units were changed."""
    return make_trial(3, None, "leg", "low").logs["log"]


def _scaled(factor: float, *names: str) -> Callable[[Columns], Columns]:
    def spoil(c: Columns) -> Columns:
        return {k: factor * v if k in names else v for k, v in c.items()}

    return spoil


def _milliamperes(c: Columns) -> Columns:
    # Drawn by a robot so light that its milliamperes are less than the drive's amperes.
    return _scaled(1e3, *(k for k in c if k.endswith("current_A")))(c)


def _exchanged(c: Columns) -> Columns:
    one, two = "rm_joint_1__current_A", "rm_joint_2__current_A"
    return c | {one: c[two], two: c[one]}


def _of_another_machine(c: Columns) -> Columns:
    other = make_trial(4, None, "leg", "low").logs["log"]
    rows = min(other["time_s"].size, c["time_s"].size)
    return {k: (other if k.endswith("current_A") else c)[k][:rows] for k in c}


SPOILT = {
    "mA": (_milliamperes, "rm_joint_1__current_A", "mA"),
    "mA at one joint": (_scaled(1e3, "rm_joint_2__current_A"), "rm_joint_2__current_A", "mA"),
    "sign": (_scaled(-1.0, "rm_joint_2__current_A"), "rm_joint_2__current_A", "flip"),
    "degrees": (_degrees, "rm_joint_1__position_rad", "degrees"),
    "degrees at one joint": (
        _scaled(180.0 / np.pi, "rm_joint_1__position_rad"),
        "rm_joint_1__position_rad",
        "degrees",
    ),
    "exchanged joints": (_exchanged, "rm_joint_1__current_A", "rm_joint_2"),
    "another robot": (_of_another_machine, "spoilt", "another robot"),
}


@pytest.mark.parametrize("case", SPOILT)
def test_a_wrong_unit_that_the_model_betrays_is_refused_by_column(
    tmp_path: Path,
    root: Path,
    capsys: pytest.CaptureFixture[str],
    simulated_leg: Columns,
    case: str,
) -> None:
    spoil, column, word = SPOILT[case]
    log = write_log(tmp_path / "spoilt.csv", spoil(dict(simulated_leg)))
    out = tmp_path / "out"
    robot = root / "urdf" / "leg.toml"
    assert exit_code(["gap", "where", str(log), "--robot", str(robot), "--out", str(out)]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert column in err
    assert word in err
    assert not out.exists()


def test_the_same_log_unspoilt_is_accepted(
    tmp_path: Path, root: Path, simulated_leg: Columns
) -> None:
    log = write_log(tmp_path / "good.csv", simulated_leg)
    robot = root / "urdf" / "leg.toml"
    arguments = ["gap", "where", str(log), "--robot", str(robot), "--out", str(tmp_path / "out")]
    assert exit_code(arguments) == 0
    quality = rows_of(tmp_path / "out" / "quality.csv")
    simulated = [r for r in quality if "simulated" in r["detail"]]
    assert len(simulated) == 3
    assert {r["verdict"] for r in simulated} == {"ok"}


@pytest.mark.parametrize(
    ("more", "word"),
    [
        (["--mapping", "none.toml"], "none.toml"),
        (["--effort", "heat"], "heat"),
        (["--base", "measured"], "leg.toml"),
        (["--alternative", "reversable"], "reversible"),
        (["--cutoff", "100000"], "Hz"),
        (["--gait-start", "0.5"], "fixed"),
        (["--gait-start", "nan"], "--gait-start"),
        (["--holdout", "none.csv"], "none.csv"),
        (["--model", "none.toml"], "none.toml"),
    ],
)
def test_bad_options_are_refused_in_one_line(
    tmp_path: Path, root: Path, capsys: pytest.CaptureFixture[str], more: list[str], word: str
) -> None:
    log = write_log(tmp_path / "log.csv", leg_columns())
    robot = root / "urdf" / "leg.toml"
    arguments = ["gap", str(log), "--robot", str(robot), "--out", str(tmp_path / "out"), *more]
    assert exit_code(arguments) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert word in err
    assert not (tmp_path / "out").exists()


def test_a_mapping_that_is_no_mapping(
    tmp_path: Path, root: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = write_log(tmp_path / "log.csv", leg_columns())
    mapping = tmp_path / "map.toml"
    mapping.write_text("[colums]\n", encoding="utf-8")
    robot = root / "urdf" / "leg.toml"
    arguments = ["gap", "read", str(log), "--robot", str(robot), "--out", str(tmp_path / "out")]
    assert exit_code([*arguments, "--mapping", str(mapping)]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "columns" in err


def test_a_urdf_with_currents_asks_for_the_actuator(
    tmp_path: Path, root: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = write_log(tmp_path / "log.csv", leg_columns())
    robot = root / "urdf" / "leg.urdf"
    arguments = ["gap", "where", str(log), "--robot", str(robot), "--out", str(tmp_path / "out")]
    assert exit_code(arguments) == 2
    assert "--alternative" in capsys.readouterr().err


def _contact_source(tmp_path: Path, log: Path, more: list[str]) -> str:
    out = tmp_path / "out"
    assert exit_code(["gap", "read", str(log), "--out", str(out), *more]) == 0
    (row,) = [r for r in rows_of(out / "quality.csv") if r["check"] == "contact"]
    return row["detail"]


def test_a_start_of_the_gait_tells_contact_where_the_log_does_not(tmp_path: Path) -> None:
    whole = pq.read_table(DEMO)
    bare = tmp_path / "bare.parquet"
    pq.write_table(whole.drop([n for n in whole.column_names if "force" in n]), bare)
    start = ["--gait-start", "0.9"]
    assert "lowest feet" in _contact_source(tmp_path, bare, [])
    assert "schedule" in _contact_source(tmp_path, bare, start)
    assert "forces" in _contact_source(tmp_path, DEMO, start)


def test_vertical_foot_forces_alone_tell_contact_and_say_what_they_do_not(tmp_path: Path) -> None:
    whole = pq.read_table(DEMO)
    lateral = [n for n in whole.column_names if "force_x" in n or "force_y" in n]
    vertical = tmp_path / "vertical.parquet"
    pq.write_table(whole.drop(lateral), vertical)
    out = tmp_path / "out"
    gaps = []
    for log in (DEMO, vertical):
        assert exit_code(["gap", "where", str(log), "--out", str(out)]) == 0
        rows = rows_of(out / "where.csv")
        assert rows[0]["joint"] == "rm_joint_1"
        gaps.append({r["joint"]: float(r["gap"]) for r in rows if r["by"] == "joint"})
    quality = {r["check"]: r for r in rows_of(out / "quality.csv")}
    assert quality["foot_forces"]["verdict"] == "warning"
    assert "least tangential" in quality["foot_forces"]["detail"]
    assert "forces" in quality["contact"]["detail"]
    # Computed lateral forces are further from the ground's than measured ones.
    assert sum(gaps[1].values()) > 1.2 * sum(gaps[0].values())


def test_a_step_without_a_log_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert exit_code(["gap", "read"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_run_killed_in_the_middle_leaves_nothing(tmp_path: Path, root: Path) -> None:
    out = tmp_path / "out"
    process = subprocess.Popen(
        [sys.executable, "-m", "pipeline", "gap", "where", str(DEMO), "--out", str(out)],
        cwd=root,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        process.wait(timeout=1.5)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    assert not out.exists() or not [p for p in out.iterdir() if p.name.startswith(".")]
