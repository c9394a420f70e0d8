"""A log held against itself and its robot: units and signs, delays, idle feet, what stays open.

None of it needs a model of the robot but its limits and its mass. Logs that share rows are refused:
data given twice test nothing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Final

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from actuators.arrays import Array, Mask
from actuators.errors import LegwattError
from pipeline.logs.errors import Finding, Findings
from pipeline.logs.log_format import Expected, column_name
from pipeline.logs.reading.log import Log
from pipeline.logs.signals.fusion import Skew, skew

#: Fast over slow speeds below which laws of speed look alike.
_SPEEDS: Final = 4.0
#: Spread of a load's magnitude over its mean below which it might as well be constant.
_LOADS: Final = 0.3
#: Share of a joint's motion that has to go the other way.
_BACK: Final = 0.1
#: Windings warm over minutes [s].
_WARMING: Final = 60.0
#: Consecutive rows that have to agree in every number; a sensor's noise alone never does.
_RUN: Final = 8
#: Share of the shorter log's runs from which two logs count as the same data.
_SHARE: Final = 0.02
DEG: Final = 180.0 / math.pi
#: Factors by which each channel is commonly wrong, and what the numbers then are.
WRONG: Final[Mapping[str, Mapping[float, str]]] = {
    "velocity": {DEG: "deg/s", 30.0 / math.pi: "rpm", 1e3: "mrad/s"},
    "torque": {1e3: "mN*m", 1e2: "N*cm", 1e-3: "kN*m"},
    "current": {1e3: "mA", 1e-3: "kA"},
    "voltage": {1e3: "mV", 1e-3: "kV"},
    "power": {1e3: "mW", 1e-3: "kW"},
}
#: Relative distance from a factor within which it is taken for it.
NEAR: Final = 0.25
#: Travel of a joint below which a log is hardly one of degrees [rad].
_LEAST_TRAVEL: Final = 0.05
#: Checks of positions that the search for wrong columns can say more about.
OF_LIMITS: Final = ("share_outside_limits", "speed")
#: Rows of two channels that are compared.
_COMPARED_ROWS: Final = 50_000
#: Rows to either side over which a position's rate is taken.
_REACH: Final = 3
#: Factor between a velocity and the position's rate that no filter or rounding makes.
_CONTRADICTS: Final = 3.0
#: Share of the weight that feet may carry more or less on average: sensors err by some per cent.
_WEIGHT: Final = 0.1
#: Correlation from which the shift between two channels means something.
_ALIKE: Final = {"velocity": 0.7, "torque": 0.9}


def position_units(log: Log, expected: Expected, ok: Mask, found: Findings) -> None:
    """Positions against the limits of the joints; `ok` are those that count, shape (N, J)."""
    for j, joint in enumerate(log.joints):
        q = log.position[ok[:, j], j]
        if q.size == 0:
            continue
        column = column_name(joint, log.position_quantity)
        low, high = float(expected.lower[j]), float(expected.upper[j])
        span = f"runs from {q.min():.4g} to {q.max():.4g} rad"
        if not (math.isfinite(low) and math.isfinite(high)):
            if np.ptp(q) > 8 * math.pi:
                detail = f"{span} on a joint without limits; degrees? else several turns"
                found.note(column, "range", np.ptp(q), "rad", "warning", detail)
            continue
        margin = 0.05 * (high - low)
        outside = float(np.mean((q < low - margin) | (q > high + margin)))
        if outside == 0.0:
            continue
        turned, verdict = q / DEG, "suspected"
        fits = turned.min() >= low - margin and turned.max() <= high + margin
        if fits and outside > 0.2 and np.ptp(turned) > _LEAST_TRAVEL:
            why = (
                "looks like degrees, or a motor's angle; in a mapping file: "
                'unit = "deg", or scale = 1 over the gear ratio'
            )
        elif outside > 0.5:
            why = (
                "another zero or sign, a motor's angle, another joint's column "
                "or the log of another robot; set zero, flip, scale or as in a mapping file"
            )
        else:
            why, verdict = f"{100 * outside:.1f} % of the rows lie outside", "warning"
        detail = f"{span}, the joint's limits are {low:.4g} to {high:.4g} rad: {why}"
        found.note(column, "share_outside_limits", outside, "1", verdict, detail)


def velocity_units(log: Log, expected: Expected, ok: Mask, dt: float, found: Findings) -> None:
    """Rates of positions against speed limits and against velocities: factor, sign and skew."""
    rows = slice(0, min(len(log), _COMPARED_ROWS))
    time = log.time[rows]
    for j, joint in enumerate(log.joints):
        q = np.where(ok[rows, j], log.position[rows, j], np.nan)
        rate, w = np.full(q.size, np.nan), _REACH
        rate[w:-w] = (q[2 * w :] - q[: -2 * w]) / (time[2 * w :] - time[: -2 * w])
        top = float(np.nanquantile(np.abs(rate), 0.99)) if np.isfinite(rate).any() else 0.0
        limit = float(expected.velocity_limit[j])
        if math.isfinite(limit) and top > 3.0 * limit:
            detail = f"moves at {top:.4g} rad/s, the joint's limit is {limit:.4g}: " + (
                "looks like degrees, or time not in seconds"
                if top / DEG <= 1.2 * limit
                else "wrong unit of position or time, or the log of another robot"
            )
            column = column_name(joint, log.position_quantity)
            found.note(column, "speed", top, "rad/s", "suspected", detail)
        if log.velocity is None:
            continue
        seen = skew(log.velocity[rows, j], rate, dt, longest=0.25)
        if seen is None or abs(seen.correlation) < _ALIKE["velocity"]:
            continue
        column = column_name(joint, "velocity")
        verdict, detail = _factor(seen.factor)
        found.note(column, "factor", seen.factor, "1", verdict, detail)
        _note_lag(found, column, "skew", seen, dt, "the rate of the position")


def _factor(factor: float) -> tuple[str, str]:
    """Verdict on a velocity that is a factor times the position's rate, and why."""
    size = abs(factor)
    unit = next(
        (u for f, u in WRONG["velocity"].items() if f / (1 + NEAR) < size < f * (1 + NEAR)), None
    )
    if unit is not None:
        detail = f"is {size:.4g} times the rate of the position: looks like {unit}; give "
        return "suspected", f"{detail}its unit in a mapping file"
    if abs(size * DEG - 1) < NEAR:
        detail = f"is 1/{1 / size:.4g} of the rate of the position: the position looks "
        return "suspected", f"{detail}like degrees; give its unit in a mapping file"
    if factor < 0:
        return (
            "suspected",
            "runs against the rate of the position: flip one of them in a mapping file",
        )
    detail = f"{factor:.4g} times the rate of the position"
    if max(size, 1.0 / size) > _CONTRADICTS:
        return (
            "suspected",
            f"is {detail}: one of them is not what it is called, or the gear's ratio "
            "is applied where it is not to be; give a scale or [gear_ratio] in a mapping file",
        )
    return "warning" if abs(factor - 1) > 0.1 else "ok", detail


def _note_lag(found: Findings, column: str, check: str, seen: Skew, dt: float, of: str) -> None:
    late = abs(seen.lag) > max(0.25 * dt, 4 * seen.lag_error)
    detail = f"{1e3 * abs(seen.lag):.3g} ms {'behind' if seen.lag > 0 else 'ahead of'} {of}"
    found.note(column, check, seen.lag, "s", "warning" if late else "ok", detail)


def effort_units(log: Log, largest: Mapping[str, Array], found: Findings) -> None:
    """Efforts against the largest the drive can give, by channel and joint."""
    for channel in (c for c in log.channels if c in largest):
        for j, joint in enumerate(log.joints):
            values, limit = np.abs(getattr(log, channel)[:, j]), largest[channel][j]
            values = values[np.isfinite(values)]
            if not np.isfinite(limit) or values.size == 0:
                continue
            top = float(np.quantile(values, 0.99))
            if top <= 5.0 * limit:
                continue
            unit = next((u for f, u in WRONG[channel].items() if f > 1 and top / f <= limit), None)
            detail = f"reaches {top:.4g}, the drive's limit is {limit:.4g}: " + (
                f"looks like {unit}; give its unit in a mapping file"
                if unit
                else "the log of another robot, or a wrong unit"
            )
            found.note(column_name(joint, channel), "magnitude", top, "1", "suspected", detail)


def torque_on_time(log: Log, dt: float, found: Findings) -> None:
    """Shift between the torque and the current of the same motor."""
    if log.torque is None or log.current is None:
        return
    rows = slice(0, _COMPARED_ROWS)
    for j, joint in enumerate(log.joints):
        seen = skew(log.torque[rows, j], log.current[rows, j], dt, longest=0.1)
        if seen is not None and abs(seen.correlation) >= _ALIKE["torque"]:
            column = column_name(joint, "torque")
            _note_lag(found, column, "late", seen, dt, "the current of the same motor")


def feet_carry(log: Log, weight: float | None, found: Findings) -> None:
    """What the feet's sensors measure; vertical forces, on average, against the weight [N].

    Over a log in which the robot neither climbs nor falls, the mean of their sum is its weight.
    """
    if log.foot_force is None:
        return
    force = log.foot_force
    absent = [axis for k, axis in enumerate("xy") if not np.isfinite(force[..., k]).any()]
    detail = "forces in three directions: taken as the ground's; they tell contact too"
    if absent:
        detail = (
            f"no force_{' and no force_'.join(absent)} at every foot: the others tell contact and "
            "loads, the rest is computed as the least tangential forces, so that feet that squeeze "
            "the ground cannot be told"
        )
    verdict = "warning" if absent else "ok"
    found.note("", "foot_forces", len(log.feet), "1", verdict, detail)
    if weight is None or weight <= 0:
        return
    share = float(np.mean(np.nansum(force[..., 2], axis=1))) / weight
    detail = f"on average the feet carry {share:.3g} of the robot's weight of {weight:.4g} N"
    if abs(share - 1.0) <= _WEIGHT:
        found.note("", "feet_carry", share, "1", "ok", detail)
        return
    top = np.nanmax(np.abs(force[..., 2]), axis=0, initial=0.0)
    idle = [foot for foot, most in zip(log.feet, top, strict=True) if most < 0.02 * weight]
    if share < 0:
        why = "their sign is turned: forces are those of the ground on the robot"
    elif idle:
        why = f"{', '.join(idle)} never {'carry' if len(idle) > 1 else 'carries'} anything"
    else:
        why = "wrong unit, a load that the model lacks, or the robot hangs or leans on something"
    found.note("", "feet_carry", share, "1", "warning", f"{detail}: {why}")


def cannot_tell(log: Log, velocity: Array, effort: Array, ok: NDArray[np.bool_]) -> list[Finding]:
    """One finding per thing that stays open.

    Args:
        log: As read.
        velocity: Of its joints in the bandwidth, shape (N, J) [rad/s].
        effort: That is compared, shape (N, J).
        ok: Rows that count, shape (N, J).
    """
    out: list[str] = []
    if log.motor_position is None or not np.isfinite(log.motor_position).any():
        side = "motor" if log.position_source == "motor" else "joint"
        other = "joint" if side == "motor" else "motor"
        out.append(
            f"play and wind-up of gears as such: positions are the {side}s' alone; log the "
            f"{other}s' positions, too"
        )
    if log.torque is None or log.current is None:
        out.append(
            "a torque constant but by gravity: log both torque and current, or hold known weights"
        )
    duration = float(log.time[-1] - log.time[0])
    if log.temperature is None and duration < _WARMING:
        out.append(
            f"warming: {duration:.3g} s without a temperature; log minutes, or the housings' "
            "temperature"
        )
    ways: dict[str, list[str]] = {}
    for j, joint in enumerate(log.joints):
        for why in _by_motion(velocity[ok[:, j], j], effort[ok[:, j], j]):
            ways.setdefault(why, []).append(joint)
    out += [f"{why} ({_names(joints, log.joints)})" for why, joints in ways.items()]
    return [Finding(log.name, "", "cannot_tell", 1.0, "1", "ok", text) for text in out]


def _by_motion(v: Array, effort: Array) -> list[str]:
    """What one joint's motion leaves open."""
    good = np.isfinite(effort)
    v, effort = v[good], effort[good]
    fast = float(np.quantile(np.abs(v), 0.95)) if v.size else 0.0
    if fast <= 0.0:
        return []
    moving = np.abs(v) > 0.02 * fast
    out = []
    if min((v[moving] > 0).mean(), (v[moving] < 0).mean()) < _BACK:
        out.append("dry friction from an offset: move both ways")
    if fast < _SPEEDS * float(np.quantile(np.abs(v[moving]), 0.1)):
        out.append("dry from viscous friction: move at speeds further apart")
    load = np.abs(effort[moving])
    if load.size and float(load.std()) < _LOADS * float(load.mean()):
        out.append("friction that grows with the load: vary pose or payload")
    return out


def _names(joints: Sequence[str], every: Sequence[str]) -> str:
    return "every joint" if len(joints) == len(every) > 1 else ", ".join(joints)


def refuse_repeats(logs: Sequence[Log]) -> None:
    """Refuse logs that hold the same rows, in whole or in part.

    Args:
        logs: Of one robot.

    Raises:
        LegwattError: Two logs share a run of rows in which a joint moves.
    """
    for a, b in combinations(logs, 2):
        if a.joints != b.joints or a.effort.channel != b.effort.channel:
            continue
        short, long = (a, b) if len(a) <= len(b) else (b, a)
        rows = shared_rows(short, long)
        if rows > max(_RUN, _SHARE * len(short)):
            raise LegwattError(
                f"{a.name} and {b.name} hold the same measurements ({rows} of {len(short)} rows): "
                "test data must be data of their own, and data given twice count twice; leave one "
                "out"
            )


def shared_rows(short: Log, long: Log) -> int:
    """Rows of a log that lie in runs which another holds too, while a joint moves."""
    keys = [_hashed(np.hstack([log.position, log.effort.values])) for log in (short, long)]
    if min(map(len, keys)) < _RUN or not np.isin(keys[0], keys[1]).any():
        return 0
    moving = (np.diff(short.position, axis=0, prepend=short.position[:1]) != 0).any(axis=1)
    runs = [_hashed(sliding_window_view(key.view(np.int64), _RUN)) for key in keys]
    same = np.isin(runs[0], runs[1])
    # A machine at rest repeats itself.
    alive = np.convolve(moving, np.ones(_RUN), mode="valid") >= _RUN / 2
    inside = np.convolve(same & alive, np.ones(_RUN), mode="full") > 0
    return int(inside.sum())


def _hashed(table: NDArray[np.float64] | NDArray[np.int64]) -> NDArray[np.uint64]:
    """A number per row (N,) that equal rows share and others hardly ever."""
    import pandas as pd

    hashes = pd.util.hash_pandas_object(pd.DataFrame(table), index=False)
    return np.asarray(hashes, dtype=np.uint64)
