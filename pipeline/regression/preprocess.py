"""Columns of a log to rows of a regression: one zero-phase low-pass for everything, derivatives.

The cut-off is found from the data: acceleration is what differentiation spoils first, and noise in
a regressor shrinks what is fitted to it by noise / (signal + noise). The cut-off is the largest at
which that share stays below `SHRINK` at every joint that moves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import scipy.interpolate
import scipy.signal
from numpy.typing import NDArray

from actuators.presliding import presliding
from pipeline.regression.errors import RegressionError

Array = NDArray[np.float64]

#: Largest share of noise in an acceleration, so the largest shrinkage of a fitted inertia: less
#: than intervals are wide.
SHRINK: Final = 0.001
#: Rows kept per second and hertz of the cut-off: what lies above half of it is filtered away.
ROWS_PER_HERTZ: Final = 2.5
#: Rows so many periods of the cut-off from either end of a run are left out: a filter invents
#: what it does not see there, and an acceleration twice so.
EDGE: Final = 1.0
#: Samples of a spectrum, so many averages at least.
AVERAGES: Final = 8


@dataclass(frozen=True)
class Rows:
    """Rows of a regression, joints along the second axis.

    Attributes:
        time: (N,) [s].
        q: Position, (N, J) [rad].
        v: Velocity [rad/s].
        a: Acceleration [rad/s^2].
        tau: Torque, low-passed like the rest [N*m].
        start: Index of the first row of every run without gaps, ascending from 0.
        rate: Rows per second [Hz].
        cutoff: Of the low-pass; amplitude is halved there [Hz].
        sigma_v: Standard deviation of a velocity's noise, (J,) [rad/s].
        fine: Position, velocity and acceleration before thinning, (M, J) each: friction jumps
            where a velocity changes sign, and is filtered as the torque was.
        fine_start: Index of the first fine row of every run.
        fine_rate: Fine rows per second [Hz].
        every: Fine rows per row.
        fine_tau: Torque before thinning, (M, J) [N*m].
        edge: Fine rows at either end of every run that are no rows.
    """

    time: Array
    q: Array
    v: Array
    a: Array
    tau: Array
    start: tuple[int, ...]
    rate: float
    cutoff: float
    sigma_v: Array
    fine: tuple[Array, Array, Array]
    fine_start: tuple[int, ...]
    fine_rate: float
    every: int
    fine_tau: Array
    edge: int

    def corrected(self, zero: Array, gain: Array, late: Array) -> Rows:
        """Rows without what sensors get wrong.

        Args:
            zero: By which positions read too much, (J,) [rad].
            gain: How many times what they should torques read, (J,).
            late: By which torques come after positions, (J,) [s].
        """
        q, v, a = self.fine
        return replace(
            self,
            q=self.q - zero,
            tau=(self.tau + self.thin(self._earlier(late) - self.fine_tau)) / gain,
            fine=(q - zero, v, a),
        )

    def slid(self, joint: int | Array, travel: float, begun: float = 1.0) -> Array:
        """Sense of friction that rises over a travel after every reversal, fine, (M,).

        Args:
            joint: Its column, or the angles of a shaft of its own, (M,) [rad].
            travel: [rad].
            begun: 1 where a run begins as it goes on, -1 where the other way.
        """
        q = joint if isinstance(joint, np.ndarray) else self.fine[0][:, joint]
        ends = [*self.fine_start[1:], len(q)]
        parts = []
        for a, b in zip(self.fine_start, ends, strict=True):
            t = np.arange(b - a) / self.fine_rate
            first = np.sign(np.diff(q[a:b], prepend=q[a] - (q[min(a + 1, b - 1)] - q[a])))
            first[0] *= begun
            parts.append(presliding(t, q[a:b], first, travel))
        return np.concatenate(parts)

    def _earlier(self, late: Array) -> Array:
        """Fine torque brought forward by a time per joint [s]; the last rows keep their value."""
        out = self.fine_tau.copy()
        ends = [*self.fine_start[1:], len(out)]
        for a, b in zip(self.fine_start, ends, strict=True):
            t = np.arange(b - a) / self.fine_rate
            for j in np.flatnonzero(late):
                spline = scipy.interpolate.CubicSpline(t, out[a:b, j])
                out[a:b, j] = spline(np.clip(t + late[j], t[0], t[-1]))
        return out

    def thin(self, x: Array) -> Array:
        """Rows of fine values, (M, ...) to (N, ...), without a filter."""
        ends = [*self.fine_start[1:], len(x)]
        parts = [self._inner(x[a:b]) for a, b in zip(self.fine_start, ends, strict=True)]
        return np.concatenate(parts)

    def _inner(self, x: Array) -> Array:
        """Rows of one run's fine values."""
        return inner(x, self.edge, self.every)

    def filtered(self, x: Array) -> Array:
        """Rows of fine values through the low-pass that the torque went through."""
        ends = [*self.fine_start[1:], len(x)]
        parts = [
            self._inner(low_pass(x[a:b], self.fine_rate, self.cutoff))
            for a, b in zip(self.fine_start, ends, strict=True)
        ]
        return np.concatenate(parts)


@dataclass(frozen=True)
class Run:
    """One recording without long gaps, on its own time stamps.

    Attributes:
        time: Ascending, (N,) [s].
        q: (N, J) [rad].
        tau: (N, J) [N*m].
        v: Velocity as logged, (N, J) [rad/s], or none.
    """

    time: Array
    q: Array
    tau: Array
    v: Array | None = None


def low_pass(x: Array, rate: float, cutoff: float) -> Array:
    """Butterworth of order 4, forward and backward: zero phase, half amplitude at the cut-off."""
    if cutoff >= 0.49 * rate:
        return x
    sos = scipy.signal.butter(4, 2 * cutoff / rate, output="sos")
    pad = min(len(x) - 1, int(3 * rate / cutoff))
    out: Array = scipy.signal.sosfiltfilt(sos, x, axis=0, padlen=pad)
    return out


def rows(runs: Sequence[Run], cutoff: float | None = None, rate: float | None = None) -> Rows:
    """Filter, differentiate and thin recordings.

    Args:
        runs: Recordings of the same joints.
        cutoff: [Hz]; found from the data by default.
        rate: Rows kept per second [Hz]; `ROWS_PER_HERTZ` times the cut-off by default.

    Raises:
        RegressionError: No recording is long enough.
    """
    step = float(np.median(np.concatenate([np.diff(r.time) for r in runs])))
    full = 1.0 / step
    grids = [_uniform(run, step) for run in runs if len(run.time) >= 16]
    if not grids:
        raise RegressionError("no recording has 16 samples or more")
    noise = _noise([g[0] for g in grids], full, derivative=0)
    logged = all(g[2] is not None for g in grids)
    noise_v = _noise([g[2] for g in grids if g[2] is not None], full, 1) if logged else noise
    cutoff, logged = _band(grids, full, (noise, noise_v if logged else None), cutoff)
    rate = min(rate or ROWS_PER_HERTZ * cutoff, full)
    every = max(1, round(full / rate))
    edge = round(EDGE * full / cutoff)
    parts: list[tuple[Array, ...]] = []
    whole: list[tuple[Array, Array, Array, Array]] = []
    start, n, fine_start, m = [], 0, [], 0
    for q, tau, v, t in grids:
        qs = low_pass(q, full, cutoff)
        vs = (
            low_pass(v, full, cutoff) if v is not None and logged else np.gradient(qs, step, axis=0)
        )
        a = np.gradient(vs, step, axis=0)
        taus = low_pass(tau, full, cutoff)
        part = tuple(inner(x, edge, every) for x in (t, qs, vs, a, taus))
        whole.append((qs, vs, a, taus))
        fine_start.append(m)
        m += len(t)
        start.append(n)
        n += len(part[0])
        parts.append(part)
    time, q, v, a, tau = (np.concatenate(x) for x in zip(*parts, strict=True))
    of_speed = noise_v * cutoff if logged else noise * (2 * np.pi) ** 2 * cutoff**3 / 3
    fine = tuple(np.concatenate(x) for x in zip(*whole, strict=True))
    return Rows(
        time,
        q,
        v,
        a,
        tau,
        tuple(start),
        full / every,
        cutoff,
        np.sqrt(of_speed),
        (fine[0], fine[1], fine[2]),
        tuple(fine_start),
        full,
        every,
        fine[3],
        edge,
    )


def _band(
    grids: Sequence[tuple[Array, Array, Array | None, Array]],
    rate: float,
    noise: tuple[Array, Array | None],
    cutoff: float | None,
) -> tuple[float, bool]:
    """Cut-off [Hz], and whether speed is the logged one.

    Args:
        grids: Position, torque, velocity and time of recordings.
        rate: [Hz].
        noise: Densities of position and logged velocity, (J,) each; None where none is logged.
        cutoff: Where it is known [Hz].
    """
    of_position, of_velocity = noise
    logged = of_velocity is not None
    if cutoff is None:
        # Of the two the one that lets acceleration be known further up.
        cutoff = _cutoff(grids, rate, of_position, logged=False)
        if of_velocity is not None:
            by_velocity = _cutoff(grids, rate, of_velocity, logged=True)
            logged, cutoff = by_velocity >= cutoff, max(cutoff, by_velocity)
    elif of_velocity is not None:
        quieter = of_velocity / 3 < of_position * (2 * np.pi * cutoff) ** 2 / 5
        logged = bool(np.median(quieter) > 0)
    return min(cutoff, 0.49 * rate), logged


def inner(x: Array, edge: int, every: int) -> Array:
    """One value in so many, edges left out; a quarter of a short series at most."""
    edge = min(edge, len(x) // 4)
    return x[edge : len(x) - edge : every]


def _uniform(run: Run, step: float) -> tuple[Array, Array, Array | None, Array]:
    """Position, torque, velocity and time on a uniform grid."""
    grid = np.arange(run.time[0], run.time[-1] + 0.5 * step, step)

    def on(x: Array) -> Array:
        return np.column_stack([np.interp(grid, run.time, c) for c in x.T])

    return on(run.q), on(run.tau), None if run.v is None else on(run.v), grid


def spectra(parts: Sequence[Array], rate: float) -> tuple[Array, Array]:
    """One-sided spectral density averaged over recordings by length: (F,) and (F, J)."""
    longest = min(len(p) for p in parts)
    size = int(max(16, min(longest, sum(len(p) for p in parts) // AVERAGES)))
    total, weight = np.zeros((size // 2 + 1, parts[0].shape[1])), 0
    for p in parts:
        f, s = scipy.signal.welch(p, rate, nperseg=size, axis=0, detrend="constant")
        total, weight = total + s * len(p), weight + len(p)
    return f, np.asarray(total / weight)


def _noise(parts: Sequence[Array], rate: float, derivative: int) -> Array:
    """Density of white noise, (J,): the upper third of the band, at least the rounding's."""
    f, s = spectra(parts, rate)
    upper = (f > 0.3 * rate) & (f < 0.48 * rate)
    level = np.median(s[upper], axis=0) / 0.7 if upper.any() else s[-1]
    rounding = np.array(
        [_resolution(np.concatenate([p[:, j] for p in parts])) for j in range(s.shape[1])]
    )
    return np.maximum(level, rounding**2 / 12 / (rate / 2))


def _resolution(x: Array) -> float:
    """Step of a rounded column: the least difference that occurs (zero where none is seen)."""
    gaps = np.diff(np.unique(x))
    span = float(np.ptp(x))
    gaps = gaps[gaps > 1e-12 * max(span, 1e-300)]
    return float(np.quantile(gaps, 0.05)) if gaps.size and gaps.size < x.size / 3 else 0.0


def _cutoff(
    grids: Sequence[tuple[Array, Array, Array | None, Array]],
    rate: float,
    noise: Array,
    logged: bool,
) -> float:
    """The largest cut-off at which noise stays below `SHRINK` of every acceleration [Hz]."""
    parts = [g[2] if logged and g[2] is not None else g[0] for g in grids]
    f, s = spectra(parts, rate)
    order = 2 if logged else 4
    w = (2 * np.pi * f[:, None]) ** order
    df = f[1] - f[0]
    signal = np.cumsum(np.maximum(s - noise, 0.0) * w, axis=0) * df
    spoiled = np.cumsum(noise * w, axis=0) * df
    best = []
    for j in range(s.shape[1]):
        if signal[-1, j] <= 0 or s[1:4, j].max() < 10 * noise[j]:
            continue  # it stands still: nothing of it is spoiled
        good = spoiled[:, j] <= SHRINK * signal[:, j]
        good[:3] = True
        best.append(float(f[len(good) - 1 - int(np.argmax(good[::-1]))]))
    return max(min(best, default=0.2 * rate), 3 * f[1])
