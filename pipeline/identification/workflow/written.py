"""The model file that a run writes, held against rows that had no say: the gap that is quoted.

What is quoted, drawn and decides the exit code is the gap of the model *as written*: the edits are
read back from the file's text, put into the machine, and the whole is simulated, with nothing
estimated anew. Names that the file leaves out are listed with what each would close beside it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import Final

import numpy as np

from pipeline.effects.base import CHANNEL_UNITS, effect_named
from pipeline.effects.model_file import Edit, EditParameter, apply_edits
from pipeline.identification.compare.circumstances import Stage, noise_floor, stages
from pipeline.identification.floor import floor_of
from pipeline.identification.residual import residuals
from pipeline.identification.results import IDLE_NAME, NOTHING, SUSPECTED, Found, Residual, named
from pipeline.identification.workflow.compared import Compared
from pipeline.logs.log import TEST
from pipeline.machine.machine import MachineModel

AS_IT_WAS: Final = "model as it was"
#: The table of what has no name.
UNNAMED: Final = "what has no name"
#: An effect of a model file with its edits.
Step = tuple[Found, Sequence[Edit]]


@dataclass(frozen=True, eq=False)
class Validated:
    """A model file against the logs."""

    #: Effects, with what each closes on test rows and whether the file holds it.
    found: tuple[Found, ...]
    stages: tuple[Stage, ...]  #: The model as it was, with one effect of the file after another.
    joints: tuple[int, ...]  #: Per effect, the column at which it shows.
    left: tuple[Residual, ...]  #: What all names in the file leave.
    text: str = ""  #: Of the file; empty where there is none.

    @property
    def unexplained(self) -> bool:
        """Whether the names in the file leave more than noise somewhere."""
        return any(r.significant for r in self.left)


def validate_found(
    model: MachineModel,
    compared: Compared,
    found: Sequence[Found],
    written: Callable[[Sequence[Found], Sequence[Edit]], tuple[Sequence[Found], str, list[Edit]]],
    tables: Callable[[MachineModel], Sequence[Edit]] = lambda model: (),
) -> Validated:
    """Hold what was found against the logs, as far as it is written.

    Args:
        model: Before anything found.
        compared: Steps 1 and 2.
        found: From naming.
        written: From effects and tables to the effects with the values that the model file gives
            them, its text, and the edits in it that are theirs, read back.
        tables: From the model with all names to tables of what has no name.
    """
    while True:
        told, text, edits = written(found, ())
        steps = steps_of([f for f in told if f.kept], edits)
        out, reason = next((f.key for f, _ in steps if may_be_nothing(f)), None), NOTHING
        if out is None:
            out, reason = _worst(model, compared, steps), IDLE_NAME
        if out is None:
            break
        found = [replace(f, level=SUSPECTED, reason=reason) if f.key == out else f for f in found]
    more = tables(apply_edits(model, edits))
    if more:
        _, text, every = written(found, more)
        more = every[len(edits) :]
    return held_against(model, compared, steps, [f for f in told if not f.kept], more, text)


def held_against(
    model: MachineModel,
    compared: Compared,
    steps: Sequence[Step],
    others: Sequence[Found] = (),
    tables: Sequence[Edit] = (),
    text: str = "",
) -> Validated:
    """Hold the edits of a model file against the logs, one effect after another.

    Args:
        model: Before the edits.
        compared: Steps 1 and 2.
        steps: Effects with their edits.
        others: Effects that the file leaves out; each is tried beside all steps.
        tables: Edits of what has no name.
        text: Of the file.
    """
    models = [(AS_IT_WAS, model)]
    for f, edits in steps:
        models.append((named(f), apply_edits(models[-1][1], edits)))
    last, names = models[-1][1], len(models)
    models += [(UNNAMED, apply_edits(last, tables))] if tables else []
    whole = len(models)
    seen = stages([*models, *((named(f), with_found(last, f)) for f in others)], compared.logs)
    pairs = [(f, seen[k], seen[k + 1]) for k, (f, _) in enumerate(steps)]
    pairs += [(f, seen[names - 1], seen[whole + k]) for k, f in enumerate(others)]
    joints = tuple(effect_column(model, *pair) for pair in pairs)
    floor, unit = noise_floor(compared.logs), CHANNEL_UNITS[compared.logs[0].channels[0]]
    told = tuple(
        replace(
            f,
            gap_before=float(before.gap[j]),
            gap_after=float(after.gap[j]),
            unit=unit,
            noise_floor=float(floor[j]),
            written=k < len(steps),
        )
        for k, ((f, before, after), j) in enumerate(zip(pairs, joints, strict=True))
    )
    own = seen[names - 1]  # a table says what, not why: that stays unexplained
    left = residuals(compared.logs, own.predictions, floor_of(compared.logs, TEST), own.gaps)
    return Validated(told, seen[:whole], joints, left, text)


def steps_of(found: Sequence[Found], edits: Sequence[Edit]) -> list[Step]:
    """Effects with their own edits, of a file that has them in this order."""
    ends = np.cumsum([len(f.each) for f in found]).tolist()
    return [(f, edits[end - len(f.each) : end]) for f, end in zip(found, ends, strict=True)]


def may_be_nothing(found: Found) -> bool:
    """Whether the interval of a name's only size holds what is no effect at all."""
    effect = effect_named(found.effect)
    if len(effect.coordinates) != 1 or found.law:
        return False
    for member in found.each:
        sizes, shape = effect.internal({p.name: p.value for p in member.parameters})
        nothing = effect.physical(dict.fromkeys(sizes, 0.0), shape)
        ends = {p.name: (p.low, p.high) for p in member.parameters if p.name not in shape}
        if any(low <= nothing[name] <= high for name, (low, high) in ends.items()):
            return True
    return False


def _worst(
    model: MachineModel, compared: Compared, steps: Sequence[Step]
) -> tuple[str, tuple[str, ...]] | None:
    """The name without which the validation error is smallest, if smaller than with it.

    Naming judges by a linear step; what two positions show, the torque hardly does.
    """
    judged = [f for f, _ in steps if not f.law]
    models = [("", apply_edits(model, [edit for _, edits in steps for edit in edits]))]
    for one in judged:
        rest = [edit for f, edits in steps if f is not one for edit in edits]
        models.append(("", apply_edits(model, rest)))
    first, *others = stages(models, compared.logs)
    worst, least = None, 0.0
    for f, less in zip(judged, others, strict=True):
        change = np.nan_to_num(less.valid**2 - first.valid**2)
        share = float(change.sum() / max(np.nansum(first.valid**2), 1e-300))
        if share < least:
            worst, least = f.key, share
    return worst


def with_found(model: MachineModel, found: Found) -> MachineModel:
    """A machine with a finding, all its members."""
    effect = effect_named(found.effect)
    return reduce(lambda m, one: effect.apply(m, one.place, one.values), found.each, model)


def effect_column(model: MachineModel, found: Found, before: Stage, after: Stage) -> int:
    """Column at which an effect shows: its joint, the one that carries its link, or the largest."""
    for name in () if found.members else found.place:
        owner = name.partition("__")[0]  # of a column of the log
        joint = owner if owner in model.joints else model.links.get(owner, "")
        if joint in model.joints:
            return model.index(joint)
    return int(np.argmax(np.nan_to_num(before.gap - after.gap, nan=-np.inf)))


def edits_of(found: Sequence[Found], source: str) -> tuple[Edit, ...]:
    """Edits of what belongs into a model file, what is only suspected left out.

    Args:
        found: From identification.
        source: The logs and their hashes, in words.
    """
    return tuple(
        Edit(
            effect=one.effect,
            place=member.place,
            parameters=tuple(
                EditParameter(name=p.name, value=p.value, unit=p.unit, interval=(p.low, p.high))
                for p in member.parameters
            ),
            source=source,
            level="confirmed" if member.level == "confirmed" else "approximate",
        )
        for one in found
        if one.kept
        for member in one.each
    )
