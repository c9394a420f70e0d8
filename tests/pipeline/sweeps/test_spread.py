"""Blocks of work on processes and on a Dask cluster."""

from __future__ import annotations

import importlib.util
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Timer

import pytest

from actuators.errors import LegwattError
from pipeline.simulation.options import WalkOptions
from pipeline.spread import spread
from pipeline.sweeps.sweep import Order, run

ROOT = Path(__file__).parents[3]


def square_or_die(number: int) -> int:
    if number == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number


def refuse(number: int) -> int:
    raise LegwattError(f"{number}: no")


def test_a_killed_process_is_one_line() -> None:
    with pytest.raises(LegwattError, match="ended several workers") as error:
        list(spread(square_or_die, range(8), workers=2))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("workers", [1, 2])
def test_what_a_block_raises_comes_as_it_was_raised(workers: int) -> None:
    with pytest.raises(LegwattError, match="^[01]: no$"):
        list(spread(refuse, range(2), workers=workers))


@pytest.mark.parametrize("workers", [1, 2])
def test_a_function_that_workers_cannot_import_is_one_line(tmp_path: Path, workers: int) -> None:
    """A module named by its path, which the calling process alone has."""
    path = tmp_path / "only_here.py"
    path.write_text("def square(number):\n    return number * number\n", encoding="utf-8")
    spec = importlib.util.spec_from_file_location("only_here", path)
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules["only_here"] = module
    spec.loader.exec_module(module)
    if workers == 1:
        assert dict(spread(module.square, range(3), workers=1)) == {0: 0, 1: 1, 2: 4}
        return
    with pytest.raises(LegwattError, match="cannot import .* No module named 'only_here'"):
        list(spread(module.square, range(3), workers=workers))


@contextmanager
def dask(*arguments: str) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", f"distributed.cli.dask_{arguments[0]}", *arguments[1:]]
    started = subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, text=True)
    try:
        yield started
    finally:
        started.kill()
        started.communicate()


@contextmanager
def cluster() -> Iterator[tuple[str, list[subprocess.Popen[str]]]]:
    """A scheduler and workers on the loopback; the address, and the processes, scheduler first."""
    with dask("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard") as scheduler:
        assert scheduler.stderr
        address = next(line.split()[-1] for line in scheduler.stderr if "Scheduler at:" in line)
        options = ("--nthreads", "1", "--no-nanny", "--no-dashboard")
        with dask("worker", address, *options) as one, dask("worker", address, *options) as two:
            yield address, [scheduler, one, two]


def slow_square(number: int) -> int:
    time.sleep(0.2)
    return number * number


@pytest.mark.slow
def test_a_sweep_on_a_cluster_has_the_same_rows_though_a_worker_is_killed(tmp_path: Path) -> None:
    vary = ["speed=0.02:0.12:20 m/s"]
    alone = run(Order(options=WalkOptions(samples=51)), vary, tmp_path / "alone")
    with cluster() as (address, processes):
        Timer(4.0, processes[1].kill).start()
        spread_out = run(
            Order(options=WalkOptions(samples=51)), vary, tmp_path / "spread", workers=address
        )
        assert processes[1].wait(timeout=30) == -signal.SIGKILL
    assert spread_out.rows.equals(alone.rows)


@pytest.mark.slow
def test_a_scheduler_that_dies_is_one_line_and_what_was_done_is_known(
    capfd: pytest.CaptureFixture[str],
) -> None:
    found = {}
    with cluster() as (address, processes):
        blocks = spread(slow_square, range(30), workers=address)
        found.update(next(blocks) for _ in range(5))
        processes[0].kill()
        with pytest.raises(LegwattError, match="the scheduler is gone"):
            found.update(blocks)
    assert 5 <= len(found) < 30
    assert "Traceback" not in capfd.readouterr().err
