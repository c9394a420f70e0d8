"""What a column says: its name of quantity, joint and unit, its numbers of clock and angles.

Numbers tell the clock's unit, degrees from radians, and whose velocity a column is.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from actuators.arrays import Array
from actuators.units import dimension
from pipeline.logs.csv_head import unit_spelt
from pipeline.logs.log_format import JOINT_COLUMNS, SUPPLY_COLUMNS

#: Rates at which robots log [Hz].
_RATES: Final = (5.0, 20_000.0)
#: Correlation from which a column is a derivative, ...
DERIVATIVE: Final = 0.95
#: ... and below which it is none, whatever its name says.
NO_DERIVATIVE: Final = 0.8
#: Relative distance from a factor that has a name.
_NEAR: Final = 0.1
#: Share by which a motion may leave the limits that a robot's file states.
_BEYOND: Final = 0.1
#: A joint of no known limits turns no further [rad], ...
_TURNS: Final = 4.0 * np.pi
#: ... and shows no more degrees.
_DEGREES: Final = 720.0
#: Units of angles [rad].
ANGLES: Final = {"rad": 1.0, "deg": float(np.radians(1.0))}
#: Velocity's unit by the factor between it and the derivative of a position in radians.
_FACTORS: Final = {
    "rad/s": 1.0,
    "deg/s": float(np.radians(1.0)),
    "rpm": 2.0 * np.pi / 60.0,
}
#: Words of a name and what they say; a word of several letters may begin a longer one.
_WORDS: Final = {
    "position": ("position", "pos", "q", "angle", "enc", "encoder", "theta", "phi", "jointpos"),
    "velocity": ("velocity", "vel", "dq", "qd", "qdot", "speed", "omega", "thetadot", "w"),
    "torque": ("torque", "tau", "effort", "trq", "tq", "moment"),
    "current": ("current", "cur", "curr", "i", "iq", "amps"),
    "voltage": ("voltage", "volt", "u"),
    "power": ("power", "pwr"),
    "temperature": ("temperature", "temp"),
}
_GOALS: Final = {
    *("goal", "target", "cmd", "command", "commanded", "desired", "des", "d"),
    *("ref", "reference", "setpoint", "sp"),
}
#: Words of columns that hold no measurement.
_STATES: Final = {"enabled", "enable", "status", "error", "mode", "on", "off", "raw", "flag"}
_MOTOR: Final = frozenset(("motor", "rotor"))
_SUPPLY: Final = frozenset(
    ("supply", "battery", "bus", "bat", "rail", "pack", "psu", "vbat", "vbus")
)
#: Quantities of a supply, by those of a joint.
_OF_SUPPLY: Final = {"voltage": "supply", "current": "supply_current", "power": "supply_power"}
#: Words that say nothing about which joint it is.
_EMPTY: Final = {
    *("joint", "joints", "state", "states", "actual", "act", "measured", "meas", "present"),
    *("axis", "servo", "robot", "data", "leg"),
}
#: Units at the end of a name, where they fit its quantity: `tau_a` is of a joint `a`.
_ENDS: Final = {
    *("rad", "deg", "degrees", "radians", "nm", "mnm", "ncm", "a", "ma", "v", "mv", "w", "mw"),
    *("rpm", "rads", "degs", "degc", "c", "ms", "us", "ns", "s"),
}
_KEYWORD: Final = {word: quantity for quantity, words in _WORDS.items() for word in words}


class Named(NamedTuple):
    """What a column's name says."""

    column: str  #: The name.
    #: Of the log format, those of the supply as in `SUPPLY_COLUMNS`; empty where unknown.
    quantity: str
    joint: str  #: What is left of the name; empty where nothing is.
    unit: str  #: Stated by the name or a row of units; empty where none is.


def words_of(name: str) -> list[str]:
    """Words of a name in lower case: letters and digits apart, camel case split."""
    parts = re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+", name)
    return [part.lower() for part in parts]


def read_name(column: str, unit: str) -> Named:
    """Read a name; `unit` is that of a row of units, empty where there is none."""
    bracket = re.search(r"[\[(]([^\[\]()]*[^\d\[\]()][^\[\]()]*)[\])]\s*$", column)
    spelt = unit_spelt(bracket[1]) if bracket else ""
    if bracket and spelt:
        return _read(column, column[: bracket.start()], unit or spelt)
    parts = column.split("_")
    for k in (2, 1):  # the name's end: _rad_s before _s
        if not unit and len(parts) > k and "".join(parts[-k:]).lower() in _ENDS:
            inside = _read(column, "_".join(parts[:-k]), unit_spelt("/".join(parts[-k:])))
            if inside.unit and inside.quantity:
                return inside
    return _read(column, column, unit)


def _read(column: str, text: str, unit: str) -> Named:
    """Read a name without its unit."""
    words = words_of(text)
    goal = next((w for w in words if w in _GOALS and (w != "d" or "q" in words)), "")
    found = next((w for w in words if w in _KEYWORD), "")
    quantity, motor = _KEYWORD.get(found, ""), bool(_MOTOR & {*words})
    rest = [w for w in words if w not in {found, goal} | _EMPTY | _MOTOR]
    if _STATES & {*words}:
        quantity = ""
    elif goal:
        quantity = {"": "goal_position", "position": "goal_position"}.get(quantity, "")
    elif _SUPPLY & {*words} and (quantity in _OF_SUPPLY or not quantity):
        volts = {"vbat", "vbus"} & {*words} or (unit and dimension(unit) == "voltage")
        quantity = _OF_SUPPLY.get(quantity, "supply" if volts else "")
    elif motor and quantity == "position":
        quantity = "motor_position"
    if quantity and unit:
        own = dict((*JOINT_COLUMNS.values(), *SUPPLY_COLUMNS.values()))[quantity]
        quantity = quantity if dimension(own) == dimension(unit) else ""
    return Named(column, quantity, "_".join(rest), unit)


def assign(owners: Sequence[str], joints: Sequence[str]) -> tuple[dict[str, str], str]:
    """Which of the log's names is which joint of the robot, and by what that was decided.

    Args:
        owners: Names in the log, in the order of its columns.
        joints: Of the robot, in its order.

    Returns:
        Name to joint, for those that are recognised, and why; a guess by order is said to be one.
    """
    plain = _plain(joints)
    assigned = {
        owner: joints[plain.index(key)]
        for owner, key in zip(owners, _plain(owners), strict=True)
        if plain.count(key) == 1
    }
    if len(assigned) == len(owners) and len({*assigned.values()}) == len(assigned):
        return assigned, "by name"
    if len(owners) == len(joints):
        ordered = sorted(owners, key=lambda o: [(w.isdigit(), w.zfill(8)) for w in words_of(o)])
        in_order = ordered if all(w.isdigit() for o in owners for w in words_of(o)) else owners
        return dict(zip(in_order, joints, strict=True)), "by order, a guess"
    known = [owner for owner in assigned if [*assigned.values()].count(assigned[owner]) == 1]
    numbered = [*owners] != known and all(owner.isdigit() for owner in owners)
    return ({} if numbered else {owner: assigned[owner] for owner in known}), "by name"


def _plain(names: Sequence[str]) -> list[str]:
    """Names without the words that say nothing and without what all begin with."""
    rows = [[w for w in words_of(name) if w not in _EMPTY | _MOTOR] for name in names]
    while len(rows) > 1 and all(len(r) > 1 for r in rows) and len({r[0] for r in rows}) == 1:
        rows = [r[1:] for r in rows]
    return ["".join(str(int(w)) if w.isdigit() else w for w in row) for row in rows]


def clock_units(time: Array) -> list[str]:
    """Units in which a column may be a clock, the likeliest first."""
    step = np.diff(time[np.isfinite(time)])
    if step.size < 2 or not (step >= 0).all() or not (step > 0).any():
        return []
    typical = float(np.median(step[step > 0]))
    seconds = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
    return [u for u, f in seconds.items() if _RATES[0] <= 1.0 / (typical * f) <= _RATES[1]]


def angle_units(x: Array, lower: float, upper: float) -> list[str]:
    """Units in which a column may be a joint's angle, the likeliest first; none where none is.

    Limits are the joint's [rad], infinite where they are not known.
    """
    low, high = float(np.nanmin(x)), float(np.nanmax(x))
    if np.isfinite(lower) and np.isfinite(upper):
        margin = _BEYOND * (upper - lower)
        fits = {
            unit: lower - margin <= low * f and high * f <= upper + margin
            for unit, f in ANGLES.items()
        }
    else:
        most = max(abs(low), abs(high))
        fits = {"rad": most <= _TURNS, "deg": most <= _DEGREES}
    if fits["rad"] and high - low < 0.2:  # as degrees it would hardly move
        return ["rad"]
    return [unit for unit, fit in fits.items() if fit]


@dataclass(frozen=True)
class Follows:
    """How a column follows the derivative of another."""

    position: str  #: The other.
    correlation: float  #: Between the derivative and the column.
    factor: float  #: Derivative over column.

    def units(self, angle: str, stated: str) -> list[str]:
        """Units of the velocity that make the position one in this unit; none where none does.

        Args:
            angle: ``"rad"`` or ``"deg"``.
            stated: The velocity's unit where the file says it, else empty.
        """
        factor = abs(self.factor) * ANGLES[angle]
        return [
            unit
            for unit, f in _FACTORS.items()
            if abs(factor / f - 1.0) < _NEAR and stated in ("", unit)
        ]

    def of(self, stated: str) -> float:
        """What one of the velocity's unit is [rad/s]; 1 where the file does not say it."""
        return _FACTORS.get(stated, 1.0)


def follows(x: Array, rates: Mapping[str, Array]) -> list[Follows]:
    """How a column (N,) follows derivatives of positions, (N,) by name; the closest first."""
    out = []
    for name, rate in rates.items():
        good = np.isfinite(x) & np.isfinite(rate)
        if good.sum() < 20 or np.ptp(x[good]) == 0 or np.ptp(rate[good]) == 0:
            continue
        a, b = x[good] - x[good].mean(), rate[good] - rate[good].mean()
        product = float(a @ b)
        r = product / float(np.sqrt((a @ a) * (b @ b)))
        out.append(Follows(name, r, product / float(a @ a)))
    return sorted(out, key=lambda f: -abs(f.correlation))


def mean_of(time: Array, x: Array) -> Array:
    """A column averaged over as many rows as `rate_of` differentiates over, so that both agree."""
    whole = np.full(x.size, np.nan)
    good = np.isfinite(x) & np.isfinite(time)
    steps = 0.5 * (x[good][1:] + x[good][:-1]) * np.diff(time[good])
    whole[good] = np.concatenate([[0.0], np.cumsum(steps)])[: int(good.sum())]
    return rate_of(time, whole)


def rate_of(time: Array, x: Array) -> Array:
    """Derivative of a column, over so many rows that the encoder's steps do not drown it.

    Shape (N,), centred, NaN at both ends.
    """
    out = np.full(x.size, np.nan)
    good = np.flatnonzero(np.isfinite(x) & np.isfinite(time))
    if good.size < 50:
        return out
    t, q = time[good], x[good]
    half = max(1, min(good.size // 100, round(0.01 / max(float(np.median(np.diff(t))), 1e-9))))
    span = t[2 * half :] - t[: -2 * half]
    middle = good[half:-half]
    out[middle] = np.where(span > 0, (q[2 * half :] - q[: -2 * half]) / np.maximum(span, 1e-12), 0)
    return out
