"""What data sheets print of a motor and its gear, and how it is read."""

from collections.abc import Mapping
from typing import Final, NamedTuple

from actuators.errors import LegwattError, closest, one_line
from actuators.units import number_and_unit, quantity, to_si

#: c of I^2 c R, the copper loss by the resistance between two terminals, which is twice a phase's:
#: 3/2 i_q^2 R_phase and 3 I_rms^2 R_phase.
CURRENTS: Final[Mapping[str, float]] = {"dc": 1.0, "phase-peak": 0.75, "phase-rms": 1.5}
_RESISTANCES: Final = {"phase-to-phase": 1.0, "terminal": 1.0, "phase": 2.0}
_SHAFTS: Final = {"motor": 0.0, "output": 1.0}  # exponent of the ratio


class Entry(NamedTuple):
    """One number or choice of a data sheet: dimension, what it is, an example, choices."""

    kind: str
    words: str
    example: str
    choices: Mapping[str, float] = {}


def _choice(words: str, choices: Mapping[str, float]) -> Entry:
    return Entry("", words, " | ".join(choices), choices)


ENTRIES: Final[Mapping[str, Entry]] = {
    "torque_constant": Entry("torque constant", "k_t, motor's torque per ampere", "0.095 N*m/A"),
    "speed_constant": Entry("speed constant", "KV, motor's speed per volt", "100 rpm/V"),
    "motor_constant": Entry("motor constant", "k_t / sqrt(resistance)", "0.24 N*m/sqrt(W)"),
    "current_of": _choice(
        "amperes: between terminals, or amplitude (i_q) or RMS of a phase", CURRENTS
    ),
    "resistance": Entry("resistance", "of the winding", "0.16 ohm"),
    "resistance_of": _choice("where it is measured; terminal is phase-to-phase", _RESISTANCES),
    "supply_voltage": Entry("voltage", "of the supply", "48 V"),
    "no_load_current": Entry("current", "at no load", "0.5 A"),
    "no_load_voltage": Entry("voltage", "at which no-load values hold", "48 V"),
    "no_load_speed": Entry("angular velocity", "at no load", "570 rpm"),
    "coulomb_share": Entry(
        "ratio", "of no-load friction at any speed; 1 with brushes", "0.2 to 0.4"
    ),
    "stall_torque": Entry("torque", "at standstill and full voltage", "2.4 N*m"),
    "rotor_inertia": Entry("inertia", "of the rotor", "579 g*cm^2"),
    "continuous_current": Entry("current", "permitted all the time", "12 A"),
    "continuous_torque": Entry("torque", "given all the time", "9 N*m"),
    "peak_current": Entry("current", "at most", "28 A"),
    "peak_torque": Entry("torque", "at most", "22 N*m"),
    "max_speed": Entry("angular velocity", "permitted; by the voltage if not said", "8000 rpm"),
    "gear_ratio": Entry("ratio", "turns of the motor per turn of the output; 1 for no gear", "9"),
    "gear_efficiency": Entry("ratio", "at rated torque, driving the load", "0.84 to 0.95"),
    "gear_load": Entry("ratio", "friction per transmitted torque instead", "0.1"),
    "gear_starting_torque": Entry("torque", "that starts the gear at its input", "21 mN*m"),
    "gear_running_torque": Entry("torque", "that turns it without load", "35 mN*m"),
    "gear_running_speed": Entry("angular velocity", "at which it does", "2000 rpm"),
    "gear_rated_torque": Entry("torque", "at the output, at which its efficiency holds", "10 N*m"),
    "gear_inertia": Entry("inertia", "of the gear at its input", "1.4 g*cm^2"),
    "back_drive_torque": Entry("torque", "that turns the whole from its output", "0.51 N*m"),
    "shaft": _choice("of which speeds, torques and limits are stated", _SHAFTS),
    "mass": Entry("mass", "of motor and gear", "0.49 kg"),
}
#: What says nothing without another.
_ONLY_WITH: Final = {
    "coulomb_share": "no_load_current",
    "gear_running_torque": "gear_starting_torque",
    "gear_running_speed": "gear_running_torque",
    "gear_rated_torque": "gear_starting_torque",
}
_SIDED: Final = ("no_load_speed", "stall_torque", "continuous_torque", "peak_torque", "max_speed")
#: Of each, one is enough.
_NEEDED: Final[tuple[tuple[str, ...], ...]] = (
    ("torque_constant", "speed_constant"),
    *((name,) for name in ("current_of", "resistance", "resistance_of", "supply_voltage")),
    ("no_load_current", "back_drive_torque"),
    ("rotor_inertia",),
    ("continuous_current", "continuous_torque"),
    ("peak_current", "peak_torque"),
    ("gear_ratio",),
)
_MAY_BE_ZERO: Final = {"no_load_current", "back_drive_torque", "coulomb_share", "gear_load"}
_AT_MOST_1: Final = {"gear_efficiency", "coulomb_share"}
#: Both say the same friction.
_NOT_BOTH: Final = (
    ("gear_efficiency", "gear_load"),
    ("gear_load", "gear_rated_torque"),
    ("gear_starting_torque", "back_drive_torque"),
    ("coulomb_share", "back_drive_torque"),
)


class Number(NamedTuple):
    """A number as read, SI, with its unit and words; `low` < `high` where none is printed."""

    value: float
    low: float
    high: float
    unit: str
    words: str


def option(name: str) -> str:
    """An entry as the command line spells it."""
    return "--" + name.replace("_", "-")


def read_entry(name: str, words: str, entries: Mapping[str, Entry] = ENTRIES) -> Number:
    """One number of a sheet, or the factor of a choice.

    Args:
        name: Of `ENTRIES`.
        words: Number and unit, `LOW to HIGH UNIT` for what no sheet prints, or a choice.
        entries: Those that there are.

    Raises:
        LegwattError: No such entry, no number of its dimension, or one that cannot be.
    """
    if name not in entries:
        raise LegwattError(f"no entry '{one_line(name)}': {closest(name, list(entries))}")
    entry, words = entries[name], one_line(words)
    if entry.choices:
        if words not in entry.choices:
            raise LegwattError(f"{option(name)} '{words}': {closest(words, list(entry.choices))}")
        factor = entry.choices[words]
        return Number(factor, factor, factor, "1", words)
    first, _, last = words.rpartition(" to ")
    try:
        upper, unit = number_and_unit(last, entry.kind)
        # The unit may stand once, behind both.
        bare = first.strip().replace(".", "", 1).isdecimal()
        low = quantity(f"{first} {unit}" if bare else first or last, entry.kind)
    except LegwattError as error:
        raise LegwattError(f"{option(name)}: {error}") from None
    high = to_si(upper, unit)
    least = low > 0.0 or (low == 0.0 and name in _MAY_BE_ZERO)
    if not least or high < low or (high > 1.0 and name in _AT_MOST_1):
        sign = "0 or more" if name in _MAY_BE_ZERO else "more than 0"
        most = ", at most 1" if name in _AT_MOST_1 else ""
        raise LegwattError(
            f"{option(name)} '{words}': expected {sign}{most}, the lower number first, such as "
            f"'{entry.example}'"
        )
    return Number(0.5 * (low + high), low, high, unit, words)


def missing(words: Mapping[str, str]) -> list[tuple[str, ...]]:
    """Entries that are needed still, in groups of which one is enough.

    Args:
        words: What is known, by entry.
    """
    needed: list[tuple[str, ...]] = [*_NEEDED]
    if "no_load_current" in words:
        needed.append(("no_load_voltage", "no_load_speed"))
    if "gear_running_torque" in words:
        needed.append(("gear_running_speed",))
    if has_gear(words):
        needed.append(("gear_efficiency", "gear_load"))
        if any(name in words for name in _SIDED):
            needed.append(("shaft",))
        if "gear_starting_torque" in words and "gear_load" not in words:
            needed.append(("gear_rated_torque",))
    return [group for group in needed if not any(name in words for name in group)]


def has_gear(words: Mapping[str, str]) -> bool:
    """Whether a ratio other than 1 is stated."""
    return words.get("gear_ratio", "1").strip() not in ("1", "1.0")


def idle(name: str, words: Mapping[str, str]) -> str:
    """Why an entry says nothing beside others; empty where it does.

    Args:
        name: Of the entry.
        words: What else is known, by entry.
    """
    if name.startswith("gear_") and name != "gear_ratio" and not has_gear(words):
        return "there is no gear, --gear-ratio is 1"
    if (other := _ONLY_WITH.get(name, name)) != name and other not in words:
        return f"it says nothing without {option(other)}"
    for pair in _NOT_BOTH:
        if name in pair and (other := pair[name == pair[0]]) in words:
            return f"{option(other)} says the same"
    return ""


def read_sheet(words: Mapping[str, str]) -> dict[str, Number]:
    """Every entry of a sheet as a number; a share of Coulomb friction nobody states is a range.

    Raises:
        LegwattError: All that is missing; else the first that cannot be read.
    """
    sheet = {name: read_entry(name, text) for name, text in words.items()}
    lacking = [" or ".join(map(option, group)) for group in missing(words)]
    if lacking:
        raise LegwattError(f"missing: {', '.join(lacking)}; --help says what each is")
    for name in sheet:
        if why := idle(name, words):
            raise LegwattError(f"{option(name)} is not used: {why}")
    if "no_load_current" in sheet and "back_drive_torque" not in sheet:
        sheet.setdefault("coulomb_share", read_entry("coulomb_share", "0.2 to 1"))
    sheet.setdefault("shaft", read_entry("shaft", "motor"))
    return sheet
