"""Parts that can be bought: what their data sheets print, one TOML file each, by kind.

The folder says the kind; `actuators/components/README.md` has the format. What a sheet does not
print is a range, taken from parts of its class that print it, so that no part wins by saying less.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from actuators.checked import Table, checked, read_toml
from actuators.errors import LegwattError, closest, one_line
from actuators.loading.converted import contradictions, converted
from actuators.loading.data_sheet import ENTRIES, Entry, Number, read_entry, read_sheet

#: The parts that come with the project.
PARTS: Final = Path(__file__).resolve().parents[1] / "components"
#: Driver and battery if no other is named.
DRIVER: Final = "moteus_x1"
PACK: Final = "aspilsan_13s4p"
_OF_GEARS: Final = {name: e for name, e in ENTRIES.items() if name.startswith("gear_")}
_GEAR: Final[Mapping[str, Entry]] = {
    **_OF_GEARS,
    "gear_continuous_torque": Entry("torque", "at the output, all the time", "10 N*m"),
    "gear_peak_torque": Entry("torque", "at the output, at most", "30 N*m"),
    "gear_max_speed": Entry("angular velocity", "of the input, at most", "8500 rpm"),
    "mass": ENTRIES["mass"],
}
#: Kind to what its sheets print.
KINDS: Final[Mapping[str, Mapping[str, Entry]]] = {
    "motor": {
        **ENTRIES,
        "winding_to_housing": Entry("thermal resistance", "winding to housing", "2 K/W"),
        "housing_to_ambient": Entry("thermal resistance", "housing to air", "5 K/W"),
        "winding_time": Entry("time", "thermal time constant of the winding", "40 s"),
        "housing_time": Entry("time", "thermal time constant of the housing", "800 s"),
        "winding_limit": Entry("temperature", "permitted", "155 degC"),
        "inductance": Entry("inductance", "between terminals", "0.08 mH"),
    },
    "strain_wave": _GEAR,
    "planetary": _GEAR,
    "belt": _GEAR,
    "self_locking": {
        **_GEAR,
        "lead_angle": Entry("angle", "of the worm", "5 deg"),
        "pressure_angle": Entry("angle", "in the normal plane", "20 deg"),
        "friction_coefficient": Entry("ratio", "of the flanks", "0.1"),
    },
    "driver": {
        "least_voltage": Entry("voltage", "of the supply", "10 V"),
        "most_voltage": Entry("voltage", "of the supply", "50 V"),
        "continuous_current": ENTRIES["continuous_current"],
        "peak_current": ENTRIES["peak_current"],
        "on_resistance": Entry("resistance", "of one transistor", "2.5 mohm"),
        "idle_power": Entry("power", "enabled, without current", "0.7 W"),
        "efficiency": Entry("ratio", "at its best", "0.98"),
        "voltage_share": Entry("ratio", "of the supply that the motor can get", "0.9"),
        "mass": ENTRIES["mass"],
    },
    "brake": {
        "holding_torque": Entry("torque", "at standstill, without power", "1.3 N*m"),
        "voltage": Entry("voltage", "of the coil", "24 V"),
        "release_power": Entry("power", "that keeps it open", "8 W"),
        "inertia": Entry("inertia", "on the shaft", "2 g*cm^2"),
        "release_time": Entry("time", "to open", "30 ms"),
        "engage_time": Entry("time", "to close", "20 ms"),
        "mass": ENTRIES["mass"],
    },
    "battery": {
        "energy": Entry("energy", "when full", "650 Wh"),
        "mass": ENTRIES["mass"],
        "specific_energy": Entry("specific energy", "energy per mass", "180 Wh/kg"),
        "voltage": Entry("voltage", "nominal", "48 V"),
        "voltage_swing": Entry(
            "ratio", "open-circuit voltage above nominal when full, and below when empty", "0.15"
        ),
        "sag": Entry("ratio", "of voltage at the current that empties it in one hour", "0.03"),
        "usable": Entry("ratio", "of its energy", "0.9"),
        "returned": Entry("ratio", "of charge fed in that can be drawn again", "0.97"),
    },
}


class _Written(Table):
    title: str
    part: str = ""
    basis: Literal["datasheet", "identified", "assumed"]
    source: str
    note: str = ""
    printed: dict[str, str]


@dataclass(frozen=True)
class Part:
    """A part by its data sheet."""

    name: str  #: Of its file.
    kind: str  #: One of `KINDS`.
    title: str  #: What it is.
    basis: str  #: Of its numbers.
    source: str  #: Where they were read.
    note: str  #: What is doubtful or filled in from its class.
    printed: Mapping[str, Number]

    @property
    def filled(self) -> tuple[str, ...]:
        """Entries that the sheet does not print: ranges of the class."""
        return tuple(name for name, n in self.printed.items() if n.low < n.high)


def load_parts(folder: Path = PARTS) -> dict[str, Part]:
    """Load every part of a folder with a folder for each kind; sorted by kind and name.

    Raises:
        LegwattError: No such folder, an unknown kind, a wrong key, or two parts of one name. An
            entry is unknown or cannot be read. A file cannot be read.
    """
    if not folder.is_dir():
        raise LegwattError(f"{one_line(folder)}: no such folder of parts")
    out: dict[str, Part] = {}
    for path in sorted(folder.glob("*/*.toml")):
        part = load_part(path)
        if part.name in out:
            raise LegwattError(f"{path.parent.name}/{path.name}: another part has this name")
        out[part.name] = part
    if not out:
        raise LegwattError(f"{one_line(folder)}: no parts; expected KIND/NAME.toml")
    return out


def load_part(path: Path) -> Part:
    """Load one part; its folder says its kind. Errors are those of `load_parts`."""
    kind, file = path.parent.name, one_line(f"{path.parent.name}/{path.name}")
    if kind not in KINDS:
        raise LegwattError(f"{file}: unknown kind '{one_line(kind)}': {closest(kind, [*KINDS])}")
    w = checked(_Written, read_toml(path), file)
    try:
        printed = {n: read_entry(n, text, KINDS[kind]) for n, text in w.printed.items()}
    except LegwattError as error:
        raise LegwattError(f"{file}: {error}") from None
    return Part(path.stem, kind, w.title, w.basis, w.source, w.note, printed)


def odd(part: Part) -> Iterator[str]:
    """Where a motor's numbers contradict each other or are not enough, one sentence each.

    Torque constant and speed constant, stall torque, and speed without load follow from others; see
    `actuators.loading.converted`.
    """
    if part.kind != "motor":
        return
    words = {n: x.words for n, x in part.printed.items() if n in ENTRIES}
    try:
        sheet = read_sheet({"gear_ratio": "1"} | words)
        found = converted({name: number.value for name, number in sheet.items()})
    except LegwattError as error:
        yield str(error)
        return
    yield from contradictions(sheet, found)
