"""What a data sheet does not print: derived from what it does, else the range of its class.

A sheet of an integrated servo prints stall torque, stall current and no-load speed and neither
torque constant nor resistance; hardly any prints a peak current or the efficiency of a gear. Rules
are tried in order, each from the numbers that stand there by then. The range of a class is what the
middle four fifths of the parts in `actuators/components` print.
"""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Final, NamedTuple

import numpy as np

from actuators.loading.data_sheet import CURRENTS, EVERY, ONE, Number, Sheet, has_gear, read_entry
from actuators.units import from_si, si_unit

#: A convention of amperes is told by a sheet's own numbers within this share; the nearest two,
#: `dc` and `phase-peak`, lie 15 % apart in sqrt(c).
_TELLS: Final = 0.05
#: Gears whose ratios lie within this factor are of one class: they have as many stages.
_LIKE: Final = 2.0
#: Percentiles of the parts' numbers that bound the range of a class.
_MIDDLE: Final = (10.0, 90.0)
X = Mapping[str, float]


class _Rule(NamedTuple):
    """How an entry follows from others, which must all stand there."""

    entry: str
    needs: Sequence[str]
    value: Callable[[X], float]
    why: str
    #: The same quotient, printed number over `value`, of parts of the class; None: `value` itself.
    share: Callable[[X], Sequence[float]] | None = None
    instead: Sequence[str] = ()  #: Entries that say the same.


def _volts(x: X) -> float:
    return x.get("no_load_voltage", x["supply_voltage"])


def _stall(x: X) -> float:
    """Current at standstill and full voltage, in the sheet's own amperes [A]."""
    return _volts(x) / (math.sqrt(x["current_of"]) * x["resistance"] * x["resistance_of"])


def _printed(kind: str, *names: str) -> list[dict[str, float]]:
    """Numbers of the parts of a kind whose sheets print all of these."""
    return [part for part in _parts(kind) if all(name in part for name in names)]


@cache
def _parts(kind: str) -> tuple[dict[str, float], ...]:
    from actuators.loading.parts import PARTS, read_parts  # which reads sheets itself

    return tuple(
        {name: n.value for name, n in part.printed.items() if n.low == n.high}
        for part in read_parts(PARTS / f"{kind}.csv")
    )


def _of_stall(name: str) -> Callable[[X], list[float]]:
    needs = (name, "supply_voltage", "resistance", "current_of", "resistance_of")
    return lambda x: [part[name] / _stall(part) for part in _printed("motor", *needs)]


def _slope(x: X) -> float:
    """Torque lost per speed gained at constant voltage, k^2 / R [N*m*s/rad]."""
    ohms = x["current_of"] * x["resistance"] * x["resistance_of"]
    return float(x["torque_constant"] ** 2 / ohms)


def _time_constants(x: X) -> list[float]:
    """Mechanical time constants, J R / k^2 [s], which hardly depend on a motor's size."""
    needs = ("rotor_inertia", "torque_constant", "resistance", "current_of", "resistance_of")
    return [part["rotor_inertia"] / _slope(part) for part in _printed("motor", *needs)]


def _efficiencies(x: X) -> list[float]:
    parts = _printed("planetary", "gear_efficiency", "gear_ratio")
    like = [p for p in parts if 1 / _LIKE <= p["gear_ratio"] / x["gear_ratio"] <= _LIKE]
    return [part["gear_efficiency"] for part in like or parts]


def _overloads(x: X) -> list[float]:
    parts = _printed("motor", "peak_current", "continuous_current")
    return [part["peak_current"] / part["continuous_current"] for part in parts]


_RULES: Final = (
    _Rule(
        "resistance",
        ("stall_current", "supply_voltage"),
        lambda x: _volts(x) / (math.sqrt(x["current_of"]) * x["stall_current"]),
        "voltage / stall current, between terminals",
    ),
    _Rule(
        "torque_constant",
        ("no_load_speed", "supply_voltage", "shaft"),
        lambda x: (
            math.sqrt(x["current_of"])
            * _volts(x)
            / (x["no_load_speed"] * x["gear_ratio"] ** x["shaft"])
        ),
        "voltage / no-load speed of the motor",
        instead=("speed_constant",),
    ),
    _Rule(
        "gear_efficiency",
        ("stall_torque", "stall_current", "torque_constant", "shaft"),
        lambda x: (
            x["stall_torque"]
            / (x["torque_constant"] * x["stall_current"] * x["gear_ratio"] ** x["shaft"])
        ),
        "stall torque / (torque constant x stall current x ratio)",
        instead=("gear_load",),
    ),
    _Rule(
        "gear_efficiency",
        ("gear_ratio",),
        lambda x: 1.0,
        "planetary gears of about its ratio",
        _efficiencies,
        instead=("gear_load",),
    ),
    _Rule(
        "no_load_current",
        ("resistance", "supply_voltage"),
        _stall,
        "the share of the stall current that motors print",
        _of_stall("no_load_current"),
        instead=("back_drive_torque",),
    ),
    _Rule(
        "no_load_voltage",
        ("no_load_current", "supply_voltage"),
        lambda x: x["supply_voltage"],
        "the supply voltage",
        instead=("no_load_speed",),
    ),
    _Rule(
        "rotor_inertia",
        ("torque_constant", "resistance", "resistance_of", "current_of"),
        _slope,
        "k^2 / R times the mechanical time constant that motors have",
        _time_constants,
    ),
    _Rule(
        "continuous_current",
        ("resistance", "supply_voltage"),
        _stall,
        "the share of the stall current that motors print",
        _of_stall("continuous_current"),
        instead=("continuous_torque",),
    ),
    _Rule(
        "peak_current",
        ("continuous_current", "resistance", "supply_voltage"),
        lambda x: x["continuous_current"],
        "the multiple of the continuous current that motors print, at most the stall current",
        _overloads,
        instead=("peak_torque",),
    ),
)


def filled(sheet: Sheet) -> dict[str, Number]:
    """Return a sheet with what it does not print, each such number with the reason `why`.

    Args:
        sheet: As read.
    """
    out = dict(sheet)
    if not any(name.startswith("gear_") for name in out):
        out["gear_ratio"] = ONE._replace(why="no gear is stated")
    if not has_gear(out):
        out.setdefault("shaft", read_entry("shaft", "motor"))
    if "resistance" not in out and "stall_current" in out:
        # At standstill and full voltage the supply's current is the one between two terminals.
        why = "the stall current is between terminals"
        out.setdefault("resistance_of", read_entry("resistance_of", "terminal")._replace(why=why))
        out.setdefault("current_of", read_entry("current_of", "dc")._replace(why=why))
    out.setdefault("current_of", _convention(out))
    for rule in _RULES:
        stands = any(name in out for name in (rule.entry, *rule.instead))
        gearless = rule.entry == "gear_efficiency" and not has_gear(out)
        if not stands and not gearless and all(name in out for name in rule.needs):
            number = _number(rule, out)
            # A motor's torque beyond its own stall torque is no efficiency: the class counts then.
            if rule.entry != "gear_efficiency" or 0.5 < number.low <= number.high <= 1.0:
                out[rule.entry] = number
    return out


def _number(rule: _Rule, sheet: Sheet) -> Number:
    """What a rule gives, over the ranges of what it needs and of its class."""
    x = {name: number.value for name, number in sheet.items()}
    needed = {name: sheet[name] for name in rule.needs if sheet[name].low < sheet[name].high}
    ends = itertools.product(*((n.low, n.high) for n in needed.values()))
    values = [rule.value(x | dict(zip(needed, end, strict=True))) for end in ends]
    low, high = min(values), max(values)
    if rule.share is not None:
        least, most = np.percentile(rule.share(x), _MIDDLE)
        low, high = low * float(least), high * float(most)
    if rule.entry == "peak_current":
        stall = max(_stall(x), x["continuous_current"])
        low, high = min(low, stall), min(high, stall)
    unit = si_unit(EVERY[rule.entry].kind)
    ends_in_words = [f"{from_si(value, unit):.4g}" for value in (low, high)]
    words = " to ".join(dict.fromkeys(ends_in_words))
    return Number(0.5 * (low + high), low, high, unit, f"{words} {unit}", rule.why)


def _convention(sheet: Sheet) -> Number:
    """Which amperes a sheet counts: told by its numbers, else the range of all."""
    x = {name: number.value for name, number in sheet.items()}
    roots = {}  # of c, by what tells it
    if {"torque_constant", "speed_constant"} <= set(x):
        roots["torque and speed constant"] = x["torque_constant"] * x["speed_constant"]
    if {"torque_constant", "motor_constant", "resistance", "resistance_of"} <= set(x):
        ohms = x["resistance"] * x["resistance_of"]
        roots["motor constant"] = x["torque_constant"] / (x["motor_constant"] * math.sqrt(ohms))
    for why, root in roots.items():
        name = min(CURRENTS, key=lambda n: abs(root / math.sqrt(CURRENTS[n]) - 1.0))
        if abs(root / math.sqrt(CURRENTS[name]) - 1.0) <= _TELLS:
            return read_entry("current_of", name)._replace(why=f"what {why} tell")
    ends = (min(CURRENTS.values()), max(CURRENTS.values()))
    return Number(1.0, *ends, "1", ", ".join(CURRENTS), "no number of the sheet tells")
