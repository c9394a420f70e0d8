"""Many trials: made, answered and judged, on processes of this machine or on Dask's workers.

A trial hangs on source, seed and number alone, so that rows are the same whatever the number of
workers. Finished trials are kept in `answers.jsonl`, keyed by the seed and the code that makes
trials and asks (not by the workflow's: a run that is resumed goes on with the workflow as it is).
"""

from __future__ import annotations

import hashlib
import json
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from pipeline.blind.answer import ask, read_answer
from pipeline.blind.machines.trial import make
from pipeline.blind.score import Score, score
from pipeline.checkpoint import Checkpoint

_ROOM: Final = Path(__file__).parent
Block = tuple[str, int, int, str | None]


def answered(block: Block) -> dict[str, Any]:
    """Make one trial and let `gap` answer it.

    Args:
        block: Source, seed and number of the trial, and where its files stay; None for a folder
            that goes when it is done.

    Returns:
        Truth, exit code and time, and the two files that are judged, as text.
    """
    source, seed, k, folder = block
    with tempfile.TemporaryDirectory() as scratch:
        own = Path(folder or f"{scratch}/trial")
        truth = make(source, seed, k, own)
        run = ask(own, truth["options"])
        files = {}
        for name in ("model.toml", "candidates.csv"):
            path = own / "answer" / name
            if run["code"] in (0, 1) and path.exists():
                files[name] = path.read_text(encoding="utf-8")
    # Through JSON at once: a truth that is read back is the one that is judged now.
    return dict(json.loads(json.dumps({"truth": truth, "run": run, "files": files}, default=float)))


def run_trials(
    sources: Sequence[str],
    seed: int,
    trials: int,
    out: Path,
    *,
    workers: int = 1,
    scheduler: str | None = None,
) -> list[Score]:
    """Run the first trials of each source; go on where a run was stopped.

    Args:
        sources: ``"own"``, ``"mujoco"``.
        seed: Of all trials.
        trials: Number per source.
        out: Folder of `answers.jsonl`, and of the trials' files where processes of this machine
            run them.
        workers: Processes.
        scheduler: Address of a Dask scheduler in place of them.

    Raises:
        PipelineError: A trial cannot be made, or workers ended before the work did.
    """
    point = Checkpoint(out / "answers.jsonl", _key(seed))
    blocks: dict[str, Block] = {}
    for k in range(trials):
        for source in sources:
            here = None if scheduler else str(out / "trials" / source / f"{k:04d}")
            blocks[f"{source} {k}"] = (source, seed, k, here)
    found = point.run(answered, blocks, workers=workers, scheduler=scheduler, title="trials")
    return [score(one["truth"], read_answer(one["files"], one["run"])) for one in found]


def _key(seed: int) -> str:
    """Hash of what a trial and its answer hang on beside the workflow."""
    total = hashlib.sha256(str(seed).encode())
    for path in sorted([*_ROOM.glob("machines/*.py"), _ROOM / "answer.py"]):
        total.update(path.name.encode() + path.read_bytes())
    return total.hexdigest()
