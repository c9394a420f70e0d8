"""What has no name: a torque table at every joint, with a variance per kind of table and joint.

It stands for what a law outside the catalogue may be, as `TorqueTable` lays it out: a torque over
the angle (coarse and fine), friction over the angle or the speed, and memory of the way it came. It
comes last, joint by joint, with the names' independent samples held, each kind kept where left-out
chunks gain, so that in a clean log it is absent. A name that does not stand beside it, or in whose
place it is likelier, may be a part of what has none. Torque logs only.

What the model *as written* leaves at a joint is laid over the same tables, one kind after another,
as long as chunks of the log that stay out are predicted better: so the file predicts as well as
anything. Nothing of it hangs on time. How it is told: by the share that each kind takes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np
from pandas import DataFrame

from actuators.arrays import Array, Index
from pipeline.columns import frame
from pipeline.effects.base import EFFECTS, Coordinate, Place
from pipeline.effects.model_file import Edit
from pipeline.identification.design import DataSet, Design, Equation, Term, make_design
from pipeline.identification.fit import Fit, settled
from pipeline.identification.settings import CHUNKS, SHARE, SURE, UNEXPLAINED
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
#: Prior standard deviations that are tried, of what is left at the joint.
_SCALES: Final = (0.03, 0.3, 3.0)
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
        less = beside.lacking([k])
        sure, share = beside.sure(less, beside.design.touched(k))
        if sure > SURE and share > SHARE:
            some = True
        else:
            beside = less
    return settled(beside, _FEW), some


def unnamed(
    model: MachineModel, data_sets: Sequence[DataSet], floor: Array, source: str
) -> tuple[tuple[Edit, ...], DataFrame]:
    """Tables of the joints at which left-out chunks gain by one, and the shares that kinds take.

    Torque logs of fixed bases have any.

    Args:
        model: As written.
        data_sets: Rows of the logs.
        floor: Standard deviation of the noise, shape (J, C).
        source: The logs and their hashes, in words.
    """
    edits, rows = [], []
    if data_sets[0].measurement.channels == ("torque",) and not model.robot.floating:
        for j, joint in enumerate(model.joints):
            design = make_design(model, data_sets, general_terms(model, data_sets, j))
            made: dict[General, Index] = {}
            for t, columns in zip(design.terms, design.columns, strict=True):
                assert isinstance(t.effect, General)
                made[t.effect] = columns
            for e in (e for e in design.equations if e.joint == j):
                shares, values = _chosen(e, made, UNEXPLAINED * float(floor[j, 0]))
                rows += [(joint, one.kind, share) for one, share in shares.items()]
                if shares:
                    table = _lists({one: values[made[one]] for one in shares})
                    own = {"effect": "unnamed_torque", "place": (joint,), "level": "approximate"}
                    edits.append(Edit.model_validate({**own, "source": source, "table": table}))
    return tuple(edits), frame("rest", rows)


def _chosen(
    e: Equation, made: Mapping[General, Index], noise: float
) -> tuple[dict[General, float], Array]:
    """Kinds with the share that each takes of what is left at a joint, and values of all columns.

    `noise`: what is left up to it is called noise, of which there is no table.
    """
    chosen: dict[General, float] = {}
    _, _, total, count = e.total
    size, least, scale = float(np.sqrt(total / max(count, 1.0))), total, 0.0
    every = np.concatenate([*made.values(), np.empty(0, int)])
    if count < 2 * CHUNKS or size <= noise:
        return {}, np.zeros(every.size)
    while others := [one for one in made if one not in chosen]:
        tried = []
        for one in others:
            ids = np.concatenate([made[k] for k in (*chosen, one)])
            tried += [(_left_out(e, ids, 1.0 / s), others.index(one), s) for s in _SCALES]
        best, first, wide = min(tried)
        if least - best < SHARE * total:
            break
        chosen[others[first]], least, scale = (least - best) / total, best, wide
    values = np.zeros(every.size)
    if chosen:
        ids = np.concatenate([made[one] for one in chosen])
        at, G, h = np.searchsorted(e.ids, ids), e.total[0], e.total[1]
        values[ids] = _ridge(G[np.ix_(at, at)], h[at], 1.0 / scale)
    return chosen, values


def _lists(tables: Mapping[General, Array]) -> dict[str, list[float]]:
    """Lists of a table; kinds that share knots are brought to the finest."""
    finest = max((t.knots for t in tables if KINDS[t.kind][1] == "angle"), key=len, default=())
    out: dict[str, Array] = {"angle": np.array(finest)} if finest else {}
    for one, values in tables.items():
        name, by, _ = KINDS[one.kind]
        if by == "angle":
            out[name] = np.interp(finest, one.knots, values) + out.get(name, 0.0)
        else:
            out |= {by: np.array(one.knots), name: values}
    return {name: [float(f"{x:.6g}") for x in values] for name, values in out.items()}


def _ridge(G: Array, h: Array, narrow: float) -> Array:
    """Estimates where the prior is so many times narrower than the noise is wide."""
    return np.asarray(np.linalg.solve(G + narrow**2 * np.eye(h.size), h))


def _left_out(e: Equation, ids: Index, narrow: float) -> float:
    """Sum of squares of every chunk by estimates of some columns from the others."""
    own = np.searchsorted(e.ids, ids)
    (G, h), s = e.by_chunk(own), e.sums[1]
    left = 0.0
    for c in range(CHUNKS):
        x = _ridge(G.sum(axis=0) - G[c], h.sum(axis=0) - h[c], narrow)
        left += float(s[c] - 2.0 * h[c] @ x + x @ G[c] @ x)
    return left
