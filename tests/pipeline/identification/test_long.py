"""Long logs: every row is looked at once, and stretches give the verdict of all rows."""

from __future__ import annotations

import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import pipeline.identification.workflow.compared
from pipeline.identification.compare.circumstances import stages
from pipeline.identification.selection.identify import identify
from pipeline.identification.workflow.compared import Compared, compare_logs, load_logs
from pipeline.logs.prepared.measurement import TEST, TRAIN, VALIDATION
from pipeline.logs.prepared.parts import GUARD
from pipeline.logs.prepared.stream import STRETCH, choose, scan
from pipeline.simulation.machine import Machine
from tests.compared import as_asked
from tests.leg_log import leg_logs
from tests.pipeline.logs.made import made_log, motion

JOINTS = ("rm_joint_1", "rm_joint_2", "rm_joint_3")


def long_leg(path: Path, effects: list[str], logs: int, seed: int = 5, times: int = 1) -> Path:
    """Several motions of one leg with something hidden, in one file with gaps between them.

    Args:
        path: To write.
        effects: To hide.
        logs: How many motions.
        seed: Of the machine.
        times: How often each motion is there.
    """
    made = leg_logs(seed, effects, logs)
    columns: dict[str, list[np.ndarray]] = {}
    start = 0.0
    for log in list(made.values()) * times:
        for name, values in log.items():
            shifted = values - values[0] + start if name == "time_s" else values
            columns.setdefault(name, []).append(shifted)
        start = float(columns["time_s"][-1][-1]) + 2.0
    table = pa.table({name: np.concatenate(parts) for name, parts in columns.items()})
    pq.write_table(table, path, row_group_size=10_000)
    return path


def taken_in(root: Path, *arguments: str) -> tuple[Machine, Compared]:
    options, given = as_asked([*arguments, "--robot", str(root / "urdf" / "leg.toml")])
    return given, compare_logs(given, given.model, *load_logs(given, options))


@pytest.fixture
def chunked(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """What is long from five thousand rows on."""
    monkeypatch.setattr(pipeline.identification.workflow.compared, "LONG_ROWS", 5_000)
    return monkeypatch


def test_a_joint_that_moves_once_is_among_the_stretches_that_tell_most() -> None:
    t, q, _, _ = motion(60 * STRETCH)
    q[:, 1] = 0.3
    once = slice(37 * STRETCH, 38 * STRETCH)
    q[once, 1] += 0.2 * np.sin(3 * t[once])
    found = scan([made_log(q, np.sin(q))])
    taken = choose(found, 5)
    assert taken.size == 5
    assert 37 * STRETCH in found.first[taken]
    # The others are spread over the log: five of its ten tenths.
    assert len({int(10 * k / 60) for k in taken}) == 5


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return long_leg(
        tmp_path_factory.mktemp("long") / "long.parquet", ["viscous_friction"], 2, times=3
    )


def test_chunks_hold_every_row_once_and_what_proves_had_no_say(
    root: Path, log: Path, chunked: pytest.MonkeyPatch
) -> None:
    given, where = taken_in(root, str(log), "--cutoff", "20")
    long = where.loaded.long
    assert long is not None
    long.rows = 7_000
    long._kept.clear()
    chunks = [s.measurement for _, s in long.chunks(given.model, where.measurements)]
    assert len(chunks) >= 5
    counted = [m.time[m.mask.any(axis=1)] for m in chunks]
    assert all(a[-1] < b[0] for a, b in pairwise(counted))
    assert pq.read_metadata(log).num_rows == long.surveys[0].found.rows
    (seen,) = where.measurements
    said = seen.time[np.isin(seen.part, (TRAIN, VALIDATION))]
    proves = np.concatenate([m.time[m.part == TEST] for m in chunks])
    assert proves.size > 200
    index = np.clip(np.searchsorted(said, proves), 1, said.size - 1)
    nearest = np.minimum(np.abs(proves - said[index - 1]), np.abs(said[index] - proves))
    assert nearest.min() > 0.99 * GUARD * where.loaded.prepared[0].memory


def test_the_table_of_chunks_is_that_of_the_whole(
    root: Path, log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tables = []
    for rows in (5_000, 10**9):
        monkeypatch.setattr(pipeline.identification.workflow.compared, "LONG_ROWS", rows)
        _, where = taken_in(root, str(log), "--cutoff", "20")
        assert (where.loaded.long is None) == (rows == 10**9)
        tables.append({(r.joint, r.by, r.band): r for r in where.rows})
    chunks, whole = tables
    for joint in JOINTS:
        one, other = chunks[joint, "joint", "all"], whole[joint, "joint", "all"]
        assert one.rows == pytest.approx(other.rows, rel=0.03)
        assert one.gap == pytest.approx(other.gap, rel=0.03)
        assert one.noise_floor == pytest.approx(other.noise_floor, rel=0.2)
    same = [key for key in whole if key in chunks and whole[key].rows > 2000]
    ratio = [chunks[key].gap / whole[key].gap for key in same]
    assert np.median(np.abs(np.log(ratio))) < 0.05


def test_a_last_share_proves_and_says_nothing_else(
    root: Path, log: Path, chunked: pytest.MonkeyPatch
) -> None:
    given, where = taken_in(root, str(log), "--prove-last", "0.3", "--cutoff", "20")
    long = where.loaded.long
    assert long is not None
    (m,) = where.measurements
    border = long.surveys[0].proves_from
    assert (m.time[m.part == TEST] >= border).all()
    assert (m.time[np.isin(m.part, (TRAIN, VALIDATION))] < border).all()
    assert {TRAIN, VALIDATION, TEST} <= set(m.part.tolist())
    for _, simulator in long.chunks(given.model, where.measurements):
        chunk = simulator.measurement
        assert (chunk.time[chunk.part == TEST] >= border).all()


@pytest.mark.slow
@pytest.mark.parametrize("effect", ["viscous_friction", "rotor_inertia", "torque_constant_error"])
def test_naming_on_stretches_gives_the_verdict_of_all_rows(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, effect: str
) -> None:
    path = long_leg(tmp_path / "long.parquet", [effect], 10, seed=8)
    verdicts, gaps = [], []
    for rows in (5_000, 10**9):
        monkeypatch.setattr(pipeline.identification.workflow.compared, "LONG_ROWS", rows)
        given, where = taken_in(root, str(path))
        named = identify(given.model, where.measurements)
        verdicts.append(named.naming.found)
        models = [("before", given.model), ("after", named.settled.problem.current)]
        gaps.append([s.gap for s in stages(models, where.measurements, where.loaded.long)])
    few, all_ = verdicts
    assert {(f.effect, f.place) for f in few} == {(f.effect, f.place) for f in all_}
    assert all_
    for a, b in zip(few, all_, strict=True):
        for p, q in zip(a.parameters, b.parameters, strict=True):
            assert p.low <= q.high
            assert q.low <= p.high
    before, after = np.array(gaps[0])
    # Other motions are held out where stretches are chosen: the gap of all joints is alike.
    assert np.sqrt(np.mean(before**2)) == pytest.approx(np.sqrt(np.mean(gaps[1][0] ** 2)), rel=0.3)
    assert np.sqrt(np.mean(after**2)) < np.sqrt(np.mean(before**2))


CHILD = """
import re, sys
from pipeline.commands.main import main
try:
    main(sys.argv[1:])
finally:  # of this program alone: what getrusage says begins with the memory of its parent
    print("peak", re.search(r"VmHWM:\\s+(\\d+) kB", open("/proc/self/status").read())[1])
"""


@pytest.mark.slow
def test_the_memory_of_the_command_does_not_grow_with_the_log(root: Path, tmp_path: Path) -> None:
    base = pq.read_table(long_leg(tmp_path / "base.parquet", [], 6))
    peaks = []
    for times in (5, 60):
        path = tmp_path / f"{times}.parquet"
        time = base["time_s"].to_numpy()
        with pq.ParquetWriter(path, base.schema) as writer:
            for k in range(times):
                shifted = pa.array(time + k * (time[-1] + 2.0))
                writer.write_table(base.set_column(0, "time_s", shifted))
        run = subprocess.run(
            [sys.executable, "-c", CHILD, "gap", "where", str(path), "--robot", "urdf/leg.toml"]
            + ["--out", str(tmp_path / "out")],
            cwd=root,
            capture_output=True,
            text=True,
        )
        assert run.returncode == 0, run.stderr
        peaks.append(int(run.stdout.split()[-1]))
    # Twelve times the rows; measurements of up to half a gigabyte are kept on purpose.
    assert peaks[1] < 1.0e6
    assert peaks[1] < 2.0 * peaks[0]
