"""The stored calibration: it belongs to the files, its sets meet the rows, it claims no more."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from actuators.loading.build import CATALOG, Catalog, load_catalog
from actuators.units import from_si
from pipeline.cli.calibrate import refuse_other_robot
from pipeline.errors import CalibrationError, PipelineError
from pipeline.paper.calibration import tasks
from pipeline.paper.calibration.prior import Prior
from pipeline.paper.calibration.problem import EXACT, Evaluation, extra_target
from pipeline.paper.calibration.store import (
    FIXED,
    VERDICTS,
    calibrated_numbers,
    load_results,
    number_verdict,
    save,
)
from pipeline.paper.motor_constants import KEYS
from pipeline.paper.published import EVEN, EXTRA, Published
from pipeline.robot.robot_file import RobotSpec, load_robot_file

LEAST_SETS = 200


def test_every_draw_of_the_posterior_meets_every_target_and_keeps_the_limits(
    results: dict[str, Any], published: dict[str, Published]
) -> None:
    members = results["sets"]
    assert len(members) >= LEAST_SETS
    for member in members:
        assert max(member["excess"].values()) <= 0
        for row in published.values():
            if row.role in ("input", "symmetry", "target") and row.id != EVEN:
                value = from_si(member["values"][row.id], row.unit)
                assert abs(value - row.value) <= row.half_width * (1 + 1e-3) + 1e-7, row.id
    extra = extra_target(published, 1)  # what the break-even implies, by which it is fitted
    assert all(abs(m["values"][EXTRA] - extra.centre) <= extra.half_width for m in members)


def test_the_walkers_of_the_stored_posterior_agree(results: dict[str, Any]) -> None:
    known = results["posterior"]
    assert max(n["r_hat"] for n in known["numbers"].values()) < 1.1
    assert min(n["effective"] for n in known["numbers"].values()) > 50
    assert sum(p["share"] for p in known["paths"].values()) == pytest.approx(1)
    # Nothing is pressed against a bound: sets are drawn, not forced.
    assert max(n["at_lower"] + n["at_upper"] for n in known["numbers"].values()) < 0.1


def test_stored_members_come_out_again(results: dict[str, Any], robot_file: str) -> None:
    member = results["sets"][57]
    again = tasks.point_of(robot_file, member["path"], member["z"], member["constants"])
    for name, value in member["values"].items():
        if value is not None:
            assert again["values"][name] == pytest.approx(value, rel=1e-5, abs=1e-9), name
    for kind in ("drawn", "returned", "excess", "totals"):
        for name, value in member[kind].items():
            assert again[kind][name] == pytest.approx(value, rel=1e-5, abs=1e-9), (kind, name)


def test_the_files_hold_the_nearest_point(
    results: dict[str, Any], spec: RobotSpec, catalog: Catalog, prior: Prior
) -> None:
    nearest = results["nearest"]
    for key, value in (prior.values(np.array(nearest["z"])) | nearest["constants"]).items():
        owner, name = key.split(".")
        entry = spec.parameters.parameter(name) if owner == "robot" else catalog.parameter(key)
        assert entry.value == pytest.approx(value, rel=1e-6), key
        assert entry.basis == "calibrated"
        assert entry.interval is not None
    assert spec.gait["transfer_path"] == nearest["path"]


def test_every_search_ends_in_the_stored_point(results: dict[str, Any], robot_file: str) -> None:
    """Several random starts, one optimum: the nearest point is not a local accident."""
    best = results["nearest"]
    distance = [s["prior_distance"] for s in results["starts"] if s["path"] == best["path"]]
    assert len(distance) >= 4
    assert max(distance) - min(distance) < 0.05 * min(distance)
    assert best["prior_distance"] == min(distance)
    found = tasks.nearest(robot_file, best["path"], tasks.READ, best["z"], 1)
    assert found["admissible"]
    assert found["prior_distance"] == pytest.approx(best["prior_distance"], rel=1e-3)


def test_a_point_is_admissible_with_every_row_met_and_no_limit_exceeded(
    results: dict[str, Any], robot_file: str
) -> None:
    best = results["nearest"]
    task = replace(tasks.problem(robot_file, best["path"]), constants=best["constants"])
    point = task.evaluate(np.array(best["z"]))

    def changed(name: str, value: float) -> Evaluation:
        return replace(point, values={**point.values, name: value})

    assert task.admissible(point)
    for name in (*EXACT, "walking_ratio_rotor", EXTRA, "rotor_voltage_2", "robot_mass"):
        assert not task.admissible(changed(name, 1.01 * point.values[name] + 2.0)), name
    for name in ("reversible_motor_torque_3", "rotor_motor_torque_2"):
        assert task.admissible(changed(name, 1.0)), name  # a prediction, and what is contradicted
    assert not task.admissible(replace(point, excess={"ideal.speed": 1e-6}))
    assert task.admissible(replace(point, excess={"ideal.speed": 0.0}))


def test_numbers_after_calibration_are_judged(results: dict[str, Any], prior: Prior) -> None:
    numbers = {n.parameter: n for n in calibrated_numbers(results, prior)}
    assert any(n.verdict == "not determined" for n in numbers.values())  # ten figures, 27 numbers
    for n in numbers.values():
        assert n.verdict in VERDICTS
        assert n.low <= n.calibrated <= n.high
    assert numbers["planetary.coulomb"].verdict == "against the prior"
    assert {n.parameter for n in numbers.values() if n.verdict == FIXED} == set(KEYS)
    at_bounds = replace(numbers["planetary.coulomb"], at_lower_share=0.1, at_upper_share=0.3)
    assert (at_bounds.bound, at_bounds.at_bound) == ("upper", pytest.approx(0.4))
    assert replace(at_bounds, at_lower_share=0.5).bound == "lower"
    assert replace(at_bounds, at_lower_share=0.0, at_upper_share=0.0).bound == ""


@pytest.mark.parametrize(
    ("shift", "spread", "verdict"),
    [
        (0.0, 0.85, "not determined"),
        (0.0, 0.84, "narrowed"),
        (0.0, 0.29, "determined"),
        (0.5, 0.6, "narrowed"),
        (-0.51, 0.95, "moved"),
        (1.96, 0.95, "moved"),
        (-1.97, 0.95, "against the prior"),
    ],
)
def test_a_number_driven_from_the_prior_is_not_called_undetermined(
    shift: float, spread: float, verdict: str
) -> None:
    assert number_verdict(shift, spread, 1.0) == verdict


def interrupted(*arguments: object) -> None:
    raise KeyboardInterrupt


def test_a_save_is_whole_or_leaves_the_old_files(
    results: dict[str, Any], tmp_path: Path, robot_file: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Saving what is stored changes no number."""
    robot, catalog = tmp_path / "hexapod.toml", tmp_path / "catalog"
    shutil.copyfile(robot_file, robot)
    shutil.copytree(CATALOG, catalog)
    stored = tmp_path / "results.json"
    monkeypatch.setattr("pipeline.paper.calibration.store.RESULTS_FILE", stored)
    before = {p: p.read_bytes() for p in [robot, *catalog.iterdir()]}
    with monkeypatch.context() as patch:
        patch.setattr("pipeline.paper.calibration.store.fingerprint", interrupted)
        with pytest.raises(KeyboardInterrupt):
            save(dict(results), robot, catalog)
    assert {p: p.read_bytes() for p in [robot, *catalog.iterdir()]} == before
    assert not list(tmp_path.rglob("*.tmp"))
    assert robot in save(dict(results), robot, catalog)
    assert load_results(stored) == results
    assert load_robot_file(robot).parameters == load_robot_file(Path(robot_file)).parameters
    assert load_catalog(catalog) == load_catalog()


@pytest.mark.parametrize(
    ("robot", "message"), [("solo12", "has no leg 'lm'"), ("leg", "its base is fixed")]
)
def test_another_robot_is_refused_before_anything_is_computed(
    root: Path, robot: str, message: str
) -> None:
    with pytest.raises(CalibrationError, match=message):
        refuse_other_robot(root / "urdf" / f"{robot}.toml")


def test_missing_results_are_one_line(tmp_path: Path) -> None:
    with pytest.raises(PipelineError, match="make calibrate"):
        load_results(tmp_path / "none.json")
