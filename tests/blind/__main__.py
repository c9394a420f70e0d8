"""Blind trials: `make blind`. Hide effects in simulated machines, count how often `gap` is right.

Exit 0: every aim was reached. Exit 1: one was not. Exit 2: unusable options or folder.
"""

import argparse
import os
import shlex
import shutil
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from actuators.checked import output_errors, write_text
from actuators.errors import LegwattError
from tests.blind.judge import tables
from tests.blind.machines.forward import engine
from tests.blind.machines.hidden import BOTH
from tests.blind.machines.supply import make_supply
from tests.blind.machines.trial import make
from tests.blind.run import run_trials


def parser() -> argparse.ArgumentParser:
    """The options."""
    out = argparse.ArgumentParser("python -m tests.blind", description=__doc__)
    text = "own: inverse of the true machine; mujoco: forward dynamics with a controller"
    out.add_argument("--source", choices=[*BOTH, "both"], default="own", help=text)
    out.add_argument("--seed", type=int, default=1, help="of the random numbers; 1")
    out.add_argument("--trials", type=int, default=60, help="number per source; 60")
    text = "processes, or the address of a Dask scheduler; $DASK_SCHEDULER_ADDRESS or 2 by default"
    address = os.environ.get("DASK_SCHEDULER_ADDRESS", "2")
    out.add_argument("--workers", metavar="N|ADDRESS", default=address, help=text)
    out.add_argument("--resume", action="store_true", help="go on where a run was stopped")
    text = "folder for everything written; reports/out/blind"
    out.add_argument("--out", type=Path, default=Path("reports/out/blind"), help=text)
    one = out.add_argument_group("one trial, which is not answered")
    one.add_argument("--write", type=Path, metavar="DIR", help="new folder for its files")
    text = "pendulum, leg, arm or walk (hexapod; own only); drawn by default"
    one.add_argument("--machine", help=text)
    text = "effects to hide; drawn by default, none without names"
    one.add_argument("--hide", nargs="*", metavar="EFFECT", help=text)
    text = "hide it between the supply and the motors of a walking hexapod, for gap power"
    one.add_argument("--supply", action="store_true", help=text)
    return out


def write(options: argparse.Namespace) -> None:
    """Make a trial or nothing; print the command that answers it.

    Raises:
        LegwattError: What cannot be made, or a folder that is not empty.
    """
    folder: Path = options.write
    if folder.is_dir() and any(folder.iterdir()):
        raise LegwattError(f"{folder}: not empty; give a new folder for the trial")
    effects = None if options.hide is None else tuple(options.hide)
    with tempfile.TemporaryDirectory() as scratch:
        trial = (options.seed, 0, Path(scratch) / "trial")
        if options.supply:
            truth = make_supply(*trial, effects)
        else:
            truth = make(options.source, *trial, machine=options.machine, effects=effects)
        shutil.copytree(trial[-1], folder, dirs_exist_ok=True)
    print(f"the truth is in {folder / 'truth.json'}; without looking at it:")
    command = shlex.join(["python", "-m", "pipeline", "gap", *truth["options"]])
    print(f"cd {shlex.quote(str(folder / 'given'))} && {command} --out ../answer")


def run(options: argparse.Namespace) -> int:
    """Run the trials, write their tables, print the rates; 0 where every aim is reached, else 1.

    Raises:
        LegwattError: A number of trials or processes below one. MuJoCo is missing.
    """
    sources = BOTH if options.source == "both" else (options.source,)
    if "mujoco" in sources:
        engine()
    workers = int(options.workers) if options.workers.isdecimal() else options.workers
    if options.trials < 1 or workers == 0:
        raise LegwattError("--trials and --workers start at 1")
    out: Path = options.out
    if not options.resume:
        # What says that trials are done goes first: a kill in between must not be gone on from.
        (out / "answers.jsonl").unlink(missing_ok=True)
        shutil.rmtree(out / "trials", ignore_errors=True)
    found = tables(run_trials(sources, options.seed, options.trials, out, workers))
    for name, table in found.items():
        write_text(out / f"{name}.csv", table.to_csv(index=False))
    for row in found["rates"].itertuples():
        aim = f"; aim {row.aim_low:.0%} to {row.aim_high:.0%}" if row.aim_low >= 0 else ""
        share = f"{row.share:6.1%} ({row.low:.1%} to {row.high:.1%})"
        print(f"{row.source:7}{row.hits:5} of{row.count:5}  {share}  {row.rate}{aim}")
    return int(found["rates"]["reached"].eq(False).any())


def main(arguments: Sequence[str] | None = None) -> int:
    """One trial or many; the exit code."""
    options = parser().parse_args(arguments)
    try:
        if options.seed < 0:
            raise LegwattError("--seed starts at 0")
        with output_errors(options.write or options.out):
            if not options.write:
                return run(options)
            write(options)
    except LegwattError as error:
        print(error, file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("interrupted; finished trials are kept for --resume", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
