"""The terms of what a supply gives: each a column of one regression, one row per sample.

    P = sum_j (work + friction + copper of drive j, where it draws)  +  sum_t coefficient_t column_t

The first sum is the model's; each column is a power that it may lack, with a coefficient that lies
between bounds. A drive of efficiency eta draws 1 / eta for each watt, so that `drivers` has the
coefficient 1 / eta - 1; of what motors return to the bus the share `returned` is used again
(Seok et al. 2015, IEEE/ASME Trans. Mechatronics 20(3), section II, has the same budget).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array, Mask
from pipeline.identification.supply.drawn import Drawn
from pipeline.identification.supply.samples import Samples

#: A coefficient of what the supply gives for a motor's work counts the losses on the way, too.
_UNSEEN = "that no torque shows, at each joint, with what drivers and windings lose for it"
#: Of the model's own sum.
OWN = ("work", "friction", "copper")


@dataclass(frozen=True)
class Term:
    """A power that the model's sum may lack."""

    name: str  #: Of the column, with its leg where it has one, e.g. ``extra_friction lf``.
    words: str  #: What it is.
    unit: str  #: Of the coefficient.
    low: float = 0.0  #: Least coefficient.
    high: float = np.inf  #: Greatest coefficient.


@dataclass(frozen=True, eq=False)
class Rows:
    """Samples of the supply of all logs with what they are held against; shapes (K,)."""

    log: NDArray[np.intp]  #: Number of each sample's log.
    begin: Array  #: [s].
    end: Array  #: [s].
    power: Array  #: Measured [W].
    own: Mapping[str, Array]  #: Of the model's sum, by `OWN` [W].
    #: By a term's name; a coefficient of one gives watts or the term's unit.
    columns: Mapping[str, Array]
    #: Motor currents summed, times the supply's voltage where it is known, by their sign.
    summed: Mapping[str, Array]

    def __len__(self) -> int:
        return self.power.size

    @property
    def predicted(self) -> Array:
        """The model's sum [W]."""
        return np.asarray(sum(self.own.values()))

    def only(self, kept: Mask | NDArray[np.intp]) -> Rows:
        """Some of them, in order."""
        return Rows(
            self.log[kept],
            self.begin[kept],
            self.end[kept],
            self.power[kept],
            *(
                {name: x[kept] for name, x in by_name.items()}
                for by_name in (self.own, self.columns, self.summed)
            ),
        )


def terms_of(legs: Sequence[str], *, switched: bool) -> tuple[Term, ...]:
    """Everything the model's sum may lack.

    Args:
        legs: Groups of joints, by name.
        switched: Whether some drive was off for a while.
    """
    out = [
        Term("constant", "electronics and idle drives, the same all the time", "W"),
        Term("drivers", "drivers' losses over the power into the motors, 1/efficiency - 1", "1"),
        Term("switching", "drivers' losses over bus voltage times motor current", "1", high=0.1),
        Term("returned", "share of what motors return that is used again", "1", high=1.0),
        Term("copper", "copper losses beyond the data sheet's, relative", "1", low=-1.0),
        Term("friction", "friction beyond the log's or the model's, relative", "1", low=-1.0),
        Term("extra_friction", f"dry friction {_UNSEEN}", "N*m"),
        Term("extra_viscous", f"viscous friction {_UNSEEN}", "N*m*s/rad"),
    ]
    out += [Term(f"extra_friction {leg}", f"friction of {leg} {_UNSEEN}", "N*m") for leg in legs]
    if switched:
        out.append(Term("idle", "each drive that is on", "W"))
    return tuple(out)


def rows_of(
    number: int, drawn: Drawn, samples: Samples, legs: Mapping[str, Sequence[int]], reading: str
) -> Rows:
    """Samples of one log's supply with the terms' mean power; those that are not known left out.

    Args:
        number: Of the log.
        drawn: By the drives.
        samples: Of the supply.
        legs: Columns of joints by the leg's name.
        reading: ``"mean"`` since the sample before, or at the ``"instant"`` of the sample.
    """
    positive = drawn.electrical > 0.0
    bus = 1.0 if np.isnan(samples.voltage).any() else float(np.mean(samples.voltage))
    size = np.abs(drawn.current)
    series = {name: np.where(positive, getattr(drawn, name), 0.0).sum(axis=1) for name in OWN}
    series |= {
        "constant": np.ones(drawn.time.size),
        "drivers": np.maximum(drawn.electrical, 0.0).sum(axis=1),
        "switching": bus * size.sum(axis=1),
        "returned": np.minimum(drawn.electrical, 0.0).sum(axis=1),
        "idle": drawn.enabled.sum(axis=1).astype(np.float64),
        "extra_friction": np.abs(drawn.speed).sum(axis=1),
        "extra_viscous": (drawn.speed**2).sum(axis=1),
        "magnitudes": size.sum(axis=1),
        "signed": drawn.current.sum(axis=1),
    }
    for leg, columns in legs.items():
        series[f"extra_friction {leg}"] = np.abs(drawn.speed[:, list(columns)]).sum(axis=1)
    names = list(series)
    means, known = _read_off(drawn, np.stack([series[n] for n in names], axis=1), samples, reading)
    column = dict(zip(names, means.T, strict=True))
    volts = np.where(np.isnan(samples.voltage), 1.0, samples.voltage)
    summed = {n: volts * column.pop(n) for n in ("magnitudes", "signed")}
    own = {name: column[name] for name in OWN}
    column.pop("work")
    every = Rows(
        np.full(samples.end.size, number),
        samples.begin,
        samples.end,
        samples.power,
        own,
        column,
        summed,
    )
    return every.only(known)


def joined(parts: Sequence[Rows]) -> Rows:
    """Rows of several logs, one after the other."""

    def by_name(every: Sequence[Mapping[str, Array]]) -> dict[str, Array]:
        return {name: np.concatenate([one[name] for one in every]) for name in every[0]}

    return Rows(
        np.concatenate([p.log for p in parts]),
        np.concatenate([p.begin for p in parts]),
        np.concatenate([p.end for p in parts]),
        np.concatenate([p.power for p in parts]),
        by_name([p.own for p in parts]),
        by_name([p.columns for p in parts]),
        by_name([p.summed for p in parts]),
    )


def _read_off(drawn: Drawn, series: Array, samples: Samples, reading: str) -> tuple[Array, Mask]:
    """Series (N, S) at the samples, (K, S), and which of them are known throughout, (K,)."""
    begin, end, time = samples.begin, samples.end, drawn.time
    if reading == "instant":
        begin, end = end - 0.5 * drawn.reach, end + 0.5 * drawn.reach
    pace = np.diff(time)[:, None]
    whole = (pace < 1.5 * drawn.step) & (drawn.usable[1:] & drawn.usable[:-1])[:, None]
    area = np.where(whole, 0.5 * pace * (series[1:] + series[:-1]), 0.0)
    total = np.cumsum(np.concatenate([np.zeros((1, series.shape[1])), area]), axis=0)
    covered = np.cumsum(np.concatenate([[0.0], np.where(whole, pace, 0.0)[:, 0]]))

    def between(x: Array) -> Array:
        return np.interp(end, time, x) - np.interp(begin, time, x)

    span = end - begin
    means = np.stack([between(x) for x in total.T], axis=1) / span[:, None]
    return means, np.asarray(between(covered) > 0.999 * span - 1e-9)
