"""The verb blind: hide effects in simulated machines, ask `gap`, count how often it is right."""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path

from pipeline.blind.machines.forward import engine
from pipeline.blind.machines.hidden import BOTH
from pipeline.blind.rates import Row, effect_rows, name_rows, rate_rows, trial_row
from pipeline.blind.run import run_trials
from pipeline.errors import PipelineError


def run_blind(options: argparse.Namespace) -> int:
    """Run the trials, write their tables, print the rates.

    Returns:
        0 where every aim is reached, else 1.

    Raises:
        PipelineError: Unusable options, MuJoCo or Dask missing, or a trial that cannot be made.
        ReportError: The folder cannot be written.
    """
    if min(options.trials, options.workers) < 1 or options.seed < 0:
        raise PipelineError("--trials and --workers start at 1, --seed at 0")
    sources = BOTH if options.source == "both" else (options.source,)
    if "mujoco" in sources:
        engine()
    out: Path = options.out
    if not options.resume:
        # What says that trials are done goes first: a kill in between must not be gone on from.
        (out / "answers.jsonl").unlink(missing_ok=True)
        shutil.rmtree(out / "trials", ignore_errors=True)
    scores = run_trials(
        sources,
        options.seed,
        options.trials,
        out,
        workers=options.workers,
        scheduler=options.scheduler,
    )
    trials = [trial_row(s) for s in scores]
    names = [row for s in scores for row in name_rows(s)]
    return write(trials, names, out, {"seed": options.seed, "trials": options.trials})


def write(trials: list[Row], names: list[Row], out: Path, settings: dict[str, int]) -> int:
    """Write the tables and print the rates."""
    from reports.folder import staged
    from reports.tables import blind as tables
    from reports.writer import write_table

    shares = list(rate_rows(trials, names))
    every = {
        tables.TrialRow: trials,
        tables.NameRow: names,
        tables.RateRow: shares,
        tables.EffectRow: list(effect_rows(trials)),
    }
    with staged(out, "blind") as folder:
        for kind, rows in every.items():
            write_table(tables.blind_table(kind, rows), folder, meta={"options": settings})
    for row in shares:
        if row["count"]:
            print(line(row))
    return int(any(row["reached"] is False for row in shares))


def line(row: Row) -> str:
    """A rate in one line: source, counts, share with its interval, aim."""
    text = f"{row['source']:7}{row['hits']:5} of{row['count']:5}  {row['share']:6.1%}"
    text += f" ({row['low']:.1%} to {row['high']:.1%})  {row['meaning']}"
    if row["aim_low"] is None:
        return text
    return f"{text}; aim {row['aim_low']:.0%} to {row['aim_high']:.0%}"
