"""What a column's name says: quantity, joint and unit; which of a log's names is which joint."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from actuators.errors import LegwattError
from actuators.units import dimension, spelt
from pipeline.logs.log_format import JOINT_COLUMNS, SUPPLY_COLUMNS

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
#: What a unit tells where no word does.
_OF_UNIT: Final = {
    **{"angle": "position", "angular velocity": "velocity", "torque": "torque"},
    **{"current": "current", "voltage": "voltage"},
}
_KEYWORD: Final = {word: quantity for quantity, words in _WORDS.items() for word in words}


#: Units as people write them beside `actuators.units`, which knows ``Nm`` and ``°/s``.
_SPELT: Final = {
    spelling: unit
    for unit, spellings in {
        "N*m": ("nm", "n.m", "n m", "n-m"),
        "mN*m": ("mnm", "mn.m", "mn m"),
        "N*cm": ("ncm", "n.cm"),
        "rad": ("radians", "radian", "rads"),
        "deg": ("degrees", "degree"),
        "rad/s": ("rads/s", "rad/sec", "radps", "rad s-1"),
        "deg/s": ("degrees/s", "deg/sec", "dps", "degps"),
        "s": ("seconds", "second", "sec", "secs"),
        "ms": ("milliseconds", "msec"),
        "us": ("microseconds", "usec"),
        "ns": ("nanoseconds", "nsec"),
        "A": ("amps", "amp", "ampere"),
        "mA": ("milliamps", "milliampere"),
        "V": ("volts", "volt"),
        "W": ("watts", "watt"),
        "degC": ("c", "celsius", "deg c"),
        "1": ("-", "none", "bool"),
    }.items()
    for spelling in spellings
}


def unit_spelt(text: str) -> str:
    """The unit that a text means, as `actuators.units` writes it; empty where it is none."""
    plain = text.strip().strip("[]()").strip()
    for name in (plain, _SPELT.get(plain.lower(), ""), plain.replace("_", "/")):
        try:
            return spelt(name)
        except LegwattError:
            continue
    return ""


@dataclass
class Guess:
    """What a column may be."""

    column: str  #: Its name in the file.
    quantity: str  #: Of the log format; empty where it is not known.
    owner: str  #: What the log calls the joint; later the robot's name of it.
    unit: str  #: As stated by name or file; empty for the log format's own.
    why: str = "as its name says"  #: By what this was guessed.
    sure: bool = True  #: Whether the line counts; else it is a remark.


def words_of(name: str) -> list[str]:
    """Words of a name in lower case: letters and digits apart, camel case split."""
    parts = re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+", name)
    return [part.lower() for part in parts]


def read_name(
    column: str, unit: str = "", joints: Sequence[str] = (), by_unit: bool = False
) -> Guess:
    """Read a name: what one of `joints` is called in full in it is no word, `q` of `q_elbow/pos`.

    `unit` is that of a row of units, empty where there is none. It alone tells the quantity where
    no word does, of a joint called in full; of any column if asked.
    """
    for joint in sorted((j for j in joints if len(j) > 2), key=len, reverse=True):
        rest = re.sub(rf"(?i)(?<![a-z0-9]){re.escape(joint)}(?![a-z0-9])", "", column)
        if rest != column and (inside := read_name(rest, unit, by_unit=True)).quantity:
            return replace(inside, column=column, owner=joint)
    bracket = re.search(r"[\[(]([^\[\]()]*[^\d\[\]()][^\[\]()]*)[\])]\s*$", column)
    spelt = unit_spelt(bracket[1]) if bracket else ""
    if bracket and spelt:
        return _read(column, column[: bracket.start()], unit or spelt, by_unit)
    parts = column.split("_")
    for k in (2, 1):  # the name's end: _rad_s before _s
        if not unit and len(parts) > k and "".join(parts[-k:]).lower() in _ENDS:
            inside = _read(column, "_".join(parts[:-k]), unit_spelt("/".join(parts[-k:])), by_unit)
            if inside.unit and inside.quantity:
                return inside
    return _read(column, column, unit, by_unit)


def _read(column: str, text: str, unit: str, by_unit: bool) -> Guess:
    """Read a name without its unit."""
    words = words_of(text)
    goal = next((w for w in words if w in _GOALS and (w != "d" or "q" in words)), "")
    found = next((w for w in words if w in _KEYWORD), "")
    told = _OF_UNIT.get(dimension(unit), "") if by_unit and unit else ""
    quantity, motor = _KEYWORD.get(found, told), bool(_MOTOR & {*words})
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
    return Guess(column, quantity, "_".join(rest), unit)


def assign(owners: Sequence[str], joints: Sequence[str]) -> tuple[dict[str, str], str]:
    """Which of the log's names is which joint of the robot, and by what that was decided.

    Args:
        owners: Names in the log, in the order of its columns.
        joints: Of the robot, in its order.

    Returns:
        Name to joint, for those that are recognised, and why; a guess by order is said to be one.
    """
    plain = _plain(joints)
    named = {
        owner: owner if owner in joints else joints[plain.index(key)]
        for owner, key in zip(owners, _plain(owners), strict=True)
        if owner in joints or plain.count(key) == 1
    }
    once = {o: joint for o, joint in named.items() if [*named.values()].count(joint) == 1}
    if len(once) == len(owners):
        return once, "by name"
    if len(owners) == len(joints):
        numbers = all(w.isdigit() for o in owners for w in words_of(o))
        ordered = sorted(owners, key=lambda o: [w.zfill(8) for w in words_of(o)] * numbers)
        return dict(zip(ordered, joints, strict=True)), "by order, a guess"
    return ({} if all(owner.isdigit() for owner in owners) else once), "by name"


def _plain(names: Sequence[str]) -> list[str]:
    """Names without the words that say nothing and without what all begin with."""
    rows = [[w for w in words_of(name) if w not in _EMPTY | _MOTOR] for name in names]
    while len(rows) > 1 and all(len(r) > 1 for r in rows) and len({r[0] for r in rows}) == 1:
        rows = [r[1:] for r in rows]
    return ["".join(str(int(w)) if w.isdigit() else w for w in row) for row in rows]
