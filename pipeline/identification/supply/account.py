"""What a supply gives beside the sum over its drives: means, intervals, and what stays unexplained.

Rows lie in blocks of consecutive samples, some of which are for the test alone. Intervals are of a
bootstrap of blocks (Künsch, Annals of Statistics 17(3), 1989).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array, Mask
from actuators.errors import LegwattError
from pipeline.columns import frame
from pipeline.identification.settings import FEWEST_SAMPLES, SMALL
from pipeline.identification.supply.drives import DrivePower, drive_power, supply_samples
from pipeline.identification.supply.fit import OWN, Fit
from pipeline.logs.log import Log
from pipeline.simulation.machine import Machine

if TYPE_CHECKING:
    from pandas import DataFrame

UNEXPLAINED, MEASURED = "unexplained", "measured"
#: Blocks a log is cut into; every so many one is for the test.
BLOCKS, TEST_EVERY = 24, 4
DRAWS, SEED = 300, 1


@dataclass(frozen=True, eq=False)
class Account:
    """The answer of `gap power`."""

    power: DataFrame  #: Term by term, what was measured and what stays unexplained last.
    drives: DataFrame  #: Mean power into every drive.
    samples: DataFrame  #: Every sample of the supply.
    #: Of measured minus predicted on test samples, by the model's sum and with all terms [W].
    rms: tuple[float, float]
    #: Whether a sample is the ``"mean"`` since the one before or of its ``"instant"``.
    reading: str
    #: Whether motor currents times the supply's voltage were taken for its power; then nothing is
    #: found.
    wrong_sum: bool
    by_model: tuple[str, ...]  #: Joints whose torque no log tells.

    @property
    def negative(self) -> bool:
        """Whether the column is no power, or more than little stays unexplained."""
        measured, left = self.power.to_dict("records")[-2:]
        clear = not left["mean_low_W"] <= 0.0 <= left["mean_high_W"]
        return self.wrong_sum or bool(clear and abs(left["mean_W"]) > SMALL * measured["mean_W"])


def account(given: Machine, logs: Sequence[Log], holdout: int, test_last: float | None) -> Account:
    """Hold the supply's samples of all logs against the sum over the drives.

    Args:
        given: The machine, with a motor in every joint.
        logs: At their full rate; so many at the end are for the test (`holdout`).
        test_last: Share of every other log that is for the test.

    Raises:
        LegwattError: A log has no power at the supply, too few samples of it, or a joint no motor.
    """
    import pandas

    names = tuple(one.name for one in logs)
    drives = [drive_power(given.model, one) for one in logs]
    pairs = zip(logs, drives, strict=True)
    samples = [supply_samples(one.recording, d.reach) for one, d in pairs if one.recording]
    legs, tried = dict[str, list[int]](), []
    of = {joint: leg.name for leg in given.robot.spec.legs for joint in leg.joints}
    for k, joint in enumerate(given.model.joints):  # every joint by itself without legs
        legs.setdefault(of.get(joint, joint), []).append(k)
    for reading in ("mean", "instant"):
        parts = [
            rows_of(d, s, legs, reading).assign(log=k)
            for k, (d, s) in enumerate(zip(drives, samples, strict=True))
        ]
        rows = pandas.concat(parts, ignore_index=True)
        if len(rows) < FEWEST_SAMPLES:
            raise LegwattError(
                f"{', '.join(names)}: {len(rows)} samples of the supply during which all joints "
                f"are known; at least {FEWEST_SAMPLES} are needed to separate terms and to test "
                "them; log longer"
            )
        fit = Fit(rows, *_blocks(rows["log"].to_numpy(), holdout, test_last))
        fit = replace(fit, terms=fit.chosen())
        tried.append((fit.error(fit.terms), reading, fit))
    _, reading, fit = min(tried, key=lambda one: one[0])
    wrong = fit.wrong_sum()
    if wrong:  # no term means anything in what is no power
        fit = replace(fit, terms=())
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
        rms=tuple(float(np.sqrt(np.mean(x[fit.test] ** 2))) for x in misses),  # type: ignore[arg-type]
        reading=reading,
        wrong_sum=wrong,
        by_model=tuple(dict.fromkeys(j for d in drives for j in d.by_model)),
    )


def _power(fit: Fit) -> tuple[DataFrame, Array]:
    """The table of terms by their mean on all samples, and the power by all terms (K,) [W]."""
    rng, rows = np.random.default_rng(SEED), fit.rows
    by_block = [np.flatnonzero(fit.block == b) for b in np.unique(fit.block)]
    own, test = ([b for b in by_block if fit.test[b[0]] == held] for held in (False, True))

    def resampled(blocks: list[NDArray[np.intp]]) -> NDArray[np.intp]:
        return np.concatenate([blocks[k] for k in rng.integers(0, len(blocks), len(blocks))])

    best = fit.coefficients(~fit.test)
    draws = np.array([fit.coefficients(resampled(own)) for _ in range(DRAWS)])
    X, left = rows[[*fit.terms]].to_numpy(), fit.left
    none, out = (None, None, None, "", ""), list[tuple[Any, ...]]()
    for name, words in OWN.items():
        mean = float(rows[name].mean())
        out.append((name, words, "model", mean, mean, mean, 1.0, None, None, "1", ""))
    for k, name in enumerate(fit.terms):
        words, unit, *_ = fit.every[name]
        values = np.array([best[k], *np.quantile(draws[:, k], [0.025, 0.975])])
        watts = values * X[:, k].mean()
        ends = [watts[0], *sorted(watts[1:])]
        out.append((name, words, "found", *ends, *values, unit, "+".join(fit.exchangeable(name))))
    over = rows["power"].mean()
    out.append((MEASURED, "by the supply", "", over, over, over, *none))
    # What is left on test samples scatters by their blocks and by the coefficients.
    spread = [float((left[b] - X[b] @ c).mean()) for c in draws for b in [resampled(test)]]
    rest = (float((left - X @ best)[fit.test].mean()), *np.quantile(spread, [0.025, 0.975]))
    words = "test samples: measured less the model's sum and all terms"
    out.append((UNEXPLAINED, words, "", *rest, *none))
    return frame("power", out), rows["power"].to_numpy() - left + X @ best


def _by_drive(joints: Sequence[str], drives: Sequence[DrivePower]) -> DataFrame:
    """Mean power by drive over all known rows of all logs."""
    rows = []
    for k, joint in enumerate(joints):
        braking = np.concatenate([d.electrical[d.known, k] < 0.0 for d in drives])
        parts = {n: np.concatenate([d.parts[n][d.known, k] for d in drives]) for n in OWN}
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
    drives: DrivePower, samples: DataFrame, legs: Mapping[str, list[int]], reading: str
) -> DataFrame:
    """Samples of one log's supply with the terms' mean power; those that are not known left out.

    `legs`: columns of joints by name. `reading`: ``"mean"`` since the sample before, or at the
    ``"instant"`` of the sample.
    """
    draws, size = drives.electrical > 0.0, np.abs(drives.current)
    begin, end, voltage = (samples[name].to_numpy() for name in ("begin", "end", "voltage"))
    bus = 1.0 if np.isnan(voltage).any() else float(np.mean(voltage))
    series = {name: np.where(draws, drives.parts[name], 0.0).sum(axis=1) for name in OWN}
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
    time = drives.time
    if reading == "instant":
        begin, end = end - 0.5 * drives.reach, end + 0.5 * drives.reach
    pace = np.diff(time)
    whole = (pace < 1.5 * drives.step) & drives.known[1:] & drives.known[:-1]

    def between(x: Array) -> Array:
        steps = np.where(whole, 0.5 * pace * (x[1:] + x[:-1]), 0.0)
        total = np.concatenate([[0.0], np.cumsum(steps)])
        return np.interp(end, time, total) - np.interp(begin, time, total)

    span = end - begin
    columns = {name: between(x) / span for name, x in series.items()}
    for name in ("magnitudes", "signed"):
        columns[name] = columns[name] * np.where(np.isnan(voltage), 1.0, voltage)
    known = between(np.ones(time.size)) > 0.999 * span - 1e-9
    return samples.assign(**columns)[known]
