"""The verbs twin and blind: hide effects in simulated machines, count how often `gap` is right."""

from __future__ import annotations

import argparse
import shlex
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.atomic import output_errors
from pipeline.cli.options import OUT, AddVerb, named, named_path
from pipeline.errors import PipelineError

if TYPE_CHECKING:
    from pipeline.blind.rates import RateRow


def add_verbs(add: AddVerb) -> None:
    """Declare the verbs."""
    twin = add("twin", "simulate a machine with hidden effects and write its log", run_twin)
    sources = "own: inverse of the true machine; mujoco: forward dynamics with a controller"
    twin.add_argument("--source", default="own", help=f"{sources}; own by default")
    twin.add_argument("--seed", type=int, default=1, help="of the random numbers")
    twin.add_argument("--number", type=int, default=0, help="of the trial; 0")
    text = "pendulum, leg, arm or walk (hexapod; own only); drawn by default"
    twin.add_argument("--machine", help=text)
    text = "effects to hide; drawn by default, none without names"
    twin.add_argument("--hide", nargs="*", metavar="EFFECT", help=text)
    text = "hide it between the supply and the motors of a walking hexapod, for gap power"
    twin.add_argument("--supply", action="store_true", help=text)
    twin.add_argument("--out", type=named_path, required=True, help="new folder for the trial")

    text = "simulate machines with hidden effects and count how often gap finds them"
    blind = add("blind", text, run_blind)
    blind.add_argument(
        "--source", choices=["own", "mujoco", "both"], default="own", help=f"{sources}; own"
    )
    blind.add_argument("--trials", type=int, default=60, help="number per source; 60")
    blind.add_argument("--seed", type=int, default=1, help="of the random numbers")
    blind.add_argument("--workers", type=int, default=2, help="number of processes; 2")
    text = "address of a Dask scheduler whose workers run the trials, e.g. tcp://10.0.0.1:8786"
    blind.add_argument("--scheduler", metavar="ADDRESS", help=text)
    blind.add_argument("--resume", action="store_true", help="go on where a run was stopped")
    text = "folder for everything written"
    blind.add_argument("--out", type=named_path, default=OUT / "blind", help=text)


def run_twin(options: argparse.Namespace) -> int:
    """Make the trial or nothing; print the command that answers it.

    Raises:
        PipelineError: An unknown source, machine or effect, a negative seed or number, options that
            `--supply` has no use for, or a folder that is not empty.
        ReportError: The folder cannot be written.
    """
    from pipeline.blind.machines.supply import make_supply
    from pipeline.blind.machines.trial import make

    if min(options.seed, options.number) < 0:
        raise PipelineError("--seed and --number start at 0")
    if options.supply and (options.machine or options.source != "own"):
        raise PipelineError("--supply is the hexapod's on its own source: no --machine, --source")
    out: Path = options.out
    if any(out.iterdir()):
        raise PipelineError(f"{out}: not empty; give a new folder for the trial")
    effects = None if options.hide is None else tuple(options.hide)
    trial = (options.seed, options.number, out)
    try:
        with output_errors(out):
            if options.supply:
                truth = make_supply(*trial, effects)
            else:
                truth = make(options.source, *trial, machine=options.machine, effects=effects)
    except BaseException:
        shutil.rmtree(out / "given", ignore_errors=True)
        (out / "truth.json").unlink(missing_ok=True)
        raise
    print(f"the truth is in {out / 'truth.json'}; without looking at it:")
    command = shlex.join(["python", "-m", "pipeline", "gap", *truth["options"]])
    print(f"cd {shlex.quote(str(out / 'given'))} && {command} --out ../answer")
    return 0


def run_blind(options: argparse.Namespace) -> int:
    """Run the trials, write their tables, print the rates.

    Returns:
        0 where every aim is reached, else 1.

    Raises:
        PipelineError: Unusable options, MuJoCo or Dask missing, or a trial that cannot be made.
        ReportError: The folder cannot be written.
    """
    from pipeline.blind.machines.forward import engine
    from pipeline.blind.machines.hidden import BOTH
    from pipeline.blind.rates import RateRow, blind_rows
    from pipeline.blind.run import run_trials
    from reports.folder import staged
    from reports.table import table_of
    from reports.writer import write_table

    if min(options.trials, options.workers) < 1 or options.seed < 0:
        raise PipelineError("--trials and --workers start at 1, --seed at 0")
    sources = BOTH if options.source == "both" else (options.source,)
    if "mujoco" in sources:
        engine()
    out: Path = options.out
    with output_errors(out):
        if not options.resume:
            # What says that trials are done goes first: a kill in between must not be gone on from.
            (out / "answers.jsonl").unlink(missing_ok=True)
            shutil.rmtree(out / "trials", ignore_errors=True)
        how = named(options, ("workers", "scheduler"))
        scores = run_trials(sources, options.seed, options.trials, out, **how)
    every, meta = blind_rows(scores), {"options": named(options, ("seed", "trials"))}
    with staged(out, "blind") as folder:
        for kind, rows in every.items():
            write_table(table_of(kind, rows), folder, meta=meta)
    shares: list[RateRow] = every[RateRow]
    for row in shares:
        if row.count:
            print(_line(row))
    return int(any(row.reached is False for row in shares))


def _line(row: RateRow) -> str:
    """A rate in one line: source, counts, share with its interval, aim."""
    text = f"{row.source:7}{row.hits:5} of{row.count:5}  {row.share:6.1%}"
    text += f" ({row.low:.1%} to {row.high:.1%})  {row.meaning}"
    if row.aim_low is None:
        return text
    return f"{text}; aim {row.aim_low:.0%} to {row.aim_high:.0%}"
