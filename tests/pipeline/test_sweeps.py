"""Sweeps: the cases, the rows, and that nothing is lost or repeated."""

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
from pipeline import sweeps
from pipeline.commands.main import main

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


def test_the_command_writes_table_figure_and_record_alone(tmp_path: Path) -> None:
    command = ["sweep", "--vary", "speed=0.1,0.3 m/s", "--samples", "51", "--out", str(tmp_path)]
    assert main([*command, "--workers", "1"]) == 0
    assert {p.name for p in tmp_path.iterdir()} == {"sweep.csv", "sweep.svg", "datapackage.json"}
    table = pandas.read_csv(tmp_path / "sweep.csv")
    assert table.groupby("speed_m_s").alternative.nunique().eq(4).all()


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
