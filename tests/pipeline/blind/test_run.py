"""Many trials: the same rows whatever the number of workers, after a resume, and on Dask."""

import os
import signal
from dataclasses import replace
from pathlib import Path
from threading import Timer

import pytest

import pipeline.blind.run as run
from pipeline.blind.rates import blind_rows, name_rows, trial_row
from tests.command_line import exit_code, rows_of

MODEL = """
[[edit]]
effect = "coulomb_friction"
place = ["joint_1"]
level = "confirmed"
[edit.parameters.torque]
value = 0.5
unit = "N*m"
interval = [0.4, 0.6]
"""


def answer(folder: Path, options: list[str]) -> dict[str, object]:
    """What any workflow could write."""
    assert (folder / "given" / options[0]).exists()
    assert not (folder / "given" / "truth.json").exists()
    (folder / "answer").mkdir()
    (folder / "answer" / "model.toml").write_text(MODEL, encoding="utf-8")
    return {"code": 1, "seconds": 1.0, "message": ""}


def test_rows_are_the_same_whatever_the_workers_and_after_a_resume(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run, "ask", answer)
    one = run.run_trials(["own"], 3, 3, tmp_path / "one")
    rows = blind_rows(one)
    assert rows == blind_rows(run.run_trials(["own"], 3, 3, tmp_path / "two", workers=2))
    # Killed in the second trial: half a line is left of it.
    kept = tmp_path / "one" / "answers.jsonl"
    lines = kept.read_text(encoding="utf-8").splitlines(keepends=True)
    kept.write_text("".join(lines[:2]) + lines[2][:40], encoding="utf-8")
    made = []
    monkeypatch.setattr(run, "make", lambda *block: made.append(block[2]) or MAKE(*block))
    assert rows == blind_rows(run.run_trials(["own"], 3, 3, tmp_path / "one"))
    assert made == [1, 2]


MAKE = run.make


@pytest.mark.slow
# The pipes of a worker that is killed are closed by nobody.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_dask_gives_the_same_rows_though_a_worker_is_killed(tmp_path: Path) -> None:
    from distributed import LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        first = next(iter(cluster.workers.values()))
        Timer(8.0, os.kill, (first.process.pid, signal.SIGKILL)).start()
        address = cluster.scheduler_address
        spread = run.run_trials(["own"], 3, 2, tmp_path / "dask", scheduler=address)
    alone = run.run_trials(["own"], 3, 2, tmp_path / "alone")
    for one, two in zip(spread, alone, strict=True):
        assert replace(trial_row(one), cpu_s=0) == replace(trial_row(two), cpu_s=0)
        assert name_rows(one) == name_rows(two)


def test_the_command_writes_its_tables(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run, "ask", answer)
    arguments = ["blind", "--trials", "2", "--workers", "1", "--seed", "3"]
    assert exit_code([*arguments, "--out", str(tmp_path / "out")]) == 1
    assert len(rows_of(tmp_path / "out" / "trials.csv")) == 2
    assert {r["effect"] for r in rows_of(tmp_path / "out" / "names.csv")} == {"coulomb_friction"}
    assert "answered" in {r["rate"] for r in rows_of(tmp_path / "out" / "rates.csv")}
