"""The least-squares problem of naming: model so far, tolerances, accepted effects, columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.effects.base import Effect, Place
from pipeline.identification.regression.design_matrix import (
    Bench,
    effect_columns,
    make_bench,
    residual,
)
from pipeline.identification.regression.kept import EffectKey, Kept, ToleranceKey
from pipeline.identification.regression.normal_equations import (
    BlockSums,
    Stack,
    block_sums,
    make_stack,
)
from pipeline.identification.regression.tolerances import (
    STRAINS,
    UNCERTAINTY,
    Nuisance,
    grouped,
    nuisance_columns,
    nuisances,
)
from pipeline.logs.prepared.measurement import CHOOSE, FIT, near_rest
from pipeline.machine.machine import MachineModel
from pipeline.simulation.predict import Prediction
from pipeline.simulation.rigid_bodies import legs_are_separate

Array = NDArray[np.float64]
Columns = Sequence[Mapping[int, Array]]


#: Change of a tolerance, in sigmas, after which columns at its joint are computed anew.
_STALE = 0.1
#: Relative step of a nonlinear parameter for its column.
SHAPE_STEP = 1e-4
#: Prior precision of what is not free.
FIXED = 1e9
#: Effects whose like at another leg leaves this leg alone, where legs are separate.
_OF_ONE_LEG = ("link_mass", "center_of_mass_offset", "position_offset")


class _Everywhere:
    """An effect at several places at once, for their columns alone."""

    def __init__(self, effect: Effect, places: Sequence[Place]) -> None:
        self.coordinates = effect.coordinates
        self._effect, self._places = effect, places

    def edit(
        self, model: MachineModel, place: Place, x: Mapping[str, float], shape: Mapping[str, float]
    ) -> MachineModel:
        """The effect everywhere."""
        for other in self._places:
            model = self._effect.edit(model, other, x, shape)
        return model


def _joint_of(model: MachineModel, place: str) -> int:
    """Column of the joint that a link or joint hangs on; -1 for the base."""
    joint = place if place in model.joints else model.carrier(place)
    return model.index(joint) if joint in model.joints else -1


@dataclass(frozen=True)
class Accepted:
    """An effect in the model.

    Attributes:
        effect: The effect.
        place: Where.
        x: Its coordinates.
        shape: Its nonlinear parameters.
    """

    effect: Effect
    place: Place
    x: Mapping[str, float]
    shape: Mapping[str, float]

    def apply(self, model: MachineModel) -> MachineModel:
        """The model with the effect."""
        return self.effect.edit(model, self.place, self.x, self.shape)


@dataclass
class _Computed:
    """What was computed of a problem; None where it was not yet.

    Attributes:
        start: Model with the tolerances as they are held.
        near: Predictions of a problem that it was made from.
        predictions: Of the present model.
        stacks: Columns of all unknowns.
        sums: Normal equations.
    """

    start: MachineModel | None = None
    near: list[Prediction] | None = None
    predictions: list[Prediction] | None = None
    stacks: list[Stack] | None = None
    sums: BlockSums | None = None


@dataclass(eq=False)
class Problem:
    """Everything linear about the machine at its present estimate.

    Attributes:
        model: Before any effect.
        benches: One per log.
        sigma: Standard deviation that residuals are judged against, shape (J, C).
        accepted: Effects in the model, in order.
        tolerances: Always free within their priors.
        held: What the present model holds of each tolerance, in its sigmas.
        floor: Standard deviation of the noise, shape (J, C).
        uncertainty: Of the URDF's bodies [1].
    """

    model: MachineModel
    benches: tuple[Bench, ...]
    sigma: Array
    accepted: tuple[Accepted, ...] = ()
    tolerances: tuple[Nuisance, ...] = ()
    held: Array = field(default_factory=lambda: np.zeros(0))
    floor: Array = field(default_factory=lambda: np.zeros(0))
    uncertainty: float = UNCERTAINTY
    _columns: Kept = field(default_factory=dict)
    _computed: _Computed = field(default_factory=_Computed)

    def __post_init__(self) -> None:
        if not self.tolerances:
            self.tolerances = nuisances(self.model, [b.measurement for b in self.benches])
        if self.floor.size == 0:
            self.floor = self.sigma
        if self.held.size == 0:
            self.held = np.zeros(len(self.tolerances))

    @property
    def names(self) -> int:
        """Number of unknowns: tolerances, then the coordinates of accepted effects."""
        return len(self.tolerances) + sum(len(a.effect.coordinates) for a in self.accepted)

    def span(self, number: int) -> slice:
        """Unknowns of one accepted effect."""
        start = len(self.tolerances)
        for a in self.accepted[:number]:
            start += len(a.effect.coordinates)
        return slice(start, start + len(self.accepted[number].effect.coordinates))

    def current(self) -> MachineModel:
        """The model with tolerances as they are held and all accepted effects."""
        model = self._start()
        for a in self.accepted:
            model = a.apply(model)
        return model

    def without(self, number: int) -> MachineModel:
        """The present model without one of the accepted effects."""
        model = self._start()
        for k, a in enumerate(self.accepted):
            model = model if k == number else a.apply(model)
        return model

    def _start(self) -> MachineModel:
        """The model with tolerances as they are held."""
        if self._computed.start is None:
            model = self.model
            for n, value in zip(self.tolerances, self.held, strict=True):
                if value:
                    model = n.edit(model, float(value) * n.sigma)
            self._computed.start = model
        return self._computed.start

    def predictions(self) -> list[Prediction]:
        """Of the present model, one per log."""
        done = self._computed
        if done.predictions is None:
            model = self.current()
            starts: Sequence[Prediction | None] = done.near or [None] * len(self.benches)
            done.predictions = [
                b.simulator.predict(model, start)
                for b, start in zip(self.benches, starts, strict=True)
            ]
        return done.predictions

    def with_accepted(self, accepted: Sequence[Accepted], held: Array | None = None) -> Problem:
        """The problem at other effects; columns at untouched joints are kept.

        Args:
            accepted: Effects in the model.
            held: What the model holds of each tolerance, in its sigmas; as before by default.
        """
        other = replace(
            self,
            accepted=tuple(accepted),
            held=self.held if held is None else held,
            _columns=dict(self._columns),
            _computed=_Computed(
                start=self._start() if held is None else None, near=self.predictions()
            ),
        )
        before = {id(a) for a in self.accepted}
        after = {id(a) for a in other.accepted}
        moved = [a for a in (*self.accepted, *other.accepted) if id(a) not in (before & after)]
        touched = {joint for a in moved for joint in self._touched(a)}
        scaled = {joint for a in moved if a.effect.rescales for joint in self._touched(a)}
        touched |= self._shifted(self.held, other.held)
        for key, per_log in self._columns.items():
            joints = {j for column in per_log for j in column}
            if joints & scaled or (joints & touched and not key.additive):
                del other._columns[key]
        return other

    def _shifted(self, old: Array, new: Array) -> set[int]:
        """Joints whose columns another hold of their motor's tolerances makes stale."""
        return {
            self.model.index(n.place)
            for n, before, after in zip(self.tolerances, old, new, strict=True)
            if n.kind in ("torque_constant", "resistance") and abs(after - before) > _STALE
        }

    def at_uncertainty(self, uncertainty: float) -> Problem:
        """The problem at another uncertainty of the URDF's bodies; all columns are kept."""
        return replace(
            self,
            uncertainty=uncertainty,
            _columns=dict(self._columns),
            _computed=_Computed(start=self._computed.start, near=self.predictions()),
        )

    def with_model(self, model: MachineModel) -> Problem:
        """The same logs with another model of the machine, no effect and no tolerance taken up.

        Columns at untouched joints are kept.
        """
        before, tolerances = self.model, self.tolerances
        if model.identified != before.identified:
            tolerances = nuisances(model, [b.measurement for b in self.benches])
        other = replace(
            self,
            model=model,
            accepted=(),
            tolerances=tolerances,
            held=np.zeros(len(tolerances)),
            _columns=dict(self._columns),
            _computed=_Computed(near=self.predictions()),
        )
        moved = model.rigid is not before.rigid or model.bodies != before.bodies
        pairs = zip(before.actuators, model.actuators, strict=True)
        touched = {k for k, (old, new) in enumerate(pairs) if moved or old is not new}
        pairs = zip(before.actuators, model.actuators, strict=True)
        scaled = {
            k
            for k, (old, new) in enumerate(pairs)
            if old.motor is not new.motor or old.gains != new.gains
        }
        touched |= self._shifted(self.held, np.zeros_like(self.held))
        for key, per_log in self._columns.items():
            joints = {j for column in per_log for j in column}
            if joints & scaled or (joints & touched and not key.additive):
                del other._columns[key]
        return other

    def _touched(self, a: Accepted) -> set[int]:
        owners = [p.partition("__")[0] for p in a.place]  # of a column of the log
        if owners and all(p in self.model.joints for p in owners):
            return {self.model.index(p) for p in owners}
        return set(range(len(self.model.joints)))

    def columns(
        self, log: int, effect: Effect, place: Place, shape: Mapping[str, float]
    ) -> list[dict[int, Array]]:
        """Columns of a candidate in one log, kept until a joint they touch changes."""
        form = tuple(c.name for c in effect.coordinates)
        key = EffectKey(log, effect.name, place, tuple(sorted(shape.items())), form)
        if key not in self._columns:
            for sibling, columns in self._columns_of_legs(log, effect, place, shape):
                self._columns[replace(key, place=sibling)] = columns
        return self._columns[key]

    def _columns_of_legs(
        self, log: int, effect: Effect, place: Place, shape: Mapping[str, float]
    ) -> list[tuple[Place, list[dict[int, Array]]]]:
        """Columns of a candidate; of the like ones of all legs where one prediction serves all."""
        bench, base = self.benches[log], self.predictions()[log]
        if effect.name not in _OF_ONE_LEG or not legs_are_separate(self.model, bench.measurement):
            return [(place, effect_columns(bench, base, effect, place, shape, self.sigma))]
        places = effect.places(base.model, bench.measurement)
        joint = {p: _joint_of(self.model, p[0]) for p in places}
        at = joint[place] % 3
        group = [p for p in places if joint[p] >= 0 and joint[p] % 3 == at and joint[place] >= 0]
        if len(group) < 2:
            return [(place, effect_columns(bench, base, effect, place, shape, self.sigma))]
        whole = effect_columns(bench, base, _Everywhere(effect, group), place, shape, self.sigma)
        return [
            (p, [{j: c for j, c in column.items() if j // 3 == joint[p] // 3} for column in whole])
            for p in group
        ]

    def tolerance_columns(self, log: int) -> list[dict[int, Array]]:
        """Columns of the tolerances, per standard deviation of each."""
        bench = self.benches[log]
        keys = {id(n): ToleranceKey(log, n.kind, n.place) for n in self.tolerances}
        for group in grouped(self.model, bench.measurement, self.tolerances):
            if any(keys[id(n)] not in self._columns for n in group):
                base = self.predictions()[log]
                columns = nuisance_columns(bench, base, group, self.sigma)
                for n, column in zip(group, columns, strict=True):
                    self._columns[keys[id(n)]] = [column]
        return [self._columns[keys[id(n)]][0] for n in self.tolerances]

    def accepted_columns(self, log: int) -> list[dict[int, Array]]:
        """Columns of the accepted effects at their estimates, without the effect applied twice."""
        out: list[dict[int, Array]] = []
        bench, predictions = self.benches[log], self.predictions()
        for number, a in enumerate(self.accepted):
            for c in a.effect.coordinates:
                moved = replace(a, x={**a.x, c.name: a.x[c.name] + c.step})
                model = self._start()
                for k, other in enumerate(self.accepted):
                    model = (moved if k == number else other).apply(model)
                change = bench.simulator.difference(predictions[log], model)
                out.append(bench.whitened(change.effort / c.step, change.joints, self.sigma))
        return out

    def stacks(self) -> list[Stack]:
        """Columns of all unknowns and the residual of the present model."""
        if self._computed.stacks is None:
            self._computed.stacks = [
                make_stack(
                    bench,
                    [*self.tolerance_columns(k), *self.accepted_columns(k)],
                    residual(bench, self.predictions()[k], self.sigma),
                )
                for k, bench in enumerate(self.benches)
            ]
        return self._computed.stacks

    @property
    def precision(self) -> Array:
        """Prior precision of the unknowns: one for tolerances, which count in sigmas; else none."""
        out = np.zeros(self.names)
        of_bodies = np.array([n.kind in STRAINS for n in self.tolerances])
        out[: len(self.tolerances)] = np.where(of_bodies, (UNCERTAINTY / self.uncertainty) ** 2, 1)
        for a in self.accepted:
            out[self.absorbed(a.effect, a.place)] = FIXED
        return out

    def absorbed(self, effect: Effect, place: Place) -> list[int]:
        """Numbers of the tolerances that stand back where an effect is."""
        keys = effect.absorbs(place)
        return [k for k, n in enumerate(self.tolerances) if (n.kind, n.place) in keys]

    @property
    def mean(self) -> Array:
        """Where the prior is centred: the tolerances' step that leads back to nothing held."""
        out = np.zeros(self.names)
        out[: len(self.tolerances)] = -self.held
        return out

    def sums(self) -> BlockSums:
        """Normal equations of the present problem."""
        if self._computed.sums is None:
            self._computed.sums = block_sums(self.stacks(), self.precision, self.mean)
        return self._computed.sums

    def extended(self, candidate: Sequence[Columns], absorbed: Sequence[int] = ()) -> BlockSums:
        """Normal equations with the columns of a candidate appended.

        Args:
            candidate: Per log, its columns.
            absorbed: Tolerances that stand back for it.
        """
        base = self.sums()
        n, p = base.precision.size, len(candidate[0])
        B = base.s.size
        H, h = np.zeros((B, n + p, n + p)), np.zeros((B, n + p))
        H[:, :n, :n], h[:, :n] = base.H, base.h
        at = 0
        for stack, columns in zip(self.stacks(), candidate, strict=True):
            bench = stack.bench
            for j in sorted({j for column in columns for j in column}):
                mine = [k for k, column in enumerate(columns) if j in column]
                X = np.stack([columns[k][j] for k in mine])
                target = n + np.array(mine)
                ids = stack.ids[j]
                for b in range(bench.block_part.size):
                    rows = slice(int(bench.edges[b]), int(bench.edges[b + 1]))
                    part = X[:, rows].reshape(len(mine), -1)
                    old = stack.X[j][:, rows].reshape(ids.size, -1)
                    cross = part @ old.T
                    H[at + b][np.ix_(target, ids)] += cross
                    H[at + b][np.ix_(ids, target)] += cross.T
                    H[at + b][np.ix_(target, target)] += part @ part.T
                    h[at + b, target] += part @ stack.r[j][rows].ravel()
            at += bench.block_part.size
        precision = np.concatenate([base.precision, np.zeros(p)])
        precision[list(absorbed)] = FIXED
        mean = np.concatenate([base.mean, np.zeros(p)])
        return BlockSums(H, h, base.s, base.count, base.part, precision, mean)

    def with_shapes(self) -> tuple[BlockSums, list[slice]]:
        """Normal equations with a column for every nonlinear parameter of accepted effects.

        Returns:
            The sums, and for each accepted effect where its nonlinear parameters stand.
        """
        per_log: list[list[dict[int, Array]]] = [[] for _ in self.benches]
        spans, at = [], self.names
        for number, a in enumerate(self.accepted):
            spans.append(slice(at, at + len(a.shape)))
            at += len(a.shape)
            for name, value in a.shape.items():
                step = SHAPE_STEP * max(abs(value), 1e-3)
                moved = replace(a, shape={**a.shape, name: value + step})
                model = self._start()
                for k, other in enumerate(self.accepted):
                    model = (moved if k == number else other).apply(model)
                for k, bench in enumerate(self.benches):
                    change = bench.simulator.difference(self.predictions()[k], model)
                    per_log[k].append(
                        bench.whitened(change.effort / step, change.joints, self.sigma)
                    )
        if at == self.names:
            return self.sums(), spans
        return self.extended(per_log), spans

    def rescaled(self, sigma: Array) -> Problem:
        """The problem at another noise level; columns are scaled, not computed anew."""
        share = self.sigma / sigma
        columns: Kept = {
            key: [{j: x * share[j] for j, x in column.items()} for column in per_log]
            for key, per_log in self._columns.items()
        }
        done = _Computed(near=self.predictions())
        return replace(self, sigma=sigma, _columns=columns, _computed=done)

    def richest(self) -> Array:
        """Noise level that even all candidates together would leave, shape (J, C).

        Each joint's residual is fitted with every column computed so far. Where that leaves more
        than the noise floor, the rest is taken for the machine's own scatter: what explains less
        than this is not worth a name.
        """
        out = self.sigma.copy()
        for j in range(out.shape[0]):
            for c in range(out.shape[1]):
                out[j, c] *= max(1.0, self._left(j, c))
        return out

    def _left(self, j: int, c: int) -> float:
        """Root mean square of what is left of one channel, in sigmas."""
        total = np.zeros((0, 0))
        moment, square, rows = np.zeros(0), 0.0, 0
        for log, stack in enumerate(self.stacks()):
            head = self.head(log)
            own = [stack.X[j][k][head, c] for k in range(stack.ids[j].size)]
            for key, per_log in self._columns.items():
                if isinstance(key, EffectKey) and key.log == log:
                    own += [column[j][head, c] for column in per_log if j in column]
            X = np.stack(own) if own else np.empty((0, head.stop - head.start))
            r = stack.r[j][head, c]
            if log == 0:
                total, moment = np.zeros((len(own), len(own))), np.zeros(len(own))
            if len(own) == moment.size:
                total += X @ X.T
                moment += X @ r
                square += float(r @ r)
                good = stack.bench.measurement.mask[stack.bench.rows[head], j]
                rows += int(good.sum() * stack.bench.weight**2)
        if rows <= 2 * moment.size or rows == 0:
            return 1.0
        scale = np.sqrt(np.maximum(np.diag(total), 1e-300))
        values, vectors = np.linalg.eigh(total / np.outer(scale, scale))
        kept = values > 1e-7 * max(float(values.max(initial=0.0)), 1e-300)
        along = vectors[:, kept].T @ (moment / scale)
        left = square - float(np.sum(along**2 / values[kept]))
        return float(np.sqrt(max(left, 0.0) / max(rows - int(kept.sum()), 1)))

    def remasked(self) -> Problem:
        """Without rows in which a coupled motor turns back, where its joint does not."""
        model = self.current()
        benches, changed = [], False
        for bench in self.benches:
            m = bench.measurement
            mask = m.mask.copy()
            for k, a in enumerate(model.actuators):
                if a.coupled_to:
                    speed = model.drivetrains.turned(k, m.v)
                    turning = near_rest(
                        speed[:, None], m.rest_speed[k : k + 1], m.pieces, m.rate, m.bandwidth
                    )[:, 0]
                    mask[turning, k] = False
                    mask[turning, model.index(a.coupled_to)] = False
            if (mask != m.mask).any():
                changed = True
                benches.append(make_bench(replace(m, mask=mask)))
            else:
                benches.append(bench)
        if not changed:
            return self
        return replace(self, benches=tuple(benches), _columns={}, _computed=_Computed())

    def head(self, log: int) -> slice:
        """Rows of *fit* and *choose* of one log's bench."""
        parts = self.benches[log].parts
        return slice(parts[FIT].start, parts[CHOOSE].stop)
