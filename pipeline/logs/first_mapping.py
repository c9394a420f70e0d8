"""A first mapping file for a foreign log: by names, units and limits, a line per column.

A column's name says quantity, joint and unit; steps tell the clock's unit; limits tell degrees from
radians. What they leave open, such as the angle of a motor, `gap` itself names, with the line that
mends it.
"""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from actuators.arrays import Array
from actuators.errors import LegwattError, one_line
from actuators.parameters import dimension, spelt
from pipeline.logs.formats import TIMES, open_source
from pipeline.logs.log import POSITIONS, TIME, UNITS, Expected, column_name

#: Words of a name and the quantity that they say.
_QUANTITIES: Final = {
    "position": "position pos q angle enc encoder theta phi jointpos",
    "velocity": "velocity vel dq qd qdot speed omega thetadot w",
    "torque": "torque tau effort trq tq moment",
    "current": "current cur curr i iq amps",
    "voltage": "voltage volt u",
    "power": "power pwr",
    "temperature": "temperature temp",
}
#: Words that say what is told, and that say nothing about which joint it is.
_WORDS: Final = {
    "goal": "goal target cmd command commanded desired des d ref reference setpoint sp",
    "no measurement": "enabled enable status error mode on off raw flag",
    "motor": "motor rotor",
    "supply": "supply battery bus bat rail pack psu",
    "empty": "joint joints state states actual act measured meas present axis servo robot data leg "
    "motor rotor",
}
_KEYWORD: Final = {word: name for name, text in _QUANTITIES.items() for word in text.split()}
_SAYS: Final = {role: {*text.split()} for role, text in _WORDS.items()}
#: Owners of columns: the supply of all drives, and no joint that the robot has.
SUPPLY, NOBODY = "supply", "JOINT"
#: Quantities of a supply, by those of a joint.
_OF_SUPPLY: Final = {"voltage": "supply", "current": "supply_current", "power": "supply_power"}
#: What a unit tells where no word does.
_OF_UNIT: Final = {
    **{"angle": "position", "angular velocity": "velocity"},
    **{name: name for name in ("torque", "current", "voltage")},
}
#: Units as people write them beside `actuators.parameters`, which knows ``Nm`` and ``°/s``.
_SPELT: Final = {
    **{"nm": "N*m", "mnm": "mN*m", "ncm": "N*cm", "c": "degC", "celsius": "degC"},
    **{"radians": "rad", "rad/sec": "rad/s", "degrees": "deg", "deg/sec": "deg/s", "dps": "deg/s"},
    **{"sec": "s", "seconds": "s", "milliseconds": "ms", "amps": "A", "volts": "V", "-": "1"},
}
_SECONDS: Final = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_ANGLES: Final = {"rad": 1.0, "deg": float(np.radians(1.0))}
_ROWS: Final = 100_000  # that are looked at
#: Rates at which robots log [Hz].
_RATES: Final = (5.0, 20_000.0)
#: Share by which a motion may leave the limits that a robot's file states; a joint of no known
#: limits turns no further [rad].
_BEYOND, _TURNS = 0.1, 4.0 * np.pi
#: Beyond this a current is hardly one of amperes.
_AMPERES: Final = 200.0
_HEAD: Final = """\
# A first mapping of {where}: every line is a guess, with its reason behind it.
# Lines that are remarks are not sure enough to count; take off the # of right ones.
# Signs and zeros are the joint's in the file as here; `gap` itself names those that are
# not, with the line that mends them (flip = true, zero = ...).
# Joints are recognised {by}."""
_NO_CLOCK: Final = """
# No column runs on like a clock: put the rate at which it was logged.
# [time]
# sample_rate = 1000  # [Hz]"""


@dataclass
class Guess:
    """What a column may be."""

    column: str  #: Its name in the file.
    quantity: str  #: Of the log format; empty where it is not known.
    owner: str  #: What the log calls the joint; later the robot's name of it.
    unit: str  #: As stated by name or file; empty for the log format's own.
    why: str = "as its name says"  #: By what this was guessed.
    sure: bool = True  #: Whether the line counts; else it is a remark.

    @property
    def target(self) -> str:
        """Its name in the log format."""
        return column_name(self.owner, self.quantity)

    @property
    def line(self) -> str:
        """Of a mapping file."""
        unit = f', unit = "{self.unit}"' if self.unit else ""
        line = f"{_quoted(self.column)} = {{as = {_quoted(self.target)}{unit}}}  # "
        return "# " * (not self.sure) + line + one_line(self.why)


class FirstMapping(NamedTuple):
    """A mapping file, and what became of the columns."""

    text: str  #: TOML.
    mapped: tuple[str, ...]  #: Columns that count.
    open: tuple[str, ...]  #: Columns that are remarks until somebody decides.


def first_mapping(path: Path, expected: Expected) -> FirstMapping:
    """Write a first mapping file for a log.

    Args:
        path: The log.
        expected: Names and limits of the robot.

    Raises:
        LegwattError: The file is no table of numbers.
    """
    table = open_source(path)
    every = table.columns(table.header, texts=True)
    data = {name: x[:_ROWS] for name, x in every.items() if np.isfinite(x).any()}
    own = {c for c in table.header if c in expected.columns}
    clock, text = _clock(data, own)
    foreign = [c for c in data if c not in {*own, clock} and "*" not in c]
    for by_unit in (False, True):  # words of another language: units tell
        guesses = [read_name(c, expected.joints, by_unit) for c in foreign]
        if any(g.quantity in POSITIONS for g in guesses):
            break
    guesses = [g for g in guesses if g.quantity]
    by = _name_owners(guesses, expected.joints)
    positions = {g.owner: g for g in guesses if g.quantity in POSITIONS}
    for g in sorted(guesses, key=lambda g: g.quantity not in POSITIONS):
        _tell_unit(g, data[g.column], positions.get(g.owner), expected)
    taken = {*own}
    for g in guesses:
        if g.owner == NOBODY:
            g.sure, g.why = False, "no joint with a position is called so: put its name"
        elif g.target in taken:
            g.sure, g.why = False, f"{g.why}; another column gives the same"
        taken |= {g.target} if g.sure else set()
    text = [_HEAD.format(where=table.where, by=by), *text]
    text += ["", "[columns]", *(g.line for g in guesses)] if guesses else []
    mapped, left = (tuple(g.column for g in guesses if g.sure == sure) for sure in (True, False))
    return FirstMapping("\n".join(text) + "\n", mapped, left)


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _clock(data: Mapping[str, Array], own: Collection[str]) -> tuple[str, list[str]]:
    """The column of time, and the lines that say so."""
    if TIME in own:
        return TIME, []
    # One that is called time, else one that never runs back.
    named = [c for c in data if {*words_of(c), c} & {*TIMES}]
    for column in (*named, *data):
        step = np.diff(data[column])
        if step.size < 2 or not (step > 0).any() or (column not in named and not (step >= 0).all()):
            continue
        stated = read_name(column).unit or unit_spelt(column.rpartition("_")[2])
        typical = float(np.median(step[step > 0]))
        rates = {unit: 1.0 / (typical * seconds) for unit, seconds in _SECONDS.items()}
        units = [u for u, rate in rates.items() if _RATES[0] <= rate <= _RATES[1]]
        units = [stated] if stated in _SECONDS else units
        if units:
            other = "".join(f"; or {unit}" for unit in units[1:])
            lines = ["", "[time]", f"column = {_quoted(column)}"]
            return column, [*lines, f'unit = "{units[0]}"  # {rates[units[0]]:.4g} Hz{other}']
    return "", _NO_CLOCK.splitlines()


def _name_owners(guesses: Sequence[Guess], joints: Sequence[str]) -> str:
    """Give columns the robot's names of their joints, or `NOBODY`; by what those were known."""
    names = {q: dict.fromkeys(g.owner for g in guesses if g.quantity == q) for q in UNITS}
    known = [*(names["position"] | names["motor_position"])]
    told, by = assign(known, joints)
    # Joints that other quantities call otherwise than positions do: `enc 1`, `motor 1 A`.
    called = {q: assign([*own], known)[0] if {*own} - {*known} else {} for q, own in names.items()}
    for g in (g for g in guesses if g.owner != SUPPLY):
        g.owner = told.get(called[g.quantity].get(g.owner, g.owner), NOBODY)
    return by


def _tell_unit(g: Guess, x: Array, position: Guess | None, expected: Expected) -> None:
    """Unit by the numbers of a column, and by its joint's position, where nothing states it."""
    if g.unit or g.owner == NOBODY:
        return
    low, high = float(np.nanmin(x)), float(np.nanmax(x))
    if g.quantity.endswith("current"):
        g.unit = "mA" if max(-low, high) > _AMPERES else ""
    elif position is not None and g.quantity in ("goal_position", "velocity"):
        g.unit = position.unit + "/s" * (g.quantity == "velocity" and position.unit == "deg")
    elif g.quantity == "position":
        k = expected.joints.index(g.owner)
        least, most = float(expected.lower[k]), float(expected.upper[k])
        margin = _BEYOND * (most - least)
        limits = (least - margin, most + margin) if np.isfinite(margin) else (-_TURNS, _TURNS)
        fits = [u for u, f in _ANGLES.items() if limits[0] <= f * low and f * high <= limits[1]]
        g.sure, g.unit = bool(fits), "rad" if not fits else "" if "rad" in fits else "deg"
        g.why = f"from {low:.4g} to {high:.4g}: "
        g.why += f"{' or '.join(fits)} by the joint's limits" if fits else "no radians, no degrees"


def words_of(name: str) -> list[str]:
    """Words of a name in lower case: letters and digits apart, camel case split."""
    parts = re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+", name)
    return [part.lower() for part in parts]


def unit_spelt(text: str) -> str:
    """The unit that a text means, as `actuators.parameters` writes it; empty where it is none."""
    plain = text.strip()
    for name in (plain, _SPELT.get(plain.lower(), ""), plain.replace("_", "/")):
        with suppress(LegwattError):
            return spelt(name)
    return ""


def read_name(column: str, joints: Sequence[str] = (), by_unit: bool = False) -> Guess:
    """Read a name: what one of `joints` is called in full in it is no word, `q` of `q_elbow/pos`.

    A unit at its end alone tells the quantity where no word does, of a joint called in full; of any
    column if asked.
    """
    for joint in sorted((j for j in joints if len(j) > 2), key=len, reverse=True):
        rest = re.sub(rf"(?i)(?<![a-z0-9]){re.escape(joint)}(?![a-z0-9])", "", column)
        if rest != column and (inside := read_name(rest, by_unit=True)).quantity:
            return replace(inside, column=column, owner=joint)
    bracket = re.search(r"[\[(]([^\[\]()]*[^\d\[\]()][^\[\]()]*)[\])]\s*$", column)
    if bracket and (unit := unit_spelt(bracket[1])):
        return _read(column, column[: bracket.start()], unit, by_unit)
    parts = column.split("_")
    for k in (2, 1):  # the name's end: _rad_s before _s; `tau_a` is of a joint `a`, since A is none
        unit = unit_spelt("/".join(parts[-k:])) if len(parts) > k else ""
        inside = _read(column, "_".join(parts[:-k]), unit, by_unit)
        if unit and inside.quantity:
            return inside
    return _read(column, column, "", by_unit)


def _read(column: str, text: str, unit: str, by_unit: bool) -> Guess:
    """Read a name without its unit."""
    words = words_of(text)
    goal = next((w for w in words if w in _SAYS["goal"] and (w != "d" or "q" in words)), "")
    found = next((w for w in words if w in _KEYWORD), "")
    told = _OF_UNIT.get(dimension(unit), "") if by_unit and unit else ""
    quantity = _KEYWORD.get(found, told)
    owner = "_".join(w for w in words if w not in {found, goal} | _SAYS["empty"])
    if _SAYS["no measurement"] & {*words}:
        quantity = ""
    elif goal:
        quantity = "goal_position" if quantity in ("", "position") else ""
    elif _SAYS["supply"] & {*words}:
        quantity, owner = _OF_SUPPLY.get(quantity, ""), SUPPLY
    elif _SAYS["motor"] & {*words} and quantity == "position":
        quantity = "motor_position"
    if quantity and unit and dimension(UNITS[quantity]) != dimension(unit):
        quantity = ""
    return Guess(column, quantity, owner, unit)


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
    if len(once) < len(owners) == len(joints):
        numbers = all(w.isdigit() for o in owners for w in words_of(o))
        ordered = sorted(owners, key=lambda o: [w.zfill(8) for w in words_of(o)] * numbers)
        return dict(zip(ordered, joints, strict=True)), "by order, a guess"
    shifted = len(once) < len(owners) and all(owner.isdigit() for owner in owners)
    return {} if shifted else once, "by name"


def _plain(names: Sequence[str]) -> list[str]:
    """Names without the words that say nothing and without what all begin with."""
    rows = [[w for w in words_of(name) if w not in _SAYS["empty"]] for name in names]
    while len(rows) > 1 and all(len(r) > 1 for r in rows) and len({r[0] for r in rows}) == 1:
        rows = [r[1:] for r in rows]
    return ["".join(str(int(w)) if w.isdigit() else w for w in row) for row in rows]
