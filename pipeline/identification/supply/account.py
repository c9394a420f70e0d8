"""What the supply gives, term by term, with what stays unexplained on test samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array, Mask
from actuators.errors import LegwattError
from pipeline.identification.supply.drawn import Drawn, drawn_along
from pipeline.identification.supply.regression import (
    DRAWS,
    SEED,
    Problem,
    Sag,
    better,
    blocks_of,
    choose,
    drawn_coefficients,
    intervals,
    rivals_of,
    sag_of,
)
from pipeline.identification.supply.samples import FEWEST, SHORTEST, supply_samples
from pipeline.identification.supply.terms import OWN, Rows, Term, joined, rows_of, terms_of
from pipeline.identification.workflow.compared import legs_of
from pipeline.logs.log import Log
from pipeline.simulation.machine import Machine

READINGS = ("mean", "instant")
BASIS_MODEL, BASIS_FOUND = "model", "found"
UNEXPLAINED, MEASURED = "unexplained", "measured"
RECOGNISED = "recognised"
#: Share of the power's variance that a sum may leave which the power is said to follow.
FOLLOWS = 0.5
#: Part of the measured power that is rounding.
_ROUNDING: Final = 1e-9
#: Part of the measured power below which what stays unexplained is no finding.
SMALL = 0.02


@dataclass(frozen=True)
class Share:
    """One term's part of the mean power on test samples."""

    term: str  #: Name.
    words: str  #: What it is.
    #: ``"model"``: as log and model say, with a coefficient of one; ``"found"``; empty for sums.
    basis: str
    coefficient: float | None  #: Of its column; None for sums.
    low: float | None  #: Lower end of its 95 % interval.
    high: float | None  #: Upper end.
    unit: str  #: Of the coefficient.
    watts: float  #: Mean [W].
    watts_low: float  #: Lower end of its 95 % interval [W].
    watts_high: float  #: Upper end [W].
    rivals: tuple[str, ...] = ()  #: Terms that may stand in its place without predicting worse.


@dataclass(frozen=True)
class DriveShare:
    """One drive's mean power on test samples [W], by log and model."""

    joint: str
    leg: str
    work: float
    friction: float
    copper: float
    returned: float
    torque: str


@dataclass(frozen=True, eq=False)
class Account:
    """The answer of `gap power`."""

    #: Rows of `power.csv`, what was measured and what stays unexplained last.
    shares: tuple[Share, ...]
    drives: tuple[DriveShare, ...]  #: By joint.
    rows: Rows  #: Every sample.
    proves: Mask  #: Which of them are test samples, shape (K,).
    explained: Array  #: Power by all terms, shape (K,) [W].
    #: Of measured minus predicted on test samples, by the model's sum and with all terms [W].
    rms: tuple[float, float]
    reading: str  #: How samples were read: ``"mean"`` or ``"instant"``.
    #: ``"recognised"``, ``"possible"`` or empty: whether motor currents times the supply's voltage
    #: were taken for its power; where that is recognised nothing is found.
    wrong_sum: str
    sag: Sag | None  #: Where voltage and current of the supply were both measured, else None.
    by_model: tuple[str, ...]  #: Joints whose torque no log tells.
    logs: tuple[str, ...]  #: Names.

    def share(self, term: str) -> Share | None:
        """A term's row, or None where it was not taken in."""
        return next((s for s in self.shares if s.term == term), None)

    @property
    def negative(self) -> bool:
        """Whether the column is no power, or more than little stays unexplained."""
        left, measured = self.share(UNEXPLAINED), self.share(MEASURED)
        assert left is not None
        assert measured is not None
        sure = not left.watts_low <= 0.0 <= left.watts_high
        much = abs(left.watts) > SMALL * abs(measured.watts)
        return self.wrong_sum == RECOGNISED or (sure and much)


def account(
    given: Machine, prepared: Sequence[Log], holdout: int, prove_last: float | None
) -> Account:
    """Hold the supply's samples of all logs against the sum over the drives.

    Args:
        given: The machine.
        prepared: Logs.
        holdout: How many at the end are for the test.
        prove_last: Share of every other log that is for the test.

    Raises:
        LegwattError: A log has no power at the supply, too few samples of it, or a joint no motor.
    """
    drawn = [drawn_along(given.model, one) for one in prepared]
    samples = [
        supply_samples(one.recording, SHORTEST * d.reach)
        for one, d in zip(prepared, drawn, strict=True)
        if one.recording is not None
    ]
    legs = _legs(given)
    terms = terms_of(list(legs), switched=any(not d.enabled.all() for d in drawn))
    tried = []
    for reading in READINGS:
        pairs = enumerate(zip(drawn, samples, strict=True))
        rows = joined([rows_of(k, d, s, legs, reading) for k, (d, s) in pairs])
        if len(rows) < FEWEST:
            logs = ", ".join(one.name for one in prepared)
            raise LegwattError(
                f"{logs}: {len(rows)} samples of the supply during which all joints are known; at "
                f"least {FEWEST} are needed to separate terms and to test them; log longer"
            )
        block, proves = blocks_of(rows, holdout, prove_last)
        problem = Problem(rows.only(~proves), block[~proves], terms)
        names = choose(problem)
        error = float(problem.ahead(names).mean())
        fitted = problem.fit(names), drawn_coefficients(problem, names)
        tried.append(_Chosen(reading, rows, block, proves, problem, names, error, *fitted))
    best = min(tried, key=lambda one: one.error)
    wrong_sum = _wrong_sum(best.problem, best.names)
    if wrong_sum == RECOGNISED:  # no term means anything in what is no power
        best = replace(best, names=(), coefficients=np.zeros(0), draws=np.zeros((DRAWS, 0)))
    misses = [
        float(np.sqrt(np.mean((best.rows.power - x)[best.proves] ** 2)))
        for x in (best.rows.predicted, best.explained)
    ]
    return Account(
        shares=_shares(best),
        drives=_drives(given, drawn, legs),
        rows=best.rows,
        proves=best.proves,
        explained=best.explained,
        rms=(misses[0], misses[1]),
        reading=best.reading,
        wrong_sum=wrong_sum,
        sag=sag_of(samples),
        by_model=tuple(dict.fromkeys(j for d in drawn for j in d.by_model)),
        logs=tuple(one.name for one in prepared),
    )


@dataclass(frozen=True, eq=False)
class _Chosen:
    """Terms that were taken in, by one reading of the samples; `draws` has shape (DRAWS, T)."""

    reading: str
    rows: Rows
    block: NDArray[np.intp]
    proves: Mask
    problem: Problem
    names: tuple[str, ...]
    error: float
    coefficients: Array
    draws: Array

    @property
    def explained(self) -> Array:
        """Power by all terms, shape (K,) [W]."""
        parts = zip(self.names, self.coefficients, strict=True)
        return np.asarray(self.rows.predicted + sum(c * self.rows.columns[n] for n, c in parts))


def _legs(given: Machine) -> dict[str, list[int]]:
    """Columns of joints by the name of their leg; every joint by itself without legs."""
    joints, of = given.model.joints, legs_of(given)
    if of is None or given.loaded is None:
        return {joint: [k] for k, joint in enumerate(joints)}
    names, out = given.loaded.leg_names, dict[str, list[int]]()
    for k, joint in enumerate(joints):
        out.setdefault(names[of[joint]] if joint in of else joint, []).append(k)
    return out


def _wrong_sum(problem: Problem, chosen: Sequence[str]) -> str:
    """Whether the column is motor currents summed, times a voltage: it has to vary as they do."""
    own, spread = problem.ahead(chosen), float(problem.rows.power.var())
    tried = (problem.ahead_of_sum(kind) for kind in problem.rows.summed)
    sums = [error for error in tried if error.mean() < FOLLOWS * spread]
    # One coefficient that predicts as well as several terms is the simpler truth.
    if any(other.mean() <= own.mean() for other in sums):
        return RECOGNISED
    return "possible" if any(not better(own, other) for other in sums) else ""


def _shares(best: _Chosen) -> tuple[Share, ...]:
    """Rows of the table: the model's sum, what was found, what was measured, what is left."""
    proof, block = best.rows.only(best.proves), best.block[best.proves]
    terms = {t.name: t for t in best.problem.terms}
    rivals = rivals_of(best.problem, best.names)
    ends = intervals(best.problem, best.names, best.draws, rivals)
    total = float(proof.power.mean())
    out = []
    for name in OWN:
        mean = float(proof.own[name].mean())
        mean = mean if abs(mean) > _ROUNDING * total else 0.0
        words = _WORDS[name]
        out.append(Share(name, words, BASIS_MODEL, 1.0, None, None, "1", mean, mean, mean))
    for k, name in enumerate(best.names):
        mean = float(proof.columns[name].mean())
        own = float(best.coefficients[k]), *ends[name]
        out.append(_found(terms[name], *own, mean, rivals[name]))
    left = proof.power - proof.predicted
    columns = [proof.columns[n] for n in best.names]
    # What is left scatters by the test blocks and by the coefficients.
    rng = np.random.default_rng(SEED)
    rows = [np.flatnonzero(block == b) for b in np.unique(block)]
    spread = []
    for coefficients in best.draws:
        kept = np.concatenate([rows[b] for b in rng.integers(0, len(rows), len(rows))])
        parts = zip(coefficients, columns, strict=True)
        spread.append(float(np.mean(left[kept])) - sum(c * np.mean(x[kept]) for c, x in parts))
    low, high = (float(x) for x in np.quantile(spread, [0.025, 0.975]))
    watts = float((best.rows.power - best.explained)[best.proves].mean())
    return (
        *out,
        _sum(MEASURED, "by the supply", total, total, total),
        _sum(UNEXPLAINED, "measured less all of the above", watts, low, high),
    )


def _sum(term: str, words: str, watts: float, low: float, high: float) -> Share:
    return Share(term, words, "", None, None, None, "", watts, low, high)


_WORDS = {
    "work": "motion of the bodies, where drives draw",
    "friction": "of gears, bearings and rotors, where drives draw",
    "copper": "windings, where drives draw",
}


def _found(
    term: Term, coefficient: float, low: float, high: float, mean: float, rivals: tuple[str, ...]
) -> Share:
    ends = sorted((low * mean, high * mean))
    name = {"copper": "more_copper", "friction": "more_friction"}.get(term.name, term.name)
    watts = coefficient * mean, ends[0], ends[1]
    return Share(
        name, term.words, BASIS_FOUND, coefficient, low, high, term.unit, *watts, rivals=rivals
    )


def _drives(
    given: Machine, drawn: Sequence[Drawn], legs: dict[str, list[int]]
) -> tuple[DriveShare, ...]:
    """Mean power by drive over all usable rows of all logs."""
    leg_of = {k: leg for leg, columns in legs.items() for k in columns}
    rows = [d.usable for d in drawn]

    def mean(name: str, k: int, *, negative: bool) -> float:
        parts = []
        for d, kept in zip(drawn, rows, strict=True):
            turned = (d.electrical[:, k] < 0.0) == negative
            parts.append(np.where(turned, getattr(d, name)[:, k], 0.0)[kept])
        return float(np.concatenate(parts).mean())

    out = []
    for k, joint in enumerate(given.model.joints):
        own = {name: mean(name, k, negative=False) for name in OWN}
        by = "model" if any(joint in d.by_model for d in drawn) else "log"
        back = mean("electrical", k, negative=True)
        out.append(DriveShare(joint, leg_of[k], **own, returned=back, torque=by))
    return tuple(out)
