"""The judgement on a log before anything is computed from it: what is refused, masked, noted."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipeline.logs.quality.carried import feet_carry, torque_on_time
from pipeline.logs.quality.finding import Findings, Quality
from pipeline.logs.quality.glitches import glitches
from pipeline.logs.quality.presence import frozen, is_constant, presence
from pipeline.logs.quality.sampling import clock, held, quantum, saturated, standstill
from pipeline.logs.quality.unit_check import (
    column_name,
    effort_units,
    position_units,
    velocity_units,
)
from pipeline.logs.reading.expected import Expected
from pipeline.logs.reading.log import EFFORTS, Log
from pipeline.logs.signals.spacing import interpolated, own_spacing

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Fewer rows say nothing about anything.
FEWEST_ROWS: Final = 100
#: Slower logs show no dynamics [Hz].
SLOWEST: Final = 5.0
#: Share of values on a lattice from which a channel is a rounded sensor's own.
_ROUNDED: Final = 0.8
#: Share of repeats from which a channel counts as held.
HELD: Final = 0.1


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
        whole: Whether this is a whole log and no piece of one.
    """
    found = Findings(log.name)
    position_ok = np.isfinite(log.position)
    n = len(log)
    found.note(
        "",
        "rows",
        n,
        "1",
        "refused" if n < FEWEST_ROWS else "ok",
        f"{n} rows; at least {FEWEST_ROWS} are needed",
    )
    if n < FEWEST_ROWS:
        effort_ok = log.valid & np.isfinite(log.effort.values)
        return Quality(tuple(found), position_ok, effort_ok)
    beat = _rate(log, found)
    still = standstill(_bridged(log.position), beat)
    dead, silent = presence(log, still, found, whole=whole)
    stale = _positions(log, position_ok, still, found)
    position_ok = position_ok & ~stale & ~_jumps(log, found)
    effort_ok = _efforts(log, still, silent, found)
    _repeated_rows(log, still, found)
    if not dead:
        found += position_units(log, expected, position_ok)
        found += velocity_units(log, expected, position_ok, beat)
    found += effort_units(log, {"torque": expected.effort_limit, **(largest or {})})
    torque_on_time(log, beat, found)
    _feet(log, found)
    feet_carry(log, expected.weight, found)
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
    return Quality(tuple(found), position_ok, effort_ok)


def _feet(log: Log, found: Findings) -> None:
    """What the feet's sensors tell, and what not."""
    if log.foot_force is None:
        return
    absent = [axis for k, axis in enumerate("xy") if not np.isfinite(log.foot_force[..., k]).any()]
    number = len(log.feet)
    if not absent:
        detail = "forces in three directions: taken as the ground's; they tell contact too"
        found.note("", "foot_forces", number, "1", "ok", detail)
        return
    detail = (
        f"no force_{' and no force_'.join(absent)} at every foot: the others tell contact and "
        "loads, the rest is computed as the least tangential forces, so that feet that squeeze "
        "the ground cannot be told"
    )
    found.note("", "foot_forces", number, "1", "warning", detail)


def _bridged(x: Array) -> Array:
    """Empty cells take the last value before them: good enough to see whether a joint moves."""
    bad = ~np.isfinite(x)
    if not bad.any():
        return x
    index = np.where(bad, 0, np.arange(x.shape[0])[:, None])
    out = np.take_along_axis(x, np.maximum.accumulate(index, axis=0), axis=0)
    return np.nan_to_num(out)


def _unit(rate: float) -> str:
    """The unit in which a time column of too low a rate [Hz] was written: the first that fits."""
    names = {1e3: ("milliseconds", "ms"), 1e6: ("microseconds", "us"), 1e9: ("nanoseconds", "ns")}
    for factor, (name, unit) in names.items():
        if rate * factor >= SLOWEST:
            return f'{name}, write [time] unit = "{unit}"'
    return "no time, name the column under [time]"


def _rate(log: Log, found: Findings) -> float:
    beat = clock(log.time)
    rate = 1.0 / beat.dt
    slow = rate < SLOWEST
    hint = f"; time_s looks like {_unit(rate)} in a mapping file" if slow else ""
    found.note(
        "time_s",
        "rate",
        rate,
        "Hz",
        "refused" if slow else "ok",
        f"{rate:.5g} Hz over {log.time[-1] - log.time[0]:.4g} s{hint}",
    )
    uneven = beat.jitter > 0.05 * beat.dt
    found.note(
        "time_s",
        "jitter",
        beat.jitter,
        "s",
        "warning" if uneven else "ok",
        "resampled by interpolation" if uneven else "rows are evenly spaced",
    )
    if beat.gaps:
        found.note(
            "time_s",
            "gaps",
            beat.gaps,
            "1",
            "masked",
            f"{beat.gaps} gaps, the longest {beat.longest:.4g} s; filtered piece by piece",
        )
    return beat.dt


def _positions(log: Log, ok: Mask, still: Mask, found: Findings) -> Mask:
    """Quantisation, held values and missing cells of the positions. Returns stale samples."""
    quantity = "motor_position" if log.position_source == "motor" else "position"
    stale = np.zeros_like(ok)
    for j, joint in enumerate(log.joints):
        column = column_name(joint, quantity)
        x = log.position[:, j]
        step, rounded = _channel(found, column, x, "rad")
        stale[:, j] = _between(log, found, column, x, rounded)
        share, repeats = held(x, step)
        if share > HELD:
            stale[:, j] |= repeats
            found.note(
                column,
                "held",
                share,
                "1",
                "masked",
                f"{100 * share:.0f} % of the rows repeat while the joint moves: about one "
                f"new value in {1 / max(1 - share, 1e-3):.1f} rows; repeats are bridged "
                f"({int(repeats.sum())} rows)",
            )
    return stale


def _jumps(log: Log, found: Findings) -> Mask:
    """Positions that jump away and back. Returns the samples."""
    quantity = "motor_position" if log.position_source == "motor" else "position"
    out = np.zeros(log.position.shape, dtype=np.bool_)
    for j, joint in enumerate(log.joints):
        rows = glitches(log.position[:, j])
        if rows.any():
            out[:, j] = rows
            _note_jumps(log, found, column_name(joint, quantity), log.position[:, j], rows, "rad")
    return out


def _note_jumps(log: Log, found: Findings, column: str, x: Array, rows: Mask, unit: str) -> None:
    count = int(rows.sum())
    first = int(np.argmax(rows))
    many = f"{count} rows jump away and back, the first" if count > 1 else "one row jumps away"
    detail = (
        f"{many} at {log.time[first]:.6g} s to {x[first]:.5g} {unit}: no motion does that; "
        f"bridged as if {'they were' if count > 1 else 'it were'} empty"
    )
    found.note(column, "glitches", count, "1", "warning", detail)


def _efforts(log: Log, still: Mask, silent: Mask, found: Findings) -> Mask:
    """Quantisation, held values, saturation and missing cells of the compared effort."""
    effort = log.effort
    ok = log.valid & np.isfinite(effort.values) & ~silent
    for j in np.flatnonzero(~silent):
        x = effort.values[:, j]
        if not is_constant(x) and np.isfinite(x).any():
            ok[:, j] &= _effort(log, int(j), still[:, j], found)
    if log.chosen_effort is None and len(log.channels) > 1:
        others = ", ".join(c for c in EFFORTS if c in log.channels and c != effort.channel)
        detail = f"{effort.channel} is compared; also there: {others}"
        found.note("", "effort", 1, "1", "ok", detail)
    return ok


def _effort(log: Log, j: int, still: Mask, found: Findings) -> Mask:
    """Rows of one joint's effort that may be used, shape (N,)."""
    effort = log.effort
    column, x = column_name(log.joints[j], effort.channel), effort.values[:, j]
    step, rounded = _channel(found, column, x, effort.unit)
    drawn = _between(log, found, column, x, rounded)
    ok = ~drawn
    share, repeats = held(x, step)
    if share > HELD:
        ok &= ~repeats
        detail = (
            f"{100 * share:.0f} % of the rows repeat while it changes: about one new value in "
            f"{1 / max(1 - share, 1e-3):.1f} rows; repeats are bridged ({int(repeats.sum())} rows)"
        )
        found.note(column, "held", share, "1", "masked", detail)
    stuck = np.zeros_like(repeats)
    stuck[~drawn] = frozen(x[~drawn], ~still[~drawn])
    if stuck.any():
        ok &= ~stuck
        detail = (
            f"{int(stuck.sum())} rows hold one value while the joint moves, the first from "
            f"{log.time[int(np.argmax(stuck))]:.6g} s: a sensor that stopped; left out"
        )
        found.note(column, "frozen", float(stuck.mean()), "1", "warning", detail)
    jumps = glitches(x)
    if jumps.any():
        ok &= ~jumps
        _note_jumps(log, found, column, x, jumps, effort.unit)
    fresh = ~repeats if share > HELD else np.ones_like(repeats)
    ok &= ~_at_limit(log, column, x, saturated(x, ~still & fresh, step), found)
    _note_drive_off(log, column, j, found)
    return ok


def _at_limit(log: Log, column: str, x: Array, limit: Mask, found: Findings) -> Mask:
    """Rows at a limit that tell nothing, shape (N,)."""
    if not limit.any():
        return limit
    # A voltage at the supply is still the voltage; a sensor at its end tells nothing.
    hard = log.effort.channel != "voltage"
    top = np.nanmax(np.abs(x[limit]))
    detail = f"{int(limit.sum())} rows stick at {top:.5g} {log.effort.unit}"
    verdict = "masked" if hard else "warning"
    found.note(column, "saturated", float(limit.mean()), "1", verdict, detail)
    return limit if hard else np.zeros_like(limit)


def _note_drive_off(log: Log, column: str, j: int, found: Findings) -> None:
    if log.torque_off is None or not log.torque_off[:, j].any():
        return
    rows = log.torque_off[:, j]
    bridge = log.torque_off_bridge or "not stated (open or shorted?)"
    detail = f"{int(rows.sum())} rows with the drive off; bridge {bridge}"
    found.note(column, "torque_off", float(rows.mean()), "1", "masked", detail)


def _between(log: Log, found: Findings, column: str, x: Array, rounded: float) -> Mask:
    """Rows of a column that were interpolated between samples after sampling, shape (N,)."""
    if rounded > _ROUNDED:  # steps of a rounded sensor make straight lines, too
        return np.zeros(x.size, dtype=np.bool_)
    rows = interpolated(log.time, x)
    if rows.any():
        share = float(rows.mean())
        detail = (
            f"{100 * share:.0f} % of the rows lie on straight lines between others: interpolated "
            f"from about one sample in {1e3 * own_spacing(log.time, ~rows):.3g} ms, which is what "
            "counts"
        )
        found.note(column, "interpolated", share, "1", "masked", detail)
    return rows


def _channel(found: Findings, column: str, x: Array, unit: str) -> tuple[float, float]:
    """Missing cells of one column. Returns its quantum and the share of values on it."""
    missing = int((~np.isfinite(x)).sum())
    if 0 < missing < x.size:
        found.note(column, "missing", missing / x.size, "1", "masked", f"{missing} empty cells")
    step, whole = quantum(x)
    if step > 0:
        found.note(
            column,
            "quantum",
            step,
            unit,
            "ok",
            f"{100 * whole:.0f} % of the values lie on it",
        )
    return step, whole


def _repeated_rows(log: Log, still: Mask, found: Findings) -> None:
    """Rows that repeat the one before in every channel while something moves."""
    same = np.ones(len(log) - 1, dtype=np.bool_)
    for block in (log.position, log.velocity, *(getattr(log, c) for c in log.channels)):
        if block is not None:
            with np.errstate(invalid="ignore"):
                same &= (block[1:] == block[:-1]).all(axis=1)
    same &= ~np.asarray(still[1:].all(axis=1))
    share = float(same.mean())
    if share > 0.001:
        found.note(
            "",
            "repeated_rows",
            share,
            "1",
            "warning",
            f"{int(same.sum())} rows repeat the one before in every channel while a joint moves",
        )
