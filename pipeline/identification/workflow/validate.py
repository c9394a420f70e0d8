"""Step 5 alone: a stored model checked against a log, without naming anything."""

from __future__ import annotations

from collections.abc import Sequence

from pipeline.effects.base import CHANNEL_UNITS
from pipeline.effects.model_file import Edit
from pipeline.effects.registry import effect_named
from pipeline.identification.floor import with_noise
from pipeline.identification.results import (
    APPROXIMATE,
    CONFIRMED,
    Estimate,
    Found,
    Member,
    Naming,
)
from pipeline.identification.workflow.compared import Compared
from pipeline.identification.workflow.outcome import Outcome, cost, gathered
from pipeline.identification.workflow.written import validate_edits
from pipeline.simulation.machine import Machine


def check(given: Machine, compared: Compared) -> Outcome:
    """Gap with and without the model file's effects, by the noise that the file states."""
    compared = compared.with_logs(with_noise(compared.measurements, given.stated_file.noise))
    channel = compared.measurements[0].channels[0]
    unit = CHANNEL_UNITS[channel]
    groups = together(given.stated_file.edits)
    named = [_found(k, group, unit) for k, group in enumerate(groups, start=1)]
    validated = validate_edits(given.bare_model, compared, groups, named)
    naming = Naming(
        found=validated.found, candidates=(), tolerances={}, tried=0, channel=channel, unit=unit
    )
    energy = cost(given, validated.found, known=False)
    return gathered(given, compared, naming, validated, energy)


def together(edits: Sequence[Edit]) -> list[list[Edit]]:
    """Edits in order, like ones that follow each other and were fitted together in one group."""
    out: list[list[Edit]] = []
    for edit in edits:
        like = bool(out) and out[-1][0].effect == edit.effect
        if like and not effect_named(edit.effect).competes:
            out[-1].append(edit)
        else:
            out.append([edit])
    return out


def _found(number: int, group: Sequence[Edit], unit: str) -> Found:
    """Edits of the model file as something found."""
    members = tuple(
        Member(
            edit.place,
            tuple(Estimate(p.name, p.value, *p.interval, unit=p.unit) for p in edit.parameters),
            edit.level,
        )
        for edit in group
    )
    first, several = group[0], len(group) > 1
    levels = {edit.level for edit in group}
    return Found(
        order=number,
        effect=first.effect,
        place=tuple(name for edit in group for name in edit.place),
        parameters=() if several else members[0].parameters,
        rivals=(),
        valid_before=float("nan"),
        valid_after=float("nan"),
        unit=unit,
        noise_floor=float("nan"),
        level=CONFIRMED if levels == {CONFIRMED} else APPROXIMATE,
        members=members if several else (),
    )
