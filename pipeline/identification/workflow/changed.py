"""What has changed on a machine since its model file was written: things mounted, friction, rest.

A body that a log asks to be another than the model file's is told as the one thing more that hangs
on its link: mass m and first moment m c of the difference, which are what a motion shows; a centre
c only where the mass is clear of nothing. Ends are those of both fits together, as squares; what
lies inside them has not changed and is not told, though the new file holds the better value.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from pipeline.columns import frame
from pipeline.effects.base import effect_named, place_text
from pipeline.effects.bodies import AXES
from pipeline.effects.model_file import Edit, apply_edits
from pipeline.machine.machine import MachineModel
from pipeline.simulation.export import spread

if TYPE_CHECKING:
    from pandas import DataFrame

#: What hangs on a link more than before.
BODY: Final = "body"
_MOMENTS: Final = tuple(f"first moment {axis}" for axis in AXES)


def changes(model: MachineModel, old: Sequence[Edit], new: Sequence[Edit]) -> DataFrame:
    """Numbers that are others than in a model file, by its edits and what a later log showed."""
    bodies = [edit for edit in new if effect_named(edit.effect).place_kind == "link"]
    rows: list[tuple[Any, ...]] = []
    for link in dict.fromkeys(edit.place[0] for edit in bodies):
        own = [edit for edit in bodies if edit.place[0] == link]
        about = [*_body(model, link, [e for e in old if e.place[0] == link], own)]
        if any(low > 0.0 or high < 0.0 for *_, low, high, _ in about[:4]):
            rows += about
    for edit in (edit for edit in new if edit not in bodies):
        for p in edit.parameters:
            if p.name == "factor" and p.interval[0] <= 1.0 <= p.interval[1]:
                continue
            place = place_text(edit.place)
            rows.append((edit.effect, place, p.name, p.value, *p.interval, p.unit))
    return frame("changed", rows)


def _body(
    model: MachineModel, link: str, old: Sequence[Edit], new: Sequence[Edit]
) -> Iterator[tuple[Any, ...]]:
    """Mass, first moment and, where the mass is clear of nothing, centre of what is more."""
    joint = model.carrier(link)
    before, after = (
        m.rigid.inertias[m.rigid.getJointId(joint)] for m in (model, apply_edits(model, new))
    )
    more = after.mass * np.array([1.0, *after.lever]) - before.mass * np.array([1.0, *before.lever])
    spreads = (spread(before, edits, moment=True) for edits in (old, new))
    half = np.hypot(*(0.5 * (high - low) for _, low, high in spreads))
    names, units = ("mass", *_MOMENTS), ("kg", *("kg*m",) * 3)
    for name, value, wide, unit in zip(names, more, half, units, strict=True):
        ends = (float(value - wide), float(value + wide))
        yield (BODY, link, name, float(value), *ends, unit)
    if abs(more[0]) > half[0]:
        for axis, moment, wide in zip(AXES, more[1:], half[1:], strict=True):
            centre = float(moment / more[0])
            # Mass and moment go together: the centre is told better than either.
            off = float(np.hypot(wide, centre * half[0]) / abs(more[0]))
            yield (BODY, link, f"centre {axis}", centre, centre - off, centre + off, "m")
