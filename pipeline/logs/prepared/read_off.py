"""What a prepared log shows by itself: velocity columns, stamps, two positions, ripple.

Ripple over the angle is looked for at the log's full bandwidth: an effort that repeats k times per
turn sums to A = sum r exp(-i k q) over its rows, whatever the speed was. What the low-pass takes
away (r, the part above the cut-off) is sorted into narrow bins of the angle and transformed, once
for rows that turn forward and once for those that turn back. A torque of the angle has one phase in
both; friction, delay and the motion's own rhythm have not. So the product of the two sums decides,
against its own scatter over neighbouring orders.

Elasticity and play are read off two positions of a joint. What the motor is ahead of the joint, x =
q_motor / n - q_joint, follows the torque t between them:

    x = x_0 + t / k + (w / 2) sgn(t) + (h / 2) sgn(v)

a line for a spring of stiffness k, a step for play of width w, a loop for friction between motor
and spring. The side of the play is unknown while the torque is small against its own noise and the
loop: such rows are left out. The torque is the log's own, brought to the joint.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from actuators.arrays import Array, Mask
from pipeline.logs.errors import Finding, Findings
from pipeline.logs.log_format import column_name
from pipeline.logs.prepared.prepare import Prepared
from pipeline.logs.signals.derivatives import LowPass

#: Chance at which noise may pass for a ripple somewhere among all orders of a joint.
CHANCE: Final = 1e-4
#: Bins of the angle per period of the highest order.
_BINS: Final = 6
_MOST_ORDER: Final = 2000.0
_RIPPLE_ROWS: Final = 500
#: Standard deviations from which a slope or a step counts as seen.
SEEN: Final = 4.0
#: Torques below this many standard deviations do not tell their sign.
_SURE: Final = 3.0
#: ... nor below this share of its root mean square, which friction may be.
_FRICTION: Final = 0.25
_BLOCKS: Final = 24
_LEAST_ROWS: Final = 60
#: Ripple is looked for above this frequency, or above the cut-off where that is lower [Hz].
_ABOVE: Final = 30.0
#: Share of what a filter sees that must have the torque's sign.
_ONE_SIDE: Final = 0.98


def signal_findings(one: Prepared) -> list[Finding]:
    """One line for everything a log shows without a model."""
    found = Findings(one.log.name)
    if one.stamp_error > 0:
        detail = (
            f"time stamps are off by {1e3 * one.stamp_error:.2g} ms: at speed v a position is off "
            "by v times that"
        )
        verdict = "warning" if one.stamp_error > 0.05 * one.settings.dt else "ok"
        found.note("time_s", "stamp_error", one.stamp_error, "s", verdict, detail)
    for j, joint in enumerate(one.joints):
        speed, rate = one.fusion.weight[:, j]
        if speed > 0 or rate > 0:
            detail = f"has {100 * speed:.0f} % of the say in speed, {100 * rate:.0f} % in "
            detail += "acceleration; the position's rate has the rest, by their noises"
            found.note(column_name(joint, "velocity"), "fused", speed, "1", "ok", detail)
    for joint, seen in two_sides(one).items():
        column = column_name(joint, "motor_position")
        if seen.elastic:
            k, low, high = seen.stiffness
            detail = f"winds up with the effort: {k:.4g} {one.unit}/rad ({low:.4g} to {high:.4g})"
            found.note(column, "elasticity", k, f"{one.unit}/rad", "ok", detail)
        if seen.plays:
            w, e = seen.width
            detail = f"plays {1e3 * w:.3g} mrad ({1e3 * (w - 1.96 * e):.3g} to "
            detail += f"{1e3 * (w + 1.96 * e):.3g}) as the effort changes sides"
            found.note(column, "play", w, "rad", "ok", detail)
        if not (seen.elastic or seen.plays):
            detail = f"motor and joint agree to {1e3 * seen.scatter:.2g} mrad under load"
            found.note(column, "rigid", seen.scatter, "rad", "ok", detail)
    for joint, ripple in ripples(one).items():
        detail = (
            f"repeats {ripple.order:.4g} times per turn with {ripple.amplitude:.3g} {one.unit}, "
            "above the cut-off; seen over the angle at the log's full bandwidth"
        )
        column = column_name(joint, one.channel)
        found.note(column, "ripple", ripple.amplitude, one.unit, "ok", detail)
    return found


def two_sides(one: Prepared) -> dict[str, TwoSides]:
    """Joint to what its two positions tell, where it has two and a torque shows it."""
    motor = one.other.get("motor_position")
    if motor is None or one.log.position_source != "joint":
        return {}
    out = {}
    for j, joint in enumerate(one.joints):
        good = np.isfinite(motor[:, j])
        if good.mean() < 0.5 or not np.isfinite(one.noise[j]):
            continue
        filled = np.interp(one.time, one.time[good], motor[good, j])
        ahead = one.lowpass(filled[:, None])[:, 0] - one.q[:, j]
        rest = 3.0 * float(one.fusion.noise[0, j])
        # While the filter sees the torque change sides, a step is no step yet.
        side = one.lowpass(np.sign(one.effort[:, [j]]))[:, 0]
        good = one.mask[:, j] & (np.abs(side) > _ONE_SIDE)
        seen = read_off(ahead, one.effort[:, j], one.v[:, j], good, float(one.noise[j]), rest)
        if seen is not None:
            out[joint] = seen
    return out


def ripples(one: Prepared) -> dict[str, Ripple]:
    """Joint to the ripple that stands out above the cut-off, where one does."""
    cutoff = min(one.cutoff, _ABOVE)
    lowpass = LowPass(one.rate, cutoff)
    raw = one.unfiltered_effort()
    rest = raw - lowpass.smooth(raw, one.pieces)
    rest[~one.mask] = np.nan
    found = {
        joint: strongest_order(rest[:, j], one.q[:, j], one.v[:, j], one.rate)
        for j, joint in enumerate(one.joints)
    }
    return {joint: ripple for joint, ripple in found.items() if ripple is not None}


@dataclass(frozen=True)
class Ripple:
    """A torque periodic in the joint's angle."""

    order: float  #: Periods per turn [1].
    amplitude: float  #: In the effort's unit.
    phase: float  #: Of amplitude * sin(order * q + phase) [rad].
    chance: float  #: That noise makes as strong a one at any order.


def strongest_order(rest: Array, angle: Array, velocity: Array, rate: float) -> Ripple | None:
    """The order that stands out most; None where none does, or the joint does not turn far enough.

    Args:
        rest: Effort above the cut-off, shape (N,).
        angle: Of the joint, shape (N,) [rad].
        velocity: Likewise [rad/s].
        rate: Rows per second [Hz].
    """
    good = np.isfinite(rest) & np.isfinite(angle)
    span = float(np.ptp(angle[good])) if good.any() else 0.0
    fast = float(np.quantile(np.abs(velocity[good]), 0.5)) if good.any() else 0.0
    if good.sum() < _RIPPLE_ROWS or span <= 0.05 or fast <= 0:
        return None
    # Above this order half of the rows would see less than three samples of a period.
    highest = min(_MOST_ORDER, 2 * np.pi * rate / (3.0 * fast))
    step = 2 * np.pi / (_BINS * highest)
    bins = int(np.ceil(span / step)) + 1
    size = 1 << int(np.ceil(np.log2(4 * bins)))
    low = float(angle[good].min())
    spectra = []
    for sign in (1.0, -1.0):
        rows = good & (sign * velocity > 0.2 * fast)
        if rows.sum() < _RIPPLE_ROWS // 2:
            return None
        k = ((angle[rows] - low) / step).astype(int)
        sums = np.bincount(k, rest[rows] - rest[rows].mean(), minlength=bins)
        spectra.append(np.fft.rfft(sums, size) / rows.sum())
    order = 2 * np.pi * np.arange(size // 2 + 1) / (size * step)
    inside = (order <= highest) & (order > 4.0 * 2 * np.pi / span)
    if inside.sum() < 16:
        return None
    product = (spectra[0] * np.conj(spectra[1])).real
    scatter = _local(np.abs(spectra[0]) ** 2) * _local(np.abs(spectra[1]) ** 2)
    score = np.where(inside, product / np.sqrt(np.maximum(scatter, 1e-300)), 0.0)
    best = int(np.argmax(score))
    # The real part of a product of two unit complex normals: P(> z) = exp(-2 z) / 2.
    tries = float(inside.sum()) * bins / size * 2.0
    chance = min(1.0, 0.5 * tries * float(np.exp(-2.0 * score[best])))
    if chance > CHANCE:
        return None
    total = 0.5 * (spectra[0][best] + spectra[1][best]) * np.exp(-1j * order[best] * low)
    # r = a sin(k q + p) sums to a / 2 (sin p - i cos p) ... a exp(i (p - pi / 2)) / 2
    return Ripple(
        float(order[best]),
        2.0 * float(np.abs(total)),
        float((np.angle(total) + np.pi / 2) % (2 * np.pi)),
        chance,
    )


def _local(power: Array) -> Array:
    """Mean power of exponentially distributed neighbours, by their median, away from peaks."""
    from scipy.ndimage import median_filter

    width = int(min(max(power.size // 8, 65), 1025)) | 1
    return np.asarray(median_filter(power, width, mode="nearest") / np.log(2.0))


@dataclass(frozen=True)
class TwoSides:
    """What two positions of a joint tell."""

    compliance: tuple[float, float]  #: 1 / k [rad/(N*m)], and its standard error.
    #: Of the play [rad], and its standard error; NaN where the torque has one sign only.
    width: tuple[float, float]
    loop: tuple[float, float]  #: h, and its standard error [rad].
    scatter: float  #: What is left, root mean square [rad].
    rows: int  #: That were used.

    @property
    def elastic(self) -> bool:
        """Whether a spring shows: a wind-up with the torque, and not against it."""
        return self.compliance[0] > SEEN * self.compliance[1]

    @property
    def plays(self) -> bool:
        """Whether play shows."""
        return bool(self.width[0] > SEEN * self.width[1])

    @property
    def stiffness(self) -> tuple[float, float, float]:
        """K with the ends of its 95 % interval [N*m/rad]; infinite where no spring shows."""
        c, e = self.compliance
        if not self.elastic:
            return np.inf, 1.0 / max(c + 1.96 * e, 1e-300), np.inf
        return 1.0 / c, 1.0 / (c + 1.96 * e), 1.0 / max(c - 1.96 * e, 1e-300)


def read_off(
    ahead: Array, torque: Array, velocity: Array, ok: Mask, noise: float, rest: float
) -> TwoSides | None:
    """Fit line, step and loop; None where the torque hardly changes or too few rows are left.

    Args:
        ahead: Motor over ratio less joint, shape (N,) [rad], at one bandwidth with the torque.
        torque: Between them, shape (N,) [N*m].
        velocity: Of the joint, shape (N,) [rad/s].
        ok: Rows that are good, shape (N,).
        noise: Standard deviation of the torque [N*m].
        rest: Speed below which the joint's direction is not known [rad/s].
    """
    good = ok & np.isfinite(ahead) & np.isfinite(torque) & (np.abs(velocity) > rest)
    # The torque that was logged has friction in it: the side is that of what passes the play.
    sure = max(
        _SURE * noise, _FRICTION * float(np.sqrt(np.mean(torque[good] ** 2))) if good.any() else 0.0
    )
    found = None
    for _ in range(3):
        rows = np.flatnonzero(good & (np.abs(torque) > sure))
        if rows.size < _LEAST_ROWS or np.ptp(torque[rows]) < 10.0 * noise:
            return found
        t, side = torque[rows], np.sign(torque[rows])
        signs = (side > 0).mean()
        both = 0.05 < signs < 0.95
        columns = [np.ones_like(t), t, 0.5 * np.sign(velocity[rows])]
        columns += [0.5 * side] if both else []
        x = np.stack(columns, axis=1)
        solution, errors, scatter = _by_blocks(x, ahead[rows])
        width = (solution[3], errors[3]) if both else (np.nan, np.nan)
        found = TwoSides(
            (float(solution[1]), float(errors[1])),
            (float(width[0]), float(width[1])),
            (float(solution[2]), float(errors[2])),
            scatter,
            rows.size,
        )
        # Friction between motor and spring: the spring's torque is that much off the motor's.
        loop = abs(found.loop[0]) / found.compliance[0] / 2.0 if found.elastic else 0.0
        wider = _SURE * noise + loop
        if wider <= sure * 1.01 or wider > 0.5 * float(np.abs(torque[good]).max()):
            break
        sure = wider
    return found


def _by_blocks(x: Array, y: Array) -> tuple[Array, Array, float]:
    """Least squares; standard errors from the scatter between consecutive blocks of rows."""
    scale = np.abs(x).max(axis=0)
    design = x / scale
    solution, *_ = np.linalg.lstsq(design, y, rcond=None)
    rest = y - design @ solution
    inverse = np.linalg.pinv(design.T @ design)
    edges = np.linspace(0, y.size, _BLOCKS + 1).astype(int)
    scores = np.stack([design[a:b].T @ rest[a:b] for a, b in pairwise(edges)])
    grown = _BLOCKS / (_BLOCKS - 1.0)
    errors = np.sqrt(np.diag(inverse @ (scores.T @ scores) @ inverse) * grown)
    return solution / scale, errors / scale, float(np.sqrt(np.mean(rest**2)))
