"""The tables of the gap workflow; their columns are declared in `pipeline/columns.csv`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from actuators.errors import LegwattError
from pipeline.columns import frame, series
from pipeline.effects.base import effect_named
from pipeline.identification.results import INDISTINGUISHABLE, SUSPECTED, Candidate, Found
from pipeline.identification.workflow.forward import Drive, by_model
from pipeline.machine.machine import MachineModel

if TYPE_CHECKING:
    from pandas import DataFrame

Tables = dict[str, "DataFrame"]


def records(table: str, rows: Sequence[Any]) -> DataFrame:
    """A table of rows whose attributes are called as its columns."""
    return frame(table, [vars(row) for row in rows])


def candidates_table(
    candidates: Sequence[Candidate], found: Sequence[Found], model: MachineModel
) -> DataFrame:
    """Every effect at every place that was tried; what was found and has rivals says so, too."""
    rivals = {(f.effect, f.place): f.rivals for f in found}
    rows = []
    for c in candidates:
        others = rivals.get((c.effect, c.place))
        verdict = c.verdict
        if others:
            names = "; ".join(f"{name} at {', '.join(place)}" for name, place in others)
            verdict = INDISTINGUISHABLE + names
        where = (joint_of(model, c.effect, c.place), "+".join(c.place))
        gaps = (_known(c.before), _known(c.after), c.unit)
        rows.append((c.effect, *where, *gaps, c.identifiable, verdict, c.reason))
    return frame("candidates", rows)


def found_table(found: Sequence[Found], model: MachineModel) -> DataFrame:
    """What the model lacked, one row per parameter."""
    rows = []
    for f in found:
        for one in f.each:
            where = (joint_of(model, f.effect, one.place), "+".join(one.place))
            level = SUSPECTED if f.level == SUSPECTED else one.level
            gaps = (_known(f.gap_before), _known(f.gap_after), f.unit, f.noise_floor)
            for p in one.parameters:
                value = (p.name, p.value, p.low, p.high, p.unit)
                head = (f.order, f.effect, f.law, *where)
                rows.append((*head, *value, *gaps, level, f.reason, f.written))
    return frame("found", rows)


def _known(value: float) -> float | None:
    """A number, or an empty cell where there is none."""
    return value if math.isfinite(value) else None


def joint_of(model: MachineModel, effect: str, place: Sequence[str]) -> str:
    """The joint at which an effect acts: that carries its link; empty where it acts on all."""
    if not place:
        return ""
    try:
        kind = effect_named(effect).place_kind
    except LegwattError:
        kind = "joint"
    if kind == "link":
        return model.links.get(place[0], "")
    if kind == "effort column":
        owner = place[0].partition("__")[0]
        return owner if owner in model.joints else ""
    return "+".join(name for name in place if name in model.joints)


def forward_tables(drives: Sequence[Drive], joints: Sequence[str]) -> Tables:
    """Errors by model, log and joint, then over all logs; and the motion of each log."""
    models, rows = by_model(drives), []
    for model, own in models.items():
        for j, joint in enumerate(joints):
            misses = [(d.log.name, d.miss[:, j]) for d in own]
            misses.append(("all", np.concatenate([miss for _, miss in misses])))
            for log, miss in misses:
                size = np.abs(miss[np.isfinite(miss)])
                rms = float(np.sqrt(np.mean(size**2)))
                row = (rms, float(np.mean(size)), float(size.max()), int(size.size))
                rows.append((model, log, joint, *row))
    tables = {"forward": frame("forward", rows)}
    first, last = next(iter(models.values())), list(models.values())[-1]
    for before, after in zip(first, last, strict=True):
        values = {
            "measured_position_rad": before.log.position,
            "before_position_rad": before.rollout.position,
            "after_position_rad": after.rollout.position,
            "after_voltage_V": after.rollout.voltage,
        }
        name = f"rollout_{before.log.name}"
        tables[name] = series(before.log.time, {}, joints, values)
    return tables
