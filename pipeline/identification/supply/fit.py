"""One bounded least-squares fit of a supply's power on a few terms, judged by blocks left out.

    P = sum_j (work + friction + copper of drive j, where it draws)  +  sum_t coefficient_t column_t

The first sum is by log and model. A drive of efficiency eta draws 1 / eta for each watt, so that
`drivers` has the coefficient 1 / eta - 1; of what motors return to the bus the share `returned` is
used again (Seok et al. 2015, IEEE/ASME Trans. Mechatronics 20(3), section II, has the same budget).
A term enters where blocks that were left out are predicted better with it; those that may stand in
another's place are told with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array, Mask
from pipeline.identification.settings import FOLLOWS, LITTLE, METER

if TYPE_CHECKING:
    from pandas import DataFrame

Bounds = Sequence[tuple[float, float]]
#: Of the model's sum.
OWN: Final = {
    "work": "motion of the bodies, where drives draw",
    "friction": "of gears, bearings and rotors, where drives draw",
    "copper": "windings, where drives draw",
}
#: What the sum may lack: meaning, unit and bounds of the coefficient.
TERMS: Final = {
    "constant": ("electronics and idle drives, the same all the time", "W", 0.0, np.inf),
    "drivers": ("drivers' losses over the power into the motors, 1/efficiency - 1", "1", 0.0, 1.0),
    "switching": ("drivers' losses over bus voltage times motor current", "1", 0.0, 0.1),
    "returned": ("share of what motors return that is used again", "1", 0.0, 1.0),
    "more_copper": ("copper losses beyond the data sheet's, relative", "1", -1.0, np.inf),
    "more_friction": ("friction beyond the log's or the model's, relative", "1", -1.0, np.inf),
}
#: Beside them for the joints of every leg: of many that rub a little, or one that does.
RUBBING: Final = ("dry friction at each joint that no torque shows", "N*m", 0.0, np.inf)
#: Fits that leave blocks out.
FOLDS: Final = 6


@dataclass(frozen=True, eq=False)
class Fit:
    """Samples with the terms' columns, and the terms that are in the sum."""

    rows: DataFrame  #: ``power``, those of `OWN` and `TERMS`, sums of currents; samples (K,).
    block: NDArray[np.intp]  #: Of each sample, shape (K,).
    test: Mask  #: Samples that nothing is estimated from, shape (K,).
    terms: tuple[str, ...] = ()

    @property
    def every(self) -> dict[str, tuple[str, str, float, float]]:
        """All terms that the sum may have: those of `TERMS`, and friction by leg."""
        legs = self.rows.columns[self.rows.columns.str.startswith("extra_friction")]
        return TERMS | dict.fromkeys(legs, RUBBING)

    @property
    def left(self) -> Array:
        """Power less the model's sum, (K,) [W]."""
        return (self.rows["power"] - self.rows[[*OWN]].sum(axis=1)).to_numpy()

    def coefficients(self, kept: NDArray[np.intp] | Mask) -> Array:
        """Of the terms by some samples, (T,)."""
        bounds = [self.every[t][2:] for t in self.terms]
        return _solved(self.rows[[*self.terms]].to_numpy()[kept], self.left[kept], bounds)

    def error(self, terms: Sequence[str]) -> float:
        """Mean square error of samples whose block is left out of the fit, test samples apart."""
        return self._missed(self.left, terms, [self.every[t][2:] for t in terms])

    def _missed(self, y: Array, columns: Sequence[str], bounds: Bounds) -> float:
        X, left = self.rows[[*columns]].to_numpy(), y.copy()
        for out in (self.block % FOLDS == k for k in range(FOLDS)):
            kept = ~self.test & ~out
            left[out] -= X[out] @ _solved(X[kept], y[kept], bounds)
        return float(np.mean(left[~self.test] ** 2))

    def chosen(self) -> tuple[str, ...]:
        """Terms that predict left-out blocks better; one that a later one makes needless leaves."""
        terms: list[str] = []
        now, least = self.error(terms), (METER * float(self.rows["power"].mean())) ** 2
        while now > least and (others := [t for t in self.every if t not in terms]):
            best = min(others, key=lambda t: self.error([*terms, t]))
            if self.error([*terms, best]) * (1.0 + LITTLE) ** 2 > now:
                break
            terms.append(best)
            for term in terms[:-1]:
                if self.error([t for t in terms if t != term]) <= self.error(terms):
                    terms.remove(term)
            now = self.error(terms)
        return tuple(terms)

    def exchangeable(self, term: str) -> list[str]:
        """Terms that predict as well in one's place."""
        rest = [t for t in self.terms if t != term]
        worst = self.error(self.terms) * (1.0 + LITTLE) ** 2
        others = (t for t in self.every if t not in self.terms)
        return [t for t in others if self.error([*rest, t]) <= worst]

    def wrong_sum(self) -> bool:
        """Whether the column is motor currents times a voltage: it has to vary as they do.

        One coefficient that predicts as well as several terms is the simpler truth.
        """
        y, free = self.rows["power"].to_numpy(), [(-np.inf, np.inf)]
        best = min(self._missed(y, [name], free) for name in ("magnitudes", "signed"))
        return best < FOLLOWS * float(y.var()) and best <= self.error(self.terms)


def _solved(X: Array, y: Array, bounds: Bounds) -> Array:
    """Bounded least squares, columns scaled to one, (T,)."""
    from scipy.optimize import lsq_linear

    if not X.shape[1]:
        return np.zeros(0)
    size = np.linalg.norm(X, axis=0)
    size[size == 0.0] = 1.0
    ends = np.array(bounds).T * size
    return np.asarray(lsq_linear(X / size, y, (ends[0], ends[1]), method="bvls").x / size)
