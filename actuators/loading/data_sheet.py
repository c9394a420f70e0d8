"""What data sheets print, an entry each in `entries.csv`, and how it is read.

A column of that table says what an entry is of: ``sheet`` is a motor with or without a gear, which
`init-actuator` takes and a part of the kind ``motor`` has, ``gear`` every kind of gear.
"""

import csv
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Final, NamedTuple

from actuators.errors import LegwattError, known, one_line
from actuators.units import number_and_unit, quantity, to_si

#: c of I^2 c R, the copper loss by the resistance between two terminals, which is twice a phase's:
#: 3/2 i_q^2 R_phase and 3 I_rms^2 R_phase.
CURRENTS: Final[Mapping[str, float]] = {"dc": 1.0, "phase-peak": 0.75, "phase-rms": 1.5}
#: Entries that are a word, and the factor that each word stands for.
CHOICES: Final[Mapping[str, Mapping[str, float]]] = {
    "current_of": CURRENTS,
    "resistance_of": {"phase-to-phase": 1.0, "terminal": 1.0, "phase": 2.0},
    "shaft": {"motor": 0.0, "output": 1.0},  # exponent of the ratio
    # Share of the permitted current at standstill: the worst of three phases then has twice the
    # mean loss, in an armature with brushes all parts have the same.
    "commutation": {"electronic": 0.7071067811865476, "brushes": 1.0},
}
GEARS: Final = ("strain_wave", "planetary", "self_locking", "belt")


class Entry(NamedTuple):
    """One number or choice of a data sheet."""

    kind: str  #: Its dimension in `actuators.units`; empty for a choice.
    words: str  #: What it is.
    example: str  #: Number and unit, or the choices.
    #: SI values outside of these are of no actuator of a legged robot: a slip of the unit. Only a
    #: number whose least is stated as 0 may be zero.
    least: float | None = None
    most: float = math.inf
    needs: str = ""  #: Entry without which it says nothing.
    instead: tuple[str, ...] = ()  #: Entries that say the same.


def _entries() -> tuple[dict[str, Entry], dict[str, dict[str, Entry]]]:
    every: dict[str, Entry] = {}
    kinds: dict[str, dict[str, Entry]] = {}
    with Path(__file__).with_name("entries.csv").open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            name, of = row["entry"], row["of"].split()
            limits = float(row["least"]) if row["least"] else None, float(row["most"] or "inf")
            about = row["dimension"], row["meaning"], row["example"]
            every[name] = Entry(*about, *limits, row["with"], tuple(row["instead"].split()))
            of += [*["motor"] * ("sheet" in of), *(GEARS if "gear" in of else ())]
            for kind in of:
                kinds.setdefault(kind, {})[name] = every[name]
    return every, kinds


#: Every entry by name, and those of each kind of part.
EVERY, _OF = _entries()
#: Those of `init-actuator`.
ENTRIES: Final[Mapping[str, Entry]] = _OF["sheet"]
#: Kind of a part to what its sheets print.
KINDS: Final[Mapping[str, Mapping[str, Entry]]] = {
    kind: _OF[kind] for kind in ("motor", *GEARS, "driver", "brake", "battery")
}
_SIDED: Final = ("no_load_speed", "stall_torque", "continuous_torque", "peak_torque", "max_speed")
#: Of each, one is enough.
_NEEDED: Final = (
    *("torque_constant speed_constant", "current_of", "resistance"),
    *("resistance_of", "supply_voltage", "no_load_current back_drive_torque", "rotor_inertia"),
    *("continuous_current continuous_torque", "peak_current peak_torque", "gear_ratio"),
)


#: What the rest or the range of a class gives (`filled`), so that it is asked for last.
_GIVEN: Final = {
    *("no_load_current", "rotor_inertia", "gear_efficiency", "continuous_current", "peak_current"),
}


class Number(NamedTuple):
    """A number as read, SI, with its unit and words; `low` < `high` where none is printed."""

    value: float
    low: float
    high: float
    unit: str
    words: str
    why: str = ""  #: Formula or class that it comes from; empty where it is printed.


#: A ratio of one: no gear.
ONE: Final = Number(1.0, 1.0, 1.0, "1", "1")
Sheet = Mapping[str, Number]


def read_entry(name: str, words: str, entries: Mapping[str, Entry] = ENTRIES) -> Number:
    """Return one number of a sheet, or the factor of a choice.

    Words are number and unit, `LOW to HIGH UNIT` for what no sheet prints, or a choice.

    Raises:
        LegwattError: No such entry, no number of its dimension, or one that cannot be.
    """
    entry, words = entries[known("no entry", name, entries)], one_line(words)
    if choices := CHOICES.get(name):
        factor = choices[known(name, words, choices)]
        return Number(factor, factor, factor, "1", words)
    first, _, last = words.rpartition(" to ")
    try:
        upper, unit = number_and_unit(last, entry.kind)
        # The unit may stand once, behind both.
        bare = first.strip().replace(".", "", 1).isdecimal()
        low = quantity(f"{first} {unit}" if bare else first or last, entry.kind)
    except LegwattError as error:
        raise LegwattError(f"{name}: {error}") from None
    high = to_si(upper, unit)
    zero = entry.least == 0.0
    if not (low > 0.0 or (low == 0.0 and zero)) or high < low:
        least = "0 or more" if zero else "more than 0"
        raise LegwattError(
            f"{name} '{words}': expected {least}, the lower number first, such as '{entry.example}'"
        )
    if low < (entry.least or 0.0) or high > entry.most:
        raise LegwattError(
            f"{name} '{words}' is of no actuator: expected {entry.least or 0:g} to {entry.most:g} "
            f"in SI units, such as '{entry.example}'"
        )
    return Number(0.5 * (low + high), low, high, unit, words)


def missing(sheet: Sheet) -> list[list[str]]:
    """Return entries that are needed still, in groups of which one is enough."""
    needed = [*_NEEDED]
    if "no_load_current" in sheet:
        needed.append("no_load_voltage no_load_speed")
    if "gear_running_torque" in sheet:
        needed.append("gear_running_speed")
    if has_gear(sheet):
        needed.append("gear_efficiency gear_load")
        if any(name in sheet for name in _SIDED):
            needed.append("shaft")
        if "gear_starting_torque" in sheet and "gear_load" not in sheet:
            needed.append("gear_rated_torque")
    groups = [group.split() for group in needed]
    return [group for group in groups if not any(name in sheet for name in group)]


def completed(sheet: Sheet) -> dict[str, Number]:
    """Return a sheet of motor and gear with what it need not say.

    Raises:
        LegwattError: All that is missing; else the first entry that says nothing.
    """
    if lacking := missing(sheet):
        lacking = [group for group in lacking if _GIVEN.isdisjoint(group)] or lacking
        words = {name: ENTRIES[name] for group in lacking for name in group}
        few = len(lacking) <= 2  # then there is room to say what each is
        said = {n: f"{n} ({f'{e.words}: ' * few}{e.example})" for n, e in words.items()}
        every = ", ".join(" or ".join(said[name] for name in group) for group in lacking)
        raise LegwattError(f"missing: {every}")
    for name in sheet:
        entry = EVERY[name]
        why = [f"it says nothing without {entry.needs}"] * (entry.needs not in ("", *sheet))
        why += [f"{other} says the same" for other in entry.instead if other in sheet]
        if name.startswith("gear_") and name != "gear_ratio" and not has_gear(sheet):
            why.append("there is no gear, gear_ratio is 1")
        if why:
            raise LegwattError(f"{name} is not used: {why[-1]}")
    whole = dict(sheet)
    if "no_load_current" in sheet and "back_drive_torque" not in sheet:
        whole.setdefault("coulomb_share", read_entry("coulomb_share", "0.2 to 1"))
    whole.setdefault("shaft", read_entry("shaft", "motor"))
    return whole


def has_gear(sheet: Sheet) -> bool:
    """Whether a sheet is of a motor with a gear."""
    return sheet.get("gear_ratio", ONE).value != 1.0
