"""How the prediction changes with each unknown, whitened and cut into blocks.

Every unknown's column comes from the simulation itself by a finite difference, so that losses
upstream of an effect's shaft are in it. Rows are ordered by part of the data and block; a column is
kept only at the joints it touches.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.effects.base import REACH, Coordinate, Effect, Place
from pipeline.logs.prepared.measurement import TEST, TRAIN, VALIDATION, Measurement
from pipeline.machine.machine import MachineModel
from pipeline.simulation.predict import Prediction, Simulator
from pipeline.simulation.rigid_bodies import legs_are_separate

Column = Mapping[int, Array]


class Editing(Protocol):
    """What has coordinates and changes a model: an effect."""

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """As fitted."""

    def edit(
        self, model: MachineModel, place: Place, x: Mapping[str, float], shape: Mapping[str, float]
    ) -> MachineModel:
        """The changed model."""


#: Effects whose like at another leg leaves this leg alone, where legs are separate.
_OF_ONE_LEG = ("link_mass", "center_of_mass_offset", "position_offset")
#: Rows kept per period of the low-pass's cut-off: twice what the sampling theorem asks.
ROWS_PER_PERIOD = 4.0
#: Most informative rows of all logs together.
LARGEST_ROWS = 50_000


@dataclass(frozen=True, eq=False)
class DataSet:
    """One log made ready for least squares."""

    simulator: Simulator  #: Of its motion.
    #: Rows of the measurement that count, ordered by part and block, shape (R,).
    rows: NDArray[np.intp]
    parts: Mapping[int, slice]  #: Part of the data to its range among those rows.
    #: First row of each block among those rows, with the end, shape (B + 1,).
    edges: NDArray[np.intp]
    block_part: NDArray[np.int8]  #: Part of each block, shape (B,).
    weight: float  #: Square root of independent samples per row [1].

    @property
    def measurement(self) -> Measurement:
        """The log."""
        return self.simulator.measurement

    def whitened(self, values: Array, joints: Sequence[int], sigma: Array) -> dict[int, Array]:
        """Series (N, len(joints), C) at the bandwidth, over sigma, masked rows zero, (R, C) each.

        Args:
            values: Before the low-pass.
            joints: Columns they belong to.
            sigma: Shape (J, C).
        """
        m = self.measurement
        smooth = m.smooth(values)[self.rows]
        out = {}
        for k, j in enumerate(joints):
            part = smooth[:, k] * (self.weight / sigma[j])
            part[~m.mask[self.rows, j]] = 0.0
            out[j] = part
        return out


def make_data_set(measurement: Measurement, share: float = 1.0) -> DataSet:
    """Choose rows and order them.

    Rows beyond `ROWS_PER_PERIOD` per period of the cut-off repeat what their neighbours say and
    are skipped at even steps; where the logs together still have more than `LARGEST_ROWS`, whole
    blocks are thinned evenly by `share`, so that every block, part and piece keeps its rows.

    Args:
        measurement: One log.
        share: Of the rows that remain, to keep.
    """
    m = measurement
    wanted = ROWS_PER_PERIOD * m.bandwidth
    step = max(1, int(m.rate / wanted)) if np.isfinite(wanted) else 1
    step = max(1, round(step / share))
    kept = []
    for piece in m.pieces:
        kept.append(np.arange(piece.start, piece.stop, step))
    rows = np.concatenate(kept)
    rows = rows[(m.part[rows] >= TRAIN) & m.mask[rows].any(axis=1)]
    order = np.lexsort((rows, m.block[rows], m.part[rows]))
    rows = rows[order]
    part, block = m.part[rows], m.block[rows]
    new = np.flatnonzero((np.diff(block) != 0) | (np.diff(part) != 0)) + 1
    edges = np.concatenate([[0], new, [rows.size]])
    parts = {
        p: slice(int(np.searchsorted(part, p)), int(np.searchsorted(part, p, side="right")))
        for p in (TRAIN, VALIDATION, TEST)
    }
    independent = 1.0
    if np.isfinite(m.bandwidth):
        independent = min(1.0, 2.0 * m.bandwidth * step / m.rate)
    return DataSet(Simulator(m), rows, parts, edges, part[edges[:-1]], float(np.sqrt(independent)))


def make_data_sets(measurements: Sequence[Measurement]) -> tuple[DataSet, ...]:
    """Benches of several logs, with at most `LARGEST_ROWS` rows together.

    Raises:
        LegwattError: A part of the data has no usable row in any log.
    """
    for part, name in ((TRAIN, "training"), (VALIDATION, "validation"), (TEST, "test")):
        if not any(((m.part == part) & m.mask.any(axis=1)).any() for m in measurements):
            names = ", ".join(m.name for m in measurements)
            raise LegwattError(f"{names}: no usable {name} row is left; log longer")
    data_sets = tuple(make_data_set(m) for m in measurements)
    rows = sum(b.rows.size for b in data_sets)
    if rows <= LARGEST_ROWS:
        return data_sets
    return tuple(make_data_set(m, LARGEST_ROWS / rows) for m in measurements)


def effect_columns(
    data_set: DataSet,
    base: Prediction,
    effect: Editing,
    place: Place,
    shape: Mapping[str, float],
    sigma: Array,
) -> list[dict[int, Array]]:
    """Columns of one effect, one per coordinate, by finite differences.

    Args:
        data_set: The log.
        base: Prediction of the model without the effect.
        effect: The effect.
        place: Where.
        shape: Its nonlinear parameters.
        sigma: Shape (J, C).
    """
    shape = dict(shape)
    reach = shape.pop(REACH, 1.0)
    zero = dict.fromkeys((c.name for c in effect.coordinates), 0.0)
    out = []
    for c in effect.coordinates:
        step = reach * c.step
        moved = effect.edit(base.model, place, zero | {c.name: step}, shape)
        change = data_set.simulator.difference(base, moved)
        out.append(data_set.whitened(change.effort / step, change.joints, sigma))
    return out


def columns_of_legs(
    data_set: DataSet,
    base: Prediction,
    effect: Effect,
    place: Place,
    shape: Mapping[str, float],
    sigma: Array,
) -> list[tuple[Place, list[dict[int, Array]]]]:
    """Columns of an effect; of the like ones of all legs where one prediction serves all.

    Args:
        data_set: The log.
        base: Prediction of the model without the effect.
        effect: The effect.
        place: Where.
        shape: Its nonlinear parameters.
        sigma: Shape (J, C).

    Returns:
        Places, this one among them, and the columns there, one per coordinate.
    """
    model, m, group = base.model, data_set.measurement, []
    if effect.name in _OF_ONE_LEG and legs_are_separate(model, m):
        number = model.in_leg(place[0])[1]
        group = [p for p in effect.places(model, m) if model.in_leg(p[0])[1] == number >= 0]
    if len(group) < 2:
        return [(place, effect_columns(data_set, base, effect, place, shape, sigma))]
    whole = effect_columns(data_set, base, _Everywhere(effect, group), place, shape, sigma)
    return [(p, [of_own_leg(model, p[0], column) for column in whole]) for p in group]


def of_own_leg(model: MachineModel, place: str, column: Column) -> dict[int, Array]:
    """Of a column by joint what stands at joints of the leg of a link or joint."""
    own = model.own_leg(place)
    return {j: c for j, c in column.items() if j in own}


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


@dataclass(frozen=True)
class Accepted:
    """An effect in the model."""

    effect: Effect  #: The effect.
    place: Place  #: Where.
    x: Mapping[str, float]  #: Its coordinates.
    shape: Mapping[str, float]  #: Its nonlinear parameters.

    @property
    def nonlinear(self) -> dict[str, float]:
        """Nonlinear parameters that are estimated."""
        return {n: v for n, v in self.shape.items() if n not in self.effect.fixed}

    def apply(self, model: MachineModel) -> MachineModel:
        """The model with the effect."""
        return self.effect.edit(model, self.place, self.x, self.shape)


def residual(data_set: DataSet, prediction: Prediction, sigma: Array) -> dict[int, Array]:
    """Measured minus predicted effort, whitened, of every joint."""
    m = data_set.measurement
    predicted = m.smooth(prediction.effort)
    rows = data_set.rows
    out = {}
    for j in range(len(m.joints)):
        rest = (m.effort[rows, j] - predicted[rows, j]) * (data_set.weight / sigma[j])
        rest[~m.mask[rows, j]] = 0.0
        out[j] = rest
    return out
