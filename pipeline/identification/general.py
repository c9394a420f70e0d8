"""What has no name: smooth zero-mean columns at every joint, with a variance per kind and joint.

They stand for what a law outside the catalogue may be: a torque over the angle (coarse and fine),
friction that depends on the angle or, in no form that has a name, on the speed, and memory of the
way a joint came (play operators: Krasnosel'skii and Pokrovskii, Systems with Hysteresis, 1989).
They come last, with the names' independent samples held, each kind kept where left-out chunks gain,
so that in a clean log they are absent. A name that does not stand beside them may be a part of what
has none. Torque logs only: there a torque at the joint is a column as it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
import pandas as pd

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
COLUMNS: Final = ("joint", "kind", "share")


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


def extended(design: Design, kappa: Array) -> Design:
    """A design with the general member at every joint's equation of torque.

    A joint whose log has fewer independent samples than it has columns has none: they would explain
    anything. `kappa`: independent samples per row of every equation.
    """
    terms, columns, equations = list(design.terms), list(design.columns), []
    size = design.size
    for e, share in zip(design.equations, kappa, strict=True):
        own, ids = [e.X], [e.ids]
        logs = [d.measurement for d in design.data_sets]
        made = [columns_of(m, e.joint, logs) for m in logs]
        if sum(x.shape[1] for x in made[0].values()) > share * e.total[3]:
            made = [{}]
        for kind in made[0] if all(made) else ():
            if any(kind not in one for one in made):
                continue
            parts = []
            for d, one in zip(design.data_sets, made, strict=True):
                m = d.measurement
                rows = d.rows[m.mask[d.rows, e.joint]]
                parts.append(m.smooth(one[kind])[rows].T)
            X = np.concatenate(parts, axis=1)
            place = (design.model.joints[e.joint],)
            own.append(X)
            ids.append(np.arange(size, size + len(X)))
            terms.append(Term(General(kind, len(X)), place, block=f"{kind} {place[0]}"))
            columns.append(ids[-1])
            size += len(X)
        equations.append(replace(e, ids=np.concatenate(ids), X=np.concatenate(own)))
    x0 = np.concatenate([design.x0, np.zeros(size - design.size)])
    return replace(
        design,
        terms=tuple(terms),
        columns=tuple(columns),
        equations=tuple(equations),
        x0=x0,
    )


def with_general(fit: Fit) -> tuple[Fit, pd.DataFrame]:
    """Names beside the general member, and what it takes where it stays.

    Args:
        fit: What is told.

    Returns:
        The fit, and by joint and kind the share of the squared residual that it takes on chunks
        that were left out.
    """
    if fit.design.data_sets[0].measurement.channels != ("torque",) or fit.design.model.floating:
        return fit, pd.DataFrame(columns=list(COLUMNS))
    assert fit.kappa is not None
    design = extended(fit.design, fit.kappa)
    numbers = range(len(fit.design.terms), len(design.terms))
    scales = {**(fit.scales or {}), **{design.terms[k].block: 0.03 for k in numbers}}
    negative = (
        None if fit.negative is None else np.pad(fit.negative, (0, design.size - fit.design.size))
    )
    beside = settled(replace(fit, design=design, scales=scales, negative=negative, tails=None))
    rows = []
    for k in numbers:
        own = frozenset(design.columns[k].tolist())
        less = replace(beside, omitted=beside.omitted | own)
        sure, share = beside.sure(less, design.touched(k))
        if sure > SURE and share > SHARE:
            kind = design.terms[k].block.rpartition(" ")[0]
            rows.append((design.terms[k].place[0], kind, share))
        else:
            beside = replace(beside, omitted=beside.omitted | own)
    beside = settled(beside)
    return beside, pd.DataFrame(rows, columns=list(COLUMNS))
