"""The judgement on a log before anything is computed from it: what is refused, masked, noted."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from actuators.arrays import Array, Mask
from pipeline.logs.errors import Findings, Quality
from pipeline.logs.log_format import EFFORTS, Expected, column_name
from pipeline.logs.quality.checks import (
    effort_units,
    feet_carry,
    position_units,
    torque_on_time,
    velocity_units,
)
from pipeline.logs.quality.sampling import (
    frozen,
    glitches,
    held,
    is_constant,
    quantum,
    saturated,
    standstill,
)
from pipeline.logs.reading.log import Log
from pipeline.logs.signals.grid import GAP, interpolated, own_spacing

#: Fewer rows say nothing about anything.
FEWEST_ROWS: Final = 100
#: Slower logs show no dynamics [Hz].
SLOWEST: Final = 5.0
#: Share of values on a lattice from which a channel is a rounded sensor's own.
_ROUNDED: Final = 0.8
#: Share of repeats from which a channel counts as held.
HELD: Final = 0.1
#: Different values up to which a channel of a joint that moves counts as nearly dead.
_FEW_VALUES: Final = 3


def judge(
    log: Log,
    expected: Expected,
    *,
    largest: Mapping[str, Array] | None = None,
    whole: bool = True,
) -> Quality:
    """Judge a log; see `Quality.refuse` for turning refusals into an error.

    Args:
        log: From `read_log`.
        expected: The robot's limits.
        largest: Channel to the largest magnitude the drive can give, shape (J,); torque from the
            joints' effort limits by default.
        whole: Whether this is a whole log: in a piece of one a joint may rest, or a drive be off,
            from end to end.
    """
    found = Findings(log.name)
    for remark in log.notes:  # what holds for all of it comes first
        found.note("", "file", 1, "1", "warning", remark)
    few, detail = len(log) < FEWEST_ROWS, f"{len(log)} rows; at least {FEWEST_ROWS} are needed"
    found.note("", "rows", len(log), "1", "refused" if few else "ok", detail)
    if few:
        return Quality(tuple(found), log.finite)
    dt = _rate(log, found)
    still = standstill(log.position, dt)
    silent, empty = _silent(log, still, found, whole=whole)
    position_ok, effort_ok = log.finite
    columns = [column_name(joint, log.position_quantity) for joint in log.joints]
    for k, column in enumerate(columns):
        drawn, repeats, _ = _stale(log, found, column, log.position[:, k], "the joint moves", "rad")
        position_ok[:, k] &= ~drawn & ~repeats
    for k, column in enumerate(columns):
        position_ok[:, k] &= ~_jumps(log, found, column, log.position[:, k], "rad")
    effort_ok &= ~silent
    for j in np.flatnonzero(~silent):
        x = log.effort.values[:, j]
        if not is_constant(x) and np.isfinite(x).any():
            effort_ok[:, j] &= _effort(log, int(j), ~still[:, j], found)
    # Rows may repeat in every channel while something moves.
    if log.chosen_effort is None and len(log.channels) > 1:
        others = ", ".join(c for c in EFFORTS if c in log.channels and c != log.effort.channel)
        detail = f"{log.effort.channel} is compared; also there: {others}"
        found.note("", "effort", 1, "1", "ok", detail)
    same = ~np.asarray(still[1:].all(axis=1))
    for block in (log.position, log.velocity, *(getattr(log, c) for c in log.channels)):
        if block is not None:
            with np.errstate(invalid="ignore"):
                same &= (block[1:] == block[:-1]).all(axis=1)
    share = float(same.mean())
    if share > 0.001:
        detail = f"{int(same.sum())} rows repeat the one before in every channel while a joint "
        found.note("", "repeated_rows", share, "1", "warning", f"{detail}moves")
    if not empty:
        position_units(log, expected, position_ok, found)
        velocity_units(log, expected, position_ok, dt, found)
    effort_units(log, {"torque": expected.effort_limit, **(largest or {})}, found)
    torque_on_time(log, dt, found)
    feet_carry(log, expected.weight, found)
    # What reading saw: sides of gears, repeated times, headers that were not used.
    for column, remark in log.remarks.items():
        found.note(column, "side", 1, "1", "warning", remark)
    if log.repeated_times:
        detail = f"{log.repeated_times} rows with the time of the row before were dropped"
        found.note("time_s", "repeated_times", log.repeated_times, "1", "warning", detail)
    for column, meant in log.misspelt.items():
        detail = f"is ignored: no column of the log format; did you mean '{meant}'?"
        found.note(column, "misspelt", 1, "1", "warning", detail)
    if log.ignored:
        found.note("", "ignored_columns", len(log.ignored), "1", "ok", ", ".join(log.ignored))
    for channel, formula in log.derived.items():
        found.note("", "derived", 1, "1", "ok", f"{channel} computed as {formula}")
    return Quality(tuple(found), (position_ok, effort_ok))


def _rate(log: Log, found: Findings) -> float:
    """Median step of the rows [s]; slow, uneven or broken clocks are noted."""
    step = np.diff(log.clock)
    dt = float(np.median(step))
    rate, inside = 1.0 / dt, step <= GAP * dt
    slow = rate < SLOWEST
    detail = f"{rate:.5g} Hz over {log.time[-1] - log.time[0]:.4g} s"
    if slow:
        detail += f"; time_s looks like {_time_unit(rate)} in a mapping file"
    found.note("time_s", "rate", rate, "Hz", "refused" if slow else "ok", detail)
    jitter = float(np.std(step[inside]))
    uneven = jitter > 0.05 * dt
    detail = "resampled by interpolation" if uneven else "rows are evenly spaced"
    found.note("time_s", "jitter", jitter, "s", "warning" if uneven else "ok", detail)
    gaps = int((~inside).sum())
    if gaps:
        detail = f"{gaps} gaps, the longest {step.max():.4g} s; filtered piece by piece"
        found.note("time_s", "gaps", gaps, "1", "masked", detail)
    return dt


def _time_unit(rate: float) -> str:
    """The unit in which a time column of too low a rate [Hz] was written: the first that fits."""
    names = {1e3: ("milliseconds", "ms"), 1e6: ("microseconds", "us"), 1e9: ("nanoseconds", "ns")}
    for factor, (name, unit) in names.items():
        if rate * factor >= SLOWEST:
            return f'{name}, write [time] unit = "{unit}"'
    return "no time, name the column under [time]"


def _silent(log: Log, still: Mask, found: Findings, *, whole: bool) -> tuple[Mask, bool]:
    """Joints whose effort says nothing, (J,), and whether positions are beyond further checks."""
    empty, silent = False, np.zeros(len(log.joints), dtype=np.bool_)
    channel = log.effort.channel
    for j, joint in enumerate(log.joints):
        position = column_name(joint, log.position_quantity)
        if not np.isfinite(log.position[:, j]).any():
            detail = f"holds no number at all, and its {channel} does: where did it move?"
            found.note(position, "empty", 1, "1", "refused", detail)
            empty = silent[j] = True
            continue
        column, check, verdict, why = _silence(log, j)
        if why and (whole or check not in ("constant", "still", "nearly_dead")):
            silent[j] = check != "still"
            found.note(column, check, 1, "1", verdict, why)
        share = float(still[:, j].mean())
        found.note(position, "standstill_share", share, "1", "ok", f"{100 * share:.1f} % at rest")
    if all(is_constant(q) for q in log.position.T):
        found.note("", "constant", 1, "1", "refused", "no joint moves; nothing can be compared")
    elif whole and silent.all() and not empty and not log.supply_alone:
        detail = f"no joint that moves has a live {channel}; nothing can be compared"
        found.note("", "empty", 1, "1", "refused", detail)
    return silent, empty


def _silence(log: Log, j: int) -> tuple[str, str, str, str]:
    """Why a joint is silent: column, check, verdict, and the reason; empty where it is not."""
    joint, effort = log.joints[j], log.effort
    x, q = effort.values[:, j], log.position[:, j]
    position, column = column_name(joint, log.position_quantity), column_name(joint, effort.channel)
    still, flat, values = is_constant(q), is_constant(x), np.unique(x[np.isfinite(x)])
    if joint in log.locked:
        return position, "locked", "masked", "locked by the mapping; left out"
    if joint in log.left_out:
        return position, "left_out", "warning", log.left_out[joint]
    if values.size == 0:
        return column, "empty", "warning", "holds no number at all: the joint is left out"
    if still and flat:
        why = "position and effort never change: the joint is left out"
        return position, "constant", "masked", why
    if still:
        place = f"never changes from {q[np.isfinite(q)][0]:.6g} rad while its {effort.channel} does"
        return position, "still", "warning", f"{place}: it stood still, or its sensor is dead"
    if flat:
        why = f"never changes from {values[0]:.6g} {effort.unit} while the joint moves"
        return column, "constant", "warning", f"{why}: a dead sensor; the joint is left out"
    if values.size <= _FEW_VALUES:
        seen = ", ".join(f"{v:.6g}" for v in values)
        why = f"takes {values.size} values only ({seen} {effort.unit}) while the joint moves"
        return column, "nearly_dead", "warning", f"{why}: nearly dead; the joint is left out"
    return "", "", "", ""


def _effort(log: Log, j: int, moving: Mask, found: Findings) -> Mask:
    """Rows of one joint's effort that may be used, shape (N,)."""
    effort = log.effort
    column, x = column_name(log.joints[j], effort.channel), effort.values[:, j]
    drawn, repeats, step = _stale(log, found, column, x, "it changes", effort.unit)
    stuck = np.zeros_like(repeats)
    stuck[~drawn] = frozen(x[~drawn], moving[~drawn])
    if stuck.any():
        detail = (
            f"{int(stuck.sum())} rows hold one value while the joint moves, the first from "
            f"{log.time[int(np.argmax(stuck))]:.6g} s: a sensor that stopped; left out"
        )
        found.note(column, "frozen", float(stuck.mean()), "1", "warning", detail)
    jumps = _jumps(log, found, column, x, effort.unit)
    # A voltage at the supply is still the voltage; a sensor at its end tells nothing.
    hard, limit = effort.channel != "voltage", saturated(x, moving & ~repeats, step)
    if limit.any():
        detail = f"{int(limit.sum())} rows stick at {np.nanmax(np.abs(x[limit])):.5g} {effort.unit}"
        verdict = "masked" if hard else "warning"
        found.note(column, "saturated", float(limit.mean()), "1", verdict, detail)
    if log.torque_off is not None and log.torque_off[:, j].any():
        off = log.torque_off[:, j]
        bridge = log.torque_off_bridge or "not stated (open or shorted?)"
        detail = f"{int(off.sum())} rows with the drive off; bridge {bridge}"
        found.note(column, "torque_off", float(off.mean()), "1", "masked", detail)
    return np.asarray(~(drawn | repeats | stuck | jumps | (limit & hard)))


def _stale(
    log: Log, found: Findings, column: str, x: Array, moves: str, unit: str
) -> tuple[Mask, Mask, float]:
    """Rows of a column (N,) drawn between samples, rows that repeat the last one, its quantum."""
    missing = int((~np.isfinite(x)).sum())
    if 0 < missing < x.size:
        found.note(column, "missing", missing / x.size, "1", "masked", f"{missing} empty cells")
    step, rounded = quantum(x)
    if step > 0:
        detail = f"{100 * rounded:.0f} % of the values lie on it"
        found.note(column, "quantum", step, unit, "ok", detail)
    drawn = np.zeros(x.size, dtype=np.bool_)
    if rounded <= _ROUNDED:  # steps of a rounded sensor make straight lines, too
        drawn = interpolated(log.time, x)
    if drawn.any():
        every = 1e3 * own_spacing(log.time, ~drawn)
        detail = (
            f"{100 * drawn.mean():.0f} % of the rows lie on straight lines between others: "
            f"interpolated from about one sample in {every:.3g} ms, which is what counts"
        )
        found.note(column, "interpolated", float(drawn.mean()), "1", "masked", detail)
    share, repeats = held(x, step)
    if share <= HELD:
        return drawn, np.zeros_like(repeats), step
    detail = (
        f"{100 * share:.0f} % of the rows repeat while {moves}: about one new value in "
        f"{1 / max(1 - share, 1e-3):.1f} rows; repeats are bridged ({int(repeats.sum())} rows)"
    )
    found.note(column, "held", share, "1", "masked", detail)
    return drawn, repeats, step


def _jumps(log: Log, found: Findings, column: str, x: Array, unit: str) -> Mask:
    """Rows of a column that jump away and back, shape (N,)."""
    rows = glitches(x)
    if rows.any():
        count, first = int(rows.sum()), int(np.argmax(rows))
        many = f"{count} rows jump away and back, the first" if count > 1 else "one row jumps away"
        detail = (
            f"{many} at {log.time[first]:.6g} s to {x[first]:.5g} {unit}: no motion does that; "
            f"bridged as if {'they were' if count > 1 else 'it were'} empty"
        )
        found.note(column, "glitches", count, "1", "warning", detail)
    return rows
