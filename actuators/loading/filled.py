"""What a data sheet does not print: derived from what it does, else the range of its class.

Rules are tried in order; one whose formula reads what does not stand there by then is passed over.
The range of a class is what the middle four fifths of the parts in `actuators/components` print.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from typing import Final, NamedTuple

from actuators.loading.data_sheet import (
    CHOICES,
    EVERY,
    ONE,
    Number,
    Sheet,
    has_gear,
    missing,
    read_entry,
)
from actuators.units import from_si, si_unit

X = Mapping[str, float]
Span = tuple[float, float]
#: Efficiency of planetary gears with as many stages as ratios up to the key need.
EFFICIENCIES: Final[Mapping[float, Span]] = {
    7.0: (0.87, 0.94),
    20.0: (0.71, 0.87),
    60.0: (0.70, 0.83),
    math.inf: (0.66, 0.78),
}
#: No-load and continuous current over the stall current [1].
NO_LOAD: Final = (0.0017, 0.0098)
CONTINUOUS: Final = (0.030, 0.151)
PEAK: Final = (2.1, 3.3)  # peak over continuous current [1]
#: Mechanical time constants, J R / k^2, which hardly depend on a motor's size [s].
STARTING: Final = (0.00094, 0.0085)
#: Torque constant of an output over ratio and 1 / KV: the efficiency at which a gear locks, and
#: the root of 3/2 of conventions of amperes, rounded up [1].
OF_OUTPUT: Final = (0.5, 1.3)


def _volts(x: X) -> float:
    return x.get("no_load_voltage", x["supply_voltage"])


def ohms(x: X) -> float:
    """Return c R between terminals, with which c I^2 R is the copper loss [ohm]."""
    return x["current_of"] * x["resistance"] * x["resistance_of"]


def stall(x: X) -> float:
    """Return the current at standstill and full voltage, in the sheet's own amperes [A]."""
    return _volts(x) * math.sqrt(x["current_of"]) / ohms(x)


def _turns(x: X) -> float:
    return float(x["gear_ratio"] ** x["shaft"])


def _peak(x: X) -> Span:
    """Multiples of the continuous current, at most what flows at standstill where that is told."""
    most = math.inf
    with suppress(KeyError):
        most = max(stall(x) / x["continuous_current"], 1.0)
    return min(PEAK[0], most), min(PEAK[1], most)


def of_output(sheet: Sheet) -> bool:
    """Whether speeds say that the torque constant is the output's torque per ampere."""
    x = {name: number.value for name, number in sheet.items()}
    try:
        speed = x.get("speed_constant") or x["no_load_speed"] * _turns(x) / x["supply_voltage"]
        (low, high), product, n = OF_OUTPUT, x["torque_constant"] * speed, x["gear_ratio"]
        return x["shaft"] == 1.0 and high < low * n < product < high * n
    except KeyError:
        return False


class _Rule(NamedTuple):
    """How an entry follows from others: a value times the range of its class."""

    entry: str
    value: Callable[[X], float]
    why: str
    ends: Callable[[X], Span] = lambda x: (1.0, 1.0)


_SHARE: Final = "the share of the stall current that motors print"
_RULES: Final = (
    _Rule(
        "resistance",
        lambda x: _volts(x) / (math.sqrt(x["current_of"]) * x["stall_current"]),
        "voltage / stall current, between terminals",
    ),
    _Rule(
        "torque_constant",
        lambda x: math.sqrt(x["current_of"]) * _volts(x) / (x["no_load_speed"] * _turns(x)),
        "voltage / no-load speed of the motor",
    ),
    _Rule(
        "gear_efficiency",
        lambda x: x["stall_torque"] / (x["torque_constant"] * x["stall_current"] * _turns(x)),
        "stall torque / (torque constant x stall current x ratio)",
    ),
    _Rule(
        "gear_efficiency",
        lambda x: 1.0,
        "planetary gears of about its ratio",
        lambda x: next(span for most, span in EFFICIENCIES.items() if x["gear_ratio"] <= most),
    ),
    _Rule("no_load_current", stall, _SHARE, lambda x: NO_LOAD),
    _Rule("no_load_voltage", lambda x: x["supply_voltage"], "the supply voltage"),
    _Rule(
        "rotor_inertia",
        lambda x: x["torque_constant"] ** 2 / ohms(x),
        "k^2 / R times the mechanical time constant that motors have",
        lambda x: STARTING,
    ),
    _Rule("continuous_current", stall, _SHARE, lambda x: CONTINUOUS),
    _Rule(
        "peak_current",
        lambda x: x["continuous_current"],
        "the multiple of the continuous current that motors print, at most the stall current",
        _peak,
    ),
)


def filled(sheet: Sheet) -> dict[str, Number]:
    """Return a sheet with what it does not print, each such number with the reason `why`."""
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
    for name in ("current_of", "resistance_of"):
        every, why = CHOICES[name].values(), "the sheet does not say which"
        words = ", ".join(CHOICES[name])
        out.setdefault(name, Number(1.0, min(every), max(every), "1", words, why))
    if of_output(sheet):
        del out["torque_constant"]
    for rule in _RULES:
        if not any(rule.entry in group for group in missing(out)):
            continue
        with suppress(KeyError):  # of what does not stand there
            values = [rule.value(x) * end for x in corners(out) for end in rule.ends(x)]
            low, high = min(values), max(values)
            # A motor's torque beyond its own stall torque is no efficiency: the class counts then.
            if rule.entry != "gear_efficiency" or 0.5 < low <= high <= 1.0:
                unit = si_unit(EVERY[rule.entry].kind)
                ends = dict.fromkeys(f"{from_si(value, unit):.4g}" for value in (low, high))
                words = f"{' to '.join(ends)} {unit.removeprefix('1')}".rstrip()
                out[rule.entry] = Number(0.5 * (low + high), low, high, unit, words, rule.why)
    return out


def corners(sheet: Sheet) -> Iterator[dict[str, float]]:
    """Return the numbers of a sheet at every combination of the ends of its ranges."""
    ends = {name: dict.fromkeys((n.low, n.high)) for name, n in sheet.items()}
    return (dict(zip(ends, values, strict=True)) for values in itertools.product(*ends.values()))
