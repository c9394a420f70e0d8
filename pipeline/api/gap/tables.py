"""From the workflow's results to the rows of its tables."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from actuators.arrays import Array
from pipeline.effects.registry import effect_named
from pipeline.identification.results import (
    INDISTINGUISHABLE,
    SUSPECTED,
    Candidate,
    Found,
)
from pipeline.identification.workflow.forward import Drive, by_model
from pipeline.logs.errors import EffectError
from pipeline.machine.machine import MachineModel
from reports.table import Table, table_of
from reports.tables import gap as forward_tables
from reports.tables import gap as tables

JOINED = "+"


def candidates_table(
    candidates: Sequence[Candidate], found: Sequence[Found], model: MachineModel
) -> Table:
    """Rows of `candidates.csv`; what was found and has rivals says so, too."""
    rivals = {(f.effect, f.place): f.rivals for f in found}
    rows = [
        tables.CandidateRow(
            effect=c.effect,
            joint=joint_of(model, c.effect, c.place),
            place=JOINED.join(c.place),
            validation_before=_known(c.before),
            validation_after=_known(c.after),
            unit=c.unit,
            identifiable=c.identifiable,
            verdict=_verdict(c, rivals.get((c.effect, c.place), ())),
            reason=c.reason,
        )
        for c in candidates
    ]
    return table_of(tables.CandidateRow, rows)


def _verdict(c: Candidate, rivals: Sequence[tuple[str, tuple[str, ...]]]) -> str:
    if not rivals:
        return c.verdict
    return INDISTINGUISHABLE + "; ".join(f"{name} at {', '.join(p)}" for name, p in rivals)


def found_table(found: Sequence[Found], model: MachineModel) -> Table:
    """Rows of `found.csv`, one per parameter."""
    rows: list[tables.FoundRow] = []
    for f in found:
        for one in f.each:
            effect = effect_named(f.effect)
            rows += [
                tables.FoundRow(
                    order=f.order,
                    effect=f.effect,
                    law=f.law,
                    amounts_to=JOINED.join(effect.amounts_to(one.values)),
                    joint=joint_of(model, f.effect, one.place),
                    place=JOINED.join(one.place),
                    parameter=p.name,
                    value=p.value,
                    ci_low=p.low,
                    ci_high=p.high,
                    unit=p.unit,
                    gap_before=_known(f.gap_before),
                    gap_after=_known(f.gap_after),
                    gap_unit=f.unit,
                    noise_floor=f.noise_floor,
                    level=SUSPECTED if f.level == SUSPECTED else one.level,
                    reason=f.reason,
                    written=f.written,
                )
                for p in one.parameters
            ]
    return table_of(tables.FoundRow, rows)


def _known(value: float) -> float | None:
    """A number, or an empty cell where there is none."""
    return value if math.isfinite(value) else None


def joint_of(model: MachineModel, effect: str, place: Sequence[str]) -> str:
    """The joint at which an effect acts: that carries its link; empty where it acts on all."""
    if not place:
        return ""
    try:
        kind = effect_named(effect).place_kind
    except EffectError:
        kind = "joint"
    if kind == "link":
        return model.links.get(place[0], "")
    if kind == "effort column":
        owner = place[0].partition("__")[0]
        return owner if owner in model.joints else ""
    return JOINED.join(name for name in place if name in model.joints)


def forward_table(drives: Sequence[Drive], joints: Sequence[str]) -> Table:
    """Rows of `forward.csv`: by model, log and joint, then over all logs."""
    rows = []
    for model, own in by_model(drives).items():
        for j, joint in enumerate(joints):
            misses = [(d.log.name, d.miss[:, j]) for d in own]
            misses.append(("all", np.concatenate([miss for _, miss in misses])))
            rows += [_row(model, log, joint, miss) for log, miss in misses]
    return table_of(forward_tables.ForwardRow, rows)


def _row(model: str, log: str, joint: str, miss: Array) -> forward_tables.ForwardRow:
    size = np.abs(miss[np.isfinite(miss)])
    errors = (float(np.sqrt(np.mean(size**2))), float(np.mean(size)), float(size.max()))
    return forward_tables.ForwardRow(model, log, joint, *errors, int(size.size))


def rollout_tables(drives: Sequence[Drive], joints: Sequence[str]) -> list[Table]:
    """One wide table per log: what the machine did, the model as it was, and with all effects."""
    models = by_model(drives)
    first, last = next(iter(models.values())), list(models.values())[-1]
    return [
        forward_tables.rollout(
            before.log.name,
            joints,
            before.log.time,
            before.log.position,
            before.rollout.position,
            after.rollout.position,
            after.rollout.voltage,
        )
        for before, after in zip(first, last, strict=True)
    ]
