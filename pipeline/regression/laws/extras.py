"""What torque depends on beside bodies, friction and couplings: springs, ripple, sensors, play.

Every member is linear in its coordinates about the point it was last computed at. What a sensor
gets wrong is taken out of the rows themselves (a torque that comes late is brought forward, an
angle is shifted) and only the rest is a column, so that few rounds reach the end:

    spring   k q                         a line over the joint's angle; its rest is in the offset
    ripple   a sin(n q) + b cos(n q)
    zero     q_seen = q + z              -> t(z) = t(z0) - (z - z0) dID/dq_j
    gain     t_seen = (1 + g) t          -> t/(1 + g0) grows by (g - g0) t / (1 + g0)
    late     t_seen(s) = t(s - d)        -> brought forward by d0, t(d) = t - (d - d0) dt/ds
    wind     q = q_seen - c t_j          -> -c (dID/dq_j t_j + dID/dv_j t_j' + dID/da_j t_j'')
    play     q = q_seen - (w/2) sgn t_j  -> -(w/2) dID/dq_j sgn t_j
    curve    a smooth curve over the joint's angle, no law of a catalogue
    drag     dry friction with such a curve

wind and play are felt where the encoder sits on the motor: the link lags behind what it shows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np
import pinocchio as pin
import scipy.interpolate
from numpy.typing import NDArray

from pipeline.regression.laws.friction import hats, sense
from pipeline.regression.preprocess import Rows

Array = NDArray[np.float64]
#: Every joint at once.
EVERY: Final = -1
#: Least periods of a ripple per turn and inside the travel: less is any function of the angle.
LEAST_ORDER: Final = 4.0
LEAST_PERIODS: Final = 1.5
#: Largest order looked for, and the share of the band that it may use.
MOST_ORDER: Final = 2000.0
BAND: Final = 0.6
#: Step between orders, in turns of phase over the travel: none lies between two.
ORDER_STEP: Final = 0.35
#: Orders of one joint that compete.
PEAKS: Final = 3
#: Knots of a curve over the angle, as quantiles of the travel.
ANGLES: Final = (0.0, 0.15, 0.3, 0.5, 0.7, 0.85, 1.0)


class Kind(StrEnum):
    """What kind of thing an extra is."""

    SPRING = "spring"
    RIPPLE = "ripple"
    ZERO = "zero"
    GAIN = "gain"
    LATE = "late"
    WIND = "wind"
    PLAY = "play"
    CURVE = "curve"
    DRAG = "drag"


#: What sensors get wrong: taken out of the rows.
SENSORS: Final = frozenset({Kind.ZERO, Kind.GAIN, Kind.LATE})
#: What sensors of every machine get wrong: less than so much is no finding.
TOLERATED: Final[Mapping[Kind, float]] = {Kind.GAIN: 0.05, Kind.ZERO: 6e-3, Kind.LATE: 7.5e-4}
#: What has no name in a catalogue: it keeps others from being named for it.
UNNAMED: Final = frozenset({Kind.CURVE, Kind.DRAG})
#: What cannot be negative.
UNSIGNED: Final = frozenset({Kind.WIND, Kind.PLAY})
#: Of a torque at the joint, whatever was logged to tell it.
MECHANICAL: Final = frozenset({Kind.SPRING, Kind.RIPPLE, Kind.ZERO, Kind.LATE, *UNNAMED})


@dataclass(frozen=True, order=True)
class Extra:
    """One thing at one joint.

    Attributes:
        kind: What.
        joint: Column of the joint; `EVERY` for all.
        order: Periods per turn [1] of a ripple's sine, as ``sin(order q)``, q in rad.
    """

    kind: Kind
    joint: int
    order: float = 0.0

    @property
    def named(self) -> bool:
        """Whether a catalogue has a name for it."""
        return self.kind not in UNNAMED

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its columns."""
        if self.kind is Kind.RIPPLE:
            parts: Sequence[str] = ("sine", "cosine")
        elif self.kind in UNNAMED:
            parts = [str(k) for k in range(len(ANGLES))]
        else:
            parts = ("size",)
        return tuple(f"{self.kind}@{self.joint}/{self.order:.6g}/{part}" for part in parts)

    def torque(self, q: Array, sizes: Sequence[float] | Array) -> Array:
        """What a spring or a ripple adds at its joint's angles (N,) [rad], (N,) [N*m]; else zero.

        Args:
            q: (N,) [rad].
            sizes: Of its columns.
        """
        if self.kind is Kind.SPRING:
            return np.asarray(sizes[0] * q)
        if self.kind is Kind.RIPPLE:
            turn = self.order * q
            return np.asarray(sizes[0] * np.sin(turn) + sizes[1] * np.cos(turn))
        return np.zeros_like(q)

    @property
    def same(self) -> tuple[Kind, int]:
        """What another order of the same ripple has in common with it."""
        return self.kind, self.joint


@dataclass(frozen=True)
class Seen:
    """A fit about which extras are linear; thin rows.

    Attributes:
        rows: As corrected so far.
        torque: As predicted, without what sensors get wrong, (N, J) [N*m].
        model: Bodies as fitted.
        gain: Of the torques, as corrected so far, (J,).
        passed: Of it what goes through the drive: friction before it winds nothing up, (N, J).
    """

    rows: Rows
    torque: Array
    model: pin.Model
    gain: Array
    passed: Array

    def rate(self, x: Array) -> Array:
        """Rate of change of thin rows (N, J), run by run, by cubic splines."""
        out = np.empty_like(x)
        ends = [*self.rows.start[1:], len(x)]
        for a, b in zip(self.rows.start, ends, strict=True):
            t = self.rows.time[a:b]
            if b - a < 4:
                out[a:b] = np.gradient(x[a:b], t, axis=0) if b - a > 1 else 0.0
            else:
                out[a:b] = scipy.interpolate.CubicSpline(t, x[a:b])(t, 1)
        return out

    def slopes(self) -> tuple[Array, Array, Array]:
        """Derivatives of inverse dynamics by angle, speed and acceleration, (N, J, J) each."""
        data, n, j = self.model.createData(), len(self.rows.q), self.model.nv
        out = np.empty((3, n, j, j))
        rows = zip(self.rows.q, self.rows.v, self.rows.a, strict=True)
        for k, (q, v, a) in enumerate(rows):
            out[:, k] = pin.computeRNEADerivatives(self.model, data, q, v, a)
        return out[0], out[1], out[2]

    def columns(self, extras: Sequence[Extra]) -> dict[str, dict[int, Array]]:
        """Torque per coordinate: column name to joint to thin rows, (N,) each."""
        kinds = {e.kind for e in extras}
        rate = self.rate(self.torque) if Kind.LATE in kinds else np.empty(0)
        wound = self.rate(self.passed) if Kind.WIND in kinds else np.empty(0)
        bend = self.rate(wound) if Kind.WIND in kinds else np.empty(0)
        bent = kinds & {Kind.ZERO, Kind.WIND, Kind.PLAY}
        slopes = self.slopes() if bent else (np.empty(0),) * 3
        out: dict[str, dict[int, Array]] = {}
        for e in extras:
            out |= self._columns(e, rate, (wound, bend), slopes)
        return out

    def _columns(
        self, e: Extra, rate: Array, wound: tuple[Array, Array], slopes: tuple[Array, Array, Array]
    ) -> dict[str, dict[int, Array]]:
        j, torque, rows = e.joint, self.torque, self.rows
        every = range(torque.shape[1]) if j == EVERY else (j,)
        if e.kind in (Kind.SPRING, Kind.RIPPLE, Kind.CURVE, Kind.DRAG):
            values = _over_angle(e, rows)
            return {n: {j: x} for n, x in zip(e.names, values, strict=True)}
        (name,) = e.names
        if e.kind is Kind.GAIN:
            return {name: {i: torque[:, i] / self.gain[i] for i in every}}
        if e.kind is Kind.LATE:
            return {name: {i: -rate[:, i] for i in every}}
        if e.kind is Kind.ZERO:
            change = -slopes[0][:, :, j]
        elif e.kind is Kind.PLAY:
            change = -0.5 * slopes[0][:, :, j] * np.sign(self.passed[:, j])[:, None]
        else:
            change = -(
                slopes[0][:, :, j] * self.passed[:, [j]]
                + slopes[1][:, :, j] * wound[0][:, [j]]
                + slopes[2][:, :, j] * wound[1][:, [j]]
            )
        largest = float(np.abs(change).max(initial=0.0))
        felt = np.flatnonzero(np.abs(change).max(axis=0) > 1e-9 * max(largest, 1e-300))
        return {name: {int(i): change[:, i] for i in felt}}


def _over_angle(e: Extra, rows: Rows) -> list[Array]:
    """Columns that depend on the joint's own angle, and on the sense of its motion."""
    q = rows.fine[0][:, e.joint]
    if e.kind is Kind.SPRING:
        return [rows.thin(q)]
    if e.kind is Kind.RIPPLE:
        wave = rows.filtered(np.column_stack([np.sin(e.order * q), np.cos(e.order * q)]))
        return [wave[:, 0], wave[:, 1]]
    knots = angle_knots(q)
    curve = hats(np.clip(q, knots[0], knots[-1]), knots)
    curve = curve - curve.mean(axis=0)  # the mean is an offset, or Coulomb friction
    if e.kind is Kind.DRAG:
        way = sense(rows.fine[1][:, e.joint], float(rows.sigma_v[e.joint])).sign
        curve = rows.filtered(curve * way[:, None])
    else:
        curve = rows.thin(curve)
    return list(curve.T)


def angle_knots(q: Array) -> Array:
    """Knots of a curve over the angle, ascending [rad]."""
    knots = np.quantile(q, ANGLES)
    span = max(float(np.ptp(q)), 1e-9)
    return np.asarray(np.maximum.accumulate(knots + 1e-9 * span * np.arange(knots.size)))


def orders(rows: Rows, joint: int) -> Array:
    """Orders of a ripple that a joint's motion can show, (K,); empty where it hardly moves."""
    q, v = rows.fine[0][:, joint], np.abs(rows.fine[1][:, joint])
    travel = float(np.ptp(q))
    speed = max(float(np.quantile(v, 0.1)), 3.0 * float(rows.sigma_v[joint]), 1e-6)
    if travel < 1e-3:
        return np.empty(0)
    top = min(2 * np.pi * BAND * rows.cutoff / speed, MOST_ORDER)
    low = max(LEAST_ORDER, LEAST_PERIODS * 2 * np.pi / travel)
    return np.arange(low, max(top, low), ORDER_STEP * 2 * np.pi / travel)


def strongest(rest: Array, q: Array, grid: Array, known: Sequence[float]) -> list[float]:
    """Orders at which a remainder (N,) is periodic in the angle (N,), refined, strongest first.

    Args:
        rest: (N,) [N*m].
        q: (N,) [rad].
        grid: Orders to look at.
        known: Orders that are known already; none next to them.
    """
    if grid.size < 2:
        return []
    power = np.array([_power(rest, q, float(n)) for n in grid])
    step = float(grid[1] - grid[0])
    out: list[float] = []
    for k in np.argsort(power)[::-1]:
        if all(abs(grid[k] - o) > 3 * step for o in (*out, *known)):
            out.append(float(grid[k]))
        if len(out) == PEAKS:
            break
    return [refined(rest, q, n, step) for n in out]


def _power(rest: Array, q: Array, order: float) -> float:
    return float(abs(np.exp(-1j * order * q) @ rest))


def tuned(series: Array, rows: Rows, joint: int, order: float, step: float) -> float:
    """The order nearby whose sine, filtered as the torque was, fits a series (N,) best."""
    q = rows.fine[0][:, joint]
    for _ in range(3):
        near = order + step * np.linspace(-1.0, 1.0, 9)
        turns = np.outer(q, near)
        waves = rows.filtered(np.concatenate([np.sin(turns), np.cos(turns)], axis=1))
        left = []
        for k in range(near.size):
            x = waves[:, [k, near.size + k]]
            solution, *_ = np.linalg.lstsq(x, series, rcond=None)
            left.append(float(np.sum((series - x @ solution) ** 2)))
        order = float(near[int(np.argmin(left))])
        step /= 4.0
    return order


def refined(rest: Array, q: Array, order: float, step: float) -> float:
    """The order nearby at which a series (N,) over an angle (N,) has most power."""
    for _ in range(3):
        near = order + step * np.linspace(-1.0, 1.0, 17)
        order = float(near[int(np.argmax([_power(rest, q, float(n)) for n in near]))])
        step /= 8.0
    return order
