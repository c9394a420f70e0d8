"""What a supply gives beside the sum over its drives: one bounded least-squares fit on a few terms.

    P = sum_j (work + friction + copper of drive j, where it draws)  +  sum_t coefficient_t column_t

The first sum is by log and model. A drive of efficiency eta draws 1 / eta for each watt, so that
`drivers` has the coefficient 1 / eta - 1; of what motors return to the bus the share `returned` is
used again (Seok et al. 2015, IEEE/ASME Trans. Mechatronics 20(3), section II, has the same budget).
Rows lie in blocks of consecutive samples, some of which are for the test alone. A term leaves where
the others predict blocks that were left out as well; those that may stand in another's place are
told with it. Intervals are of a bootstrap of blocks (Künsch, Annals of Statistics 17(3), 1989).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array, Mask
from actuators.errors import LegwattError
from pipeline.columns import frame
from pipeline.identification.supply.drives import DrivePower, drive_power
from pipeline.identification.supply.samples import Samples, supply_samples
from pipeline.logs.log import Log
from pipeline.simulation.machine import Machine

if TYPE_CHECKING:
    from pandas import DataFrame

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
UNEXPLAINED, MEASURED = "unexplained", "measured"
#: Fewest samples from which terms can be separated and tested.
FEWEST: Final = 24
#: Share of the root mean square error by which a term has to improve a prediction: where a motion
#: repeats, so do the model's own errors, and what is no better in truth is a little better in every
#: block. Nothing is improved below a share of the power that no meter at a supply tells from zero.
LITTLE: Final = 0.05
METER: Final = 1e-3
#: Part of the measured power below which what stays unexplained is no finding.
SMALL: Final = 0.02
#: Share of the power's variance that a sum may leave which the power is said to follow.
FOLLOWS: Final = 0.5
#: Blocks a log is cut into; every so many one is for the test; fits that leave blocks out.
BLOCKS, TEST_EVERY, FOLDS = 24, 4, 6
DRAWS, SEED = 300, 1


@dataclass(frozen=True, eq=False)
class Account:
    """The answer of `gap power`."""

    power: DataFrame  #: Term by term, what was measured and what stays unexplained last.
    drives: DataFrame  #: Mean power into every drive.
    samples: DataFrame  #: Every sample of the supply.
    logs: tuple[str, ...]  #: Names.
    #: Of measured minus predicted on test samples, by the model's sum and with all terms [W].
    rms: tuple[float, float]
    reading: (
        str  #: Whether a sample is the ``"mean"`` since the one before or of its ``"instant"``.
    )
    #: ``"recognised"``, ``"possible"`` or empty: whether motor currents times the supply's voltage
    #: were taken for its power; where that is recognised nothing is found.
    wrong_sum: str
    sag: Sag | None  #: Where voltage and current of the supply were both measured, else None.
    by_model: tuple[str, ...]  #: Joints whose torque no log tells.

    @property
    def negative(self) -> bool:
        """Whether the column is no power, or more than little stays unexplained."""
        rows = {str(row["term"]): row for row in self.power.to_dict("records")}
        left, measured = rows[UNEXPLAINED], rows[MEASURED]
        clear = not left["mean_low_W"] <= 0.0 <= left["mean_high_W"]
        much = bool(abs(left["mean_W"]) > SMALL * measured["mean_W"])
        return self.wrong_sum == "recognised" or (clear and much)


@dataclass(frozen=True)
class Sag:
    """A supply's resistance with its 95 % interval: V = V0 - R I - a t (Plett, section 2.3)."""

    resistance: float  #: [ohm].
    low: float  #: Lower end [ohm].
    high: float  #: Upper end [ohm].
    voltage: float  #: Without current, at the first sample [V].
    lost: float  #: Mean power that it turns into heat before the voltage is measured [W].


@dataclass(frozen=True, eq=False)
class Fit:
    """Samples with the terms' columns, and the terms that are in the sum."""

    rows: DataFrame  #: ``power``, those of `OWN` and `TERMS`, sums of currents; samples (K,).
    block: NDArray[np.intp]  #: Of each sample, shape (K,).
    test: Mask  #: Samples that nothing is estimated from, shape (K,).
    terms: tuple[str, ...] = ()

    @cached_property
    def every(self) -> dict[str, tuple[str, str, float, float]]:
        """All terms that the sum may have: those of `TERMS`, and friction by leg."""
        legs = (str(name) for name in self.rows if str(name).startswith("extra_friction"))
        return TERMS | dict.fromkeys(legs, RUBBING)

    @property
    def left(self) -> Array:
        """Power less the model's sum, (K,) [W]."""
        return (self.rows["power"] - self.rows[[*OWN]].sum(axis=1)).to_numpy()

    def coefficients(self, kept: NDArray[np.intp] | Mask) -> Array:
        """Of the terms by some samples, (T,)."""
        from scipy.optimize import lsq_linear

        if not self.terms:
            return np.zeros(0)
        X = self.rows[[*self.terms]].to_numpy()[kept]
        size = np.linalg.norm(X, axis=0)
        size[size == 0.0] = 1.0
        low, high = (np.array([self.every[t][k] for t in self.terms]) * size for k in (2, 3))
        return np.asarray(
            lsq_linear(X / size, self.left[kept], (low, high), method="bvls").x / size
        )

    def error(self, terms: Sequence[str]) -> float:
        """Mean square error of samples whose block is left out of the fit, test samples apart."""
        fit, left = Fit(self.rows, self.block, self.test, tuple(terms)), self.left.copy()
        X = self.rows[list(terms)].to_numpy()
        for out in (self.block % FOLDS == k for k in range(FOLDS)):
            left[out] -= X[out] @ fit.coefficients(~self.test & ~out)
        return float(np.mean(left[~self.test] ** 2))

    def chosen(self) -> tuple[str, ...]:
        """Terms without which left-out blocks are predicted worse; the least needed leave first."""
        terms = list(self.every)
        least = (METER * float(self.rows["power"].mean())) ** 2
        while terms:
            now = max(self.error(terms), least)
            without = {t: self.error([o for o in terms if o != t]) for t in terms}
            spare = min(terms, key=without.__getitem__)
            if without[spare] > now * (1.0 + LITTLE) ** 2:
                break
            terms.remove(spare)
        return tuple(terms)

    def exchangeable(self, term: str) -> list[str]:
        """Terms that predict as well in one's place."""
        rest = [t for t in self.terms if t != term]
        worst = self.error(self.terms) * (1.0 + LITTLE) ** 2
        others = (t for t in self.every if t not in self.terms)
        return [t for t in others if self.error([*rest, t]) <= worst]

    def error_of_sum(self, column: str) -> float:
        """The same for one sum of currents times a voltage, taken as the power."""
        x, y = self.rows[column].to_numpy(), self.rows["power"].to_numpy()
        errors = np.zeros(y.size)
        for out in (self.block % FOLDS == k for k in range(FOLDS)):
            kept = ~self.test & ~out
            errors[out] = y[out] - x[out] * float(x[kept] @ y[kept]) / float(x[kept] @ x[kept])
        return float(np.mean(errors[~self.test] ** 2))

    def wrong_sum(self) -> str:
        """Whether the column is motor currents times a voltage: it has to vary as they do."""
        spread = float(self.rows["power"].var())
        every = [self.error_of_sum(column) for column in ("magnitudes", "signed")]
        best = min(every, default=np.inf)
        own = self.error(self.terms)
        if best >= FOLLOWS * spread or best > own * (1.0 + LITTLE) ** 2:
            return ""
        # One coefficient that predicts as well as several terms is the simpler truth.
        return "recognised" if best <= own else "possible"


def account(given: Machine, logs: Sequence[Log], holdout: int, test_last: float | None) -> Account:
    """Hold the supply's samples of all logs against the sum over the drives.

    Args:
        given: The machine, with a motor in every joint.
        logs: At their full rate.
        holdout: How many at the end are for the test.
        test_last: Share of every other log that is for the test.

    Raises:
        LegwattError: A log has no power at the supply, too few samples of it, or a joint no motor.
    """
    import pandas

    drives = [drive_power(given.model, one) for one in logs]
    samples, names = [], tuple(one.name for one in logs)
    for one, d in zip(logs, drives, strict=True):
        assert one.recording is not None
        samples.append(supply_samples(one.recording, d.reach))
    legs, tried = _legs(given), []
    for reading in ("mean", "instant"):
        pairs = zip(drives, samples, strict=True)
        parts = [rows_of(d, s, legs, reading).assign(log=k) for k, (d, s) in enumerate(pairs)]
        rows = pandas.concat(parts, ignore_index=True)
        if len(rows) < FEWEST:
            raise LegwattError(
                f"{', '.join(names)}: {len(rows)} samples of the supply during which all joints "
                f"are known; at least {FEWEST} are needed to separate terms and to test them; "
                "log longer"
            )
        fit = Fit(rows, *_blocks(rows["log"].to_numpy(), holdout, test_last))
        fit = Fit(fit.rows, fit.block, fit.test, fit.chosen())
        tried.append((fit.error(fit.terms), reading, fit))
    _, reading, fit = min(tried, key=lambda one: one[0])
    wrong = fit.wrong_sum()
    if wrong == "recognised":  # no term means anything in what is no power
        fit = Fit(fit.rows, fit.block, fit.test)
    power, explained = _power(fit)
    rows = fit.rows
    predicted = rows[[*OWN]].sum(axis=1).to_numpy()
    misses = [rows["power"].to_numpy() - x for x in (predicted, explained)]
    columns = ([names[k] for k in rows["log"]], rows["begin"], rows["end"], rows["power"])
    every = zip(*columns, predicted, explained, fit.test.tolist(), strict=True)
    return Account(
        power=power,
        drives=_by_drive(given.model.joints, drives),
        samples=frame("power_samples", every),
        logs=names,
        rms=tuple(float(np.sqrt(np.mean(x[fit.test] ** 2))) for x in misses),  # type: ignore[arg-type]
        reading=reading,
        wrong_sum=wrong,
        sag=sag_of(samples),
        by_model=tuple(dict.fromkeys(j for d in drives for j in d.by_model)),
    )


def _power(fit: Fit) -> tuple[DataFrame, Array]:
    """The table of terms by their mean on all samples, and the power by all terms (K,) [W]."""
    rng, rows = np.random.default_rng(SEED), fit.rows
    by_block = [np.flatnonzero(fit.block == b) for b in np.unique(fit.block)]
    own = [b for b in by_block if not fit.test[b[0]]]

    def resampled(blocks: list[NDArray[np.intp]]) -> NDArray[np.intp]:
        return np.concatenate([blocks[k] for k in rng.integers(0, len(blocks), len(blocks))])

    best = fit.coefficients(~fit.test)
    draws = np.array([fit.coefficients(resampled(own)) for _ in range(DRAWS)])
    X, left = rows[[*fit.terms]].to_numpy(), fit.left
    out: list[tuple[Any, ...]] = []
    for name, words in OWN.items():
        mean = float(rows[name].mean())
        out.append((name, words, "model", mean, mean, mean, 1.0, None, None, "1", ""))
    for k, name in enumerate(fit.terms):
        words, unit, *_ = fit.every[name]
        low, high = np.quantile(draws[:, k], [0.025, 0.975])
        watts = np.array([best[k], low, high]) * X[:, k].mean()
        ends = (float(watts[0]), float(watts[1:].min()), float(watts[1:].max()))
        like = "+".join(fit.exchangeable(name))
        out.append(
            (name, words, "found", *ends, float(best[k]), float(low), float(high), unit, like)
        )
    # What is left on test samples scatters by their blocks and by the coefficients.
    test = [b for b in by_block if fit.test[b[0]]]
    spread = [float((left[b] - X[b] @ c).mean()) for c in draws for b in [resampled(test)]]
    over = rows["power"].mean()
    out.append((MEASURED, "by the supply", "", over, over, over, None, None, None, "", ""))
    rest = float((left - X @ best)[fit.test].mean())
    low, high = (float(x) for x in np.quantile(spread, [0.025, 0.975]))
    words = "test samples: measured less the model's sum and all terms"
    out.append((UNEXPLAINED, words, "", rest, low, high, None, None, None, "", ""))
    return frame("power", out), rows["power"].to_numpy() - left + X @ best


def _legs(given: Machine) -> dict[str, list[int]]:
    """Columns of joints by the name of their leg; every joint by itself without legs."""
    joints, loaded = given.model.joints, given.loaded
    of = {} if loaded is None else {j: leg.name for leg in loaded.spec.legs for j in leg.joints}
    out: dict[str, list[int]] = {}
    for k, joint in enumerate(joints):
        out.setdefault(of.get(joint, joint), []).append(k)
    return out


def _by_drive(joints: Sequence[str], drives: Sequence[DrivePower]) -> DataFrame:
    """Mean power by drive over all known rows of all logs."""
    rows = []
    for k, joint in enumerate(joints):
        braking = np.concatenate([d.electrical[d.known, k] < 0.0 for d in drives])
        parts = {n: np.concatenate([getattr(d, n)[d.known, k] for d in drives]) for n in OWN}
        drawn = [float(np.where(braking, 0.0, x).mean()) for x in parts.values()]
        back = float(np.where(braking, sum(parts.values()), 0.0).mean())
        by = "model" if any(joint in d.by_model for d in drives) else "log"
        rows.append((joint, by, *drawn, back))
    return frame("power_drives", rows)


def _blocks(
    log: NDArray[np.intp], holdout: int, test_last: float | None
) -> tuple[NDArray[np.intp], Mask]:
    """Number of each sample's block and whether it is for the test, each (K,)."""
    block, test = np.empty(log.size, dtype=np.intp), np.zeros(log.size, dtype=np.bool_)
    logs = int(log.max()) + 1
    for k in range(logs):
        own = np.flatnonzero(log == k)
        place = np.arange(own.size) * min(BLOCKS, own.size // 2) // own.size
        block[own] = k * BLOCKS + place
        if k >= logs - holdout:
            test[own] = True
        elif test_last is not None:
            test[own] = place >= (1.0 - test_last) * (place[-1] + 1)
        elif not holdout:
            test[own] = place % TEST_EVERY == TEST_EVERY - 1
    return block, test


def rows_of(
    drives: DrivePower, samples: Samples, legs: Mapping[str, list[int]], reading: str
) -> DataFrame:
    """Samples of one log's supply with the terms' mean power; those that are not known left out.

    Args:
        drives: Power into the drives.
        samples: Of the supply.
        legs: Columns of joints by the name of the leg.
        reading: ``"mean"`` since the sample before, or at the ``"instant"`` of the sample.
    """
    import pandas

    draws, size = drives.electrical > 0.0, np.abs(drives.current)
    bus = 1.0 if np.isnan(samples.voltage).any() else float(np.mean(samples.voltage))
    series = {name: np.where(draws, getattr(drives, name), 0.0).sum(axis=1) for name in OWN}
    series |= {
        "constant": np.ones(drives.time.size),
        "drivers": np.maximum(drives.electrical, 0.0).sum(axis=1),
        "switching": bus * size.sum(axis=1),
        "returned": np.minimum(drives.electrical, 0.0).sum(axis=1),
        "more_copper": series["copper"],
        "more_friction": series["friction"],
        **{f"extra_friction {n}": np.abs(drives.speed[:, k]).sum(axis=1) for n, k in legs.items()},
        "magnitudes": size.sum(axis=1),
        "signed": drives.current.sum(axis=1),
    }
    begin, end, time = samples.begin, samples.end, drives.time
    if reading == "instant":
        begin, end = end - 0.5 * drives.reach, end + 0.5 * drives.reach
    pace = np.diff(time)
    whole = (pace < 1.5 * drives.step) & drives.known[1:] & drives.known[:-1]

    def between(x: Array) -> Array:
        total = np.concatenate(
            [[0.0], np.cumsum(np.where(whole, 0.5 * pace * (x[1:] + x[:-1]), 0))]
        )
        return np.interp(end, time, total) - np.interp(begin, time, total)

    span = end - begin
    columns = {name: between(x) / span for name, x in series.items()}
    for name in ("magnitudes", "signed"):
        columns[name] = columns[name] * np.where(np.isnan(samples.voltage), 1.0, samples.voltage)
    measured = {"begin": samples.begin, "end": samples.end, "power": samples.power}
    known = between(np.ones(time.size)) > 0.999 * span - 1e-9
    return pandas.DataFrame(measured | columns)[known]


def sag_of(samples: Sequence[Samples]) -> Sag | None:
    """The supply's resistance; None where voltage and current were not both measured.

    Each log has a voltage without current and a slope in time of its own: a battery runs down.
    """
    if not all(s.measured and np.isfinite(s.current).all() for s in samples):
        return None
    parts, block = [], []
    for k, s in enumerate(samples):
        own = np.zeros((s.end.size, 1 + 2 * len(samples)))
        own[:, 0], own[:, 1 + 2 * k], own[:, 2 + 2 * k] = -s.current, 1.0, s.end - s.end[0]
        parts.append(own)
        block.append(k * BLOCKS + np.arange(s.end.size) * BLOCKS // s.end.size)
    X, number = np.concatenate(parts), np.concatenate(block)
    volts = np.concatenate([s.voltage for s in samples])
    if np.ptp(X[:, 0]) == 0.0:
        return None
    rows = [np.flatnonzero(number == b) for b in np.unique(number)]
    rng, draws = np.random.default_rng(SEED), []
    for _ in range(DRAWS):
        kept = np.concatenate([rows[b] for b in rng.integers(0, len(rows), len(rows))])
        draws.append(np.linalg.lstsq(X[kept], volts[kept], rcond=None)[0][0])
    found = np.linalg.lstsq(X, volts, rcond=None)[0]
    low, high = (float(x) for x in np.quantile(draws, [0.025, 0.975]))
    lost = float(found[0] * np.mean(X[:, 0] ** 2))
    return Sag(float(found[0]), low, high, float(found[1]), lost)
