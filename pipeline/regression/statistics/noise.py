"""Noise of a joint's torque: white and coloured as one autoregression, and what rows are worth.

The residual of the richest model is what no law explains: its autoregression by Yule and Walker
whitens both sides of the regression (feasible generalised least squares). Rows at which the sign of
the velocity is in doubt carry the variance of the friction on top; they are weighted, not cut out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

Array = NDArray[np.float64]
Span = tuple[int, int]

#: Longest autoregression tried, rows.
LONGEST: Final = 12
#: White part added to the autocovariance at lag zero: no band is trusted more than it allows.
WHITE: Final = 0.01


@dataclass(frozen=True)
class Colour:
    """Noise of one joint.

    Attributes:
        ar: Coefficients of e_t = sum ar_k e_(t-k) + u_t, (p,).
        sigma: Standard deviation of u [N*m].
        level: Standard deviation of e [N*m].
        correlation: Time over which e stays correlated, both sides together [rows].
    """

    ar: Array
    sigma: float
    level: float
    correlation: float

    @property
    def memory(self) -> int:
        """Rows the whitening looks back."""
        return len(self.ar)

    def below(self, frequency: float, rate: float) -> float:
        """Standard deviation of the part below a frequency [Hz] of rows at a rate [Hz]."""
        f = np.linspace(0.0, 0.5, 513)
        turns = np.exp(-2j * np.pi * np.outer(f, np.arange(1, self.memory + 1)))
        power = 1.0 / np.abs(1.0 - turns @ self.ar) ** 2
        share = float(power[f <= frequency / rate].sum() / power.sum())
        return self.level * float(np.sqrt(share))

    def whiten(self, x: Array) -> Array:
        """Filter a contiguous stretch, (N, ...) to (N - p, ...), and scale it to unit noise."""
        if len(x) <= self.memory:
            return x[:0]
        p, n = self.memory, len(x)
        out: Array = x[p:].copy()
        for k, a in enumerate(self.ar, start=1):
            out -= a * x[p - k : n - k]
        return out / self.sigma


def colour(residual: Array, spans: Sequence[Span], longest: int = LONGEST) -> Colour:
    """Fit an autoregression to stretches of one joint's residual; its order by BIC.

    Args:
        residual: (N,) [N*m].
        spans: Contiguous stretches, first row and row after the last.
        longest: Longest order tried.
    """
    lags = longest + 1
    n = sum(b - a for a, b in spans)
    cov = np.zeros(lags)
    for a, b in spans:
        x = residual[a:b]
        for k in range(min(lags, b - a)):
            cov[k] += float(x[: b - a - k] @ x[k:])
    cov /= max(n, 1)
    if cov[0] <= 0:
        return Colour(np.zeros(0), 1e-12, 1e-12, 1.0)
    level = float(np.sqrt(cov[0]))
    cov[0] *= 1.0 + WHITE
    best = (np.inf, np.zeros(0), cov[0])
    for p in range(lags):
        ar = scipy.linalg.solve_toeplitz(cov[:p], cov[1 : p + 1]) if p else np.zeros(0)
        variance = float(cov[0] - ar @ cov[1 : p + 1])
        score = n * np.log(max(variance, 1e-300)) + p * np.log(max(n, 2))
        if score < best[0]:
            best = (score, ar, variance)
    gain = 1.0 - float(best[1].sum())
    # Long-run variance over variance: how many rows count as one.
    correlation = float(np.clip(best[2] / gain**2 / cov[0], 1.0, n / 4)) if gain > 0 else n / 4
    return Colour(best[1], float(np.sqrt(best[2])), level, correlation)


def weights(doubt: Array, friction: float, level: float) -> Array:
    """Weight of rows whose friction is unsure by `doubt` times its square, (N,)."""
    return 1.0 / np.sqrt(1.0 + doubt * (friction / max(level, 1e-12)) ** 2)
