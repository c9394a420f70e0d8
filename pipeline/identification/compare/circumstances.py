"""Step 2: where measured and predicted effort disagree, by joint and circumstance.

The rows of a joint are sorted in several ways (support or transfer, direction, speed, load,
nearness to reversal, position, time); every band gets its share of the squared gap of all joints
and how much of it lies beyond the noise floor. A cause shows as a band that stands out.

`stages` gives the gap step by step: the model as it was, with one effect after another.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from actuators.arrays import Array, Mask
from pipeline.effects.base import CHANNEL_UNITS
from pipeline.identification.floor import floor_of
from pipeline.logs.log import TEST, VALIDATION, Log
from pipeline.machine.machine import MachineModel
from pipeline.simulation.predict import Prediction, Simulator

#: The way of sorting that leaves a joint whole.
WHOLE: Final = "joint"
#: Nearness to a reversal, in periods of the cut-off.
NEAR_REVERSAL: Final = 2.0
#: Fewer rows in a band say nothing.
FEWEST_ROWS: Final = 20


@dataclass(frozen=True)
class Where:
    """The gap of one joint in one band."""

    rank: int  #: From 1, by the part of the gap above the noise floor.
    joint: str  #: Name.
    by: str  #: How the rows are sorted; `WHOLE` for all of them.
    band: str  #: Which of them.
    rows: int  #: Compared rows.
    gap: float  #: Root mean square of measured minus predicted, in `unit`.
    mean: float  #: Of measured minus predicted, in `unit`.
    noise_floor: float  #: Standard deviation of the noise in the bandwidth, in `unit`.
    unit: str  #: Of the compared channel.
    share_of_total: float  #: Of the squared gap of all joints [1].
    share_above_noise: float  #: Of this band's squared gap beyond the squared noise floor [1].


def gap_of(m: Log, prediction: Prediction, channel: int = 0) -> Array:
    """Measured minus predicted effort at the log's bandwidth, NaN where masked, shape (N, J)."""
    rest = m.effort[..., channel] - m.lowpass(prediction.effort[..., channel])
    return np.where(m.mask, rest, np.nan)


#: By way of sorting, the two edges between its three bands.
Edges = Mapping[str, tuple[float, float]]


class Tally:
    """The gap by joint and band, gathered from logs or from chunks of logs."""

    def __init__(self, legs: Mapping[str, int] | None = None) -> None:
        """Begin.

        Args:
            legs: Joint to its leg's column in `Log.standing`; None without legs.
        """
        self._legs = legs
        self._sums: dict[tuple[int, str, str], Array] = {}

    def add(self, m: Log, prediction: Prediction, edges: Sequence[Edges] | None = None) -> None:
        """Take in a log or a chunk of one.

        Args:
            m: Of the machine.
            prediction: Of it.
            edges: By joint, from `edges_of`; of these rows by default.
        """
        rest = gap_of(m, prediction)
        edges = edges or edges_of(m, prediction)
        for j in range(len(m.joints)):
            good = np.flatnonzero(np.isfinite(rest[:, j]))
            r = rest[good, j]
            square = r * r
            for (by, band), rows in _bands(m, prediction, j, self._legs, edges[j]).items():
                inside = rows[good]
                # Sums, not products of matrices: those start threads for a few thousand numbers.
                entry = np.array([inside.sum(), square[inside].sum(), r[inside].sum()])
                key = (j, by, band)
                self._sums[key] = self._sums.get(key, np.zeros(3)) + entry

    def ranked(self, measurements: Sequence[Log]) -> tuple[Where, ...]:
        """The table, ranked by the part of the gap above the noise floor.

        Args:
            measurements: Of whose noise and joints the gap is.
        """
        first = measurements[0]
        noise = np.sqrt(np.mean([m.noise[:, 0] ** 2 for m in measurements], axis=0))
        total = sum(s[1] for (_, by, _), s in self._sums.items() if by == WHOLE)
        rows_ = []
        for (j, by, band), (count, square, plain) in self._sums.items():
            if count < FEWEST_ROWS:
                continue
            gap = float(np.sqrt(square / count))
            excess = max(0.0, 1.0 - (float(noise[j]) / gap) ** 2) if gap > 0 else 0.0
            share = float(square / total) if total > 0 else 0.0
            unit = CHANNEL_UNITS[first.channels[0]]
            rows_.append(
                (
                    share * excess,
                    (first.joints[j], by, band, int(count), gap),
                    (float(plain / count), float(noise[j]), unit, share, excess),
                )
            )
        rows_.sort(key=lambda r: (-r[0], r[1][:3]))
        return tuple(Where(k, *head, *tail) for k, (_, head, tail) in enumerate(rows_, start=1))


def where(
    measurements: Sequence[Log],
    predictions: Sequence[Prediction],
    legs: Mapping[str, int] | None = None,
) -> tuple[Where, ...]:
    """Table the gap of all rows of several logs, ranked.

    Args:
        measurements: Of one machine.
        predictions: One per log.
        legs: Joint to its leg's column in `Log.standing`; None without legs.
    """
    tally = Tally(legs)
    for m, prediction in zip(measurements, predictions, strict=True):
        tally.add(m, prediction)
    return tally.ranked(measurements)


def edges_of(
    m: Log, prediction: Prediction, span: tuple[float, float] | None = None
) -> tuple[Edges, ...]:
    """Where the three bands of every joint meet: equal counts, or equal widths.

    Args:
        m: A log, or the stretches that stand for it.
        prediction: Of it.
        span: First and last time of the whole log [s]; of these rows by default.
    """
    begin, end = span or (float(m.time.min()), float(m.time.max()))
    out = []
    for j in range(len(m.joints)):
        v, q = m.v[:, j], m.q[:, j]
        everything = m.mask[:, j]
        moving = everything & (np.abs(v) > _rest(m, j))
        edges: dict[str, tuple[float, float]] = {}
        if moving.any():
            edges["speed"] = _thirds_of(np.abs(v)[moving])
        if everything.any():
            edges["load"] = _thirds_of(np.abs(prediction.torque[everything, j]))
            edges["position"] = _even(float(q.min()), float(q.max()))
            edges["time"] = _even(begin, end)
        out.append(edges)
    return tuple(out)


def _thirds_of(x: Array) -> tuple[float, float]:
    a, b = np.quantile(x, [1 / 3, 2 / 3])
    return float(a), float(b)


def _even(low: float, high: float) -> tuple[float, float]:
    return low + (high - low) / 3, low + 2 * (high - low) / 3


def _rest(m: Log, j: int) -> float:
    return float(m.rest_speed[j]) if m.rest_speed.size else 0.0


def _bands(
    m: Log, prediction: Prediction, j: int, legs: Mapping[str, int] | None, edges: Edges
) -> dict[tuple[str, str], Mask]:
    """Every way of sorting one joint's rows: (by, band) to rows, each (N,)."""
    v, q, load = m.v[:, j], m.q[:, j], prediction.torque[:, j]
    rest = _rest(m, j)
    everything = m.mask[:, j]
    out: dict[tuple[str, str], Mask] = {(WHOLE, "all"): everything}
    if m.standing is not None and legs is not None and m.joints[j] in legs:
        stands = m.standing[:, legs[m.joints[j]]]
        out["phase", "support"], out["phase", "transfer"] = stands, ~stands
    out["direction", "positive"], out["direction", "negative"] = v > rest, v < -rest
    moving = everything & (np.abs(v) > rest)
    out |= _thirds("speed", ("slow", "middle", "fast"), np.abs(v), moving, edges)
    out |= _thirds("load", ("light", "middle", "heavy"), np.abs(load), everything, edges)
    out["power", "driving"] = moving & (v * load > 0)
    out["power", "driven"] = moving & (v * load < 0)
    near = _near_reversal(m, v)
    out["reversal", "near"], out["reversal", "away"] = near, ~near
    out |= _thirds("position", ("low", "middle", "high"), q, everything, edges)
    return out | _thirds("time", ("first", "middle", "last"), m.time, everything, edges)


def _thirds(
    by: str, names: tuple[str, str, str], x: Array, among: Mask, edges: Edges
) -> dict[tuple[str, str], Mask]:
    """Three bands."""
    if by not in edges:
        return {}
    a, b = edges[by]
    return {
        (by, names[0]): among & (x <= a),
        (by, names[1]): among & (x > a) & (x <= b),
        (by, names[2]): among & (x > b),
    }


def _near_reversal(m: Log, v: Array) -> Mask:
    """Rows within `NEAR_REVERSAL` periods of the cut-off of a change of sign of the velocity."""
    half = 1
    if np.isfinite(m.bandwidth):
        half = max(1, round(NEAR_REVERSAL / m.bandwidth * m.rate))
    turns = np.flatnonzero(np.sign(v[1:]) != np.sign(v[:-1])) + 1
    edges = np.zeros(v.size + 1)
    np.add.at(edges, np.maximum(turns - half, 0), 1)
    np.add.at(edges, np.minimum(turns + half, v.size), -1)
    return np.asarray(np.cumsum(edges[:-1]) > 0)


@dataclass(frozen=True, eq=False)
class Stage:
    """One model along all logs."""

    label: str  #: What it has that the one before has not.
    predictions: tuple[Prediction, ...]  #: One per log.
    #: Root mean square on test rows by joint and channel, shape (J, C), NaN where no row counts.
    gaps: Array
    valid: Array  #: The same on validation rows, of the compared channel, shape (J,).

    @property
    def gap(self) -> Array:
        """On test rows, of the compared channel, by joint, shape (J,)."""
        return np.asarray(self.gaps[:, 0])


def stages(
    models: Sequence[tuple[str, MachineModel]],
    measurements: Sequence[Log],
) -> tuple[Stage, ...]:
    """Simulate models one after another; what one shares with the next is computed once.

    Args:
        models: Label and model, each like the one before but for one effect.
        measurements: One per log.
    """
    by_log = [_along(models, Simulator(m)) for m in measurements]
    held = list(zip(measurements, by_log, strict=True))
    chosen = _root([_squares(m, predictions, VALIDATION) for m, predictions in held])
    proved = _root([_squares(m, predictions, TEST) for m, predictions in held])
    return tuple(
        Stage(label, tuple(predictions[k] for predictions in by_log), proved[k], chosen[k, :, 0])
        for k, (label, _) in enumerate(models)
    )


def _along(models: Sequence[tuple[str, MachineModel]], simulator: Simulator) -> list[Prediction]:
    """Predictions of all models for one log or chunk."""
    out: list[Prediction] = []
    for _, model in models:
        out.append(simulator.predict(model, out[-1] if out else None))
    return out


def _squares(m: Log, predictions: Sequence[Prediction], part: int) -> Array:
    """Squared gaps and rows on a part, by model, joint and channel, shape (2, M, J, C)."""
    inside = m.part == part
    out = np.zeros((2, len(predictions), len(m.joints), len(m.channels)))
    for k, prediction in enumerate(predictions):
        for c in range(len(m.channels)):
            rest = gap_of(m, prediction, c)[inside]
            good = np.isfinite(rest)
            out[0, k, :, c] = (np.where(good, rest, 0.0) ** 2).sum(axis=0)
            out[1, k, :, c] = good.sum(axis=0)
    return out


def _root(squares: Sequence[Array]) -> Array:
    """Root mean square by model, joint and channel, shape (M, J, C); NaN without rows."""
    total = np.sum(squares, axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.sqrt(total[0] / total[1]))


def overall(gap: Array) -> float:
    """Root mean square over joints."""
    known = gap[np.isfinite(gap)]
    return float(np.sqrt(np.mean(known**2))) if known.size else 0.0


def noise_floor(measurements: Sequence[Log]) -> Array:
    """Of the compared channel by joint, of the test logs, shape (J,)."""
    return np.asarray(floor_of(measurements, TEST)[:, 0])
