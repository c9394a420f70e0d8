"""What data sheets print, an entry each in `entries.csv`, and how it is read.

A column of that table says what an entry is of: ``sheet`` is a motor with or without a gear, which
`init-actuator` takes and a part of the kind ``motor`` has, ``gear`` every kind of gear.
"""

import csv
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final, NamedTuple

from actuators.errors import LegwattError, known, one_line
from actuators.parameters import from_si, number_and_unit, quantity, to_si

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

    kind: str  #: Its dimension in `actuators.parameters`; empty for a choice.
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
    *("no_load_current", "rotor_inertia", "gear_efficiency", "continuous_current", "peak_current")
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


#: Sheets round, and windings scatter: constants are commonly sold to this share.
TOLERANCE: Final = 0.1
#: Within this two numbers of a sheet are the same, rounded.
ROUNDING: Final = 0.05
#: Beyond this one of the two numbers is of another motor, unit or convention.
REFUSED: Final = 0.15
Values = Mapping[str, float]  # SI


def converted(x: Values) -> dict[str, float]:
    """The parameters of motor, rotor and gear, by `component.parameter` [SI].

    Args:
        x: Entries of a sheet that lacks nothing, choices as factors; see `completed`.
    """
    c, n, output = x["current_of"], x["gear_ratio"], x["shaft"]
    k = x.get("torque_constant") or math.sqrt(c) / x["speed_constant"]
    resistance, volts = c * x["resistance"] * x["resistance_of"], math.sqrt(c) * x["supply_voltage"]
    out = {
        "motor.torque_constant": k,
        "motor.resistance": resistance,
        "motor.supply_voltage": volts,
        "gear.ratio": n,
        **gear_friction(x),
    }
    load, turns, idle = out.get("gear.load", 0.0), n**output, k * x.get("no_load_current", 0.0)
    if "back_drive_torque" in x:
        out["rotor.coulomb"] = x["back_drive_torque"] * (1.0 - load) / n
    else:
        out["rotor.coulomb"] = x["coulomb_share"] * idle
    if "no_load_current" in x:
        free = math.sqrt(c) * x.get("no_load_voltage", 0.0)  # [V]
        speed = (free - resistance * x["no_load_current"]) / k  # [rad/s]
        if "no_load_speed" in x:
            speed = x["no_load_speed"] * turns
        if speed <= 0.0:
            raise LegwattError("no_load_current x resistance exceeds no_load_voltage")
        out["rotor.viscous"] = (idle - out["rotor.coulomb"]) / speed
    out["motor.max_speed"] = x["max_speed"] * turns if "max_speed" in x else volts / k
    dry = out["rotor.coulomb"] + out.get("gear.coulomb", 0.0) * output
    for rating in ("continuous", "peak"):
        current = x.get(f"{rating}_current")
        if current is None:
            current = (x[f"{rating}_torque"] / turns * (1 + load * output) + dry) / k
        out[f"motor.{rating}_current"] = current
    out |= {e.replace("_", "."): x[e] for e in ("rotor_inertia", "gear_inertia") if e in x}
    if "mass" in x or "motor_mass" in x:
        out["motor.mass"] = x.get("mass", x.get("motor_mass", 0.0) + x.get("gear_mass", 0.0))
    return out


def gear_friction(x: Values) -> dict[str, float]:
    """Friction of a gear: drive 1 / (1 + load) of the power, driven back 1 - load of it."""
    out: dict[str, float] = {}
    start = x.get("gear_starting_torque", 0.0)
    run = x.get("gear_running_torque", start)
    if "gear_load" in x:
        out["gear.load"] = x["gear_load"]
    elif "gear_efficiency" in x:
        idle = run * x["gear_ratio"] / x["gear_rated_torque"] if run else 0.0
        out["gear.load"] = 1.0 / x["gear_efficiency"] - 1.0 - idle
    if start:
        out["gear.coulomb"] = start
    if run > start:
        out["gear.viscous"] = (run - start) / x["gear_running_speed"]
    return out


def contradictions(sheet: Sheet, p: Values) -> Iterator[tuple[float, str, str]]:
    """Where numbers of a sheet say different things or what cannot be.

    Args:
        sheet: As read.
        p: What they give; see `converted`.

    Yields:
        The share by which two numbers differ (infinite for what cannot be) [1], one sentence, and
        the number that is used.
    """
    whole = {name: number.value for name, number in sheet.items()}
    for name, (low, high, why) in _expected(whole, p).items():
        if name in sheet and not sheet[name].why:
            off = max(low / whole[name] - 1.0 if low else 0.0, whole[name] / high - 1.0)
            unit = sheet[name].unit
            near = [f"{from_si(v, unit):.3g}" for v in ((low, high) if low else (high,))]
            span = " to ".join(dict.fromkeys(near))
            used = name if name == "torque_constant" else why.rpartition(" give")[0]
            yield off, f"{name} {sheet[name].words}, but {why} {span} {unit}", used
    drop, volts = p["motor.continuous_current"] * p["motor.resistance"], p["motor.supply_voltage"]
    start, run = (whole.get(f"gear_{k}_torque", 0.0) for k in ("starting", "running"))
    load, drag = p.get("gear.load", 0.0), p["rotor.coulomb"] / p["motor.torque_constant"]
    wrong = {
        f"the continuous current through the resistance drops {drop:.3g} V, more than the "
        f"supply's {volts:.3g} V: one of the three is in another unit": drop > volts,
        "the peak current or torque is below the continuous one": (
            p["motor.continuous_current"] > p["motor.peak_current"]
        ),
        "gear_efficiency: the torque that turns the gear without load alone costs more": load < 0,
        "gear friction of 1 and more per load (an efficiency of 0.5 and less) locks the gear: no "
        "law of friction drives it backwards; see the law hypoid in actuators/catalog": load >= 1,
        "gear_running_torque is below gear_starting_torque": 0.0 < run < start,
        "no_load_current: its torque is less than back_drive_torque brings to the rotor, "
        f"{drag:.3g} A": p.get("rotor.viscous", 0.0) < 0,
    }
    yield from ((math.inf, words, "") for words, holds in wrong.items() if holds)


def _expected(x: Values, p: Values) -> dict[str, tuple[float, float, str]]:
    """Lowest and highest value, SI, that other entries leave to one, and why."""
    root, turns = math.sqrt(x["current_of"]), x["gear_ratio"] ** x["shaft"]
    k, resistance = p["motor.torque_constant"], p["motor.resistance"]
    volts = root * x.get("no_load_voltage", x["supply_voltage"])
    slowed = volts - resistance * x.get("no_load_current", 0.0)
    stall = k * volts / resistance * turns
    dry = (p["rotor.coulomb"] + p.get("gear.coulomb", 0.0) * x["shaft"]) * turns
    loaded = 1.0 + p.get("gear.load", 0.0) * x["shaft"]
    km = k / math.sqrt(resistance)
    out = {
        "motor_constant": (km, km, "torque constant, resistance and their conventions give"),
        "no_load_speed": (slowed / k / turns, volts / k / turns, "voltage and k_t give"),
        "stall_torque": ((stall - dry) / loaded, stall, "voltage, resistance and k_t give"),
    }
    for rating in ("continuous", "peak"):
        most = k * x.get(f"{rating}_current", math.inf) * turns
        out[f"{rating}_torque"] = (0.0, most, f"{rating}_current gives without any loss at most")
    if "speed_constant" in x:
        by = {name: math.sqrt(c) / x["speed_constant"] for name, c in CURRENTS.items()}
        each = ", ".join(f"{value:.3g} N*m/A for current_of {name}" for name, value in by.items())
        own = root / x["speed_constant"]
        out["torque_constant"] = (own, own, f"speed_constant ({each}) gives")
    return out
