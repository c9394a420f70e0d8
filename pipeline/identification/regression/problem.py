"""The least-squares problem of naming: model so far, tolerances, accepted effects, columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from actuators.arrays import Array
from pipeline.effects.base import Effect, Place
from pipeline.identification.regression.design_matrix import (
    Accepted,
    DataSet,
    columns_of_legs,
    residual,
)
from pipeline.identification.regression.normal_equations import (
    BlockSums,
    DesignMatrix,
    block_sums,
    make_design_matrix,
)
from pipeline.identification.regression.tolerances import (
    STRAINS,
    UNCERTAINTY,
    Nuisance,
    grouped,
    nuisance_columns,
    nuisances,
)
from pipeline.logs.prepared.measurement import TRAIN, VALIDATION
from pipeline.machine.machine import MachineModel
from pipeline.simulation.predict import Prediction

#: Log and form of a column, and its place.
_Key = tuple[tuple[object, ...], Place]
#: Whether effects of a joint hardly change them; one per coordinate, each by joint.
_Columns = tuple[bool, list[dict[int, Array]]]
#: Change of a tolerance, in sigmas, after which columns at its joint are computed anew.
_STALE = 0.1
#: Relative step of a nonlinear parameter for its column.
SHAPE_STEP = 1e-4
#: Largest of a tolerance, in its sigmas.
_HELD = 3.0
#: Prior precision of what is not free.
FIXED = 1e9


@dataclass(eq=False)
class Problem:
    """Everything linear about the machine at its present estimate."""

    model: MachineModel  #: Before any effect.
    data_sets: tuple[DataSet, ...]  #: One per log.
    sigma: Array  #: Standard deviation that residuals are judged against, shape (J, C).
    accepted: tuple[Accepted, ...] = ()  #: Effects in the model, in order.
    tolerances: tuple[Nuisance, ...] = ()  #: Always free within their priors.
    #: What the present model holds of each tolerance, in its sigmas.
    held: Array = field(default_factory=lambda: np.zeros(0))
    #: Standard deviation of the noise, shape (J, C).
    floor: Array = field(default_factory=lambda: np.zeros(0))
    uncertainty: float = UNCERTAINTY  #: Of the URDF's bodies [1].
    #: Of the squared residuals, shape (J, C): one over the variance of what is taken for noise, in
    #: floors.
    weights: Array = field(default_factory=lambda: np.zeros(0))
    _columns: dict[_Key, _Columns] = field(default_factory=dict)
    _files: list[Prediction] = field(default_factory=list)
    _start: MachineModel | None = None
    _near: list[Prediction] | None = None
    _at_estimates: dict[tuple[int, int], list[dict[int, Array]]] = field(
        default_factory=dict, init=False
    )

    def __post_init__(self) -> None:
        if not self.tolerances:
            self.tolerances = nuisances(self.model, [b.measurement for b in self.data_sets])
        if self.floor.size == 0:
            self.floor = self.sigma
        if self.held.size == 0:
            self.held = np.zeros(len(self.tolerances))
        if self.weights.size == 0:
            self.weights = np.ones_like(self.sigma)

    @property
    def names(self) -> int:
        """Number of unknowns: tolerances, then coordinates and shape of every accepted effect."""
        return len(self.tolerances) + sum(
            len(a.effect.coordinates) + len(a.nonlinear) for a in self.accepted
        )

    def spans(self) -> list[tuple[slice, slice]]:
        """Unknowns of every accepted effect: its coordinates, its nonlinear parameters."""
        out, at = [], len(self.tolerances)
        for a in self.accepted:
            middle = at + len(a.effect.coordinates)
            out.append((slice(at, middle), slice(middle, middle + len(a.nonlinear))))
            at = middle + len(a.nonlinear)
        return out

    @property
    def current(self) -> MachineModel:
        """The model with tolerances as they are held and all accepted effects."""
        return self._models[-1]

    @property
    def start(self) -> MachineModel:
        """The model with tolerances as they are held."""
        if self._start is None:
            model = self.model
            for n, value in zip(self.tolerances, self.held, strict=True):
                if value:
                    model = n.edit(model, float(value) * n.sigma)
            self._start = model
        return self._start

    @cached_property
    def _models(self) -> list[MachineModel]:
        """With the first 0, 1, ... accepted effects."""
        out = [self.start]
        for a in self.accepted:
            out.append(a.apply(out[-1]))
        return out

    @cached_property
    def predictions(self) -> list[Prediction]:
        """Of the present model, one per log."""
        starts: Sequence[Prediction | None] = self._near or [None] * len(self.data_sets)
        return [
            d.simulator.predict(self.current, start)
            for d, start in zip(self.data_sets, starts, strict=True)
        ]

    def files(self) -> list[Prediction]:
        """Of the model before any effect, one per log.

        What multiplies a channel is counted in multiples of these: (1 + g) (p + F x) is linear in
        g and in (1 + g) x, so that leaving out F does not leave it in what g multiplies.
        """
        if not self._files:
            self._files += [b.simulator.predict(self.model) for b in self.data_sets]
        return self._files

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
            _start=self.start if held is None else None,
            _near=self.predictions,
        )
        before = {id(a) for a in self.accepted}
        after = {id(a) for a in other.accepted}
        moved = [a for a in (*self.accepted, *other.accepted) if id(a) not in (before & after)]
        touched = {joint for a in moved for joint in self._touched(a)}
        scaled = {joint for a in moved if a.effect.rescales for joint in self._touched(a)}
        # Another hold of their motor's tolerances makes joints' columns stale, too.
        touched |= {
            self.model.index(n.place)
            for n, before, after in zip(self.tolerances, self.held, other.held, strict=True)
            if n.kind in ("torque_constant", "resistance") and abs(after - before) > _STALE
        }
        for key, (additive, per_log) in self._columns.items():
            joints = {j for column in per_log for j in column}
            if joints & scaled or (joints & touched and not additive):
                del other._columns[key]
        return other

    def judged(self, uncertainty: float, weights: Array) -> Problem:
        """The problem at another uncertainty of the URDF's bodies and with other weights (J, C)."""
        return replace(
            self,
            uncertainty=uncertainty,
            weights=weights,
            _columns=dict(self._columns),
            _near=self.predictions,
        )

    def _touched(self, a: Accepted) -> set[int]:
        owners = [p.partition("__")[0] for p in a.place]  # of a column of the log
        if owners and all(p in self.model.joints for p in owners):
            return {self.model.index(p) for p in owners}
        return set(range(len(self.model.joints)))

    def columns(
        self, log: int, effect: Effect, place: Place, shape: Mapping[str, float]
    ) -> list[dict[int, Array]]:
        """Columns of a candidate in one log, kept until a joint they touch changes."""
        form = (log, effect.name, *(c.name for c in effect.coordinates), *sorted(shape.items()))
        if (form, place) not in self._columns:
            kept = effect.additive or effect.rescales
            data_set = self.data_sets[log]
            base = self.files()[log] if effect.rescales else self.predictions[log]
            every = columns_of_legs(data_set, base, effect, place, shape, self.sigma)
            for sibling, columns in every:
                self._columns[form, sibling] = kept, columns
        return self._columns[form, place][1]

    def tolerance_columns(self, log: int) -> list[dict[int, Array]]:
        """Columns of the tolerances, per standard deviation of each."""
        data_set = self.data_sets[log]
        keys = {id(n): ((log, n.kind), (n.place,)) for n in self.tolerances}
        for group in grouped(self.model, data_set.measurement, self.tolerances):
            if any(keys[id(n)] not in self._columns for n in group):
                base = self.predictions[log]
                columns = nuisance_columns(data_set, base, group, self.sigma)
                for n, column in zip(group, columns, strict=True):
                    self._columns[keys[id(n)]] = True, [column]  # a tolerance is small
        return [self._columns[keys[id(n)]][1][0] for n in self.tolerances]

    def accepted_columns(self, log: int) -> list[dict[int, Array]]:
        """Columns of the accepted effects' coordinates at their estimates, scales at the files."""
        return [
            column
            for number, a in enumerate(self.accepted)
            for column in (
                self.columns(log, a.effect, a.place, a.shape)
                if a.effect.rescales
                else self._own(log, number)
            )
        ]

    def _own(self, log: int, number: int) -> list[dict[int, Array]]:
        """Columns of the coordinates of an accepted effect; what is additive has them at zero."""
        a = self.accepted[number]
        if a.effect.additive:
            return self.columns(log, a.effect, a.place, a.shape)
        if (log, number) not in self._at_estimates:
            steps = [(c.name, c.step) for c in a.effect.coordinates]
            self._at_estimates[log, number] = [
                self._moved(log, number, replace(a, x={**a.x, name: a.x[name] + step}), step)
                for name, step in steps
            ]
        return self._at_estimates[log, number]

    def _nonlinear_columns(self, log: int, number: int) -> list[dict[int, Array]]:
        """Columns of the nonlinear parameters of an accepted effect."""
        a, out = self.accepted[number], []
        for name, value in a.nonlinear.items():
            step = SHAPE_STEP * max(abs(value), 1e-3)
            moved = replace(a, shape={**a.shape, name: value + step})
            out.append(self._moved(log, number, moved, step))
        return out

    def _moved(self, log: int, number: int, a: Accepted, step: float) -> dict[int, Array]:
        """Column of a change of one accepted effect; joints that it leaves alone are as before."""
        data_set, model, now = self.data_sets[log], self._models[number], self.current
        own = self._touched(a)
        for other in (a, *self.accepted[number + 1 :]):
            if own & self._touched(other):
                model = other.apply(model)
        pairs = enumerate(zip(now.actuators, model.actuators, strict=True))
        actuators = tuple(new if k in own else old for k, (old, new) in pairs)
        moved = replace(now, bodies=model.bodies, actuators=actuators)
        change = data_set.simulator.difference(self.predictions[log], moved)
        return data_set.whitened(change.effort / step, change.joints, self.sigma)

    @cached_property
    def matrices(self) -> list[DesignMatrix]:
        """Columns of all unknowns and the residual of the present model."""
        return [
            make_design_matrix(
                d, self._unknown_columns(k), residual(d, self.predictions[k], self.sigma)
            )
            for k, d in enumerate(self.data_sets)
        ]

    def _unknown_columns(self, log: int) -> list[dict[int, Array]]:
        out = self.tolerance_columns(log)
        for number in range(len(self.accepted)):
            out += [*self._own(log, number), *self._nonlinear_columns(log, number)]
        return out

    @property
    def precision(self) -> Array:
        """Prior precision of the unknowns: one for tolerances, which count in sigmas; else none."""
        out = np.zeros(self.names)
        of_bodies = np.array([n.kind in STRAINS for n in self.tolerances])
        out[: len(self.tolerances)] = np.where(of_bodies, (UNCERTAINTY / self.uncertainty) ** 2, 1)
        for a in self.accepted:
            # Tolerances stand back where an effect is.
            keys = a.effect.absorbs(a.place)
            out[[k for k, n in enumerate(self.tolerances) if (n.kind, n.place) in keys]] = FIXED
        return out

    def inside(self, held: Array) -> Array:
        """Tolerances (n,) in their sigmas inside the bounds of what one can be.

        Beyond a few sigmas it only stands in for an effect not yet found.
        """
        reach = _HELD / np.sqrt(self.precision[: held.size])
        lowest = np.array([n.lowest / n.sigma for n in self.tolerances])
        return np.asarray(np.clip(held, np.maximum(-reach, lowest), reach))

    @property
    def mean(self) -> Array:
        """Where the prior is centred: the tolerances' step that leads back to nothing held."""
        out = np.zeros(self.names)
        out[: len(self.tolerances)] = -self.held
        return out

    @cached_property
    def sums(self) -> BlockSums:
        """Normal equations of the present problem; an effect's torque is at most the effort's."""
        # A torque as large as the effort it touches.
        energy, square = np.zeros(self.names), np.zeros(self.names)
        for k, matrix in enumerate(self.matrices):
            data_set, rows = matrix.data_set, self.head(k)
            m = data_set.measurement
            for j, ids in matrix.ids.items():
                seen = m.effort[data_set.rows[rows], j] * m.mask[data_set.rows[rows], j][:, None]
                effort = np.sum((seen * data_set.weight / self.sigma[j]) ** 2 * self.weights[j])
                own = np.sum(matrix.X[j][:, rows] ** 2 * self.weights[j], axis=(1, 2))
                energy[ids] += own
                square[ids] += np.where(own > 0.0, effort, 0.0)
        out = energy / np.maximum(square, 1e-300)
        out[: len(self.tolerances)] = 0.0
        precision = self.precision + out
        return block_sums(self.matrices, self.weights, precision, self.mean)

    def cost(self) -> float:
        """Twice the negative logarithm of likelihood and prior of what the model holds."""
        out = float(self.precision @ self.mean**2)
        for k, data_set in enumerate(self.data_sets):
            rest = residual(data_set, self.predictions[k], self.sigma)
            for j, r in rest.items():
                out += float(np.sum(r[self.head(k)] ** 2 * self.weights[j]))
        return out

    def head(self, log: int) -> slice:
        """Rows of one log that are not for the test."""
        parts = self.data_sets[log].parts
        return slice(parts[TRAIN].start, parts[VALIDATION].stop)
