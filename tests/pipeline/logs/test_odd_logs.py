"""Logs as robots make them: a leg's pace, short runs, steady turning, a joint at rest.

An arm of three joints by Pinocchio alone, with friction that its URDF lacks.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pinocchio as pin
import pytest

from pipeline.identification.answer import identify
from pipeline.identification.workflow.compared import Compared, compare_logs, load_logs
from pipeline.logs import load as load_module
from pipeline.logs.log import TEST, TRAIN, VALIDATION
from tests.command_line import as_compared
from tests.pipeline.arm import arm_file, sines, table, torques

COULOMB, VISCOUS = np.array([1.0, 0.6, 0.3]), np.array([0.5, 0.3, 0.1])


@pytest.fixture(scope="module")
def urdf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return arm_file(tmp_path_factory.mktemp("arm"))


def swung(
    urdf: Path,
    seed: int,
    *,
    seconds: float,
    rate: float,
    hz: Sequence[float] = (0.17, 0.53, 1.1),
    size: Sequence[float] = (0.8, 0.3, 0.1),
    still: int | None = None,
) -> pd.DataFrame:
    """A log of sums of sines [rad], a joint held still or none."""
    rng, t = np.random.default_rng(seed), np.arange(round(seconds * rate)) / rate
    moving = np.arange(3) != (3 if still is None else still)
    q, v, a = sines(rng, t, hz, size)
    return logged(urdf, t, np.where(moving, q, 0.5), moving * v, moving * a, rng)


def logged(
    urdf: Path, t: np.ndarray, q: np.ndarray, v: np.ndarray, a: np.ndarray, rng: np.random.Generator
) -> pd.DataFrame:
    """Columns of a motion with the torque that it takes."""
    tau = torques(pin.buildModelFromUrdf(str(urdf)), q, v, a)
    tau += COULOMB * np.tanh(v / 0.005) + VISCOUS * v + 0.02 * rng.standard_normal(q.shape)
    return table(t, q + 1e-4 * rng.standard_normal(q.shape), tau)


def compared(
    urdf: Path, folder: Path, logs: Sequence[pd.DataFrame], test: Sequence[pd.DataFrame] = ()
) -> Compared:
    """Logs compared with the URDF, `test` held out."""
    paths = []
    for k, log in enumerate([*logs, *test]):
        paths.append(folder / f"run_{k:02d}.parquet")
        log.to_parquet(paths[-1])
    learn, held = paths[: len(logs)], paths[len(logs) :]
    order, machine = as_compared(*learn, robot=urdf, holdout=held, step="where")
    return compare_logs(machine, machine.model, load_logs(machine, order))


def test_a_legs_pace_sampled_fifty_times_a_second_keeps_half_of_its_rows(urdf, tmp_path):
    """Every row lies within the filter's reach of a reversal; friction is found all the same."""
    pace = {"seconds": 40, "rate": 50, "hz": (2.1, 4.2, 0.1), "size": (0.35, 0.05, 0.05)}
    found = compared(urdf, tmp_path, *([swung(urdf, seed, **pace)] for seed in (1, 2)))  # type: ignore[arg-type]
    for m, prediction in zip(found.loaded.logs, found.predictions, strict=True):
        assert (m.mask.mean(axis=0) > 0.3).all()
        rest = m.effort[..., 0] - m.smooth(prediction.effort[..., 0])
        for j in range(3):
            rows = m.mask[:, j]
            x = np.stack([m.v[rows, j], m.smooth(np.tanh(m.v / 0.005))[rows, j]], axis=1)
            viscous, dry = np.linalg.lstsq(x, rest[rows, j], rcond=None)[0]
            assert viscous == pytest.approx(VISCOUS[j], rel=0.1)
            assert dry == pytest.approx(COULOMB[j], rel=0.15)


def test_a_motor_turned_steadily_in_short_pieces_is_dealt_out_piece_by_piece(urdf, tmp_path):
    rng, rate, parts, start = np.random.default_rng(0), 20.0, [], 0.0
    for k in range(40):
        t = np.arange(120) / rate
        speed = rng.uniform(0.05, 0.3) * (-1) ** k * np.array([1.0, 0.5, 0.7])
        q = np.sin(k + np.arange(3)) + speed * t[:, None]
        parts.append(logged(urdf, start + t, q, speed + 0 * q, 0 * q, rng))
        start += t[-1] + rng.uniform(2.0, 4.0)
    found = compared(urdf, tmp_path, [pd.concat(parts, ignore_index=True)])
    (log,) = found.loaded.logs
    assert [int(np.isin(log.part, k).mean() * 100) for k in (TRAIN, VALIDATION, TEST)] == [
        50,
        25,
        25,
    ]
    assert len(log.pieces) == 40
    assert (found.loaded.logs[0].mask.mean(axis=0) > 0.5).all()


def test_of_short_runs_those_without_use_are_left_out_in_a_line_each(urdf, tmp_path):
    runs = [swung(urdf, k, seconds=3, rate=100) for k in range(12)]
    runs[3] = runs[3].iloc[:20]
    runs[5].loc[:, [name for name in runs[5] if "torque" in name]] = np.nan
    runs[7] = runs[7].iloc[:0]
    found = compared(urdf, tmp_path, runs)
    said = {f.log: f.detail for f in found.loaded.findings if f.check == "left_out"}
    assert sorted(said) == ["run_03", "run_05", "run_07"]
    assert all(text.startswith("this log is left out: ") for text in said.values())
    assert {m.name for m in found.loaded.logs}.isdisjoint(said)
    assert found.loaded.rule == "tested on every fourth log"


def test_many_logs_are_compared_as_one_of_as_many_pieces(urdf, tmp_path, monkeypatch):
    runs = [swung(urdf, k, seconds=6, rate=100) for k in range(8)]
    apart = compared(urdf, tmp_path, runs[:6], runs[6:])
    assert len(apart.logs) == 8
    monkeypatch.setattr(load_module, "MANY", 7)
    together = compared(urdf, tmp_path, runs[:6], runs[6:])
    assert [m.name for m in together.logs] == ["run_00 to run_05", "run_06 to run_07"]
    assert together.fitted == 1
    for one, other in zip(apart.logs, together.logs[0].pieces, strict=False):
        assert np.array_equal(one.q, together.logs[0].q[other])
    one, other = (
        found.where.set_index(["joint", "by"]).query("by == 'joint'").sort_index()
        for found in (apart, together)
    )
    assert np.allclose(other["gap"], one["gap"], rtol=0.01)
    assert np.allclose(other["noise_floor"], one["noise_floor"], rtol=0.1)


def test_a_joint_at_rest_is_left_out_with_what_to_log_instead(urdf, tmp_path):
    logs = ([swung(urdf, seed, seconds=20, rate=200, still=1)] for seed in (1, 2))
    found = compared(urdf, tmp_path, *logs)
    (said,) = {
        f.detail
        for f in found.loaded.findings
        if f.column == "j1__torque_Nm" and f.check == "rows_left"
    }
    assert "the joint is left out; 99 % within the filter's reach of standstill" in said
    assert "let it move further" in said
    assert found.loaded.logs[0].mask[:, [0, 2]].any(axis=0).all()


@pytest.mark.slow
def test_beside_a_joint_at_rest_the_others_are_named(urdf, tmp_path):
    logs = ([swung(urdf, seed, seconds=20, rate=200, still=1)] for seed in (1, 2))
    found = compared(urdf, tmp_path, *logs)
    told = identify(found.predictions[0].model, found.logs).found
    assert {f.place for f in told if f.kept} == {("j0",), ("j2",)}
    # Coupled to the joint at rest, their friction would be its shaft's.
    assert not any(f.rivals for f in told)


@pytest.mark.parametrize(
    ("factor", "told"), [(60.0 / (2 * np.pi), True), (-1.0, True), (1.2, False)]
)
def test_a_velocity_in_another_unit_has_no_say_and_is_told(urdf, tmp_path, factor, told):
    logs = [swung(urdf, seed, seconds=20, rate=200) for seed in (1, 2)]
    for log in logs:
        log["j1__velocity_rad_s"] = factor * np.gradient(log["j1__position_rad"], 1 / 200)
    found = compared(urdf, tmp_path, *([log] for log in logs))
    values = {f.value for f in found.loaded.findings if f.column == "j1__velocity_rad_s"}
    assert [round(value / factor, 1) for value in values] == [1.0] * len(values)
    assert bool(values) == told
