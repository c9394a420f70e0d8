"""The model file that a run writes, held against rows that had no say: the gap that is quoted.

What is quoted, drawn and decides the exit code is the gap of the model *as written*: its edits are
put into the machine, and the whole is simulated, with nothing estimated anew. Names that the file
leaves out are listed with what each would close beside it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from actuators.arrays import Array
from pipeline.effects.base import effect_named
from pipeline.effects.model_file import Edit, apply_edits
from pipeline.identification.residual import floor_of, gap_of, residuals
from pipeline.identification.results import IDLE_NAME, NOTHING, SUSPECTED, Found, Residual, named
from pipeline.logs.log import TEST, VALIDATION, Log
from pipeline.machine.machine import MachineModel
from pipeline.simulation.predict import Prediction, Simulator

AS_IT_WAS: Final = "model as it was"
#: The table of what has no name.
UNNAMED: Final = "what has no name"


@dataclass(frozen=True, eq=False)
class Stage:
    """One model along all logs."""

    label: str  #: What it has that the one before has not.
    predictions: tuple[Prediction, ...]  #: One per log.
    #: Root mean square on test rows by joint and channel, shape (J, C), NaN where no row counts.
    gaps: Array
    valid: Array  #: The same on validation rows, of the compared channel, shape (J,).

    @property
    def gap(self) -> Array:
        """On test rows, of the compared channel, by joint, shape (J,)."""
        return np.asarray(self.gaps[:, 0])


def stages(models: Sequence[tuple[str, MachineModel]], logs: Sequence[Log]) -> tuple[Stage, ...]:
    """Simulate models one after another; what one shares with the next is computed once."""
    simulators, out = [Simulator(m) for m in logs], list[Stage]()
    for label, model in models:
        before = out[-1].predictions if out else [None] * len(logs)
        pairs = zip(simulators, before, strict=True)
        predictions = tuple(one.predict(model, last) for one, last in pairs)
        proved, valid = (_rms(logs, predictions, part) for part in (TEST, VALIDATION))
        out.append(Stage(label, predictions, proved, valid[:, 0]))
    return tuple(out)


def _rms(logs: Sequence[Log], predictions: Sequence[Prediction], part: int) -> Array:
    """Of the gap on a part, by joint and channel, shape (J, C); NaN without rows."""
    rests = [
        np.stack([gap_of(m, p, c) for c in range(len(m.channels))], axis=-1)[m.part == part]
        for m, p in zip(logs, predictions, strict=True)
    ]
    rest = np.concatenate(rests)
    known = np.isfinite(rest)
    with np.errstate(invalid="ignore"):
        square = (np.where(known, rest, 0.0) ** 2).sum(axis=0)
        return np.asarray(np.sqrt(square / known.sum(axis=0)))


def overall(gap: Array) -> float:
    """Root mean square over joints."""
    known = gap[np.isfinite(gap)]
    return float(np.sqrt(np.mean(known**2))) if known.size else 0.0


def chosen(
    model: MachineModel,
    logs: Sequence[Log],
    found: Sequence[Found],
    alone: Callable[[Sequence[Found]], Sequence[Found]],
) -> list[Found]:
    """What was found, with the values that the names in the model file have without the others.

    Suspected and not written is a name that may be nothing, and one without which the validation
    error is smaller: naming judges by a linear step. `alone`: names as they are without the rest.
    """
    while True:
        anew = {f.key: f for f in alone([f for f in found if f.kept and not f.law])}
        told = [f if f.law else anew.get(f.key, f) for f in found]
        kept = [f for f in told if f.kept]
        out, reason = next((f for f in kept if may_be_nothing(f)), None), NOTHING
        if out is None:
            out, reason = _worst(model, logs, kept), IDLE_NAME
        if out is None:
            return told
        key = out.key
        found = [replace(f, level=SUSPECTED, reason=reason) if f.key == key else f for f in found]


def may_be_nothing(found: Found) -> bool:
    """Whether the interval of a name's only size holds what is no effect at all."""
    effect = effect_named(found.effect)
    if len(effect.coordinates) != 1 or found.law:
        return False
    for edit in found.edits:
        sizes, shape = effect.internal(edit.values)
        nothing = effect.physical(dict.fromkeys(sizes, 0.0), shape)
        ends = {p.name: p.interval for p in edit.parameters if p.name not in shape}
        if any(low <= nothing[name] <= high for name, (low, high) in ends.items()):
            return True
    return False


def _worst(model: MachineModel, logs: Sequence[Log], found: Sequence[Found]) -> Found | None:
    """The name without which the validation error is smallest, if smaller than with it.

    What two positions show, the torque hardly does.
    """
    judged = [f for f in found if not f.law]
    sets = [found, *([f for f in found if f is not one] for one in judged)]
    first, *others = stages([("", with_found(model, own)) for own in sets], logs)
    worst, least = None, 0.0
    for f, less in zip(judged, others, strict=True):
        change = np.nan_to_num(less.valid**2 - first.valid**2)
        share = float(change.sum() / max(np.nansum(first.valid**2), 1e-300))
        if share < least:
            worst, least = f, share
    return worst


def with_found(model: MachineModel, found: Sequence[Found]) -> MachineModel:
    """A machine with findings."""
    return apply_edits(model, [edit for f in found for edit in f.edits])


@dataclass(frozen=True, eq=False)
class Held:
    """A model file against the logs."""

    #: Effects, with what each closes on test rows and whether the file holds it.
    found: tuple[Found, ...]
    stages: tuple[Stage, ...]  #: The model as it was, with one effect of the file after another.
    joints: tuple[int, ...]  #: Per effect, the column at which it shows.
    left: tuple[Residual, ...]  #: What all names in the file leave; a table has no name.


def held_against(
    model: MachineModel, logs: Sequence[Log], found: Sequence[Found], tables: Sequence[Edit] = ()
) -> Held:
    """Hold the edits of a model file against the logs, one effect after another.

    Each effect that is left out is tried beside all of the others. `tables`: what has no name.
    """
    steps = [f for f in found if f.kept]
    models = [(AS_IT_WAS, model)]
    for f in steps:
        models.append((named(f), with_found(models[-1][1], [f])))
    last, names = models[-1][1], len(models)
    models += [(UNNAMED, apply_edits(last, tables))] if tables else []
    whole, others = len(models), [f for f in found if not f.kept]
    seen = stages([*models, *((named(f), with_found(last, [f])) for f in others)], logs)
    pairs = [(f, seen[k], seen[k + 1]) for k, f in enumerate(steps)]
    pairs += [(f, seen[names - 1], seen[whole + k]) for k, f in enumerate(others)]
    joints = tuple(_column(model, *pair) for pair in pairs)
    floor, own = floor_of(logs, TEST), seen[names - 1]
    told = tuple(
        replace(
            f,
            gap_before=float(before.gap[j]),
            gap_after=float(after.gap[j]),
            noise_floor=float(floor[j, 0]),
            written=f.kept,
        )
        for (f, before, after), j in zip(pairs, joints, strict=True)
    )
    left = residuals(logs, own.predictions)
    return Held(told, seen[:whole], joints, left)


def _column(model: MachineModel, found: Found, before: Stage, after: Stage) -> int:
    """Column at which an effect shows: its joint, the one that carries its link, or the largest."""
    for name in found.place if effect_named(found.effect).competes else ():
        owner = name.partition("__")[0]  # of a column of the log
        joint = owner if owner in model.joints else model.robot.links.get(owner, "")
        if joint in model.joints:
            return model.index(joint)
    return int(np.argmax(np.nan_to_num(before.gap - after.gap, nan=-np.inf)))


def edits_of(found: Sequence[Found], source: str) -> tuple[Edit, ...]:
    """Edits of what belongs into a model file, what is only suspected left out."""
    return tuple(
        edit.model_copy(update={"source": source, "level": f.level})
        for f in found
        if f.kept
        for edit in f.edits
    )
