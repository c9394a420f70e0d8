"""Step 5 alone: a stored model checked against a log, without naming anything."""

from __future__ import annotations

from pipeline.effects.base import CHANNEL_UNITS
from pipeline.effects.model_file import Edit
from pipeline.effects.registry import effect_named
from pipeline.identification.results import Estimate, Found, Naming
from pipeline.identification.workflow.locate import Whereabouts
from pipeline.identification.workflow.setup import Setup
from pipeline.identification.workflow.story import Told, cost, gathered
from pipeline.identification.workflow.written import weigh_edits


def check(given: Setup, where: Whereabouts) -> Told:
    """Gap with and without the model file's effects, tolerances estimated anew for every model."""
    channel = where.measurements[0].channels[0]
    unit = CHANNEL_UNITS[channel]
    named = [_found(k, edit, unit) for k, edit in enumerate(given.file.edits, start=1)]
    weighed = weigh_edits(given.bare, where, given.file.edits, named)
    naming = Naming(
        found=weighed.found, candidates=(), tolerances={}, tried=0, channel=channel, unit=unit
    )
    energy = cost(given, weighed.found, known=False)
    return gathered(given, where, naming, weighed, energy, None)


def _found(number: int, edit: Edit, unit: str) -> Found:
    """An edit of the model file as something found."""
    return Found(
        order=number,
        effect=edit.effect,
        place=edit.place,
        parameters=tuple(
            Estimate(p.name, p.value, *p.interval, unit=p.unit) for p in edit.parameters
        ),
        rivals=(),
        valid_before=float("nan"),
        valid_after=float("nan"),
        unit=unit,
        noise_floor=float("nan"),
        excitation=effect_named(edit.effect).excitation,
    )
