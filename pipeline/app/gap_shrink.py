"""Step 5 alone: a stored model checked against a log, without naming anything."""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np

from pipeline.app.gap_run import Whereabouts
from pipeline.app.gap_setup import Setup
from pipeline.app.gap_stages import Stage, noise_floor, stages
from pipeline.app.gap_story import AS_IT_WAS, TOLERANCES, Told, cost, gathered
from pipeline.app.gap_words import place_text
from pipeline.gap.columns import make_benches
from pipeline.gap.effects.base import CHANNEL_UNITS
from pipeline.gap.effects.registry import effect_named
from pipeline.gap.measurement import CHOOSE, FIT
from pipeline.gap.model_file import apply_edits
from pipeline.gap.nuisance import with_tolerances
from pipeline.gap.problem import Problem
from pipeline.gap.refit import refit, tolerances_of
from pipeline.gap.remainder import remainders
from pipeline.gap.verdict import Estimate, Found, Naming


def check(given: Setup, where: Whereabouts, options: argparse.Namespace) -> Told:
    """Gap with and without the model file's effects, tolerances estimated on *fit* and *choose*."""
    measurements = where.measurements
    sigma = np.sqrt(np.mean([m.noise**2 for m in measurements], axis=0))
    problem = refit(Problem(given.model, make_benches(measurements), sigma))
    sums = problem.sums()
    theta = sums.solve(sums.blocks(FIT, CHOOSE))
    channel = measurements[0].channels[0]
    naming = Naming(
        found=(),
        candidates=(),
        tolerances=tolerances_of(problem),
        remainders=remainders(problem, theta),
        tried=0,
        channel=channel,
        unit=CHANNEL_UNITS[channel],
    )
    models = [(AS_IT_WAS, given.bare), (TOLERANCES, with_tolerances(given.bare, naming.tolerances))]
    for edit in given.file.edits:
        label = f"{edit.effect} at {place_text(edit.place)}"
        models.append((label, apply_edits(models[-1][1], [edit])))
    steps = stages(models, measurements, where.intake.long)
    found = tuple(_found(given, where, k, steps[1:]) for k in range(len(given.file.edits)))
    naming = replace(naming, found=found)
    return gathered(given, where, naming, steps, cost(given, found, known=False), None, options)


def _found(given: Setup, where: Whereabouts, k: int, steps: tuple[Stage, ...]) -> Found:
    """An edit of the model file with its gap before and after."""
    edit = given.file.edits[k]
    before, after = steps[k], steps[k + 1]
    names = [n if n in given.model.joints else given.model.links.get(n, "") for n in edit.place]
    columns = [given.model.index(n) for n in names if n in given.model.joints]
    columns = columns or list(range(len(given.model.joints)))
    return Found(
        order=k + 1,
        effect=edit.effect,
        place=edit.place,
        parameters=tuple(
            Estimate(p.name, p.value, *p.interval, unit=p.unit) for p in edit.parameters
        ),
        rivals=(),
        gap_before=_rms(before.gap[columns]),
        gap_after=_rms(after.gap[columns]),
        unit=CHANNEL_UNITS[where.measurements[0].channels[0]],
        noise_floor=_rms(noise_floor(where.measurements)[columns]),
        excitation=effect_named(edit.effect).excitation,
    )


def _rms(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if known.size else float("nan")
