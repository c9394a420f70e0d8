"""The regression of all that a model may lack: rows, columns, and their sums by chunk of the log.

A column is the change of the prediction by one unit of a coordinate of an effect, a finite
difference of the effect's own edit along the log, so that what a chain makes of a torque (current,
voltage, losses above a shaft) is in it; those of bodies on a fixed base are one regressor. Columns
are made once about a point; every estimate, trial of a name and left-out chunk after that is a
matter of sums X^T X, X^T r. Values count from the files' model, whatever the point.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array, Index, Mask
from actuators.errors import LegwattError
from pipeline.effects.base import Effect, Place
from pipeline.identification.settings import CHUNKS, MARGIN, SHARE
from pipeline.identification.tolerances import BodyStrain, Slope, Tolerance, inertial, slope
from pipeline.logs.log import TEST, TRAIN, VALIDATION, Log
from pipeline.machine.machine import MachineModel
from pipeline.simulation.equations import Left, OnLegs
from pipeline.simulation.predict import Prediction, Simulator

#: Rows kept per period of the low-pass's cut-off: twice what the sampling theorem asks.
ROWS_PER_PERIOD: Final = 4.0
#: Sets of columns of which sums are kept.
_KEPT: Final = 8
#: Most rows of all logs together.
LARGEST_ROWS: Final = 40_000
#: ... of robots on legs, of which each row holds all joints and the base: half a minute of walking,
#: and a gigabyte.
LARGEST_ON_LEGS: Final = 1500
#: Share of the largest direction of some columns below which one of them is none.
_SAME: Final = 1e-9
#: Share of the largest below which an equation does not see a column, or a sample a joint.
_SEEN: Final = 1e-4
#: On legs its columns are those about the files wherever a design is made: how feet carry the base
#: is all to be computed anew for each, and what an estimate moves changes them by some per cent,
#: which a step on the residual there puts right.
_ABOUT_FILES: Final = "position_offset"
#: Columns of terms by what tells them apart, each by joint.
Made = dict[tuple[Any, ...], list[dict[int, Array]]]
Key = tuple[str, Place]


@dataclass(frozen=True, eq=False)
class Term:
    """An effect at a place with nonlinear parameters of its own: some columns."""

    effect: Effect | Tolerance
    place: Place
    shape: Mapping[str, float] = field(default_factory=dict)
    block: str = ""  #: Whose prior scale it shares; empty where it stands as a name of its own.
    #: Largest scale of its block.
    bound: float = np.inf
    #: Prior standard deviation of each coordinate at a scale of one; the effort's size by default.
    unit: tuple[float, ...] = ()
    #: Multiple of the coordinates' small steps across which its columns look.
    reach: float = 1.0

    @property
    def key(self) -> Key:
        """Effect and place."""
        return self.effect.name, self.place

    @property
    def moves(self) -> Key | None:
        """Name with whose nonlinear parameter it moves, of a slope; else None."""
        return (self.effect.effect, self.place) if isinstance(self.effect, Slope) else None

    @property
    def identity(self) -> tuple[object, ...]:
        """What makes it this one."""
        return (*self.key, self.block, *self.shape.items())

    @property
    def free(self) -> dict[str, float]:
        """Nonlinear parameters that are estimated."""
        fixed = getattr(self.effect, "fixed", ())
        return {name: value for name, value in self.shape.items() if name not in fixed}


@dataclass(frozen=True)
class Placed:
    """A term at its values."""

    term: Term
    x: Mapping[str, float]

    def apply(self, model: MachineModel) -> MachineModel:
        """The model with it."""
        return self.term.effect.edit(model, self.term.place, self.x, self.term.shape)


def placed_in(model: MachineModel, placed: Sequence[Placed]) -> MachineModel:
    """A model with all of some terms, first those that change what its files state."""
    for one in sorted(placed, key=lambda p: not getattr(p.term.effect, "on_stated", False)):
        model = one.apply(model)
    return model


@dataclass(frozen=True, eq=False)
class DataSet:
    """One log's rows."""

    simulator: Simulator  #: Of its motion.
    rows: NDArray[np.intp]  #: Of the measurement, in time's order, shape (R,).
    chunk: NDArray[np.intp]  #: Of every row, -1 for test rows, shape (R,).

    @property
    def measurement(self) -> Log:
        """The log."""
        return self.simulator.measurement

    @cached_property
    def legs(self) -> OnLegs | None:
        """Of a robot on legs the equations of motion at its rows, about what was predicted."""
        whole = self.simulator.on_legs
        return None if whole is None else whole.part(self.rows)

    @cached_property
    def _files(self) -> dict[int, tuple[Prediction, Made]]:
        return {}

    def about(self, model: MachineModel, point: Sequence[Placed]) -> tuple[Prediction, Made]:
        """Prediction at a point, and columns that were made about it; those of files are kept."""
        if point:
            return self.simulator.predict(placed_in(model, point)), {}
        if id(model) not in self._files:
            self._files[id(model)] = self.simulator.predict(model), {}
        return self._files[id(model)]

    @property
    def directions(self) -> int:
        """Joints, and on legs the base's six directions."""
        return len(self.measurement.joints) + 6 * (self.legs is not None)

    def good(self, joint: int) -> Mask:
        """Rows at which a joint is compared, shape (R,); on legs where they say something."""
        if self.legs is None:
            return np.asarray(self.measurement.mask[self.rows, joint])
        size = np.abs(self.legs.sparse[:, joint]).max(axis=1)
        return np.asarray(size > _SEEN * max(float(size.max()), 1e-300))

    def left(
        self, model: MachineModel, near: Prediction | None = None, base: Left | None = None
    ) -> Left:
        """What a model leaves on legs; `near` and `base`: of another, to take equal parts from."""
        assert self.legs is not None
        load, q = self.simulator.load(model, near)[self.rows], self.legs.m.q
        if base is not None and _zeros(model) == _zeros(base.model):
            q = base.q
        elif any(_zeros(model)):
            q = self.simulator.positions(model)[self.rows]
        return self.legs.left(model, load, q, base)

    def left_by(self, model: MachineModel, near: Prediction | None = None) -> list[Rows]:
        """What a model on legs leaves at every joint, then in six directions of the base.

        `near`: a prediction of it.
        """
        assert self.legs is not None
        feet, at = self.legs.about.feet, self.legs.about.joints
        left = self.left(model, near)
        torque = np.zeros_like(left.rigid)
        torque[:, at] = left.load
        rows = (
            self.in_torque(self.legs.weighed(r), model) for r in (left.under(feet.known), torque)
        )
        out = []
        for j, (r, effort) in enumerate(zip(*rows, strict=True)):
            good = self.good(j)
            out.append(Rows(r[good], good, self.chunk[good], effort[good]))
        return out

    def in_torque(self, z: Array, model: MachineModel) -> Array:
        """Weighed rows on legs (R, J + 6) by joint, then by direction of the base, [N*m]."""
        return z.T * self.units(model)[:, None]

    def units(self, model: MachineModel) -> Array:
        """Of weighed rows of every joint, then of a base, shape (J + 6,) [N*m].

        A joint's noise, or the joints' mean, as its sensor shows it: rows of what drives carry
        would fall where a sensor is said to read more, whatever it reads.
        """
        gains = np.abs([a.gains.get("torque", 1.0) for a in model.actuators])
        noise = self.measurement.noise[:, 0] * gains
        base = np.sqrt(np.mean(self.measurement.noise[:, 0] ** 2)) * np.exp(np.log(gains).mean())
        return np.append(noise, np.full(6, base))


def make_data_sets(measurements: Sequence[Log]) -> tuple[DataSet, ...]:
    """Rows of logs: those that estimate and choose in chunks, test rows beside them.

    Rows beyond `ROWS_PER_PERIOD` per period of the cut-off repeat what their neighbours say.

    Raises:
        LegwattError: A part of the data has no usable row in any log.
    """
    for part, name in ((TRAIN, "training"), (VALIDATION, "validation"), (TEST, "test")):
        if not any(((m.part == part) & m.mask.any(axis=1)).any() for m in measurements):
            names = ", ".join(m.name for m in measurements)
            raise LegwattError(f"{names}: no usable {name} row is left; log longer")
    steps = [
        max(1, int(m.rate / (ROWS_PER_PERIOD * m.bandwidth))) if np.isfinite(m.bandwidth) else 1
        for m in measurements
    ]
    legs = measurements[0].standing is not None and measurements[0].channels == ("torque",)
    most = LARGEST_ON_LEGS if legs else LARGEST_ROWS
    thin = sum(len(m) / step for m, step in zip(measurements, steps, strict=True)) / most
    every = []
    for m, step in zip(measurements, steps, strict=True):
        apart = max(1, round(step * max(thin, 1.0)))
        rows = np.concatenate([np.arange(p.start, p.stop, apart) for p in m.pieces])
        every.append(rows[(m.part[rows] >= TRAIN) & m.mask[rows].any(axis=1)])
    said = [
        np.isin(m.part[r], (TRAIN, VALIDATION)) for m, r in zip(measurements, every, strict=True)
    ]
    total, at, out = sum(int(x.sum()) for x in said), 0, []
    for m, rows, own in zip(measurements, every, said, strict=True):
        chunk = np.full(rows.size, -1)
        chunk[own] = (at + np.arange(int(own.sum()))) * CHUNKS // max(total, 1)
        at += int(own.sum())
        out.append(DataSet(Simulator(m), rows, chunk))
    return tuple(out)


@dataclass(frozen=True, eq=False)
class Equation:
    """Rows of one channel of one joint, all logs one after another, masked rows left out.

    On legs each direction of the base stands as one more joint: what is not known of soft ground
    or of where a foot touches it is not alike in all.
    """

    joint: int
    channel: int
    ids: Index  #: Columns that touch it, shape (n,).
    X: Array  #: Shape (n, R), in the channel's unit per unit of the coordinate.
    r: Array  #: What the files' model leaves by these columns, shape (R,).
    chunk: NDArray[np.intp]  #: Of every row, -1 for test rows, shape (R,).
    effort: float  #: Root mean square of the measured effort.

    @cached_property
    def _products(self) -> Array:
        """X X^T of every chunk, (C, n, n), or of all where rows are fewer than these, (1, n, n)."""
        few = self.r.size < CHUNKS * self.ids.size
        rows = [self.chunk >= 0] if few else [self.chunk == c for c in range(CHUNKS)]
        return np.stack([self.X[:, own] @ self.X[:, own].T for own in rows])

    @cached_property
    def sums(self) -> tuple[Array, Array, Array]:
        """X r (C, n), r r and rows (C,) of every chunk."""
        rows = [self.chunk == c for c in range(CHUNKS)]
        h = np.stack([self.X[:, own] @ self.r[own] for own in rows])
        square = np.array([self.r[own] @ self.r[own] for own in rows])
        return h, square, np.array([own.sum() for own in rows], float)

    @cached_property
    def total(self) -> tuple[Array, Array, float, float]:
        """X X^T (n, n), X r (n,), r r and rows of all chunks."""
        h, s, count = (x.sum(axis=0) for x in self.sums)
        return self._products.sum(axis=0), h, float(s), float(count)

    @cached_property
    def least(self) -> Array:
        """What least squares with every column that touches it leave of all chunks' rows, (n,)."""
        H, h = self.total[:2]
        scale = np.sqrt(np.maximum(np.diag(H), 1e-300))
        values, vectors = np.linalg.eigh(H / np.outer(scale, scale))
        kept = values > 1e-7 * max(float(values.max(initial=0.0)), 1e-300)
        x = vectors[:, kept] @ ((vectors[:, kept].T @ (h / scale)) / values[kept]) / scale
        return np.asarray((self.r - x @ self.X)[self.chunk >= 0])

    def by_chunk(self, own: Index) -> tuple[Array, Array]:
        """X X^T (C, m, m) and X r (C, m) of some of its columns, of every chunk."""
        if len(self._products) == CHUNKS:
            return self._products[:, own[:, None], own], self.sums[0][:, own]
        X, rows = self.X[own], [self.chunk == c for c in range(CHUNKS)]
        return np.stack([X[:, c] @ X[:, c].T for c in rows]), self.sums[0][:, own]

    def left(self, x: Array) -> Array:
        """Residual at values (K,) of all columns, shape (R,)."""
        return self.r - x[self.ids] @ self.X

    def level(self, floor: Array) -> float:
        """Its own of a level by joint and channel, shape (J, C); a base has that of all joints."""
        if self.joint < len(floor):
            return float(floor[self.joint, self.channel])
        return float(np.sqrt(np.mean(floor[:, self.channel] ** 2)))


class Grams:
    """Sums of every equation over some columns, and what follows of all of them at once."""

    def __init__(self, design: Design, ids: Index) -> None:
        """Gather them; equations that most columns touch stand in one array, filled with zeros."""
        n, parts, wide = ids.size, list[tuple[Index, Array]](), list[int]()
        for k, (e, where) in enumerate(zip(design.equations, design.local[:, ids], strict=True)):
            at = np.flatnonzero(where >= 0)
            G = e.total[0][where[at][:, None], where[at]]
            if 2 * at.size > n:
                wide.append(k)
                if at.size < n:
                    G, own = np.zeros((n, n)), G
                    G[at[:, None], at] = own
            parts.append((at, G))
        self.h = design.rights[:, ids]  #: X^T r, shape (E, n).
        self._wide = np.array(wide, int)
        self._flat = np.array([parts[k][1].ravel() for k in wide]).reshape(len(wide), n * n)
        self._narrow = [(k, at, G) for k, (at, G) in enumerate(parts) if k not in wide]
        self._last: tuple[bytes, Array, Array] | None = None

    def weighted(self, weights: Array) -> tuple[Array, Array]:
        """X^T X (n, n) and X^T r (n,) of all equations, each with a weight."""
        key, n = weights.tobytes(), self.h.shape[1]
        if self._last is None or self._last[0] != key:
            H = (weights[self._wide] @ self._flat).reshape(n, n)
            for k, at, G in self._narrow:
                H[at[:, None], at] += weights[k] * G
            self._last = key, H, weights @ self.h
        return self._last[1:]

    def traces(self, M: Array) -> Array:
        """Of X^T X M of every equation, M symmetric (n, n), shape (E,)."""
        out = np.empty(len(self.h))
        out[self._wide] = self._flat @ M.ravel()
        for k, at, G in self._narrow:
            out[k] = np.vdot(G, M[at[:, None], at])
        return out


@dataclass(frozen=True, eq=False)
class Design:
    """Everything that competes on some logs, about a point."""

    model: MachineModel  #: The files'.
    data_sets: tuple[DataSet, ...]
    terms: tuple[Term, ...]
    columns: tuple[Index, ...]  #: Numbers of every term's columns.
    equations: tuple[Equation, ...]
    x0: Array  #: Values at the point, shape (K,).
    predictions: tuple[Prediction, ...]  #: At the point, one per log.
    made: tuple[Made, ...] = ()  #: Columns on legs as they were made, one per log.
    kept_of: int = 0  #: Names that competed where all but those that stand are left away.
    _grams: dict[bytes, Grams] = field(default_factory=dict, init=False)
    _standing: dict[tuple[int, ...], Index] = field(default_factory=dict, init=False)
    _within: dict[int, list[int]] = field(default_factory=dict, init=False)

    @property
    def size(self) -> int:
        """Number of columns."""
        return self.x0.size

    @cached_property
    def owner(self) -> Index:
        """Term of every column, shape (K,)."""
        return np.repeat(np.arange(len(self.terms)), [c.size for c in self.columns])

    @cached_property
    def blocks(self) -> list[str]:
        """Of the terms that share a prior scale."""
        return list(dict.fromkeys(t.block for t in self.terms if t.block))

    @cached_property
    def block_of(self) -> Index:
        """Block of every column, -1 without, shape (K,)."""
        number = {b: k for k, b in enumerate(self.blocks)}
        return np.array([number.get(self.terms[k].block, -1) for k in self.owner], int)

    def of(self, names: Sequence[int]) -> Index:
        """Columns of some terms."""
        every = [self.columns[k] for k in names]
        return np.concatenate(every) if every else np.empty(0, int)

    def whole(self, number: int) -> Index:
        """Columns of a name, and of what moves with its nonlinear parameters."""
        key, every = self.terms[number].key, zip(self.terms, self.columns, strict=True)
        return np.concatenate([self.columns[number], *(c for t, c in every if t.moves == key)])

    def within(self, number: int) -> list[int]:
        """Terms at its place with fewer numbers that a term has in it, to `SHARE` of them.

        Dry friction with a level for each direction, say, has Coulomb's and an offset.
        """
        if number not in self._within:
            place = self.terms[number].place
            here = [k for k, t in enumerate(self.terms) if t.place == place]
            ids, effort = self.of(here), np.array([max(e.effort, 1e-300) for e in self.equations])
            H, owner = self.between(effort**-2.0, ids, ids), self.owner[ids]
            # Slopes are in nothing.
            size = [np.inf if self.terms[k].moves else self.columns[k].size for k in owner]
            for k in here:
                w = np.flatnonzero(owner == k)
                fewer = np.flatnonzero(np.array(size) < w.size)
                told = np.linalg.lstsq(H[np.ix_(w, w)], H[np.ix_(w, fewer)], rcond=_SAME)[0]
                mine = np.diag(H)[fewer]
                told = mine - np.sum(H[np.ix_(w, fewer)] * told, axis=0) <= SHARE * mine
                out = set(owner[fewer].tolist()) - set(owner[fewer[~told]].tolist())
                self._within[k] = sorted(out)
        return self._within[number]

    def standing(self, names: tuple[int, ...]) -> Index:
        """Columns of blocks and of names; a name takes what says the same out of its block.

        What moves with a name's nonlinear parameter is nothing without the name.
        """
        if names not in self._standing:
            own = set(names)
            keys = {self.terms[k].key for k in names}
            gone = keys | {self.terms[b].key for k in names for b in self.within(k)}
            kept = [
                k
                for k, t in enumerate(self.terms)
                if k in own or (t.block and t.key not in gone and t.moves in (None, *keys))
            ]
            self._standing[names] = np.concatenate([self.columns[k] for k in kept])
        return self._standing[names]

    @cached_property
    def signed(self) -> NDArray[np.bool_]:
        """Columns that may have either sign, shape (K,)."""
        every = [c.signed for t in self.terms for c in t.effect.coordinates]
        return np.array(every, dtype=np.bool_)

    @cached_property
    def wide(self) -> Array:
        """Prior standard deviation of a name's columns, shape (K,): a torque as measured."""
        out, square = np.ones(self.size), self.squares.sum(axis=0)
        effort = (self.totals[1] * [e.effort**2 for e in self.equations]) @ (self.squares > 0.0)
        live = square > 0.0
        out[live] = np.sqrt(effort[live] / square[live])
        return out

    @cached_property
    def narrow(self) -> Array:
        """Size of a name's columns in practice, shape (K,), no more than `wide`."""
        out = self.wide.copy()
        for term, columns in zip(self.terms, self.columns, strict=True):
            scales = self._scales(term)
            for column, coordinate in zip(columns, term.effect.coordinates, strict=True):
                if coordinate.size:
                    size = coordinate.sized(scales)
                    out[column] = min(out[column], max(size, 1e-300))
        return out

    def _scales(self, term: Term) -> dict[str, float]:
        """Root mean squares at a term's joint and of the robot, by the names that sizes use."""
        joints = list(self.model.joints)
        owners = [p.partition("__")[0] for p in term.place]
        owners = [self.model.robot.links.get(p, p) for p in owners]
        own = [joints.index(p) for p in owners if p in joints] or list(range(len(joints)))

        def rms(x: Array) -> float:
            return max(float(np.sqrt(np.mean(x[:, own] ** 2))), 1e-9)

        m = self.data_sets[0].measurement
        effort = [e.effort for e in self.equations if e.joint in own and not e.channel]
        mass = float(sum(body.mass for body in self.model.robot.model.inertias))
        sensed = max(float(np.mean(effort)) if effort else 0.0, 1e-9)
        return {
            "torque": sensed if m.channels[0] == "torque" else rms(self.predictions[0].torque),
            "speed": rms(m.v),
            "acceleration": rms(m.a),
            "travel": max(float(np.ptp(m.q[:, own], axis=0).max()), 1e-9),
            "effort": sensed,
            "sample": 1.0 / m.rate,
            "mass": mass,
            "weight": 9.81 * mass,
        }

    def tail(self, columns: Index, x: Array) -> Array:
        """Prior standard deviation of names' columns at values x (n,).

        A size far beyond practice is rare and possible: of a density that falls with the square of
        the value, as Cauchy's, the Gaussian that is as wide as the value and as much rarer.
        """
        return np.clip(np.abs(x), self.narrow[columns], self.wide[columns])

    @property
    def competing(self) -> int:
        """Names of which each is one: a design of some of them is judged as the whole is."""
        return self.kept_of or len({t.key for t in self.terms})

    @cached_property
    def name_cost(self) -> float:
        """Logarithm of the prior of one name."""
        return float(-np.log(self.competing + 1) - MARGIN)

    def loose_cost(self, links: int) -> float:
        """Logarithm of the prior of so many wrong bodies, one name: a URDF is rarely off at one."""
        return self.name_cost - MARGIN * (links - 1) if links else 0.0

    @cached_property
    def cost(self) -> Array:
        """Logarithm of the prior of every term as a name, shape (T,).

        All names are equally likely; a nonlinear parameter pays what a coordinate that many rows
        tell does until columns of its own are made: one that the log does not show pays nothing.
        """
        rows = 0.5 * np.log(max(float(np.mean(self.totals[1])), 1.0))
        moving = {t.moves for t in self.terms}
        free = [0 if t.key in moving else len(t.free) for t in self.terms]
        return np.array([self.name_cost - rows * count for count in free])

    @cached_property
    def unit(self) -> Array:
        """Prior standard deviation of a block's columns at a scale of one, shape (K,)."""
        out = self.wide.copy()
        for term, columns in zip(self.terms, self.columns, strict=True):
            if term.unit:
                out[columns] = term.unit
        return out

    def touched(self, number: int) -> list[int]:
        """Equations that a term touches."""
        own = set(self.columns[number].tolist())
        return [k for k, e in enumerate(self.equations) if own & set(e.ids.tolist())]

    @cached_property
    def local(self) -> Index:
        """Of every column its number in every equation, -1 where it does not touch it, (E, K)."""
        out = np.full((len(self.equations), self.size), -1)
        for row, e in zip(out, self.equations, strict=True):
            row[e.ids] = np.arange(e.ids.size)
        return out

    @cached_property
    def rights(self) -> Array:
        """X^T r of every equation, shape (E, K)."""
        return self._spread([e.total[1] for e in self.equations])

    @cached_property
    def squares(self) -> Array:
        """Diagonals of X^T X of every equation, shape (E, K)."""
        return self._spread([np.diag(e.total[0]) for e in self.equations])

    def _spread(self, own: Sequence[Array]) -> Array:
        out = np.zeros((len(self.equations), self.size))
        for row, e, x in zip(out, self.equations, own, strict=True):
            row[e.ids] = x
        return out

    @cached_property
    def totals(self) -> Array:
        """Of every equation r r and rows of all chunks, shape (2, E)."""
        return np.array([e.total[2:] for e in self.equations]).reshape(-1, 2).T

    def between(self, weights: Array, rows: Index, columns: Index) -> Array:
        """X^T X of some columns (n,) with others (m,), every equation with a weight, (n, m)."""
        out = np.zeros((rows.size, columns.size))
        for e, w, at in zip(self.equations, weights, self.local, strict=True):
            i, j = np.flatnonzero(at[rows] >= 0), np.flatnonzero(at[columns] >= 0)
            own = w * e.total[0][at[rows[i]][:, None], at[columns[j]]]
            out[(i[:, None], j) if own.shape != out.shape else ...] += own
        return out

    def apart(self, weights: Array, columns: Index) -> Array:
        """X^T X of sets of columns (T, k), every equation with a weight, (T, k, k)."""
        out = np.zeros((*columns.shape, columns.shape[1]))
        for e, w, at in zip(self.equations, weights, self.local[:, columns], strict=True):
            t = np.flatnonzero((at >= 0).any(axis=1))
            own = at[t]
            seen = (own[:, :, None] >= 0) & (own[:, None] >= 0)
            out[t] += w * np.where(seen, e.total[0][own[:, :, None], own[:, None]], 0.0)
        return out

    def grams(self, ids: Index) -> Grams:
        """Sums over some columns; those asked for last are kept."""
        key = ids.tobytes()
        if key not in self._grams:
            if len(self._grams) >= _KEPT:
                self._grams.pop(next(iter(self._grams)))
            self._grams[key] = Grams(self, ids)
        return self._grams[key]

    def extended(self, terms: Sequence[Term]) -> Design:
        """With more terms, about the files' model."""
        more = make_design(self.model, self.data_sets, terms)
        extra = {(e.joint, e.channel): e for e in more.equations}
        equations = []
        for e in self.equations:
            other = extra.get((e.joint, e.channel))
            if other is not None:
                ids = np.concatenate([e.ids, other.ids + self.size])
                e = replace(e, ids=ids, X=np.concatenate([e.X, other.X]))
            equations.append(e)
        columns = (*self.columns, *(c + self.size for c in more.columns))
        return replace(
            self,
            made=tuple(a | b for a, b in zip(self.made, more.made, strict=True)),
            terms=(*self.terms, *more.terms),
            columns=columns,
            equations=tuple(equations),
            x0=np.concatenate([self.x0, more.x0]),
        )

    def placed(self, x: Array, numbers: Sequence[int]) -> list[Placed]:
        """Some terms at values (K,)."""
        out = []
        for number in numbers:
            term, values = self.terms[number], x[self.columns[number]]
            if values.any():
                names = [c.name for c in term.effect.coordinates]
                own = dict(zip(names, values.tolist(), strict=True))
                for p in getattr(term.effect, "parameters", ()):
                    if p.name in own:  # an estimate on the way may lie where no law is
                        own[p.name] = float(np.clip(own[p.name], p.low, p.high))
                out.append(Placed(term, own))
        return out


def make_design(
    model: MachineModel,
    data_sets: Sequence[DataSet],
    terms: Sequence[Term],
    point: Sequence[Placed] = (),
    before: Design | None = None,
    moved: frozenset[str] = frozenset(),
) -> Design:
    """Columns of terms about a point; terms that change nothing there are left out.

    Args:
        model: The files'.
        data_sets: Of its logs.
        terms: What competes.
        point: Terms, some of `terms`, at the values about which columns are made.
        before: On legs, a design about another point whose columns stay but where something moved:
            what feet carry is all to be computed anew for every column, and what is left at the
            point puts right by how little the others have changed.
        moved: Parts of the places of what moved since.
    """
    values = {p.term.identity: p.x for p in point}
    about = [d.about(model, point) for d in data_sets]
    predictions = tuple(base for base, _ in about)
    if before is not None and point:
        pairs = zip(data_sets, before.predictions, before.made, about, strict=True)
        for d, old, there, (base, here) in pairs:
            here.update(_kept(there, d.units(base.model) / d.units(old.model), moved))
    made = [_columns(model, d, *x, terms, point) for d, x in zip(data_sets, about, strict=True)]
    # A joint without torque that is known has no rows.
    told = {j for d in data_sets for j in range(d.directions) if (d.chunk[d.good(j)] >= 0).any()}
    kept, columns, x0, at = [], [], [], 0
    for number, term in enumerate(terms):
        names = [c.name for c in term.effect.coordinates]
        own = values.get(term.identity, {})
        seen = [any(not told.isdisjoint(log[number][c]) for log in made) for c in range(len(names))]
        if not all(seen) and not (term.block and any(seen)):
            continue
        kept.append(number)
        columns.append(np.arange(at, at + len(names)))
        x0 += [own.get(name, 0.0) for name in names]
        at += len(names)
    flat = [[c for number in kept for c in log[number]] for log in made]
    held = np.array(x0)
    equations = tuple(_equations(data_sets, predictions, flat, held))
    own_terms = tuple(terms[number] for number in kept)
    on_legs = tuple(own if d.legs else {} for d, (_, own) in zip(data_sets, about, strict=True))
    every = (model, tuple(data_sets), own_terms, tuple(columns), equations, held, predictions)
    return Design(*every, on_legs)


def parts_of(place: Place) -> frozenset[str]:
    """Joints, links and columns of a place."""
    return frozenset(part.partition("__")[0] for part in place)


def _kept(made: Made, grown: Array, moved: frozenset[str]) -> Made:
    """Columns of terms at places where nothing moved, by sensors that read so many times more."""
    same = grown == 1.0
    return {
        own: [{j: x if same[j] else grown[j] * x for j, x in c.items()} for c in columns]
        for own, columns in made.items()
        if not parts_of(own[1]) & moved
    }


def _columns(
    model: MachineModel,
    data_set: DataSet,
    base: Prediction,
    made: Made,
    terms: Sequence[Term],
    point: Sequence[Placed],
) -> list[list[dict[int, Array]]]:
    """Of every term its columns of one log, by joint (R, C); those that are `made` are taken."""
    here = None if data_set.legs is None else data_set.left(base.model, base)
    placed = {p.term.key: k for k, p in enumerate(point) if not p.term.block or _made_anew(p.term)}
    out: list[list[dict[int, Array]]] = []
    if here is not None:
        files, grown = data_set.about(model, ())[1], data_set.units(base.model)
        grown = grown / data_set.units(model)
    for term in terms:
        # A block's column is that of the name.
        own = (*term.key, *term.shape.items(), term.reach)
        if here is not None and term.effect.name == _ABOUT_FILES and own in files:
            made[own] = [{j: grown[j] * x for j, x in c.items()} for c in files[own]]
        if own in made and not isinstance(term.effect, Slope):
            out.append(made[own])
            continue
        bodies = _of_strains(data_set, base, term) if here is None else None
        out.append(bodies or [])
        made[own] = out[-1]
        for c in term.effect.coordinates if bodies is None else ():
            step = c.step * term.reach
            if isinstance(term.effect, Slope):
                k = placed[term.effect.effect, term.place]
                shape = dict(point[k].term.shape)
                shape[c.name] += step
                other = replace(point[k], term=replace(point[k].term, shape=shape))
                moved = placed_in(model, [*point[:k], other, *point[k + 1 :]])
            elif _made_anew(term) and term.key in placed:
                k = placed[term.key]
                x = {**point[k].x, c.name: point[k].x[c.name] + step}
                moved = placed_in(model, [*point[:k], replace(point[k], x=x), *point[k + 1 :]])
            else:
                x = {one.name: step * (one is c) for one in term.effect.coordinates}
                moved = term.effect.edit(base.model, term.place, x, term.shape)
            out[-1].append(_change(data_set, base, here, moved, step))
    return out


def _of_strains(data_set: DataSet, base: Prediction, term: Term) -> list[dict[int, Array]] | None:
    """Columns of a link's body by what torques show; None of other terms and where that varies."""
    if not isinstance(term.effect, BodyStrain):
        return None
    model, size = base.model, len(term.effect.coordinates)
    joint = model.carrier(term.place[0])
    now = np.array(model.bodies.body(joint).strain or (0.0,) * size)
    ten = slope(inertial(model, term.place[0]), now)
    seen = data_set.simulator.of_body(base, model.rigid.getJointId(joint), ten)
    if seen is None:
        return None
    smooth, rows = data_set.measurement.smooth, data_set.rows
    every = {j: smooth(x)[rows] for j, x in seen.items()}
    return [{j: x[..., i] for j, x in every.items() if x[..., i].any()} for i in range(size)]


def _change(
    data_set: DataSet, base: Prediction, here: Left | None, moved: MachineModel, step: float
) -> dict[int, Array]:
    """Change of the rows of every joint (R, C), per unit, from one model to another.

    `here`: what the first leaves on legs, else None.
    """
    if here is None or data_set.legs is None:
        smooth, change = data_set.measurement.smooth, data_set.simulator.difference(base, moved)
        return {j: smooth(effort)[data_set.rows] / step for j, effort in change.items()}
    assert base.force is not None
    legs, old, new = data_set.legs, base.model, moved
    z = np.zeros((data_set.rows.size, len(old.joints) + 6))
    if (
        _zeros(new) != _zeros(old)
        or new.bodies.tilt != old.bodies.tilt
        or new.robot is not old.robot
    ):
        there = data_set.left(moved, base, here)
        force = base.force[data_set.rows]
        turned = here.under(force) - there.under(force)
        turned[:, here.moved.joints] += there.load - here.load
        z += legs.weighed(turned)
    elif new.bodies != old.bodies:
        z += legs.of_bodies(here, new.bodies)
    for j, shown in data_set.simulator.drives_apart(base, moved).items():
        z += legs.by_joint[j] * shown[data_set.rows, None]
    rows = data_set.in_torque(z, old)
    largest = max(float(np.abs(x).max(initial=0.0)) for x in rows)
    seen = (np.abs(x).max(initial=0.0) > _SEEN * largest for x in rows)
    return {j: rows[j][:, None] / step for j, is_seen in enumerate(seen) if is_seen}


def _zeros(model: MachineModel) -> list[float]:
    return [a.encoder_offset for a in model.actuators]


def _made_anew(term: Term) -> bool:
    """Whether a second effect on top of the same is another thing than more of it."""
    return getattr(term.effect, "replaces", False)


class Rows(NamedTuple):
    """What a prediction leaves of one channel of one joint in one log."""

    left: Array  #: Shape (R,).
    good: Mask  #: Which rows of the columns they are.
    chunk: NDArray[np.intp]  #: Shape (R,).
    effort: Array  #: As measured, shape (R,).


def rows_left(data_set: DataSet, prediction: Prediction, joint: int, channel: int) -> Rows:
    """Rows that can be compared, of a joint or a direction of a base."""
    m, rows = data_set.measurement, data_set.rows
    if data_set.legs is not None:
        return _left_on_legs(data_set, prediction)[joint]
    good = m.mask[rows, joint]
    smooth = m.smooth(prediction.effort[:, [joint], channel])[rows, 0]
    seen = m.effort[rows, joint, channel]
    return Rows((seen - smooth)[good], good, data_set.chunk[good], seen[good])


def left_at(data_set: DataSet, model: MachineModel, equations: Sequence[Equation]) -> list[Array]:
    """What a model leaves of one log, by equation."""
    if data_set.legs is not None:  # whatever forces of the ground it predicts
        every = data_set.left_by(model)
        return [every[e.joint].left for e in equations]
    predicted = data_set.simulator.predict(model)
    return [rows_left(data_set, predicted, e.joint, e.channel).left for e in equations]


@lru_cache(maxsize=2)
def _left_on_legs(data_set: DataSet, prediction: Prediction) -> list[Rows]:
    """Of all joints at once."""
    return data_set.left_by(prediction.model, prediction)


def _equations(
    data_sets: Sequence[DataSet],
    predictions: Sequence[Prediction],
    columns: Sequence[Sequence[Mapping[int, Array]]],
    held: Array,
) -> list[Equation]:
    first, out = data_sets[0].measurement, []
    for j in range(data_sets[0].directions):
        ids = np.array(sorted({k for own in columns for k, x in enumerate(own) if j in x}), int)
        for c in range(len(first.channels)):
            parts, X = [], []
            for d, own, prediction in zip(data_sets, columns, predictions, strict=True):
                rows = rows_left(d, prediction, j, c)
                part = np.zeros((ids.size, rows.left.size))
                for i, k in enumerate(ids):
                    if j in own[k]:
                        part[i] = own[k][j][rows.good, c]
                X.append(part)
                parts.append(rows)
            said = np.concatenate([rows.chunk for rows in parts])
            if not (said >= 0).any():
                continue
            whole = np.concatenate(X, axis=1)
            effort = np.concatenate([rows.effort for rows in parts])
            out.append(
                Equation(
                    joint=j,
                    channel=c,
                    ids=ids,
                    X=whole,
                    r=np.concatenate([rows.left for rows in parts]) + held[ids] @ whole,
                    chunk=said,
                    effort=float(np.sqrt(np.mean(effort**2))),
                )
            )
    return out
