"""Sweeps: the cases, the rows, and that nothing is lost or repeated."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from threading import Timer
from typing import Any

import numpy as np
import pandas
import pytest

import pipeline as lw
from actuators.errors import LegwattError
from pipeline import sweeps
from pipeline.commands.main import main
from pipeline.sweeps import resumed
from tests.command_line import Refused

VARY = ("speed=0.1:0.3:2 m/s", "payload_mass=0,5,600 kg", "body_pitch=0,80 deg")


def run(folder: Path, vary: Any = VARY, **more: Any) -> sweeps.Swept:
    return lw.sweep(lw.load(), vary, folder, samples=51, **more)


@pytest.fixture(scope="module")
def frame(tmp_path_factory: pytest.TempPathFactory) -> pandas.DataFrame:
    """A finished sweep of twelve cases, in one process."""
    return run(tmp_path_factory.mktemp("sweep")).rows


def test_a_row_is_what_walk_says_of_the_same_machine(frame: pandas.DataFrame) -> None:
    case = frame[
        (frame.speed_m_s == 0.3) & (frame.payload_mass_kg == 5) & (frame.body_pitch_deg == 0)
    ]
    machine = lw.load().with_values({"gait.speed": "0.3 m/s", "gait.payload_mass": "5 kg"})
    walk = lw.walk(machine, samples=51)
    energy = walk.table("robot_energy")
    for name in energy.columns.intersection(case.columns):
        assert case[name].tolist() == energy[name].tolist()
    torque = np.concatenate([part.torque for part in walk.result.demand.segments])
    assert case.peak_torque_Nm.iloc[0] == np.abs(torque).max()
    limits = walk.table("motor_limits")
    for row in case.itertuples():
        own = limits[limits.alternative == row.alternative]
        assert row.peak_voltage_V == own[own.quantity == "voltage"].peak.max()
        assert bool(row.beyond) == bool(own.breach.any())


def test_every_case_is_there_once_and_a_refused_one_says_why(frame: pandas.DataFrame) -> None:
    assert sorted(set(frame.case)) == list(range(12))
    refused = frame[frame.refusal != ""]
    assert len(refused) == refused.case.nunique() > 0
    assert refused.average_power_W.isna().all()
    assert not refused.refusal.str.contains("/").any()  # the same wherever files lie
    done = frame[frame.refusal == ""]
    assert done.groupby("case").alternative.nunique().eq(4).all()
    assert set(refused.body_pitch_deg) == {80.0}


def test_the_same_rows_in_other_processes(frame: pandas.DataFrame, tmp_path: Path) -> None:
    pandas.testing.assert_frame_equal(run(tmp_path, workers=2).rows, frame, check_exact=True)


def test_a_stopped_sweep_goes_on_without_loss_or_repetition(
    frame: pandas.DataFrame, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A stop after the first case, with a half-written line that a kill left."""
    computed: list[int] = []
    real = sweeps.rows_of_case

    def until(most: int) -> Any:
        def counted(*given: Any) -> list:
            if len(computed) == most:
                raise LegwattError("a worker process ended")
            computed.append(given[-1][0])
            return real(*given)

        return counted

    monkeypatch.setattr(sweeps, "rows_of_case", until(1))
    with pytest.raises(LegwattError):
        run(tmp_path)
    (kept,) = tmp_path.iterdir()
    with kept.open("a", encoding="utf-8") as file:
        file.write('{"task": "4", "result": [{"case": 4, "spe')
    monkeypatch.setattr(sweeps, "rows_of_case", until(99))
    done = run(tmp_path)
    assert sorted(computed) == list(range(12))
    pandas.testing.assert_frame_equal(done.rows, frame, check_exact=True)


def test_the_command_writes_table_figure_and_record_alone(tmp_path: Path) -> None:
    command = ["sweep", "--vary", "speed=0.1,0.3 m/s", "--samples", "51", "--out", str(tmp_path)]
    assert main([*command, "--workers", "1"]) == 0
    assert {p.name for p in tmp_path.iterdir()} == {"sweep.csv", "sweep.svg", "datapackage.json"}
    table = pandas.read_csv(tmp_path / "sweep.csv")
    assert table.groupby("speed_m_s").alternative.nunique().eq(4).all()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "give NAME=VALUES"),
        (["--vary", "speed="], "expected NAME=VALUES"),
        (["--vary", "sped=0.1,0.2 m/s"], "did you mean 'speed'"),
        (["--vary", "hip_spacing=1,2 kg"], "its unit is"),
        (["--vary", "speed=0.1,nan m/s"], "expected finite numbers"),
        (["--vary", "speed=0.1,,0.2 m/s"], "empty or stands twice"),
        (["--vary", "speed=0.1:0.4 m/s"], "expected FIRST:LAST:COUNT"),
        (
            ["--vary", "speed=0.1:0.2:500 m/s", "--vary", "payload_mass=0:5:500 kg"],
            "at most 100000",
        ),
        (["--vary", "speed=0.1,0.2 m/s", "--vary", "gait.speed=0.1,0.2 m/s"], "stands twice"),
        (["--vary", "duty_factor=0.6,1.4"], "must be above 0 to 1"),
        (["--vary", "duty_factor=0.6,0.7", "--workers", "tcp://127.0.0.1:9"], "no scheduler"),
    ],
)
def test_bad_input_is_one_line(
    arguments: list[str],
    words: str,
    tmp_path: Path,
    refused: Refused,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("pipeline.sweeps._PATIENCE", 0.3)
    assert words in refused(["sweep", *arguments], tmp_path / "out")


def die(number: int) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def refuse(number: int) -> int:
    raise LegwattError(f"{number}: no")


@pytest.mark.parametrize(
    ("work", "workers", "words"),
    [(die, 2, "ended several workers"), (refuse, 1, "^0: no$"), (refuse, 2, "^[01]: no$")],
)
def test_what_ends_a_block_is_one_line(work: Any, workers: int, words: str, tmp_path: Path) -> None:
    with pytest.raises(LegwattError, match=words) as error:
        resumed(work, {"a": 0, "b": 1}, tmp_path / "kept", "", workers)
    assert "\n" not in str(error.value)


@pytest.mark.slow
def test_a_cluster_gives_the_same_rows_though_a_worker_is_killed(tmp_path: Path) -> None:
    vary = ["speed=0.02:0.12:20 m/s"]
    started: list[subprocess.Popen[str]] = []

    def dask(kind: str, *arguments: str) -> subprocess.Popen[str]:
        command = [sys.executable, "-m", f"distributed.cli.dask_{kind}", *arguments]
        root = Path(__file__).parents[2]
        started.append(subprocess.Popen(command, cwd=root, stderr=subprocess.PIPE, text=True))
        return started[-1]

    try:
        scheduler = dask("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
        assert scheduler.stderr
        address = next(line.split()[-1] for line in scheduler.stderr if "Scheduler at:" in line)
        options = (address, "--nthreads", "1", "--no-nanny", "--no-dashboard")
        first, _ = dask("worker", *options), dask("worker", *options)
        Timer(4.0, first.kill).start()
        spread_out = run(tmp_path / "spread", vary, workers=address)
        assert first.wait(timeout=30) == -signal.SIGKILL
    finally:
        for process in started:
            process.kill()
            process.communicate()
    assert spread_out.rows.equals(run(tmp_path / "alone", vary).rows)
