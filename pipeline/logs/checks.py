"""The judgement on a log before anything is computed from it: what is refused, masked, noted.

None of it needs a model of the robot but its limits and its mass. What columns hold is one table of
checks; a log as a whole is held against its clock, its robot and itself.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array, Mask
from actuators.errors import LegwattError
from pipeline.logs.log import Finding, Findings, Recording
from pipeline.logs.log_format import Expected, column_name
from pipeline.logs.sampling import (
    GAP,
    ROUNDED,
    frozen,
    glitches,
    held,
    interpolated,
    is_constant,
    own_spacing,
    quantum,
    saturated,
    standstill,
)

#: Fewer rows say nothing about anything.
FEWEST_ROWS: Final = 100
#: Slower logs show no dynamics [Hz].
SLOWEST: Final = 5.0
#: Scatter of the steps of time over their median from which rows are brought to a grid.
_UNEVEN: Final = 0.05
#: Different values up to which a channel of a joint that moves counts as dead.
_FEW_VALUES: Final = 3
#: Travel from which a joint hardly turns on and on: four turns [rad].
TURNS: Final = 8 * np.pi
#: Effort over the largest that the drive can give from which its unit is suspected.
_TOO_STRONG: Final = 5.0
#: Share of the weight that feet may carry more or less on average: sensors err by some per cent.
_WEIGHT: Final = 0.1
#: Times the weight, or a part of it, that no load is but another unit.
_NO_LOAD: Final = 3.0
#: Consecutive rows that have to agree in every number; a sensor's noise alone never does.
_RUN: Final = 8
#: Share of the shorter log's runs from which two logs count as the same data.
_SHARE: Final = 0.02


class _Channel(NamedTuple):
    """One column on its way through the checks."""

    time: Array
    x: Array
    moving: Mask
    step: float  # of its lattice
    rounded: float  # share of values on it


class _Check(NamedTuple):
    """What may be odd with rows of a column."""

    name: str
    rows: Callable[[_Channel], Mask]  #: Odd rows, (N,).
    verdict: str
    detail: str
    efforts_only: bool = False


#: In this order; rows of one check are good for none after it.
CHECKS: Final = (
    _Check(
        "interpolated",
        # Steps of a rounded sensor make straight lines, too.
        lambda c: interpolated(c.time, c.x) & (c.rounded <= ROUNDED),
        "masked",
        "{share:.0f} % of the rows lie on straight lines between others: interpolated from about "
        "one sample in {every:.3g} ms, which is what counts",
    ),
    _Check(
        "held",
        lambda c: held(c.x, c.step),
        "masked",
        "{count} rows repeat while it moves, {share:.0f} % of all: it is slower than the log; "
        "repeats are bridged",
    ),
    _Check(
        "frozen",
        lambda c: frozen(c.x, c.moving),
        "warning",
        "{count} rows hold one value while the joint moves, the first from {at:.6g} s: a sensor "
        "that stopped; left out",
        efforts_only=True,
    ),
    _Check(
        "glitches",
        lambda c: glitches(c.x),
        "warning",
        "{count} rows jump away and back, the first at {at:.6g} s to {value:.5g} {unit}: no motion "
        "does that; bridged as if empty",
    ),
    _Check(
        "saturated",
        lambda c: saturated(c.x, c.moving, c.step),
        "masked",
        "{count} rows stick at {most:.5g} {unit}",
        efforts_only=True,
    ),
)


def judge(log: Recording, expected: Expected) -> tuple[list[Finding], Recording]:
    """Judge a log.

    Args:
        log: As read.
        expected: The robot's limits.

    Returns:
        Findings, of which some may refuse the log, and the log with what of it is good.
    """
    found = Findings(log.name)
    found += log.findings
    shape = len(log), len(log.joints)
    usable = np.zeros(shape, dtype=np.bool_), np.zeros(shape, dtype=np.bool_)
    few, detail = len(log) < FEWEST_ROWS, f"{len(log)} rows; at least {FEWEST_ROWS} are needed"
    found.note("", "rows", len(log), "1", "refused" if few else "ok", detail)
    if few:
        return found, replace(log, judged=usable)
    _rate(log, found)
    off, silent = log.torque_off, 0
    for j, joint in enumerate(log.joints):
        q, x = log.position_of(joint), log.column(joint, log.effort)
        x = np.full(len(log), np.nan) if x is None else x
        column = column_name(joint, log.position_quantity)
        if not np.isfinite(q).any():
            detail = f"holds no number at all, and its {log.effort} does: where did it move?"
            found.note(column, "empty", 1, "1", "refused", detail)
            continue
        moving = ~standstill(q)
        usable[0][:, j] = _good(log.time, q, moving, column, "rad", found)
        if _silent(log, joint, q, x, found):
            silent += 1
            continue
        column = column_name(joint, log.effort)
        usable[1][:, j] = _good(log.time, x, moving, column, log.unit, found)
        if off is not None and off[:, j].any():
            bridge = log.torque_off_bridge or "not stated (open or shorted?)"
            detail = f"{int(off[:, j].sum())} rows with the drive off; bridge {bridge}"
            found.note(column, "torque_off", float(off[:, j].mean()), "1", "masked", detail)
            usable[1][off[:, j], j] = False
    if all(is_constant(log.position_of(joint)) for joint in log.joints):
        found.note("", "constant", 1, "1", "refused", "no joint moves; nothing can be compared")
    elif silent == len(log.joints) and not log.supply_alone:
        detail = f"no joint that moves has a live {log.effort}; nothing can be compared"
        found.note("", "empty", 1, "1", "refused", detail)
    if usable[0].any(axis=0).all():
        _positions(log, expected, usable[0], found)
    _efforts(log, expected, found)
    _feet_carry(log, expected.weight, found)
    if log.ignored:
        found.note("", "ignored_columns", len(log.ignored), "1", "ok", ", ".join(log.ignored))
    for channel, formula in log.derived.items():
        found.note("", "derived", 1, "1", "ok", f"{channel} computed as {formula}")
    return found, replace(log, judged=usable)


def _rate(log: Recording, found: Findings) -> None:
    """Note the rate of the rows, and slow, uneven or broken clocks."""
    step = np.diff(log.clock)
    dt = float(np.median(step))
    rate, inside = 1.0 / dt, step <= GAP * dt
    detail, verdict = f"{rate:.5g} Hz over {log.time[-1] - log.time[0]:.4g} s", "ok"
    if rate < SLOWEST:
        detail += "; time_s is no time in seconds? give its unit under [time] in a mapping file"
        verdict = "refused"
    found.note("time_s", "rate", rate, "Hz", verdict, detail)
    jitter = float(np.std(step[inside]))
    if jitter > _UNEVEN * dt:
        found.note("time_s", "jitter", jitter, "s", "warning", "resampled by interpolation")
    if gaps := int((~inside).sum()):
        detail = f"{gaps} gaps, the longest {step.max():.4g} s; filtered piece by piece"
        found.note("time_s", "gaps", gaps, "1", "masked", detail)


def _good(time: Array, x: Array, moving: Mask, column: str, unit: str, found: Findings) -> Mask:
    """Rows of a column that may be used, shape (N,), by the table of checks."""
    good = np.isfinite(x)
    missing = int((~good).sum())
    if 0 < missing < x.size:
        found.note(column, "missing", missing / x.size, "1", "masked", f"{missing} empty cells")
    if is_constant(x):
        return good
    step, rounded = quantum(x)
    for check in CHECKS:
        if check.efforts_only and unit == "rad":
            continue
        kept = good if check.name == "frozen" else np.ones_like(good)
        odd = np.zeros_like(good)
        odd[kept] = check.rows(_Channel(time[kept], x[kept], moving[kept], step, rounded))
        if not odd.any():
            continue
        first = int(np.argmax(odd))
        # A voltage at the supply is still the voltage; a sensor at its end tells nothing.
        passes = check.name == "saturated" and unit == "V"
        detail = check.detail.format(
            count=int(odd.sum()),
            share=100 * odd.mean(),
            at=time[first],
            value=x[first],
            most=float(np.nanmax(np.abs(x[odd]), initial=0.0)),
            unit=unit,
            every=1e3 * own_spacing(time, ~odd),
        )
        verdict = "warning" if passes else check.verdict
        found.note(column, check.name, float(odd.mean()), "1", verdict, detail)
        if not passes:
            good &= ~odd
    return good


def _silent(log: Recording, joint: str, q: Array, x: Array, found: Findings) -> bool:
    """Whether a joint's effort says nothing, and why."""
    still, values = is_constant(q), np.unique(x[np.isfinite(x)])
    seen = f"{', '.join(f'{v:.6g}' for v in values[:_FEW_VALUES])} {log.unit}"
    verdict, quantity, silent = "warning", log.effort, True
    if joint in log.left_out:
        check, why, quantity = "left_out", log.left_out[joint], log.position_quantity
    elif values.size == 0:
        check, why = "empty", "holds no number at all: the joint is left out"
    elif still and values.size == 1:
        check, verdict, quantity = "constant", "masked", log.position_quantity
        why = "position and effort never change: the joint is left out"
    elif still:
        check, silent, quantity = "still", False, log.position_quantity
        why = f"never changes while its {log.effort} does: it stood still, or its sensor is dead"
    elif values.size <= _FEW_VALUES:
        check = "constant"
        why = f"is nothing but {seen} while the joint moves: a dead sensor; the joint is left out"
    else:
        return False
    found.note(column_name(joint, quantity), check, 1, "1", verdict, why)
    return silent


def _positions(log: Recording, expected: Expected, ok: Mask, found: Findings) -> None:
    """Positions against the limits of the joints; `ok` are those that count, shape (N, J)."""
    for j, joint in enumerate(log.joints):
        q, column = log.position_of(joint)[ok[:, j]], column_name(joint, log.position_quantity)
        low, high = float(expected.lower[j]), float(expected.upper[j])
        span = f"runs from {q.min():.4g} to {q.max():.4g} rad"
        margin = 0.05 * (high - low) if np.isfinite(high - low) else 0.0
        low, high = low - margin, high + margin
        outside = float(np.mean((q < low) | (q > high)))
        if outside == 0.0:
            continue
        # A joint that swings over goes beyond its limits by turns; degrees do by 57 times.
        turned = np.radians(q)
        degrees = np.ptp(q) > TURNS and turned.min() >= low and turned.max() <= high
        away = outside > 0.5 and max(low - q.max(), q.min() - high) > TURNS
        detail = f"{span}, the joint's limits are {expected.lower[j]:.4g} to "
        detail += f"{expected.upper[j]:.4g} rad: " + (
            "looks like degrees, or a motor's angle; in a mapping file: "
            'unit = "deg", or scale = 1 over the gear ratio'
            if degrees
            else f"{100 * outside:.1f} % of the rows lie outside: it turns over, or another zero "
            "or sign, a motor's angle, another joint's column or the log of another robot"
        )
        verdict = "suspected" if degrees or away else "warning"
        found.note(column, "share_outside_limits", outside, "1", verdict, detail)


def _efforts(log: Recording, expected: Expected, found: Findings) -> None:
    """Efforts against the largest that the drive can give, by channel and joint."""
    largest = {"torque": expected.effort_limit, **expected.largest}
    for channel in (c for c in log.channels if c in largest):
        for joint, limit in zip(log.joints, largest[channel], strict=True):
            x = log.column(joint, channel)
            if x is None or not np.isfinite(x).any():
                continue
            if (top := float(np.nanquantile(np.abs(x), 0.99))) > _TOO_STRONG * limit:
                detail = f"reaches {top:.4g}, the drive's limit is {limit:.4g}: another unit (give "
                detail += "it in a mapping file), or the log of another robot"
                found.note(column_name(joint, channel), "magnitude", top, "1", "suspected", detail)


def _feet_carry(log: Recording, weight: float | None, found: Findings) -> None:
    """Vertical forces of the feet, on average, against the weight [N].

    Over a log in which the robot neither climbs nor falls, the mean of their sum is its weight.
    """
    force = log.foot_force
    if force is None:
        return
    absent = [f"force_{axis}" for k, axis in enumerate("xy") if np.isnan(force[..., k]).all()]
    if absent:
        detail = f"no {' and no '.join(absent)}: what is not measured is unknown"
        found.note("", "foot_forces", len(log.feet), "1", "warning", detail)
    if not weight:
        return
    share, why = float(np.mean(np.nansum(force[..., 2], axis=1))) / weight, ""
    if share < -_WEIGHT:
        why = ": their sign is turned: forces are those of the ground on the robot"
    elif not 1.0 / _NO_LOAD < share < _NO_LOAD:
        why = f": {log.feet[0]}__force_z_N, ... are no newtons; give their unit in a mapping file"
    elif abs(share - 1.0) > _WEIGHT:
        why = ": a foot that tells nothing, a load that the model lacks, or it hangs or leans"
    detail = f"on average the feet carry {share:.3g} of the robot's weight of {weight:.4g} N{why}"
    found.note("", "feet_carry", share, "1", "warning" if why else "ok", detail)


def refuse_repeats(logs: Sequence[Recording]) -> None:
    """Refuse logs that hold the same rows, in whole or in part.

    Args:
        logs: Of one robot.

    Raises:
        LegwattError: Two logs share runs of rows in which a joint moves.
    """
    runs = [(log, _runs(log)) for log in logs if len(logs) > 1]
    for (one, a), (other, b) in combinations(runs, 2):
        same = np.intersect1d(a, b, assume_unique=True).size
        if same > max(_RUN, _SHARE * min(len(one), len(other))):
            raise LegwattError(
                f"{one.name} and {other.name} hold the same measurements ({same} rows): test "
                "data must be data of their own, and data given twice count twice; leave one out"
            )


def _runs(log: Recording) -> NDArray[np.uint64]:
    """A number per run of rows, in which a joint moves, that equal runs share and others do not."""
    import pandas as pd

    names = [column_name(joint, q) for joint in log.joints for q in ("position", log.effort)]
    table = log.frame[[name for name in names if name in log.frame]]
    own = np.asarray(pd.util.hash_pandas_object(table, index=False), dtype=np.uint64)
    if own.size < _RUN:
        return own[:0]
    changes = np.convolve(own[1:] != own[:-1], np.ones(_RUN - 1), mode="valid")
    key = np.random.default_rng(0).integers(2**63, size=_RUN, dtype=np.uint64)
    runs = np.convolve(own, 2 * key + 1, mode="valid")  # wraps around, as hashes do
    return np.unique(runs[changes >= _RUN / 2])  # at rest it repeats
