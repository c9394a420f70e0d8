"""A log against the first simulation of its motion: rows that are left, the log of another robot.

A real gap, however large an effect is missing, must pass.

Friction that drifts, as in a machine that warms, is looked for, too: what a simulation leaves of an
effort is laid over the direction of motion and the direction times
time, with what else a model may have wrong (an offset, viscous friction, inertia, gravity's share
and direction). The coefficient of the product is the drift; its scatter is that between blocks of
the logs, since what is left is no white noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from actuators.arrays import Array, Mask
from pipeline.effects.base import CHANNEL_UNITS
from pipeline.identification.compare.circumstances import FEWEST_ROWS, gap_of
from pipeline.logs.errors import Finding, Findings
from pipeline.logs.log_format import column_name
from pipeline.logs.prepared.measurement import Measurement
from pipeline.logs.reduce import INSTEAD
from pipeline.logs.velocity import skew
from pipeline.simulation.predict import Prediction

#: Blocks per log.
_BLOCKS: Final = 8
#: Standard deviations from which friction drifts, and the least change per level.
_SEEN: Final = 4.0
_LEAST: Final = 0.1
_LEAST_ROWS: Final = 400
#: A machine warms over minutes, or from one run to the next [s].
_WARMING: Final = 60.0
#: Median correlation below which a log has little in common with the simulation: lags are searched,
#: which finds up to 0.5 by chance. Friction alone can do that, so it is said and no more.
_WEAK: Final = 0.45
#: Efforts that are exchanged in time against their own motion, to see whether they belong to it ...
_SHIFTS: Final = 60
#: ... and the share of those that explains as much, from which on they do not.
_CHANCE: Final = 0.05
#: Spread of an effort over the simulated one that the machine's parts leave open: mass 3 %, torque
#: constant 2 %, inertia 10 % of its part, three times each together.
_SCALE: Final = 0.2


def against_model(m: Measurement, prediction: Prediction) -> list[Finding]:
    """A log against a first simulation of its motion, before anything is fitted.

    Args:
        m: The log at its bandwidth.
        prediction: By the model as given.
    """
    left = rows_left(m)
    if any(f.verdict == "refused" for f in left):
        return left
    predicted = m.smooth(prediction.effort)[..., 0]
    dt = 1.0 / m.rate
    out = [
        *left,
        *compare_with_prediction(m, m.effort[..., 0], predicted, m.mask, dt, m.channels[0]),
    ]
    weak = any(f.check == "correlation" for f in out)
    return [*out, *(_of_another_motion(m, predicted) if weak else ())]


def rows_left(m: Measurement) -> list[Finding]:
    """How many rows are compared, and what removed the others; refused where hardly any is left.

    A log or joint without rows gets the one reason that took most, and what to log instead.
    """
    share = float(m.mask.mean())
    means = [(why, float(np.mean(part))) for why, part in m.removed]
    taken = "; ".join(f"{100 * part:.0f} % {why}" for why, part in means if part >= 0.005)
    detail = f"{100 * share:.0f} % of all joints' rows are compared" + (
        f"; not those with {taken}" if taken else ""
    )
    alive = m.mask.sum(axis=0) >= FEWEST_ROWS
    if not alive.any():
        detail = f"near zero rows left ({int(m.mask.sum())} of {m.mask.size})"
        detail += _most_taken([(why, float(np.mean(part))) for why, part in m.removed])
        return [Finding(m.name, "", "rows_left", share, "1", "refused", detail)]
    out = [Finding(m.name, "", "rows_left", share, "1", "ok", detail)]
    for j in np.flatnonzero(~alive):
        detail = f"{int(m.mask[:, j].sum())} rows left to compare: the joint is left out"
        detail += _most_taken([(why, float(part[j])) for why, part in m.removed])
        column = column_name(m.joints[j], m.channels[0])
        out.append(Finding(m.name, column, "rows_left", 0.0, "1", "warning", detail))
    return out


def _most_taken(removed: Sequence[tuple[str, float]]) -> str:
    """What took most rows, with what to log instead; empty where nothing did."""
    why, part = max(removed, key=lambda one: one[1], default=("", 0.0))
    return f"; {100 * part:.0f} % {why}: {INSTEAD[why]}" if why else ""


def drifts(measurements: Sequence[Measurement], predictions: Sequence[Prediction]) -> list[Finding]:
    """Joints whose friction changes from the first log to the last, in the order given."""
    out = []
    first, channel = measurements[0], measurements[0].channels[0]
    for j, joint in enumerate(first.joints):
        drift = friction_drift(
            [_course(m, p, j) for m, p in zip(measurements, predictions, strict=True)]
        )
        if drift is None or not drift.seen:
            continue
        unit = CHANNEL_UNITS[channel]
        falls = abs(drift.last) < abs(drift.first)
        detail = (
            f"friction {'falls' if falls else 'rises'} from {abs(drift.first):.3g} to "
            f"{abs(drift.last):.3g} {unit} (standard error {drift.error:.1g}) from beginning to "
            f"end: {'the machine warms' if falls else 'it wears, cools or is loaded otherwise'}; "
            "one level for all logs is a mean"
        )
        change = drift.last - drift.first
        column = column_name(joint, channel)
        out.append(Finding(first.name, column, "drift", change, unit, "warning", detail))
    return out


def _course(m: Measurement, prediction: Prediction, j: int) -> Course:
    rest = gap_of(m, prediction)[:, j]
    rows = np.isfinite(rest)
    simulated = prediction.effort[rows, j, 0]
    return Course(m.time[rows], rest[rows], simulated, m.q[rows, j], m.v[rows, j], m.a[rows, j])


def _of_another_motion(m: Measurement, predicted: Array) -> list[Finding]:
    """Efforts that do not belong to the motion beside them, by any reading.

    Bodies, those of the robot and any that hang on the joint, dry and viscous friction and an
    offset explain some of every joint's effort. Efforts shifted against their motion are explained
    by chance alone: where they are explained as well as the ones in place, those belong to another
    motion or robot.
    """
    columns = []
    for j in range(len(m.joints)):
        rows = np.flatnonzero(m.mask[:, j])
        x = m.effort[rows, j, 0]
        if rows.size < 50 or np.ptp(x) == 0.0 or np.ptp(predicted[rows, j]) == 0.0:
            continue
        v = m.v[rows, j]
        rest = max(float(m.rest_speed[j]), 1e-12) if m.rest_speed.size else 1e-12
        q, a = m.q[rows, j], m.a[rows, j]
        own = [np.sin(q), np.cos(q), a]
        readings = np.stack(
            [np.ones_like(v), predicted[rows, j], np.tanh(v / rest), v, *own], axis=1
        )
        basis = np.linalg.qr(readings / np.maximum(np.abs(readings).max(axis=0), 1e-300))[0]
        columns.append((x - x.mean(), basis))
    if not columns:
        return []

    def explained(share: float) -> float:
        total = 0.0
        for x, basis in columns:
            y = np.roll(x, round(share * x.size))
            rest = 1.0 - float(((basis.T @ y) ** 2).sum() / (y @ y))
            total -= float(np.log(max(rest, 1e-12)))
        return total

    here = explained(0.0)
    others = [explained(share) for share in np.linspace(0.05, 0.95, _SHIFTS)]
    chance = float(np.mean([other >= here for other in others]))
    if chance <= _CHANCE:
        return []
    detail = (
        f"{m.channels[0]}s follow neither from the bodies of this robot nor from friction along "
        f"this motion (shifted in time, {100 * chance:.0f} % of the shifts explain them as well): "
        "the log of another robot, or joints are swapped"
    )
    return [Finding(m.name, "", "another_motion", chance, "1", "suspected", detail)]


def compare_with_prediction(
    m: Measurement, measured: Array, predicted: Array, mask: Mask, dt: float, channel: str
) -> list[Finding]:
    """Efforts against a first simulation of the same motion: spread and skew.

    Args:
        m: The log.
        measured: Filtered effort, shape (N, J).
        predicted: By the model before anything is fitted, same bandwidth, shape (N, J).
        mask: Rows to compare, shape (N, J).
        dt: [s].
        channel: Which effort.
    """
    found = Findings(m.name)
    agree = []
    for j, joint in enumerate(m.joints):
        x = np.where(mask[:, j], measured[:, j], np.nan)
        seen = skew(x, np.where(mask[:, j], predicted[:, j], np.nan), dt, longest=0.1)
        if seen is None:
            continue
        agree.append(seen.correlation)
        column = column_name(joint, channel)
        good = np.isfinite(x)
        size = float(np.std(x[good]) / max(np.std(predicted[good, j]), 1e-300))
        detail = f"{size:.3g} times the simulated, correlation {seen.correlation:.2f}"
        scaled = seen.correlation > 0.9 and not 1.0 - _SCALE < size < 1.0 / (1.0 - _SCALE)
        if scaled:
            detail += ": the model lacks something, or the column reads a multiple"
        found.note(column, "factor", size, "1", "warning" if scaled else "ok", detail)
        if seen.correlation > 0.9:
            # No verdict: friction that the model lacks shifts an effort as a late channel does.
            detail = f"{1e3 * seen.lag:.3g} ms behind the simulation of the same motion"
            found.note(column, "skew", seen.lag, "s", "ok", detail)
    if agree and float(np.median(agree)) < _WEAK:
        detail = (
            f"{channel}s have little in common with the simulation (median correlation "
            f"{np.median(agree):.2f}): mostly friction, swapped joints, or the log of another robot"
        )
        found.note("", "correlation", float(np.median(agree)), "1", "warning", detail)
    return found


@dataclass(frozen=True)
class Course:
    """One joint along one log, rows that count only."""

    time: Array  #: Shape (N,) [s].
    rest: Array  #: Measured minus simulated effort, shape (N,).
    simulated: Array  #: Effort, shape (N,).
    q: Array  #: Position [rad].
    v: Array  #: Velocity [rad/s].
    a: Array  #: Acceleration [rad/s^2].


@dataclass(frozen=True)
class Drift:
    """How a joint's friction changes."""

    first: float  #: Level at the beginning of the first log, in the effort's unit.
    last: float  #: Level at the end of the last.
    error: float  #: Standard error of their difference.

    @property
    def seen(self) -> bool:
        """Whether the change stands out from the scatter and matters."""
        change = abs(self.last - self.first)
        return change > _SEEN * self.error and change > _LEAST * abs(self.first)


def friction_drift(courses: Sequence[Course]) -> Drift | None:
    """Friction of one joint over logs in the order they were recorded.

    Several logs count as runs one after the other, whatever their clocks say. None where no log
    has a row of the joint, a single log is too short for a machine to warm, or too little moves
    both ways.
    """
    courses = [c for c in courses if c.time.size]  # a joint may stand still or lack its effort
    length = sum(float(np.ptp(c.time)) for c in courses)
    if len(courses) < 2 and length < _WARMING:
        return None
    designs, rests, blocks = [], [], []
    begin = 0.0
    for k, c in enumerate(courses):
        span = float(np.ptp(c.time))
        when = (begin + c.time - c.time[0]) / length - 0.5
        begin += span
        way = np.sign(c.v)
        columns = [way, way * when, np.ones_like(way), c.v, c.a, c.simulated]
        designs.append(np.stack([*columns, np.sin(c.q), np.cos(c.q)], axis=1))
        rests.append(c.rest)
        blocks.append(k * _BLOCKS + np.arange(way.size) * _BLOCKS // way.size)
    x, y, block = np.concatenate(designs), np.concatenate(rests), np.concatenate(blocks)
    if y.size < _LEAST_ROWS or min((x[:, 0] > 0).mean(), (x[:, 0] < 0).mean()) < 0.1:
        return None
    x = x / np.maximum(np.abs(x).max(axis=0), 1e-300)  # both signs of motion reach one
    solution, *_ = np.linalg.lstsq(x, y, rcond=None)
    inverse, left = np.linalg.pinv(x.T @ x), y - x @ solution
    scores = np.stack([x[block == b].T @ left[block == b] for b in np.unique(block)])
    spread = inverse @ (scores.T @ scores) @ inverse
    grown = scores.shape[0] / max(scores.shape[0] - x.shape[1], 1)
    top = float(np.abs(np.concatenate([d[:, 1] for d in designs])).max())
    change = float(solution[1]) / top
    error = float(np.sqrt(spread[1, 1] * grown)) / top
    level = float(solution[0])
    return Drift(level - 0.5 * change, level + 0.5 * change, error)
