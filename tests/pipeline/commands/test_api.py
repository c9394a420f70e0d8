"""The Python API says what the command line writes."""

from __future__ import annotations

import contextlib
import doctest
import io
import runpy
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import pipeline as lw
from actuators.errors import LegwattError
from pipeline.result import own_names
from tests.command_line import exit_code

FOLDER = Path(__file__).parents[3] / "pipeline" / "examples"
#: The one that identifies from logs is run by the long tests.
EXAMPLES = [
    pytest.param(path.stem, marks=pytest.mark.slow if path.stem == "log_with_a_gap" else ())
    for path in sorted(FOLDER.glob("*.py"))
]
Example = Callable[[str], tuple[str, dict[str, Any]]]


@pytest.fixture
def machine(root: Path, monkeypatch: pytest.MonkeyPatch) -> lw.Machine:
    monkeypatch.chdir(root)
    return lw.load("urdf/hexapod.toml")


def test_saved_files_are_those_of_the_command_line(machine: lw.Machine, tmp_path: Path) -> None:
    """With a gait file and a changed number of the gait."""
    file = tmp_path / "wave.toml"
    file.write_text('[gait]\nname = "wave"\npayload_mass = "2 kg"\n', encoding="utf-8")
    changed = lw.load(machine.path, gait=file, changes={"gait.slope_forward": "4 deg"})
    walk = lw.walk(changed, samples=51)
    rise = walk.table("walking_base")["base__z_m"]
    assert rise.iloc[-1] > rise.iloc[0]
    walk.save(tmp_path / "api")
    lw.stand(machine).save(tmp_path / "api" / "stand")
    gait = ["--gait", str(file), "--set", "gait.slope_forward=4 deg"]
    assert exit_code(["walk", *gait, "--samples", "51", "--out", str(tmp_path / "cli")]) == 0
    assert exit_code(["stand", "--out", str(tmp_path / "cli" / "stand")]) == 0
    files = {p.relative_to(tmp_path / "cli") for p in (tmp_path / "cli").rglob("*.*")}
    assert {p.relative_to(tmp_path / "api") for p in (tmp_path / "api").rglob("*.*")} == files
    for name in files:
        assert (tmp_path / "api" / name).read_bytes() == (tmp_path / "cli" / name).read_bytes()


def test_changed_numbers_reach_a_comparison_with_logs(
    machine: lw.Machine, short_demo: Path
) -> None:
    """Current is torque over the torque constant: a tenth more constant, a tenth less current."""
    log, key = str(short_demo), "motor_re40_24v.torque_constant"
    changed = lw.load(changes={key: 33})
    where, plain = lw.gap(log, changed, step="where"), lw.gap(log, machine, step="where")
    gaps = [r.where["gap"].to_numpy() for r in (plain, where)]
    assert max(gaps[1]) != pytest.approx(max(gaps[0]), rel=1e-3)
    assert f"{key}=33" in where.meta["warnings"][0]
    with pytest.raises(LegwattError, match="no such number; did you mean"):
        changed.with_values({"hip_spacin": 3})


def test_files_of_one_name_are_told_apart_by_their_folders() -> None:
    files = [Path(p) for p in ("/a/one/log.csv", "/a/two/log.csv", "/b/two/log.csv", "/a/r.toml")]
    assert own_names(files) == ["one/log.csv", "a/two/log.csv", "b/two/log.csv", "r.toml"]
    assert own_names([files[0], files[0]]) == ["log.csv", "log.csv"]


@pytest.fixture(scope="module")
def example(root: Path) -> Example:
    """Runs an example, once; what it printed and the names it leaves."""

    @cache
    def run(name: str) -> tuple[str, dict[str, Any]]:
        with contextlib.chdir(root), contextlib.redirect_stdout(io.StringIO()) as said:
            left = runpy.run_path(str(FOLDER / f"{name}.py"))
        return said.getvalue(), left

    return run


@pytest.mark.slow
def test_what_is_found_is_in_the_model_and_read_back(
    machine: lw.Machine, example: Example, tmp_path: Path
) -> None:
    """Of the example that identifies from a log with another one as its test."""
    _, left = example("log_with_a_gap")
    assert "ok" in set(left["log"].quality["verdict"])
    found = left["result"]
    assert list(found.found["effect"]) == ["coulomb_friction"]
    before, after = found.gap
    assert after < 0.15 * before
    assert not found.negative
    file = found.model.save(tmp_path / "model.toml")
    read = lw.load(model=file)
    assert read.model_file is not None
    assert found.model.model_file is not None
    assert read.model_file.edits == found.model.model_file.edits
    energies = [lw.walk(m, "rotor", samples=101).energy for m in (found.model, read)]
    pd.testing.assert_frame_equal(*energies)
    plain = lw.walk(machine, "rotor", samples=101).energy
    assert energies[0]["electrical_J"].max() > plain["electrical_J"].max()
    again = lw.gap("pipeline/identification/demo/walk_slow.parquet", read, step="shrink")
    assert again.gap[1] < 0.2 * again.gap[0]


def test_errors_are_one_line(machine: lw.Machine, tmp_path: Path) -> None:
    demo = "pipeline/identification/demo/walk.parquet"
    trials = [
        (lambda: lw.load(tmp_path / "no.toml"), LegwattError),
        (lambda: lw.load(tmp_path / "no.urdf"), LegwattError),
        (lambda: lw.load(changes={"hip_spacin": 3}), LegwattError),
        (lambda: lw.walk(machine, "reversibel"), LegwattError),
        (lambda: lw.walk(machine, samples=3), LegwattError),
        (lambda: lw.read_log(tmp_path / "no.csv", machine), LegwattError),
        (lambda: lw.gap(demo, machine, step="shrink"), LegwattError),
        (lambda: lw.gap(demo, machine, step="shirnk"), LegwattError),
        (lambda: lw.stand(machine).table("standin"), LegwattError),
        (lambda: machine.with_effect("coulomb_frictoin", "rm_joint_1", {}), LegwattError),
        (lambda: machine.save(tmp_path / "model.toml"), LegwattError),
        (lambda: lw.stand(lw.load("urdf/leg.toml")), LegwattError),
        (lambda: lw.demand(lw.load("urdf/leg.urdf")), LegwattError),
        (lambda: lw.energy(lw.load("urdf/leg.urdf"), lw.demand(machine)), LegwattError),
    ]
    for call, kind in trials:
        with pytest.raises(kind) as error:
            call()
        assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", EXAMPLES)
def test_examples_run(name: str, example: Example) -> None:
    said, _ = example(name)
    assert said.count("\n") >= 2


@pytest.mark.parametrize("last", ["lw.read_log", pytest.param("", marks=pytest.mark.slow)])
def test_the_example_of_the_package_is_true(
    root: Path, monkeypatch: pytest.MonkeyPatch, last: str
) -> None:
    """What walks by the fast tests, logs and choice by the long ones."""
    monkeypatch.chdir(root)
    (example,) = doctest.DocTestFinder(recurse=False).find(lw)
    texts = [one.source for one in example.examples]
    end = next((k for k, text in enumerate(texts) if last and last in text), len(texts))
    example.examples = example.examples[:end]
    assert end >= 5
    assert doctest.DocTestRunner().run(example).failed == 0


def test_what_is_printed_is_ten_readable_lines(machine: lw.Machine) -> None:
    shown = [machine, lw.stand(machine), lw.walk(machine, "rotor", samples=51)]
    shown += [lw.demand(machine, samples=51), lw.check(machine.path), lw.components()]
    for one in shown:
        lines = str(one).splitlines()
        assert 1 <= len(lines) <= 10, type(one)
        assert max(map(len, lines)) < 200, type(one)
