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
    rest = prediction.rest
    if rest is None:
        rest = m.effort[..., channel] - m.lowpass(prediction.effort[..., channel])
    return np.where(m.mask, rest, np.nan)


def where(
    measurements: Sequence[Log],
    predictions: Sequence[Prediction],
    legs: Mapping[str, int] | None = None,
) -> tuple[Where, ...]:
    """Table the gap of all rows of several logs, ranked by its part above the noise floor.

    Args:
        measurements: Of one machine.
        predictions: One per log.
        legs: Joint to its leg's column in `Log.standing`; None without legs.
    """
    first, sums = measurements[0], dict[tuple[int, str, str], Array]()
    for m, prediction in zip(measurements, predictions, strict=True):
        rest = gap_of(m, prediction)
        for j in range(len(m.joints)):
            good = np.isfinite(rest[:, j])
            for (by, band), rows in _bands(m, prediction, j, legs).items():
                r = rest[good & rows, j]
                entry = np.array([r.size, np.sum(r * r), np.sum(r)])
                sums[j, by, band] = sums.get((j, by, band), 0.0) + entry
    noise = np.sqrt(np.mean([m.noise[:, 0] ** 2 for m in measurements], axis=0))
    total = sum(s[1] for (_, by, _), s in sums.items() if by == WHOLE)
    unit, out = CHANNEL_UNITS[first.channels[0]], []
    for (j, by, band), (count, square, plain) in sums.items():
        if count < FEWEST_ROWS:
            continue
        gap = float(np.sqrt(square / count))
        excess = max(0.0, 1.0 - (float(noise[j]) / gap) ** 2) if gap > 0 else 0.0
        share = float(square / total) if total > 0 else 0.0
        head = (first.joints[j], by, band, int(count), gap)
        tail = (float(plain / count), float(noise[j]), unit, share, excess)
        out.append((share * excess, head, tail))
    out.sort(key=lambda r: (-r[0], r[1][:3]))
    return tuple(Where(k, *head, *tail) for k, (_, head, tail) in enumerate(out, start=1))


def _bands(
    m: Log, prediction: Prediction, j: int, legs: Mapping[str, int] | None
) -> dict[tuple[str, str], Mask]:
    """Every way of sorting one joint's rows: (by, band) to rows, each (N,)."""
    v, q, load = m.v[:, j], m.q[:, j], prediction.torque[:, j]
    rest = float(m.rest_speed[j]) if m.rest_speed.size else 0.0
    everything = m.mask[:, j]
    out: dict[tuple[str, str], Mask] = {(WHOLE, "all"): everything}
    if not everything.any():
        return out
    if m.standing is not None and legs is not None and m.joints[j] in legs:
        stands = m.standing[:, legs[m.joints[j]]]
        out["phase", "support"], out["phase", "transfer"] = stands, ~stands
    out["direction", "positive"], out["direction", "negative"] = v > rest, v < -rest
    moving = everything & (np.abs(v) > rest)
    thirds = [1 / 3, 2 / 3]
    ways: list[tuple[str, tuple[str, str, str], Array, Mask, Array]] = []
    if moving.any():
        edges = np.quantile(np.abs(v)[moving], thirds)
        ways.append(("speed", ("slow", "middle", "fast"), np.abs(v), moving, edges))
    edges = np.quantile(np.abs(load[everything]), thirds)
    ways.append(("load", ("light", "middle", "heavy"), np.abs(load), everything, edges))
    for by, names, x in (
        ("position", ("low", "middle", "high"), q),
        ("time", ("first", "middle", "last"), m.time),
    ):
        edges = np.linspace(float(x.min()), float(x.max()), 4)[1:3]
        ways.append((by, names, x, everything, edges))
    for by, names, x, among, (low, high) in ways:
        out[by, names[0]] = among & (x <= low)
        out[by, names[1]] = among & (x > low) & (x <= high)
        out[by, names[2]] = among & (x > high)
    out["power", "driving"] = moving & (v * load > 0)
    out["power", "driven"] = moving & (v * load < 0)
    near = _near_reversal(m, v)
    out["reversal", "near"], out["reversal", "away"] = near, ~near
    return out


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
