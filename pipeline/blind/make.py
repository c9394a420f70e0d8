"""Make one blind trial: log, robot and actuators in a folder, the truth sealed elsewhere."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pipeline.blind.bench import trial_bench
from pipeline.blind.identifiable import Identifiability, Rival, identifiability
from pipeline.blind.truth import hidden_truths
from pipeline.blind.twin.files import TrialFiles, write_trial
from pipeline.blind.twin.trial import Trial, make_trial
from reports.atomic import write_text

#: Feet's tangential forces are what this effect is about: its logs hold normal forces alone.
_SQUEEZE = "internal_foot_force"


def make(out: str, number: int, seed: int, effects: list[str], motion: str, noise: str) -> Any:
    """Make a trial, seal its truth, and seal what its log could tell.

    Args:
        out: Folder of all trials.
        number: Of this one.
        seed: Of everything drawn.
        effects: What to hide.
        motion: Of the twin's.
        noise: Of the twin's levels.

    Returns:
        Hash of the sealed truth, and the robot file relative to the trial's folder.
    """
    folder, sealed = trial_folder(Path(out), number), seal_file(Path(out), number)
    if folder.exists():
        shutil.rmtree(folder)  # of a run that was cut short
    trial = make_trial(seed, effects, motion, noise)
    files = write_trial(trial, folder, sealed)
    judged = _judge(trial, files, seed, effects, motion, noise)
    write_text(judgement_file(Path(out), number), judgement_text(judged))
    return {"sha256": files.sha256, "robot": files.robot.relative_to(folder).as_posix()}


def trial_folder(out: Path, number: int) -> Path:
    """All that the workflow gets to see of a trial."""
    return out / "trials" / f"{number:04d}"


def seal_file(out: Path, number: int) -> Path:
    """The truth of a trial."""
    return out / "sealed" / f"{number:04d}.json"


def judgement_file(out: Path, number: int) -> Path:
    """What a trial's log could tell."""
    return out / "sealed" / f"{number:04d}.identifiable.json"


def answer_folder(out: Path, number: int) -> Path:
    """What the workflow wrote."""
    return out / "answers" / f"{number:04d}"


def _judge(
    trial: Trial, files: TrialFiles, seed: int, effects: Sequence[str], motion: str, noise: str
) -> list[Identifiability]:
    if not effects:
        return []
    exact = {"whole": trial.exact["log"]}
    feet = "normal" if _SQUEEZE in effects else "full"
    kinds = {f"without_{k}": [e for e in effects if e != name] for k, name in enumerate(effects)}
    if len(effects) > 1:
        kinds["empty"] = []
    for name, others in kinds.items():
        less = make_trial(seed, others, motion, noise, foot_force=feet)
        exact[name] = less.exact["log"]
    with tempfile.TemporaryDirectory() as scratch:
        given, bench, measured = trial_bench(
            files.logs[0], files.robot, files.catalog, exact, Path(scratch)
        )
    hidden = hidden_truths(trial.truth, given.model)
    return identifiability(
        given.model,
        bench,
        measured["whole"],
        [measured[f"without_{k}"] for k in range(len(effects))],
        measured.get("empty", measured["without_0"]),
        hidden,
    )


def judgement_text(judged: Sequence[Identifiability]) -> str:
    """As JSON; of the rivals only those that come nearest."""
    rows = [
        {
            "nothing": one.nothing,
            "rivals": [[r.effect, list(r.place), float(r.misfit)] for r in one.rivals[:40]],
        }
        for one in judged
    ]
    return json.dumps(rows) + "\n"


def read_judgement(path: Path) -> list[Identifiability]:
    """Read what `judgement_text` wrote."""
    return [
        Identifiability(
            row["nothing"], tuple(Rival(name, tuple(place), z) for name, place, z in row["rivals"])
        )
        for row in json.loads(path.read_text(encoding="utf-8"))
    ]
