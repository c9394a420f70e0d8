"""Columns that are wrong by a factor that limits or other columns betray."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipeline.logs.quality.finding import Finding
from pipeline.logs.quality.skew import Skew, skew
from pipeline.logs.reading.expected import Expected
from pipeline.logs.reading.log import Log

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

DEG: Final = 180.0 / math.pi
_SUFFIX: Final = {
    "position": "position_rad",
    "motor_position": "motor_position_rad",
    "velocity": "velocity_rad_s",
    "torque": "torque_Nm",
    "current": "current_A",
    "voltage": "voltage_V",
    "power": "power_W",
    "goal_position": "goal_position_rad",
}
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
#: Rows of velocity and position that are compared.
_COMPARED_ROWS: Final = 50_000


def column_name(joint: str, quantity: str) -> str:
    """Header of a channel in the log format."""
    return f"{joint}__{_SUFFIX[quantity]}"


def position_units(log: Log, expected: Expected, ok: Mask) -> list[Finding]:
    """Positions against the limits of the joints.

    Args:
        log: The log.
        expected: Limits.
        ok: Positions that may be used, shape (N, J).
    """
    out = []
    quantity = "motor_position" if log.position_source == "motor" else "position"
    for j, joint in enumerate(log.joints):
        q = log.position[ok[:, j], j]
        if q.size == 0:
            continue
        column = column_name(joint, quantity)
        low, high = float(expected.lower[j]), float(expected.upper[j])
        span = f"runs from {q.min():.4g} to {q.max():.4g} rad"
        if not (math.isfinite(low) and math.isfinite(high)):
            if np.ptp(q) > 8 * math.pi:
                detail = f"{span} on a joint without limits; degrees? else several turns"
                out.append(_finding(log, column, "range", np.ptp(q), "rad", "warning", detail))
            continue
        margin = 0.05 * (high - low)
        outside = float(np.mean((q < low - margin) | (q > high + margin)))
        if outside == 0.0:
            continue
        limits = f"the joint's limits are {low:.4g} to {high:.4g} rad"
        turned = q / DEG
        fits = turned.min() >= low - margin and turned.max() <= high + margin
        if fits and outside > 0.2 and np.ptp(turned) > _LEAST_TRAVEL:
            detail = (
                f"{span}, {limits}: looks like degrees, or a motor's angle; in a mapping file: "
                f'unit = "deg", or scale = 1 over the gear ratio'
            )
            verdict = "refused"
        elif outside > 0.5:
            detail = (
                f"{span}, {limits}: another zero or sign, a motor's angle, another joint's column "
                "or the log of another robot; set zero, flip, scale or as in a mapping file"
            )
            verdict = "refused"
        else:
            detail = f"{span}, {limits}: {100 * outside:.1f} % of the rows lie outside"
            verdict = "warning"
        out.append(_finding(log, column, "share_outside_limits", outside, "1", verdict, detail))
    return out


def velocity_units(log: Log, expected: Expected, ok: Mask, dt: float) -> list[Finding]:
    """Measured velocities against the positions' rate: factor, sign and skew; speed limits."""
    out: list[Finding] = []
    rows = slice(0, min(len(log), _COMPARED_ROWS))
    time = log.time[rows]
    w = 3
    for j, joint in enumerate(log.joints):
        q = np.where(ok[rows, j], log.position[rows, j], np.nan)
        if q.size < 100:
            continue
        rate = np.full(q.size, np.nan)
        rate[w:-w] = (q[2 * w :] - q[: -2 * w]) / (time[2 * w :] - time[: -2 * w])
        out += _speed_limit(log, expected, j, rate)
        if log.velocity is None:
            continue
        seen = skew(log.velocity[rows, j], rate, dt, longest=0.25)
        if seen is None or abs(seen.correlation) < 0.7:
            continue
        out += _velocity_findings(log, column_name(joint, "velocity"), seen, dt)
    return out


def _speed_limit(log: Log, expected: Expected, j: int, rate: Array) -> list[Finding]:
    top = float(np.nanquantile(np.abs(rate), 0.99)) if np.isfinite(rate).any() else 0.0
    limit = float(expected.velocity_limit[j])
    if not math.isfinite(limit) or top <= 3.0 * limit:
        return []
    quantity = "motor_position" if log.position_source == "motor" else "position"
    detail = f"moves at {top:.4g} rad/s, the joint's limit is {limit:.4g}: " + (
        "looks like degrees, or time not in seconds"
        if top / DEG <= 1.2 * limit
        else "wrong unit of position or time, or the log of another robot"
    )
    column = column_name(log.joints[j], quantity)
    return [_finding(log, column, "speed", top, "rad/s", "refused", detail)]


def _velocity_findings(log: Log, column: str, seen: Skew, dt: float) -> list[Finding]:
    out = []
    wrong = nearest(abs(seen.factor), WRONG["velocity"])
    inverse = abs(seen.factor) * DEG
    if wrong is not None:
        detail = (
            f"is {abs(seen.factor):.4g} times the rate of the position: looks like {wrong}; give "
            "its unit in a mapping file"
        )
        out.append(_finding(log, column, "factor", seen.factor, "1", "refused", detail))
    elif abs(inverse - 1) < NEAR:
        detail = (
            f"is 1/{1 / abs(seen.factor):.4g} of the rate of the position: the position looks "
            "like degrees; give its unit in a mapping file"
        )
        out.append(_finding(log, column, "factor", seen.factor, "1", "refused", detail))
    elif seen.factor < 0:
        detail = "runs against the rate of the position: flip one of them in a mapping file"
        out.append(_finding(log, column, "factor", seen.factor, "1", "refused", detail))
    else:
        off = abs(seen.factor - 1) > 0.1
        detail = f"{seen.factor:.4g} times the rate of the position"
        verdict = "warning" if off else "ok"
        out.append(_finding(log, column, "factor", seen.factor, "1", verdict, detail))
    late = abs(seen.lag) > max(0.25 * dt, 4 * seen.lag_error)
    word = "behind" if seen.lag > 0 else "ahead of"
    detail = f"{1e3 * abs(seen.lag):.3g} ms {word} the rate of the position"
    out.append(_finding(log, column, "skew", seen.lag, "s", "warning" if late else "ok", detail))
    return out


def effort_units(log: Log, largest: Mapping[str, Array]) -> list[Finding]:
    """Efforts against the largest the drive can give.

    Args:
        log: The log.
        largest: Channel to its largest plausible magnitude per joint, shape (J,).
    """
    out = []
    for channel in log.channels:
        limit = largest.get(channel)
        if limit is None:
            continue
        values = np.abs(getattr(log, channel))
        for j, joint in enumerate(log.joints):
            seen = values[np.isfinite(values[:, j]), j]
            if not np.isfinite(limit[j]) or seen.size == 0:
                continue
            top = float(np.quantile(seen, 0.99))
            if top <= 5.0 * limit[j]:
                continue
            unit = next(
                (u for f, u in WRONG[channel].items() if f > 1 and top / f <= limit[j]), None
            )
            detail = f"reaches {top:.4g}, the drive's limit is {limit[j]:.4g}: " + (
                f"looks like {unit}; give its unit in a mapping file"
                if unit
                else "the log of another robot, or a wrong unit"
            )
            column = column_name(joint, channel)
            out.append(_finding(log, column, "magnitude", top, "1", "refused", detail))
    return out


def nearest(factor: float, table: Mapping[float, str], near: float = 1 + NEAR) -> str | None:
    """Name of the wrong unit whose factor lies within `near` times, or None."""
    for wrong, unit in table.items():
        if wrong / near < factor < wrong * near:
            return unit
    return None


def _finding(
    log: Log, column: str, check: str, value: float, unit: str, verdict: str, detail: str
) -> Finding:
    return Finding(log.name, column, check, float(value), unit, verdict, detail)
