"""Many trials: made, and answered by `gap`, on processes of this machine or on Dask's workers.

A trial hangs on source, seed and number alone, so that rows are the same whatever the number of
workers. Finished trials are kept in `answers.jsonl`, keyed by the seed and the code that makes
trials and asks (not by the workflow's: a run that is resumed goes on with the workflow as it is).
"""

import hashlib
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final

from pipeline.sweeps import resumed
from tests.blind.machines.trial import make

_HERE: Final = Path(__file__).parent
#: An answer takes some ten seconds of computing; after this much it counts as none [s].
PATIENCE: Final = 240
Block = tuple[str, int, int, str | None]


def ask(folder: Path, options: list[str]) -> dict[str, Any]:
    """Let `gap` answer in a process of its own, which sees a trial's folder `given` alone.

    Returns:
        Exit code (0 explained, 1 a part unexplained, 2 refused, -1 no answer), seconds of
        computing, the last line on standard error, and the files that are judged.
    """
    out = (folder / "answer").resolve()
    shutil.rmtree(out, ignore_errors=True)  # an older answer is none
    command = [sys.executable, "-P", "-m", "pipeline", "gap", *options, "--out", str(out)]
    environment = {k: v for k, v in os.environ.items() if k in ("PATH", "HOME", "LANG")}
    environment |= {"PYTHONPATH": str(_HERE.parents[1]), "MPLBACKEND": "Agg"}
    environment |= {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "ARROW")}
    # The limit is one of computing time: other work on the machine must not cost an answer.
    limited = ["/bin/sh", "-c", f'ulimit -t {PATIENCE}; exec "$@"', "gap", *command]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(limited, cwd=folder / "given", env=environment, capture_output=True)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    code = done.returncode
    if code == 130:
        raise KeyboardInterrupt
    said = done.stderr.decode(errors="replace").strip().splitlines()[-1:]
    said = [f"no answer within {PATIENCE} s of computing"] if code < 0 else said
    names = [name for name in ("candidates.csv", "model.toml") if (out / name).exists()]
    return {
        "code": code if code == 2 or (code in (0, 1) and names) else -1,
        "seconds": sum(used[:2]) - sum(before[:2]),
        "message": "" if names else "".join(said),
        "files": {name: (out / name).read_text("utf-8") for name in names},
    }


Ask = Callable[[Path, list[str]], dict[str, Any]]


def answered(block: Block, ask: Ask = ask) -> dict[str, Any]:
    """Make a trial of this source, seed and number in a folder (None for no longer than needed)."""
    source, seed, k, folder = block
    with tempfile.TemporaryDirectory() as scratch:
        own = Path(folder or f"{scratch}/trial")
        truth = make(source, seed, k, own)
        record = {"truth": truth, "answer": ask(own, truth["options"])}
    # Through JSON at once: a truth that is read back is the one that is judged now.
    return dict(json.loads(json.dumps(record, default=float)))


def run_trials(
    sources: Sequence[str],
    seed: int,
    trials: int,
    out: Path,
    workers: int | str = 1,
    ask: Ask = ask,
) -> list[dict[str, Any]]:
    """Truths and answers of the first trials of each source; goes on where a run was stopped.

    `workers`: see `pipeline.sweeps`; those of other machines keep no files of trials.
    """
    key = hashlib.sha256(str(seed).encode())
    for path in sorted([*_HERE.glob("machines/*.py"), Path(__file__)]):
        key.update(path.name.encode() + path.read_bytes())
    blocks: dict[str, Block] = {}
    for k in range(trials):
        for source in sources:
            here = None if isinstance(workers, str) else str(out / "trials" / source / f"{k:04d}")
            blocks[f"{source} {k}"] = (source, seed, k, here)
    file = out / "answers.jsonl"
    work = partial(answered, ask=ask)
    return resumed(work, blocks, file, key.hexdigest(), workers)
