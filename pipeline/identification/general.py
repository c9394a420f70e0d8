"""What has no name: smooth zero-mean columns at every joint, with a variance per kind and joint.

They stand for what a law outside the catalogue may be: a torque over the angle (coarse and fine),
friction that depends on the angle or, in no form that has a name, on the speed, and memory of the
way a joint came (play operators: Krasnosel'skii and Pokrovskii, Systems with Hysteresis, 1989).
They come last, joint by joint, with the names' independent samples held, each kind kept where
left-out chunks gain, so that in a clean log they are absent. A name that does not stand beside
them, or in whose place they are likelier, may be a part of what has none. Torque logs only: there a
torque at the joint is a column as it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from actuators.arrays import Array
from pipeline.effects.base import Coordinate
from pipeline.identification.design import Design, Term
from pipeline.identification.fit import Fit, settled
from pipeline.identification.settings import SHARE, SURE
from pipeline.identification.tolerances import Tolerance
from pipeline.logs.log import Log

#: Widths of the play operators [rad].
_PLAYS: Final = (0.01, 0.03, 0.1, 0.3)
#: Bumps over the travel: of a torque, of a fine one, of friction; and of friction over the speed.
_BUMPS: Final = {"angle": 9, "fine angle": 40, "friction by angle": 7}
_SPEEDS: Final = 6
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
        self.kind = kind
        self.coordinates = tuple(Coordinate(f"{k}", 1.0, signed=True) for k in range(count))


def columns_of(m: Log, j: int, logs: Sequence[Log]) -> dict[str, Array]:
    """Columns of every kind of one joint, each (N, n), before the low-pass.

    Places and widths are those of all logs together, so that a column is one function in each.
    """
    q, v = m.q[:, j], m.v[:, j]
    if min(np.ptp(one.q[:, j]) for one in logs) < 1e-6:
        return {}
    sign = np.tanh(v / m.rest_speed[j])
    angles = np.quantile(np.concatenate([one.q[:, j] for one in logs]), _ENDS)
    speeds = np.quantile(np.abs(np.concatenate([one.v[:, j] for one in logs])), _ENDS)
    out = {kind: _bumps(q, angles, n) for kind, n in _BUMPS.items()}
    out["friction by angle"] = out["friction by angle"] * sign[:, None]
    out["friction by speed"] = _bumps(np.abs(v), speeds, _SPEEDS) * sign[:, None]
    plays = [r for r in _PLAYS if 2.0 * r < min(np.ptp(one.q[:, j]) for one in logs)]
    if plays:
        out["memory"] = np.stack([_played(m, q, r) for r in plays], axis=1)
    return {kind: x - x.mean(axis=0) for kind, x in out.items()}


def _bumps(x: Array, ends: Array, count: int) -> Array:
    """Gaussian bumps at even places between two ends, (N, count)."""
    places = np.linspace(float(ends[0]), float(ends[1]), count)
    wide = max(float(ends[1] - ends[0]) / (count - 1), 1e-9)
    return np.asarray(np.exp(-0.5 * ((x[:, None] - places) / wide) ** 2))


def _played(m: Log, q: Array, radius: float) -> Array:
    """How far a joint pushes what follows it with a play, -1 to 1, (N,)."""
    out = np.empty_like(q)
    for piece in m.pieces:
        follower = q[piece.start]
        for k in range(piece.start, piece.stop):
            follower = min(max(follower, q[k] - radius), q[k] + radius)
            out[k] = (q[k] - follower) / radius
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
        made = [columns_of(m, joint, logs) for m in logs]
        own, ids = [e.X], [e.ids]
        for kind in made[0]:
            parts = []
            for d, one in zip(design.data_sets, made, strict=True):
                m = d.measurement
                rows = d.rows[m.mask[d.rows, joint]]
                parts.append(m.smooth(one[kind])[rows].T)
            X = np.concatenate(parts, axis=1)
            if len(X) > 0.5 * kappa[number] * e.total[3]:
                continue
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
    assert fit.kappa is not None
    design = extended(fit.design, fit.kappa, joint)
    more = design.size - fit.design.size
    scales = {t.block: _START for t in design.terms[len(fit.design.terms) :]}
    negative = None if fit.negative is None else np.pad(fit.negative, (0, more))
    scales = {**(fit.scales or {}), **scales}
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
