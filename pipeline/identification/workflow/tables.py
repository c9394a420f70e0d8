"""What was tried and what was found, as tables; their columns are declared in `columns.csv`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from pipeline.columns import frame
from pipeline.effects.base import EFFECTS
from pipeline.identification.results import INDISTINGUISHABLE
from pipeline.identification.workflow.outcome import Outcome
from pipeline.machine.machine import MachineModel

if TYPE_CHECKING:
    from pandas import DataFrame


def candidates_table(outcome: Outcome) -> DataFrame:
    """Every effect at every place that was tried; what was found and has rivals says so, too."""
    rivals = {f.key: f.rivals for f in outcome.held.found}
    model, rows = outcome.given.model, []
    for c in outcome.candidates:
        others = rivals.get((c.effect, c.place))
        verdict = c.verdict
        if others:
            names = "; ".join(f"{name} at {', '.join(place)}" for name, place in others)
            verdict = INDISTINGUISHABLE + names
        where = (joint_of(model, c.effect, c.place), "+".join(c.place))
        rows.append((c.effect, *where, c.identifiable, verdict, c.reason))
    return frame("candidates", rows)


def found_table(outcome: Outcome) -> DataFrame:
    """What the model lacked, one row per parameter."""
    model, unit, rows = outcome.given.model, outcome.unit, []
    for f in outcome.held.found:
        gaps = (_known(f.gap_before), _known(f.gap_after), unit, f.noise_floor)
        for edit in f.edits:
            where = (joint_of(model, f.effect, edit.place), "+".join(edit.place))
            for p in edit.parameters:
                value = (p.name, p.value, *p.interval, p.unit)
                head = (f.order, f.effect, f.law, *where)
                rows.append((*head, *value, *gaps, f.level, f.reason, f.written))
    return frame("found", rows)


def _known(value: float) -> float | None:
    """A number, or an empty cell where there is none."""
    return value if math.isfinite(value) else None


def joint_of(model: MachineModel, effect: str, place: Sequence[str]) -> str:
    """The joint at which an effect acts: that carries its link; empty where it acts on all."""
    kind = EFFECTS[effect].place_kind if effect in EFFECTS else "joint"
    if kind == "link" and place:
        return model.robot.links.get(place[0], "")
    owners = [name.partition("__")[0] for name in place]
    return "+".join(name for name in owners if name in model.joints)
