"""Splitting a series where velocity reverses, so that no integral runs across a jump.

Friction and with it R I^2 jump where a joint reverses. Each velocity zero of any joint becomes a
break: two samples at the same time that carry the left and the right limit.
"""

from typing import Final

import numpy as np

from actuators.arrays import Array, Index
from actuators.shaft import REST_SPEED, ShaftSeries

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
