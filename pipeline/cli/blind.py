"""The verb blind: make trials, seal what was hidden, ask the workflow, then open the seals.

Three steps, each of which goes on where it was stopped: every trial is made and sealed, with what
its log could tell; `gap` answers each in a process of its own, in a folder that holds only log,
robot and actuators; only then are the seals opened and the answers judged.
"""

from __future__ import annotations

import argparse
import hashlib
import json
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from pipeline.blind.answer import ask, read_answer
from pipeline.blind.make import (
    answer_folder,
    judgement_file,
    make,
    read_judgement,
    seal_file,
    trial_folder,
)
from pipeline.blind.score import score
from pipeline.blind.summary import Scored, by_effect, confusion, rates, trial_rows
from pipeline.blind.truth import hidden_truths
from pipeline.blind.twin.matrix import TrialSpec, trial_matrix
from pipeline.blind.twin.trial import ROBOT_FILES
from pipeline.cli.blind_standard import run_standard
from pipeline.cli.blind_steps import clear, hash_of, pool, processes, progress, together
from pipeline.logs.errors import GapError
from pipeline.machine.machine import MachineModel, machine_of_robot
from pipeline.paper.calibration.checkpoint import Checkpoint
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import load_robot_file
from reports.folder import staged

#: What a trial is made of, and what an answer hangs on beside it.
_OF_TRIALS: Final = (
    "urdf/*.toml",
    "actuators/catalog/*.toml",
    "pipeline/robot/*.py",
    "pipeline/motion/*.py",
    "pipeline/dynamics/*.py",
)
_OF_TRIALS_TOO: Final = ("pipeline/blind/twin/**/*.py", "pipeline/blind/[bimt]*.py")
_OF_ANSWERS: Final = ("pipeline/**/*.py", "actuators/**/*.py")


@dataclass(frozen=True)
class Sealed:
    """A trial that was made.

    Attributes:
        spec: Of the matrix.
        sha256: Of its sealed truth.
        robot: Robot file, relative to its folder.
    """

    spec: TrialSpec
    sha256: str
    robot: str


def run_blind(options: argparse.Namespace) -> int:
    """Run the matrix, or its first trials.

    Returns:
        0 where every aim is reached, else 1.

    Raises:
        PipelineError: Unusable options, or a trial that cannot be made.
        ReportError: The folder cannot be written.
    """
    out: Path = options.out
    if options.trials is not None and options.trials < 1:
        raise GapError(f"--trials {options.trials}: give a number from 1")
    if not 1 <= options.workers <= 64:
        raise GapError(f"--workers {options.workers}: give a number from 1 to 64")
    if options.matrix == "standard":
        return run_standard(options)
    specs = trial_matrix(options.seed)[: options.trials]
    if out.exists() and not options.resume:
        clear(out)
    sealed = seal(specs, out, options.seed, options.workers)
    hashes = together({s.spec.number: s.sha256 for s in sealed})
    print(f"{len(sealed)} truths sealed; sha256 of their hashes {hashes}", flush=True)
    runs = answer(sealed, out, options.workers)
    trials = open_and_score(sealed, runs, out)
    return write(trials, out, options.seed, [run["seconds"] for run in runs])


def seal(specs: Sequence[TrialSpec], out: Path, seed: int, workers: int) -> list[Sealed]:
    """Make every trial and print the hash of what was hidden in it."""
    point = Checkpoint(out / "sealed.jsonl", hash_of(seed, *_OF_TRIALS, *_OF_TRIALS_TOO))
    tasks = [
        (str(s.number), (str(out), s.number, s.seed, list(s.effects), s.motion, s.noise))
        for s in specs
    ]
    # One simulation at a time per process: libraries' own threads would only get in the way.
    with (
        pool(processes(workers)) as makers,
        progress("making trials", len(tasks)) as tick,
    ):
        made = point.run(makers, make, tasks, tick)
    sealed = [Sealed(spec, m["sha256"], m["robot"]) for spec, m in zip(specs, made, strict=True)]
    for s in sorted(sealed, key=lambda s: s.spec.number):
        print(f"trial {s.spec.number:04d} sha256 {s.sha256}")
    return sealed


def answer(sealed: Sequence[Sealed], out: Path, workers: int) -> list[dict[str, Any]]:
    """Let `gap` answer every trial."""
    point = Checkpoint(
        out / "answers.jsonl",
        hash_of(together({s.spec.number: s.sha256 for s in sealed}), *_OF_ANSWERS),
    )
    tasks = []
    for s in sealed:
        folder = trial_folder(out, s.spec.number)
        to = answer_folder(out, s.spec.number)
        tasks.append((str(s.spec.number), (str(folder), s.robot, str(to))))
    with (
        pool(ThreadPoolExecutor(workers)) as threads,
        progress("asking gap", len(tasks)) as tick,
    ):
        return point.run(threads, ask, tasks, tick)


def open_and_score(
    sealed: Sequence[Sealed], runs: Sequence[dict[str, Any]], out: Path
) -> list[Scored]:
    """Open the seals and judge the answers.

    Raises:
        GapError: A sealed truth is not the one whose hash was printed.
    """
    models = {motion: nominal(motion) for motion in {s.spec.motion for s in sealed}}
    trials = []
    for s, run in zip(sealed, runs, strict=True):
        path = seal_file(out, s.spec.number)
        content = path.read_bytes()
        if hashlib.sha256(content).hexdigest() != s.sha256:
            raise GapError(f"{path}: not what was sealed, its hash differs; make the trials anew")
        hidden = hidden_truths(json.loads(content), models[s.spec.motion])
        judged = read_judgement(judgement_file(out, s.spec.number))
        given = read_answer(run, answer_folder(out, s.spec.number))
        trials.append(Scored(s.spec, score(s.spec.number, hidden, judged, given), s.sha256))
    return sorted(trials, key=lambda t: t.spec.number)


def nominal(motion: str) -> MachineModel:
    """The machine of a motion by its files, without an actuator."""
    return machine_of_robot(load_robot(load_robot_file(ROBOT_FILES[motion])), None)


def write(trials: Sequence[Scored], out: Path, seed: int, seconds: Sequence[float]) -> int:
    """Write tables and figure, print the rates."""
    from reports.figures.gap.confusion import confusion as draw
    from reports.figures.save import save_figure
    from reports.tables import blind as tables
    from reports.writer import write_table

    rows = trial_rows(trials)
    reached = rates(rows)
    hidden, named, counts = confusion(trials)
    shares = [
        {
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
        for r in reached
    ]
    meta = {"options": {"seed": seed, "trials": len(trials)}}
    every = (
        tables.blind_table(tables.TrialRow, rows),
        tables.blind_table(tables.RateRow, shares),
        tables.blind_table(tables.EffectRow, by_effect(rows)),
        tables.confusion(hidden, named, counts),
    )
    with staged(out, "blind") as folder:
        for table in every:
            write_table(table, folder, meta=meta)
        shown = int(counts.sum())
        text = f"{shown} trials with one effect the log could show, or nothing hidden"
        save_figure(draw(hidden, named, counts, text), folder, "blind_confusion")
    for r in reached:
        if r.trials:
            print(r)
    usual = sorted(seconds)[len(seconds) // 2]
    print(f"{len(trials)} trials; an answer takes {usual:.1f} s of computing (median)")
    return 0 if all(r.reached for r in reached if r.trials) else 1
