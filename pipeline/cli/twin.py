"""The verb twin: make one trial, a log with something hidden in it and the truth beside it."""

from __future__ import annotations

import argparse
import shlex
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pipeline.atomic import PREFIX, output_errors
from pipeline.blind.machines.supply import make_supply
from pipeline.blind.machines.trial import make
from pipeline.errors import PipelineError


@contextmanager
def _whole(out: Path, there: bool) -> Iterator[None]:
    """The trial or nothing; a folder that was there stays."""
    try:
        yield
    except BaseException:
        if out.is_dir():
            for name in ("given", "truth.json"):
                path = out / name
                shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
            if not there:
                out.rmdir()
        raise


def run_twin(options: argparse.Namespace) -> int:
    """Make it; print the command that answers it.

    Raises:
        PipelineError: An unknown source, machine or effect, a negative seed or number, options that
            `--supply` has no use for, or a folder that is not empty.
        ReportError: The folder cannot be written.
    """
    if min(options.seed, options.number) < 0:
        raise PipelineError("--seed and --number start at 0")
    if options.supply and (options.machine or options.source != "own"):
        raise PipelineError("--supply is the hexapod's on its own source: no --machine, --source")
    out: Path = options.out
    if [path for path in out.glob("*") if not path.name.startswith(PREFIX)]:
        raise PipelineError(f"{out}: not empty; give a new folder for the trial")
    effects = None if options.hide is None else tuple(options.hide)
    there = out.exists()
    with output_errors(out), _whole(out, there):
        if options.supply:
            truth = make_supply(options.seed, options.number, out, effects)
        else:
            truth = make(
                options.source,
                options.seed,
                options.number,
                out,
                machine=options.machine,
                effects=effects,
            )
    print(f"the truth is in {out / 'truth.json'}; without looking at it:")
    command = shlex.join(["python", "-m", "pipeline", "gap", *truth["options"]])
    print(f"cd {shlex.quote(str(out / 'given'))} && {command} --out ../answer")
    return 0
