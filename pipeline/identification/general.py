"""What has no name: a torque table at every joint, with a variance per kind of table and joint.

It stands for what a law outside the catalogue may be, as `TorqueTable` lays it out: a torque over
the angle (coarse and fine), friction over the angle or the speed, and memory of the way it came. It
comes last, joint by joint, with the names' independent samples held, each kind kept where left-out
chunks gain, so that in a clean log it is absent. A name that does not stand beside it, or in whose
place it is likelier, may be a part of what has none. Torque logs only.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from pipeline.effects.base import EFFECTS, Coordinate, Place
from pipeline.identification.design import DataSet, Design, Term
from pipeline.identification.fit import Fit, settled
from pipeline.identification.settings import SHARE, SURE
from pipeline.identification.tolerances import Tolerance
from pipeline.machine.machine import MachineModel

#: Kinds, the simplest first, with their list of torques, that of its knots, and how many these are.
KINDS: Final = {
    "angle": ("level", "angle", 9),
    "fine angle": ("level", "angle", 40),
    "friction by angle": ("friction", "angle", 7),
    "friction by speed": ("drag", "speed", 6),
    "memory": ("memory", "radius", 4),
}
#: Half widths of plays [rad].
_RADII: Final = (0.01, 0.03, 0.1, 0.3)
#: Shares of the joint's range between which knots lie.
_ENDS: Final = (0.005, 0.995)
#: Prior scale from which its kinds start, and turns of the updates.
_START: Final = 0.03
_FEW: Final = 6


class General(Tolerance):
    """A table of one kind at one joint: a coordinate for every knot."""

    def __init__(self, kind: str, knots: Sequence[float]) -> None:
        self.name, self.kind, self.knots = f"general {kind}", kind, tuple(knots)
        self.coordinates = tuple(Coordinate(f"{k}", 1.0, signed=True) for k in range(len(knots)))

    def edit(
        self, model: MachineModel, place: Place, x: Mapping[str, float], shape: Mapping[str, float]
    ) -> MachineModel:
        """The machine with the table."""
        torques, by, _ = KINDS[self.kind]
        lists: dict[str, Any] = {
            by: self.knots,
            torques: tuple(x[c.name] for c in self.coordinates),
        }
        return EFFECTS["unnamed_torque"].apply(model, place, lists)


def general_terms(model: MachineModel, data_sets: Sequence[DataSet], j: int) -> list[Term]:
    """Tables of all kinds at a joint, over the range of the rows that estimate."""
    logs = [d.measurement for d in data_sets if (d.chunk >= 0).any()]
    q, v = (np.concatenate([getattr(m, name)[:, j] for m in logs]) for name in "qv")
    ends = {"angle": np.quantile(q, _ENDS), "speed": (0.0, np.quantile(np.abs(v), _ENDS[1]))}
    out = []
    for kind, (_, by, count) in KINDS.items():
        if by == "radius":
            knots = [r for r in _RADII if 2.0 * r < np.ptp(q)]
        else:
            low, high = ends[by]
            knots = np.linspace(low, high, count).tolist() if high - low > 1e-6 else []
        if knots:
            place = (model.joints[j],)
            out.append(Term(General(kind, knots), place, block=f"{kind} {place[0]}"))
    return out


def has_general(design: Design) -> bool:
    """Whether the general member competes."""
    torque = design.data_sets[0].measurement.channels == ("torque",)
    return torque and not design.model.robot.floating


def with_general(fit: Fit, joint: int) -> Fit:
    """A fit with the general member at one joint beside its names, their noise held.

    A kind with more knots than half of the joint's independent samples would explain anything.
    """
    d = fit.design
    k = next(k for k, e in enumerate(d.equations) if e.joint == joint)
    size, samples = d.equations[k].effort, float(fit.kappa[k] * d.equations[k].total[3])
    terms = [
        replace(t, unit=(size,) * len(t.effect.coordinates))
        for t in general_terms(d.model, d.data_sets, joint)
        if len(t.effect.coordinates) <= 0.5 * samples
    ]
    design = d.extended(terms)
    negative = None if fit.negative is None else np.pad(fit.negative, (0, design.size - d.size))
    scales = {**fit.scales, **{t.block: _START for t in terms}}
    return settled(replace(fit, design=design, scales=scales, negative=negative, tails=None), _FEW)


def kept_kinds(beside: Fit, names: int) -> tuple[Fit, bool]:
    """The general member where it gains on chunks that were left out, and whether it does.

    Args:
        beside: From `with_general`.
        names: Number of terms before the general member's.
    """
    some = False
    for k in range(names, len(beside.design.terms)):
        less = replace(beside.lacking([k]), negative=beside.negative)
        sure, share = beside.sure(less, beside.design.touched(k))
        if sure > SURE and share > SHARE:
            some = True
        else:
            beside = less
    return settled(beside, _FEW), some
