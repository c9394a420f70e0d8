"""A shaft of a set of joints' actuators: its motion and torque, and the motor that drives the last.

Sign convention: ratios are positive, so torque and velocity keep the joint's positive sense at
every shaft; torque times velocity is positive where power flows from the supply to the joint.

sgn(0) is decided here and nowhere else, as `ShaftSeries.direction`:

- A repeated time stamp is a break between two closed blocks and carries both limits.
- Where velocity keeps its sign in a block, every sample has it, also where the velocity is zero.
- A block whose speed stays below `REST_SPEED` is at rest: direction and velocity are zero.
- Where velocity changes sign (not yet split by `split_at_reversals`) a sample below `REST_SPEED`
  takes the direction of the sample before it, at the block's start of the one after.

At its end a permanent-magnet DC motor converts electrical into mechanical power (Fig. 5):

    I = torque / k        U = R I + k velocity        P = U I = torque velocity + R I^2

No integral may run across a jump, and friction and with it R I^2 jump where a joint reverses. Each
velocity zero of any joint becomes a break (`split_at_reversals`): two samples at the same time that
carry the left and the right limit.
"""

import math
from collections.abc import Sequence
from dataclasses import MISSING, dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from actuators.arrays import Array, Index, Scalars
from actuators.errors import LegwattError
from actuators.parameters import Numbers, number, require

REST_SPEED: Final = 1e-9  # [rad/s]
#: Fields of a series that have a column per joint.
BY_JOINT: Final = ("position", "velocity", "acceleration", "torque", "direction")


@dataclass(frozen=True, eq=False)
class ShaftSeries:
    """Samples of every joint at one shaft; build it with `at_joint`."""

    joints: tuple[str, ...]  #: Names of the J joints.
    time: Array  #: (N,) [s], not decreasing; a repeated stamp is a break.
    position: Array  #: (N, J) [rad].
    velocity: Array  #: (N, J) [rad/s].
    acceleration: Array  #: (N, J) [rad/s^2].
    torque: Array  #: (N, J) [N*m].
    direction: Array  #: (N, J) in {-1, 0, +1}: sgn(velocity) as decided by this module.

    @classmethod
    def at_joint(
        cls,
        joints: Sequence[str],
        time: ArrayLike,
        position: ArrayLike,
        velocity: ArrayLike,
        acceleration: ArrayLike,
        torque: ArrayLike,
    ) -> "ShaftSeries":
        """Return a checked series with its directions decided; arguments as its fields.

        Raises:
            LegwattError: Shapes differ, a value is not finite, or time runs backwards.
        """
        names, t = tuple(joints), np.asarray(time, dtype=float)
        given = {"position": position, "velocity": velocity}
        given |= {"acceleration": acceleration, "torque": torque}
        arrays = {name: np.asarray(values, dtype=float) for name, values in given.items()}
        for name, array in arrays.items():
            if array.shape != (t.size, len(names)) or not np.isfinite(array).all():
                expected = f"finite numbers of {t.size} samples and {len(names)} joints"
                raise LegwattError(f"{name} of shape {array.shape}: expected {expected}")
        if not np.isfinite(t).all() or (np.diff(t) < 0.0).any():
            raise LegwattError("time must be finite and never decrease: sort the samples")
        direction, rest = directions(t, arrays["velocity"])
        arrays["velocity"] = np.where(rest, 0.0, arrays["velocity"])
        return cls(joints=names, time=t, direction=direction, **arrays)

    @property
    def power(self) -> Array:
        """Power through the shaft towards the joint, (N, J) [W]."""
        return self.torque * self.velocity

    def of(self, joints: Sequence[str]) -> "ShaftSeries":
        """Return the series of some joints, by name."""
        which = [self.joints.index(joint) for joint in joints]
        arrays = {name: getattr(self, name).take(which, axis=1) for name in BY_JOINT}
        return ShaftSeries(joints=tuple(joints), time=self.time, **arrays)

    def with_torque(self, torque: Array) -> "ShaftSeries":
        """Return the same motion with another torque, (N, J) [N*m]; arrays are shared."""
        return replace(self, torque=torque)

    def geared(self, ratio: Scalars, torque: Array) -> "ShaftSeries":
        """Return a shaft that turns `ratio` times as fast, with its torque (N, J) [N*m]."""
        turned = {name: getattr(self, name) * ratio for name in BY_JOINT[:3]}
        return replace(self, torque=torque, **turned)


def directions(time: Array, velocity: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return directions (N, J) by this module's rules, and which samples are at rest (N, J)."""
    starts = np.concatenate(([0], np.flatnonzero(np.diff(time) == 0.0) + 1))  # of the blocks
    lengths = np.diff(np.append(starts, time.size))
    high = np.maximum.reduceat(velocity, starts, axis=0) >= REST_SPEED  # (blocks, J)
    low = np.minimum.reduceat(velocity, starts, axis=0) <= -REST_SPEED
    per_block = high.astype(float) - low.astype(float)
    direction = np.repeat(per_block, lengths, axis=0)
    rest = np.repeat(~(high | low), lengths, axis=0)
    for block, joint in np.argwhere(high & low):
        part = slice(starts[block], starts[block] + lengths[block])
        v = velocity[part, joint]
        # Samples at rest copy the moving sample before, or the first.
        moving = np.flatnonzero(np.abs(v) >= REST_SPEED)
        source = np.searchsorted(moving, np.arange(v.size), side="right") - 1
        direction[part, joint] = np.sign(v[moving[np.maximum(source, 0)]])
    return direction, rest


@dataclass(frozen=True, eq=False)
class DCMotor(Numbers):
    """Conversion only: rotor friction and inertia are elements of their own.

    Note:
        Inductance is left out: with 0.08 mH and 0.3 ohm it matters below a millisecond.
    """

    name: str  #: Names the row of its copper loss.
    #: k, of torque per current and of voltage per speed [N*m/A = V*s/rad].
    torque_constant: Scalars = number("torque constant", "positive", MISSING)
    #: R of the winding at its working temperature [ohm].
    resistance: Scalars = number("resistance", "", MISSING)
    max_speed: float = number("angular velocity", "limit", math.inf)  #: Permissible [rad/s].
    supply_voltage: float = number("voltage", "limit", math.inf)  #: At hand [V].
    continuous_current: float = number("current", "limit", math.inf)  #: Root mean square [A].
    peak_current: float = number("current", "limit", math.inf)  #: At every instant [A].
    mass: float = number("mass")  #: [kg]; no law uses it, and 0 says that no file states it.
    torque_constant_spread: float = 0.0  #: Relative standard deviation of k in its file [1].
    resistance_spread: float = 0.0  #: Of R likewise [1].

    def __post_init__(self) -> None:
        super().__post_init__()
        apart = self.peak_current >= self.continuous_current
        require(apart, self.name, "peak_current must not be below continuous_current")

    def current(self, torque: Array) -> Array:
        """Return the current (...) [A] for an air-gap torque [N*m]."""
        return torque / self.torque_constant

    def voltage(self, current: Array, velocity: Array) -> Array:
        """Return the voltage at the terminals (...) [V]."""
        return self.resistance * current + self.torque_constant * velocity

    def copper_loss(self, current: Array) -> Array:
        """Return R I^2, (...) [W]."""
        return self.resistance * current * current


_SNAP: Final = 1e-9  # a zero nearer to a sample than this share of the interval is on the sample
_BISECTIONS: Final = 60  # halves an interval down to the resolution of a float


def split_at_reversals(series: ShaftSeries) -> ShaftSeries:
    """Return the series with a break at every velocity zero of any joint.

    Between samples velocity is the cubic Hermite of velocity and acceleration, position that of
    position and velocity, torque and acceleration are linear. At a zero the velocity of the
    joints that reverse there is exactly zero. Breaks that are there already stay; a zero where
    velocity touches without changing its sign, or that lies at the edge of a block, needs none.
    A stay at rest inside a block is cut out at both its ends, so that it counts as rest.

    Note:
        Two zeros between the same two samples, where the signs at both agree, are not looked for:
        sample finely enough that velocity does not swing twice within one interval.
    """
    signs = np.where(np.abs(series.velocity) < REST_SPEED, 0.0, np.sign(series.velocity))
    interval, fraction, joint = _crossings(series, signs)
    on_left, on_right = fraction < _SNAP, fraction > 1.0 - _SNAP
    row, column = _zeros_on_samples(series.time, signs)
    snapped_row = np.concatenate((row, interval[on_left], interval[on_right] + 1))
    snapped_column = np.concatenate((column, joint[on_left], joint[on_right]))
    inside = ~(on_left | on_right)
    interval, fraction, joint = interval[inside], fraction[inside], joint[inside]

    order = np.lexsort((fraction, interval))
    interval, fraction, joint = interval[order], fraction[order], joint[order]
    # Zeros closer than `_SNAP` share an instant: its number, and whether a zero is its first.
    new = np.ones(interval.size, dtype=bool)
    new[1:] = (np.diff(interval) != 0) | (np.diff(fraction) > _SNAP)
    group = np.cumsum(new) - 1
    at, u = interval[new], fraction[new]

    columns = _interpolated(series, at, u)
    columns["velocity"][group, joint] = 0.0
    _keep_signs(columns["velocity"], series, signs, (interval, fraction, joint), at, u)

    velocity = series.velocity
    if snapped_row.size:
        velocity = velocity.copy()
        velocity[snapped_row, snapped_column] = 0.0
    doubled = np.unique(snapped_row)
    # Only zeros with a neighbour of their own block on both sides double a sample.
    joined = np.concatenate(([False], np.diff(series.time) > 0.0, [False]))
    doubled = doubled[np.asarray(joined[doubled] & joined[doubled + 1])]

    # Rows in order: every sample, twice where doubled, and two rows for each instant between.
    row = np.concatenate((np.arange(series.time.size), doubled, np.repeat(at, 2)))
    within = np.concatenate((np.zeros(series.time.size + doubled.size), np.repeat(u, 2)))
    source = np.lexsort((within, row))  # stable

    def merged(samples: Array, between: Array) -> Array:
        everything = np.concatenate((samples, samples[doubled], np.repeat(between, 2, axis=0)))
        return everything[source]

    return ShaftSeries.at_joint(
        joints=series.joints,
        time=merged(series.time, columns["time"]),
        position=merged(series.position, columns["position"]),
        velocity=merged(velocity, columns["velocity"]),
        acceleration=merged(series.acceleration, columns["acceleration"]),
        torque=merged(series.torque, columns["torque"]),
    )


def _crossings(series: ShaftSeries, signs: Array) -> tuple[Index, Array, Index]:
    """Return interval, fraction of it and joint of each sign change between two samples."""
    step = np.diff(series.time)
    interval, joint = np.nonzero((signs[:-1] * signs[1:] < 0.0) & (step > 0.0)[:, None])
    v, a = series.velocity, series.acceleration
    low, high = np.zeros(interval.size), np.ones(interval.size)
    first = signs[interval, joint]
    low_v, high_v, low_a, high_a = (x[k, joint] for x in (v, a) for k in (interval, interval + 1))
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        value = _hermite(low_v, high_v, low_a, high_a, step[interval], middle)
        before = value * first > 0.0
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    return interval, 0.5 * (low + high), joint


def _zeros_on_samples(time: Array, signs: Array) -> tuple[Index, Index]:
    """Return row and joint of zeros on samples where a sign changes or a stay at rest ends."""
    found: list[tuple[np.intp, np.intp]] = []
    joined = np.diff(time) > 0.0  # sample i and i + 1 lie in one block
    for column in np.flatnonzero((signs == 0.0).any(axis=0)):
        zero = np.diff(np.concatenate(([0], signs[:, column] == 0.0, [0])).astype(int))
        for first, stop in zip(np.flatnonzero(zero > 0), np.flatnonzero(zero < 0), strict=True):
            last = stop - 1
            before = signs[first - 1, column] if first > 0 and joined[first - 1] else 0.0
            after = signs[stop, column] if stop < time.size and joined[last] else 0.0
            if first == last and before * after >= 0.0:
                continue  # touches, or at the edge of a block
            ends = [row for row, side in ((first, before), (last, after)) if side != 0.0]
            found += [(row, column) for row in dict.fromkeys(ends)]
    rows, columns = np.array(found, dtype=np.intp).reshape(-1, 2).T
    return rows, columns


def _interpolated(series: ShaftSeries, at: Index, u: Array) -> dict[str, Array]:
    """Return time (K,) and the series' quantities (K, J) at fractions `u` of intervals `at`."""
    step = np.diff(series.time)[at]
    s, h = u[:, None], step[:, None]
    q, v, a, torque = series.position, series.velocity, series.acceleration, series.torque
    return {
        "time": np.minimum(series.time[at] + u * step, series.time[at + 1]),
        "position": _hermite(q[at], q[at + 1], v[at], v[at + 1], h, s),
        "velocity": _hermite(v[at], v[at + 1], a[at], a[at + 1], h, s),
        "acceleration": (1.0 - s) * a[at] + s * a[at + 1],
        "torque": (1.0 - s) * torque[at] + s * torque[at + 1],
    }


def _keep_signs(
    velocity: Array,
    series: ShaftSeries,
    signs: Array,
    zeros: tuple[Index, Array, Index],
    at: Index,
    u: Array,
) -> None:
    """Set to zero, in place, velocities whose Hermite overshoots to the wrong side of zero.

    Before its own zero a joint has the sign of the interval's first sample, then of the second.
    """
    own_zero = np.full(velocity.shape, np.inf)
    interval, fraction, joint = zeros
    for i, f, j in zip(interval, fraction, joint, strict=True):
        own_zero[at == i, j] = f
    left, right = signs[at], signs[at + 1]
    one_sign = np.where(left != 0.0, left, right)
    expected = np.where(u[:, None] < own_zero, one_sign, right)
    velocity[velocity * expected < 0.0] = 0.0
    velocity[np.broadcast_to(expected == 0.0, velocity.shape)] = 0.0


def _hermite(f0: Array, f1: Array, d0: Array, d1: Array, h: Array, u: Array) -> Array:
    """Return the cubic with values f0, f1 and slopes d0, d1 over a step h at fraction u."""
    w = 1.0 - u
    ends = w * w * (1.0 + 2.0 * u) * f0 + u * u * (3.0 - 2.0 * u) * f1
    return np.asarray(ends + u * w * h * (w * d0 - u * d1))
