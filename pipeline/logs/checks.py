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
import pandas as pd
from numpy.typing import NDArray
from scipy.ndimage import median_filter, percentile_filter

from actuators.arrays import Array, Mask
from actuators.errors import LegwattError
from pipeline.logs.filters import GAP, runs_of
from pipeline.logs.log import EFFORTS, Expected, Finding, Findings, Recording, column_name

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
#: Rows looked at for the lattice of values.
LATTICE_ROWS: Final = 100_000
#: Half-width of the window in which a channel's mean change per row is taken.
WINDOW: Final = 20
#: Share of repeats from which a channel counts as held.
HELD: Final = 0.1
#: Rows of the median that ramps and steps pass: what lasts up to five rows is passed over.
_MEDIAN: Final = 11
#: Rows over which the usual change from row to row is taken.
_NEAR: Final = 41
#: Distance from the median in usual changes, and in rows at the channel's fastest pace.
_CHANGES, _ROWS = 12.0, 6.0
#: Chance at which a live channel may look frozen somewhere in a log.
_CHANCE: Final = 1e-6
#: Rows that hold one value are looked at from this many on.
_LEAST_RUN: Final = 20
#: Share of the shorter log's moving rows from which two logs count as the same data.
_SHARE: Final = 0.02
#: Share of a joint's range by which positions may leave it.
_MARGIN: Final = 0.05
#: What positions beyond the limits of a joint may be.
_OUTSIDE: Final = (
    'degrees (in a mapping file: unit = "deg"), a motor\'s angle (scale = 1 over the gear ratio), '
    "another zero or sign, another joint's column, or the log of another robot"
)


def judge(log: Recording, expected: Expected) -> tuple[list[Finding], Recording]:
    """Judge a log.

    Args:
        log: As read.
        expected: The robot's limits.

    Returns:
        Findings, of which some may refuse the log, and the log, in which cells that are not good
        are empty.
    """
    found, frame = Findings(log.name), dict[str, Array]()
    found += log.findings
    few, detail = len(log) < FEWEST_ROWS, f"{len(log)} rows; at least {FEWEST_ROWS} are needed"
    found.note("", "rows", "refused" if few else "ok", detail, len(log))
    if few:
        return found, log
    _rate(log, found)
    off, silent = log.torque_off, 0
    for j, joint in enumerate(log.joints):
        q, x = log.position_of(joint), log.column(joint, log.effort)
        x = np.full(len(log), np.nan) if x is None else x
        column = column_name(joint, log.position_quantity(joint))
        if not np.isfinite(q).any():
            detail = f"holds no number at all, and its {log.effort} does: where did it move?"
            found.note(column, "empty", "refused", detail)
            continue
        moving, own = ~standstill(q), column_name(joint, log.effort)
        frame[column_name(joint, "position")] = _good(log.time, q, moving, column, "rad", found)
        frame[own] = np.full(len(log), np.nan)
        if _silent(log, joint, q, x, found):
            silent += 1
            continue
        frame[own] = _good(log.time, x, moving, own, EFFORTS[log.effort], found)
        if off is not None and off[:, j].any():
            frame[own] = np.where(off[:, j], np.nan, frame[own])
    good = replace(log, frame=log.frame.assign(**frame))
    if all(is_constant(log.position_of(joint)) for joint in log.joints):
        found.note("", "constant", "refused", "no joint moves; nothing can be compared")
    elif silent == len(log.joints) and not log.supply_alone:
        detail = f"no joint that moves has a live {log.effort}; nothing can be compared"
        found.note("", "empty", "refused", detail)
    _limits(good, expected, found)
    _feet_carry(log, expected.weight, found)
    if log.ignored:
        found.note("", "ignored_columns", "ok", ", ".join(log.ignored), len(log.ignored))
    return found, good


def _rate(log: Recording, found: Findings) -> None:
    """Note the rate of the rows, and slow, uneven or broken clocks."""
    step = np.diff(log.clock)
    dt = float(np.median(step))
    rate, inside, slow = 1.0 / dt, step <= GAP * dt, 1.0 / dt < SLOWEST
    detail = f"{rate:.5g} Hz over {log.time[-1] - log.time[0]:.4g} s"
    detail += "; time_s is no time in seconds? give its unit in a mapping file" * slow
    found.note("time_s", "rate", "refused" if slow else "ok", detail, rate, "Hz")
    jitter = float(np.std(step[inside]))
    if jitter > _UNEVEN * dt:
        found.note("time_s", "jitter", "warning", "resampled by interpolation", jitter, "s")
    if gaps := int((~inside).sum()):
        detail = f"{gaps} gaps, the longest {step.max():.4g} s; filtered piece by piece"
        found.note("time_s", "gaps", "masked", detail, gaps)


def _good(time: Array, x: Array, moving: Mask, column: str, unit: str, found: Findings) -> Array:
    """A column (N,) without what may not be used by the table of checks."""
    good = np.isfinite(x)
    missing = int((~good).sum())
    if 0 < missing < x.size:
        found.note(column, "missing", "masked", f"{missing} empty cells", missing / x.size)
    if is_constant(x):
        return x
    step = quantum(x)
    for check in (c for c in CHECKS if unit != "rad" or not c.efforts_only):
        kept = good if check.name == "frozen" else np.ones_like(good)
        odd = np.zeros_like(good)
        odd[kept] = check.rows(x[kept], moving[kept], step)
        if not odd.any():
            continue
        # A voltage at the supply is still the voltage; a sensor at its end tells nothing.
        passes = check.name == "saturated" and unit == "V"
        first, verdict = int(np.argmax(odd)), "warning" if passes else check.verdict
        detail = f"{int(odd.sum())} rows {check.detail}; the first, at {time[first]:.6g} s, is "
        detail += f"{x[first]:.5g} {unit}"
        found.note(column, check.name, verdict, detail, float(odd.mean()))
        if not passes:
            good &= ~odd
    return np.where(good, x, np.nan)


def _silent(log: Recording, joint: str, q: Array, x: Array, found: Findings) -> bool:
    """Whether a joint's effort says nothing, and why."""
    still, values = is_constant(q), np.unique(x[np.isfinite(x)])
    place = column_name(joint, log.position_quantity(joint))
    if joint in log.left_out:
        found.note(place, "left_out", "warning", log.left_out[joint])
    elif still and values.size == 1:
        why = "position and effort never change: the joint is left out"
        found.note(place, "constant", "masked", why)
    elif still and values.size:
        why = f"never changes while its {log.effort} does: it stood still, or its sensor is dead"
        found.note(place, "still", "warning", why)
        return False
    elif values.size <= _FEW_VALUES:
        seen = ", ".join(f"{v:.6g}" for v in values) or "empty cells"
        why = f"is nothing but {seen} while the joint moves: a dead sensor; the joint is left out"
        found.note(column_name(joint, log.effort), "constant", "warning", why)
    else:
        return False
    return True


def _limits(log: Recording, expected: Expected, found: Findings) -> None:
    """Positions against the limits of the joints, efforts against those of drives."""
    for j, joint in enumerate(log.joints):
        q, column = log.position_of(joint), column_name(joint, log.position_quantity(joint))
        q = q[np.isfinite(q)]
        low, high = float(expected.lower[j]), float(expected.upper[j])
        margin = _MARGIN * (high - low) if np.isfinite(high - low) else 0.0
        outside = (q < low - margin) | (q > high + margin)
        if not outside.any():
            continue
        # A joint that swings over goes beyond its limits by turns; degrees do by 57 times.
        far = max(np.ptp(q), low - q.max(), q.min() - high) > TURNS and outside.mean() > 0.5
        detail = f"runs from {q.min():.4g} to {q.max():.4g} rad, {100 * outside.mean():.1f} % of "
        detail += f"the rows outside the joint's limits of {low:.4g} to {high:.4g} rad: it turns "
        detail += f"over, or {_OUTSIDE}"
        verdict = "suspected" if far else "warning"
        found.note(column, "share_outside_limits", verdict, detail, float(outside.mean()))
    largest = {"torque": expected.effort_limit, **expected.largest}
    for channel in (c for c in log.channels if c in largest):
        for joint, limit in zip(log.joints, largest[channel], strict=True):
            x = log.column(joint, channel)
            top = 0.0 if x is None else float(pd.Series(np.abs(x)).quantile(0.99))
            if top > _TOO_STRONG * limit:
                detail = f"reaches {top:.4g}, the drive's limit is {limit:.4g}: another unit (give "
                detail += "it in a mapping file), or the log of another robot"
                found.note(column_name(joint, channel), "magnitude", "suspected", detail, top)


def _feet_carry(log: Recording, weight: float | None, found: Findings) -> None:
    """Vertical forces of the feet, on average, against the weight [N].

    Over a log in which the robot neither climbs nor falls, the mean of their sum is its weight.
    """
    force = log.foot_force
    if force is None:
        return
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
    found.note("", "feet_carry", "warning" if why else "ok", detail, share)


def refuse_repeats(logs: Sequence[Recording]) -> None:
    """Refuse logs that hold the same rows, in whole or in part.

    Raises:
        LegwattError: Names two that do.
    """
    rows = [(log.name, _moving_rows(log)) for log in logs if len(logs) > 1]
    for (one, a), (other, b) in combinations(rows, 2):
        same = np.intersect1d(a, b, assume_unique=True).size
        if same > _SHARE * min(a.size, b.size):
            raise LegwattError(
                f"{one} and {other} hold the same measurements ({same} rows): test data must be "
                "data of their own, and data given twice count twice; leave one out"
            )


def _moving_rows(log: Recording) -> NDArray[np.uint64]:
    """A number for every three rows in which something changes; the same for equal ones."""
    names = [column_name(joint, q) for joint in log.joints for q in ("position", log.effort)]
    table = log.frame[[name for name in names if name in log.frame]].dropna(how="all", axis=1)
    own = np.asarray(pd.util.hash_pandas_object(table.dropna(), index=False), dtype=np.uint64)
    both = own[2:] + np.uint64(3) * own[1:-1] + np.uint64(7) * own[:-2]  # wraps, as hashes do
    return np.unique(both[(own[2:] != own[1:-1]) & (own[1:-1] != own[:-2])])


def is_constant(x: Array) -> bool:
    """Whether a series (N,) holds one number and nothing else but empty cells."""
    x = x[np.isfinite(x)]
    return x.size > 0 and bool((x == x[0]).all())


def quantum(x: Array) -> float:
    """Step of a quantised channel (N,); zero where it is none."""
    part = x[: LATTICE_ROWS + 1]
    part = part[np.isfinite(part)]
    values, counts = np.unique(part, return_counts=True)
    # A log that was interpolated after sampling still rests on the values of the sensor.
    often = counts >= 5
    for own, least, enough in (
        (values, 0.9, values.size < 0.5 * part.size),
        (values[often], 0.6, often.sum() >= 5 and counts[often].sum() > 0.2 * part.size),
    ):
        if own.size >= 3 and enough:
            gaps = np.diff(own)
            gaps = gaps[gaps > 1e-9 * (own[-1] - own[0])]
            step = float(np.quantile(gaps, 0.1))
            if np.mean(np.abs(gaps / step - np.round(gaps / step)) < 0.05) > least:
                return step
    return 0.0


def held(x: Array, moving: Mask, step: float) -> Mask:
    """Rows (N,) that repeat the one before and that no rounding to `step` explains.

    Where a channel changes by more than two of its quanta per row on average, every row should
    differ from the one before, but for those that rounding makes alike: no more rows than differ by
    one smallest step. None where fewer than `HELD` of those rows repeat.
    """
    none = np.zeros(x.size, dtype=np.bool_)
    if x.size <= 4 * WINDOW:
        return none
    pace = _pace(x, WINDOW)
    fast = pace > max(2.0 * step, 0.1 * float(np.quantile(pace, 0.95)), 1e-12)
    if fast.sum() < 50:
        return none
    change = np.abs(np.diff(x, prepend=np.nan))
    repeats = (change == 0) & fast
    steps = change[fast & (change > 0)]
    by_chance = int((steps < 1.5 * float(np.quantile(steps, 0.01))).sum()) if steps.size else 0
    count = int(repeats.sum())
    enough = count > 1.5 * by_chance + 4.0 * np.sqrt(count) and repeats[fast].mean() > HELD
    return repeats if enough else none


def _pace(x: Array, w: int) -> Array:
    """Mean change per row over a window of w rows to either side, (N,); zero where unknown."""
    change = np.abs(x[2 * w :] - x[: -2 * w]) / (2 * w)
    return np.nan_to_num(np.pad(change, w, mode="edge"))


def saturated(x: Array, moving: Mask, step: float) -> Mask:
    """Rows (N,) at a channel's largest or smallest value where it sticks there while moving.

    A peak passes through its neighbourhood; a limit collects rows at one value. Where the channel
    is quantised in steps, more must lie at the limit than just inside it; where it is not, no value
    comes back by chance.
    """
    out = np.zeros(x.size, dtype=np.bool_)
    good = np.isfinite(x) & moving
    for limit in (x[good].min(), x[good].max()) if good.sum() >= 50 else ():
        away = np.abs(x - limit)
        at = good & (away <= 0.5 * step)
        inside = good & ~at & (away < 4.5 * step)
        runs = at[2:] & at[1:-1] & at[:-2]
        if at.sum() >= 20 and runs.any() and (step == 0 or at.sum() > 2 * inside.sum()):
            # Known to be a limit, it counts at standstill, too.
            out |= away <= 0.5 * step
    return out


def frozen(x: Array, moving: Mask, step: float) -> Mask:
    """Rows of an effort (N,) that hold one value longer than chance allows while the joint moves.

    A live channel repeats a value with some probability p from row to row (rounding, or a rate of
    its own); n repeats in a row come by chance p^n times.
    """
    out = np.zeros(x.size, dtype=np.bool_)
    if moving.sum() < 2 * _LEAST_RUN:
        return out
    starts, stops = runs_of(np.concatenate([[False], (x[1:] == x[:-1]) & moving[1:]]))
    length = stops - starts
    usual = length < max(_LEAST_RUN, int(np.quantile(length, 0.9)) if length.size else 0)
    repeats = float(length[usual].sum()) / max(float(moving.sum() - length[~usual].sum()), 1.0)
    p = min(max(repeats, 1.0 / x.size), 1.0 - 1e-9)
    longest = max(_LEAST_RUN, int(np.ceil(np.log(_CHANCE / x.size) / np.log(p))))
    for k in np.flatnonzero(length >= longest):
        out[starts[k] : stops[k]] = True
    return out


def glitches(x: Array, moving: Mask, step: float) -> Mask:
    """Rows of a series (N,) that jump away and back, further than noise and its own pace explain.

    A median over a few rows follows ramps and steps exactly and passes over what lasts less than
    half of it; NaN rows are no glitches.
    """
    out = np.zeros(x.size, dtype=np.bool_)
    good = np.flatnonzero(np.isfinite(x))
    if good.size < 2 * _NEAR:
        return out
    y = x[good]
    away = np.abs(y - median_filter(y, _MEDIAN, mode="mirror"))
    # Most channels have none: the local pace is computed where something stands out at all.
    least = _ROWS * float(np.abs(y[_MEDIAN + 1 :] - y[: -_MEDIAN - 1]).max()) / (_MEDIAN + 1)
    if (away > least).any():
        change = np.abs(np.diff(y, prepend=y[0]))
        usual = percentile_filter(change, 75, _NEAR, mode="mirror")
        out[good] = away > least + _CHANGES * usual
    return out


def standstill(q: Array) -> Mask:
    """Rows (N,) in which a joint moves at less than 1 % of its usual top speed.

    Empty cells of positions [rad] take the last value before them.
    """
    known = np.where(np.isfinite(q), np.arange(q.size), 0)
    pace = _pace(np.nan_to_num(q[np.maximum.accumulate(known)]), max(1, min(WINDOW, q.size // 8)))
    # A short excursion still counts as motion, a single jump does not.
    return np.asarray(pace <= 0.01 * np.quantile(pace, 0.98))


class _Check(NamedTuple):
    """What may be odd with rows of a column."""

    name: str
    rows: Callable[[Array, Mask, float], Mask]  #: By values (N,), where it moves, and lattice.
    verdict: str
    detail: str
    efforts_only: bool = False


#: In this order; rows of one check are good for none after it.
CHECKS: Final = (
    _Check("held", held, "masked", "repeat while it moves: slower than the log, bridged"),
    _Check("frozen", frozen, "warning", "hold one value while the joint moves, left out", True),
    _Check("glitches", glitches, "warning", "jump away and back as no motion does, bridged"),
    _Check("saturated", saturated, "masked", "stick at the largest or smallest value", True),
)
