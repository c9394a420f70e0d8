"""The verb blind, standard matrix: made and sealed, answered, opened and scored straight.

The steps are those of the first matrix, and go on where they were stopped.
"""

from __future__ import annotations

import argparse
import hashlib
import json
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Final

from pipeline.blind.answer import ask, read_answer
from pipeline.blind.make import answer_folder, seal_file, trial_folder
from pipeline.blind.rates import Rate
from pipeline.blind.standard.make import MORE, ROBOT, make_standard
from pipeline.blind.standard.rows import Row, by_effect, rates, reliability, trial_row
from pipeline.blind.standard.score import score_straight
from pipeline.blind.twin.fixed.matrix import StandardSpec, standard_matrix
from pipeline.cli.blind_steps import clear, hash_of, pool, processes, progress, together
from pipeline.logs.errors import GapError
from pipeline.paper.calibration.checkpoint import Checkpoint

_OF_TRIALS: Final = ("pipeline/blind/twin/**/*.py", "pipeline/blind/standard/make.py")
_OF_ANSWERS: Final = ("pipeline/**/*.py", "actuators/**/*.py")


def run_standard(options: argparse.Namespace) -> int:
    """Run the matrix, or its first trials.

    Returns:
        0 where every aim is reached, else 1.

    Raises:
        PipelineError: Unusable options, or a trial that cannot be made.
        ReportError: The folder cannot be written.
    """
    out: Path = options.out
    specs = standard_matrix(options.seed)[: options.trials]
    if out.exists() and not options.resume:
        clear(out)
    sealed = _seal(specs, out, options.seed, options.workers)
    hashes = {spec.number: sha for spec, sha in zip(specs, sealed, strict=True)}
    print(f"{len(sealed)} truths sealed; sha256 of their hashes {together(hashes)}", flush=True)
    runs = _answer(specs, out, together(hashes), options.workers)
    rows = [_judged(s, sha, run, out) for s, sha, run in zip(specs, sealed, runs, strict=True)]
    return _write(rows, out, options.seed, sorted(run["seconds"] for run in runs))


def _seal(specs: Sequence[StandardSpec], out: Path, seed: int, workers: int) -> list[str]:
    point = Checkpoint(out / "sealed.jsonl", hash_of("standard", seed, *_OF_TRIALS))
    tasks = [
        (str(s.number), (str(out), s.number, s.seed, s.machine, list(s.effects), s.background))
        for s in specs
    ]
    with (
        pool(processes(workers)) as makers,
        progress("making trials", len(tasks)) as tick,
    ):
        return [m["sha256"] for m in point.run(makers, make_standard, tasks, tick)]


def _answer(
    specs: Sequence[StandardSpec], out: Path, truths: str, workers: int
) -> list[dict[str, Any]]:
    point = Checkpoint(out / "answers.jsonl", hash_of(truths, *_OF_ANSWERS))
    tasks = []
    for s in specs:
        folder, to = trial_folder(out, s.number), answer_folder(out, s.number)
        tasks.append((str(s.number), (str(folder), ROBOT, str(to), MORE)))
    with (
        pool(ThreadPoolExecutor(workers)) as threads,
        progress("asking gap", len(tasks)) as tick,
    ):
        return point.run(threads, ask, tasks, tick)


def _judged(spec: StandardSpec, sha256: str, run: dict[str, Any], out: Path) -> Row:
    """Open a seal and judge.

    Raises:
        GapError: A sealed truth is not the one whose hash was printed.
    """
    path = seal_file(out, spec.number)
    content = path.read_bytes()
    if hashlib.sha256(content).hexdigest() != sha256:
        raise GapError(f"{path}: not what was sealed, its hash differs; make the trials anew")
    answer = read_answer(run, answer_folder(out, spec.number))
    return trial_row(spec, score_straight(json.loads(content), answer), sha256)


def _write(rows: Sequence[Row], out: Path, seed: int, seconds: Sequence[float]) -> int:
    from reports.folder import staged
    from reports.tables import blind as tables
    from reports.writer import write_table

    reached = rates(rows)
    meta = {"options": {"seed": seed, "trials": len(rows), "matrix": "standard"}}
    every = (
        tables.blind_table(tables.StandardTrialRow, rows),
        tables.standard_rates([_share(r) for r in reached]),
        tables.blind_table(tables.StandardEffectRow, by_effect(rows)),
        tables.blind_table(tables.ReliabilityRow, reliability(rows)),
    )
    with staged(out, "blind standard") as folder:
        for table in every:
            write_table(table, folder, meta=meta)
    for r in reached:
        if r.trials:
            print(r)
    usual = seconds[len(seconds) // 2]
    print(f"{len(rows)} trials; an answer takes {usual:.1f} s of computing (median)")
    return 0 if all(r.reached for r in reached if r.trials) else 1


def _share(r: Rate) -> Row:
    return {
        "rate": r.name,
        "meaning": r.meaning,
        "hits": r.hits,
        "trials": r.trials,
        "share": r.value,
        "low": r.interval[0],
        "high": r.interval[1],
        "aim_low": r.aim[0] if r.aim else None,
        "aim_high": r.aim[1] if r.aim else None,
        "reached": r.reached if r.aim else None,
    }
