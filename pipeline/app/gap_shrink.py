"""Step 5 alone: a stored model checked against a log, without naming anything."""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np

from pipeline.app.gap_run import Whereabouts
from pipeline.app.gap_setup import Setup
from pipeline.app.gap_stages import Stage, noise_floor, stages
from pipeline.app.gap_story import AS_IT_WAS, Told, cost, gathered
from pipeline.app.gap_words import place_text
from pipeline.gap.effects.base import CHANNEL_UNITS
from pipeline.gap.effects.registry import effect_named
from pipeline.gap.measurement import FIT, PROVE, Measurement
from pipeline.gap.model_file import apply_edits
from pipeline.gap.verdict import UNEXPLAINED, Estimate, Found, Naming, Remainder


def check(given: Setup, where: Whereabouts, options: argparse.Namespace) -> Told:
    """Gap with and without the model file's effects.

    A log from which an effect was identified proves on its own held-out part; any other log proves
    from end to end.
    """
    sources = " ".join(edit.source for edit in given.file.edits)
    known = tuple(m if m.sha256 in sources else _all_proves(m) for m in where.measurements)
    where = replace(where, measurements=known)
    models = [(AS_IT_WAS, given.bare)]
    for edit in given.file.edits:
        models.append(
            (f"{edit.effect} at {place_text(edit.place)}", apply_edits(models[-1][1], [edit]))
        )
    steps = stages(models, known)
    found = tuple(_found(given, where, k, steps) for k in range(len(given.file.edits)))
    channel = known[0].channels[0]
    naming = Naming(
        found=found,
        candidates=(),
        tolerances={},
        remainders=_remainders(where, steps[-1]),
        tried=0,
        channel=channel,
        unit=CHANNEL_UNITS[channel],
    )
    return gathered(given, where, naming, steps, cost(given, found, known=False), None, options)


def _all_proves(m: Measurement) -> Measurement:
    return replace(m, part=np.where(m.part >= FIT, PROVE, m.part).astype(np.int8))


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


def _remainders(where: Whereabouts, last: Stage) -> tuple[Remainder, ...]:
    m = where.measurements[0]
    floor = noise_floor(where.measurements)
    unit = CHANNEL_UNITS[m.channels[0]]
    return tuple(
        Remainder(
            joint,
            m.channels[0],
            float(last.gap[j]),
            float(floor[j]),
            unit,
            bool(last.gap[j] > UNEXPLAINED * floor[j]),
            "tolerances of the machine's parts are not taken out here",
        )
        for j, joint in enumerate(m.joints)
        if np.isfinite(last.gap[j])
    )
