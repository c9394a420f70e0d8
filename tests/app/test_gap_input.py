"""`gap` on unusable input: one line, exit 2, nothing written."""

from __future__ import annotations

import csv
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from pipeline.app.demo import DEMO
from tests.app.conftest import exit_code

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


@pytest.mark.parametrize(
    ("more", "word"),
    [
        (["--mapping", "none.toml"], "none.toml"),
        (["--effort", "heat"], "heat"),
        (["--base", "measured"], "leg.toml"),
        (["--alternative", "reversable"], "reversible"),
        (["--cutoff", "100000"], "Hz"),
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
