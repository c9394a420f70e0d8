"""The model file that a run writes, held against rows that had no say: the gap that is quoted.

What is quoted, drawn and decides the exit code is the gap of the model *as written*: the edits are
read back from the file's text, put into the machine, and the whole is simulated, with nothing
estimated anew. Names that the file leaves out are listed with what each would close beside it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from pipeline.effects.base import CHANNEL_UNITS
from pipeline.effects.model_file import Edit, EditParameter, apply_edits
from pipeline.effects.registry import effect_named
from pipeline.identification.compare.circumstances import Stage, noise_floor, stages
from pipeline.identification.floor import floor_of
from pipeline.identification.residual import residuals
from pipeline.identification.results import IDLE_NAME, SUSPECTED, Estimate, Found, Residual, named
from pipeline.identification.two_positions import READ_OFF
from pipeline.identification.workflow.compared import Compared
from pipeline.logs.log import TEST
from pipeline.machine.machine import MachineModel

AS_IT_WAS = "model as it was"


@dataclass(frozen=True, eq=False)
class Validated:
    """A model file against the logs."""

    #: Effects, with what each closes on test rows and whether the file holds it.
    found: tuple[Found, ...]
    stages: tuple[Stage, ...]  #: The model as it was, with one effect of the file after another.
    #: Per effect, the stage without it and the stage with it.
    pairs: tuple[tuple[Stage, Stage], ...]
    joints: tuple[int, ...]  #: Per effect, the column at which it shows.
    left: tuple[Residual, ...]  #: What the model as written leaves.
    text: str = ""  #: Of the file; empty where there is none.

    @property
    def unexplained(self) -> bool:
        """Whether the model as written leaves more than noise somewhere."""
        return any(r.significant for r in self.left)


def validate_found(
    model: MachineModel,
    compared: Compared,
    found: Sequence[Found],
    written: Callable[[Sequence[Found]], tuple[tuple[Found, ...], str, tuple[Edit, ...]]],
) -> Validated:
    """Hold what was found against the logs, as far as it is written.

    Args:
        model: Before anything found.
        compared: Steps 1 and 2.
        found: From naming.
        written: From effects to the same with the values that the model file gives them, its text,
            and the edits in it that are theirs, read back.
    """
    while True:
        told, text, edits = written(found)
        kept = [f for f in told if f.kept]
        ends = np.cumsum([len(f.each) for f in kept]).tolist()
        groups = [edits[end - len(f.each) : end] for f, end in zip(kept, ends, strict=True)]
        worse = _worst(model, compared, kept, groups)
        if worse is None:
            found = told
            break
        found = [
            replace(f, level=SUSPECTED, reason=IDLE_NAME) if f.key == worse else f for f in found
        ]
    last = apply_edits(model, edits)
    others = [f for f in found if not f.kept]
    beside = [(named(f), with_found(last, f)) for f in others]
    models = [*_models(model, kept, groups), *beside]
    seen = stages(models, compared.measurements)
    first = len(kept)
    pairs = {f.key: (seen[k], seen[k + 1]) for k, f in enumerate(kept)}
    pairs |= {f.key: (seen[first], seen[first + 1 + k]) for k, f in enumerate(others)}
    return gathered(model, compared, found, seen[: first + 1], pairs, text)


def validate_edits(
    model: MachineModel,
    compared: Compared,
    groups: Sequence[Sequence[Edit]],
    found: Sequence[Found],
) -> Validated:
    """Hold the edits of a model file against the logs.

    Args:
        model: Before the edits.
        compared: Steps 1 and 2.
        groups: Edits of the file, those together that are reported as one.
        found: One per group.
    """
    seen = stages(_models(model, found, groups), compared.measurements)
    # A file may hold an effect twice: each edit has a pair of its own.
    pairs = [(seen[k], seen[k + 1]) for k in range(len(groups))]
    joints = [effect_column(model, f, *pair) for f, pair in zip(found, pairs, strict=True)]
    floor = noise_floor(compared.measurements)
    told = tuple(
        _told(f, pair, j, float(floor[j]), compared, written=True)
        for f, pair, j in zip(found, pairs, joints, strict=True)
    )
    return Validated(told, seen, tuple(pairs), tuple(joints), _left(compared, seen[-1]))


def gathered(
    model: MachineModel,
    compared: Compared,
    found: Sequence[Found],
    seen: tuple[Stage, ...],
    pairs: dict[tuple[str, tuple[str, ...]], tuple[Stage, Stage]],
    text: str,
) -> Validated:
    """Effects with their proofs, those of the file first to last."""
    floor = noise_floor(compared.measurements)
    told, joints, own = [], [], []
    for f in found:
        pair = pairs[f.key]
        j = effect_column(model, f, *pair)
        told.append(_told(f, pair, j, float(floor[j]), compared, written=f.kept))
        joints.append(j)
        own.append(pair)
    left = _left(compared, seen[-1])
    return Validated(tuple(told), seen, tuple(own), tuple(joints), left, text)


def _told(
    f: Found, pair: tuple[Stage, Stage], j: int, floor: float, compared: Compared, *, written: bool
) -> Found:
    return replace(
        f,
        gap_before=float(pair[0].gap[j]),
        gap_after=float(pair[1].gap[j]),
        unit=CHANNEL_UNITS[compared.measurements[0].channels[0]],
        noise_floor=floor,
        written=written,
    )


def _left(compared: Compared, last: Stage) -> tuple[Residual, ...]:
    floor = floor_of(compared.measurements, TEST)
    return residuals(compared.measurements, last.predictions, floor, last.gaps)


def _models(
    model: MachineModel,
    found: Sequence[Found],
    groups: Sequence[Sequence[Edit]],
) -> list[tuple[str, MachineModel]]:
    """Labels and models: as it was, then with one group of edits after another."""
    out, edited = [(AS_IT_WAS, model)], model
    for f, group in zip(found, groups, strict=True):
        edited = apply_edits(edited, group)
        out.append((named(f), edited))
    return out


def _worst(
    model: MachineModel,
    compared: Compared,
    found: Sequence[Found],
    groups: Sequence[Sequence[Edit]],
) -> tuple[str, tuple[str, ...]] | None:
    """The name without which the validation error is smallest, if smaller than with it.

    Naming judges by a linear step; what two positions show, the torque hardly does.
    """
    judged = [k for k, f in enumerate(found) if f.law != READ_OFF]
    whole = [edit for group in groups for edit in group]
    models = [("", apply_edits(model, whole))]
    for k in judged:
        rest = [edit for i, group in enumerate(groups) if i != k for edit in group]
        models.append(("", apply_edits(model, rest)))
    first, *others = stages(models, compared.measurements)
    worst, least = None, 0.0
    for k, less in zip(judged, others, strict=True):
        change = np.nan_to_num(less.valid**2 - first.valid**2)
        share = float(change.sum() / max(np.nansum(first.valid**2), 1e-300))
        if share < least:
            worst, least = found[k].key, share
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
            parameters=_stated(member.parameters),
            source=source,
            level="confirmed" if member.level == "confirmed" else "approximate",
        )
        for one in found
        if one.kept
        for member in one.each
    )


def _stated(parameters: Sequence[Estimate]) -> tuple[EditParameter, ...]:
    return tuple(
        EditParameter(name=p.name, value=p.value, unit=p.unit, interval=(p.low, p.high))
        for p in parameters
    )
