"""What has no name: smooth zero-mean columns at every joint, with a variance per kind and joint.

They stand for what a law outside the catalogue may be, as `TorqueTable` lays it out: a torque over
the angle (coarse and fine), friction over the angle or the speed, and memory of the way it came.
They come last, joint by joint, with the names' independent samples held, each kind kept where
left-out chunks gain, so that in a clean log they are absent. A name that does not stand beside
them, or in whose place they are likelier, may be a part of what has none. Torque logs only: there a
torque at the joint is a column as it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from actuators.arrays import Array
from actuators.elements.torque_table import TorqueTable
from actuators.shaft import ShaftSeries
from pipeline.effects.base import Coordinate
from pipeline.identification.design import Design, Term
from pipeline.identification.fit import Fit, settled
from pipeline.identification.settings import SHARE, SURE
from pipeline.identification.tolerances import Tolerance
from pipeline.logs.log import Log

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
#: Share of the largest column's square below which a column is not seen.
_SEEN: Final = 1e-6


class General(Tolerance):
    """Columns of one kind at one joint; in no model."""

    def __init__(self, kind: str, count: int) -> None:
        self.name = f"general {kind}"
        self.coordinates = tuple(Coordinate(f"{k}", 1.0, signed=True) for k in range(count))


def knots_of(logs: Sequence[Log], j: int, kind: str) -> tuple[float, ...]:
    """Knots of a kind over the range of all logs; none where the joint does not move."""
    _, by, count = KINDS[kind]
    q = np.concatenate([m.q[:, j] for m in logs])
    if by == "radius":
        return tuple(r for r in _RADII if 2.0 * r < np.ptp(q))
    if by == "angle":
        low, high = np.quantile(q, _ENDS).tolist()
    else:
        low, high = (
            0.0,
            float(np.quantile(np.abs(np.concatenate([m.v[:, j] for m in logs])), 0.995)),
        )
    return tuple(np.linspace(low, high, count).tolist()) if high - low > 1e-6 else ()


def columns_of(logs: Sequence[Log], j: int, kind: str) -> list[Array]:
    """Torque along every log by one at each knot of a kind, (N, n), before the low-pass."""
    (name, by, _), knots, out = KINDS[kind], knots_of(logs, j, kind), []
    empty: dict[str, Any] = {by: knots, name: (0.0,) * len(knots)}
    for m in logs:
        turns = np.tanh(m.v / m.rest_speed) if m.sign is None else m.sign
        series = (m.q, m.v, m.a, np.zeros_like(m.q), turns)
        side = ShaftSeries((m.joints[j],), m.time, *(x[:, [j]] for x in series))
        own = np.zeros((len(m), len(knots)))
        for k in range(len(knots)):
            one = tuple(float(i == k) for i in range(len(knots)))
            own[:, k] = TorqueTable(kind, **{**empty, name: one}).added(side)[:, 0]
        out.append(own)
    return out


def extended(design: Design, kappa: Array, joint: int) -> Design:
    """A design with the general member at one joint's equation of torque.

    A kind with more columns than half of the joint's independent samples would explain anything.
    `kappa`: independent samples per row of every equation.
    """
    logs = [d.measurement for d in design.data_sets]
    terms, columns, size = list(design.terms), list(design.columns), design.size
    place, equations = (design.model.joints[joint],), list(design.equations)
    for number, e in enumerate(design.equations):
        if e.joint != joint or e.channel:
            continue
        own, ids = [e.X], [e.ids]
        for kind in KINDS:
            made = columns_of(logs, joint, kind)
            if not 0 < made[0].shape[1] <= 0.5 * kappa[number] * e.total[3]:
                continue
            pairs = zip(design.data_sets, made, strict=True)
            parts = [
                d.measurement.smooth(x - x.mean(axis=0))[d.rows[d.good(joint)]].T for d, x in pairs
            ]
            X = np.concatenate(parts, axis=1)
            # A column that hardly any row of the estimate sees would have a size without bound.
            square = (X[:, e.chunk >= 0] ** 2).sum(axis=1)
            X[square < _SEEN * square.max(initial=0.0)] = 0.0
            own.append(X)
            ids.append(np.arange(size, size + len(X)))
            terms.append(Term(General(kind, len(X)), place, block=f"{kind} {place[0]}"))
            columns.append(ids[-1])
            size += len(X)
        equations[number] = replace(e, ids=np.concatenate(ids), X=np.concatenate(own))
    x0 = np.concatenate([design.x0, np.zeros(size - design.size)])
    return replace(
        design,
        terms=tuple(terms),
        columns=tuple(columns),
        equations=tuple(equations),
        x0=x0,
    )


def has_general(design: Design) -> bool:
    """Whether the general member competes: where torques at the joints are columns as they are."""
    torque = design.data_sets[0].measurement.channels == ("torque",)
    return torque and not design.model.floating


def with_general(fit: Fit, joint: int) -> Fit:
    """A fit with the general member at one joint beside its names, their noise held."""
    design = extended(fit.design, fit.kappa, joint)
    more = design.size - fit.design.size
    scales = {t.block: _START for t in design.terms[len(fit.design.terms) :]}
    negative = None if fit.negative is None else np.pad(fit.negative, (0, more))
    scales = {**fit.scales, **scales}
    return settled(replace(fit, design=design, scales=scales, negative=negative, tails=None), _FEW)


def kept_kinds(beside: Fit, names: int) -> tuple[Fit, bool]:
    """The general member where it gains on chunks that were left out, and whether it does.

    Args:
        beside: From `with_general`.
        names: Number of terms before the general member's.
    """
    some = False
    for k in range(names, len(beside.design.terms)):
        own = frozenset(beside.design.columns[k].tolist())
        less = replace(beside, omitted=beside.omitted | own)
        sure, share = beside.sure(less, beside.design.touched(k))
        if sure > SURE and share > SHARE:
            some = True
        else:
            beside = replace(beside, omitted=beside.omitted | own)
    return settled(beside, _FEW), some
