"""A folder of actuator files from a data sheet: `ideal`, and the actuator after its name."""

import math
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from actuators.errors import LegwattError, one_line
from actuators.loading.build import (
    ALTERNATIVES_FILE,
    MOTOR,
    MOTOR_KIND,
    NAME,
    NUMBERS,
    load_catalog,
)
from actuators.loading.data_sheet import (
    REFUSED,
    ROUNDING,
    completed,
    contradictions,
    converted,
    has_gear,
    read_entry,
)
from actuators.loading.filled import corners, filled, of_output
from actuators.parameters import ParameterSet, parameters_from_table
from actuators.units import from_si, si_unit

_IDEAL: Final = "ideal"
#: Components and their kinds.
_KINDS: Final = {"motor": MOTOR_KIND, "rotor": "rotating_friction", "gear": "gear"}
#: Of those with elements, the stage after them.
_STAGES: Final = {
    "gear": {"stage": "g", "shaft": "between rotor and gear"},
    "rotor": {"stage": "m"},
}
_LAWS: Final = {"friction": ("coulomb", "load", "viscous"), "inertia": ("inertia",)}
#: Parameters by `component.parameter`, as a file has them.
Written = dict[str, dict[str, Any]]


@dataclass(frozen=True)
class OwnActuator:
    """A folder of actuator files and what stands in it."""

    folder: Path  #: That `--actuators` takes.
    parameters: ParameterSet  #: By `component.parameter`.
    notes: tuple[str, ...]  #: What the sheet does not print, and where it contradicts itself.

    def __str__(self) -> str:
        """Its numbers, a line per component; their reasons are in `notes` and in the files."""
        lines: dict[str, str] = {}
        for p in self.parameters.rows():
            component, name = p.name.split(".")
            unit = "" if p.unit == "1" else f" {p.unit}"
            told = "" if p.basis == "datasheet" else f" ({p.basis})"
            before = f"{lines[component]}, " if component in lines else f"{component}: "
            lines[component] = f"{before}{name} {p.value_as_written:.6g}{unit}{told}"
        return "\n".join([f"{self.folder}, {len(self.notes)} notes", *lines.values()])


def init_actuator(
    name: str, out: str | Path | None = None, *, source: str, **printed: str
) -> OwnActuator:
    """Write a folder that `--actuators` takes, from what a data sheet prints.

    Args:
        name: Of the alternative: letters, digits, `_` and `-`.
        out: The folder; `name` in the current folder by default. To one that is there and holds
            alternatives the actuator is added.
        source: Which sheet, in words.
        **printed: Entries of `actuators.loading.data_sheet.ENTRIES`, number and unit in one text;
            `LOW to HIGH UNIT` for what is not printed. What is left out is derived from the rest
            or a range of its class; see `actuators.loading.filled`.

    Raises:
        LegwattError: Something is missing, unreadable or contradicts the rest, or the folder cannot
            be written; nothing is.
    """
    import tomlkit  # not above: the command line starts without it

    if not NAME.fullmatch(name) or name == _IDEAL:
        raise LegwattError(
            f"'{one_line(name)}': expected a name of letters a to z, digits, '_' and '-', other "
            f"than '{_IDEAL}': tables and files are called after it"
        )
    folder = Path(out) if out is not None else Path(name)
    there = (folder / ALTERNATIVES_FILE).is_file()
    if folder.exists() and not there:
        raise LegwattError(f"{folder}: is there and is no folder of actuator files; name another")
    if there and name in load_catalog(folder).alternatives:
        raise LegwattError(f"{folder}: there is an alternative '{name}'; give another name")
    written, notes = written_from(printed, source)
    files = _files(name, source, written)
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".legwatt_") as scratch:
            inside, options = Path(scratch), tomlkit.document()
            if there:
                shutil.copytree(folder, inside, dirs_exist_ok=True)
                options = tomlkit.parse((folder / ALTERNATIVES_FILE).read_text(encoding="utf-8"))
            for key, alternative in files.pop(ALTERNATIVES_FILE).items():
                options.setdefault(key, alternative)  # the ideal one is that of the first
            for file, content in {**files, ALTERNATIVES_FILE: options}.items():
                (inside / file).write_text(tomlkit.dumps(content), encoding="utf-8")
            load_catalog(inside)  # what is written works
            folder.mkdir(exist_ok=True)
            for file in (*files, ALTERNATIVES_FILE):  # the list of alternatives last
                (inside / file).replace(folder / file)
    except OSError as error:
        raise LegwattError(f"{folder}: cannot be written ({error.strerror})") from None
    return OwnActuator(folder, parameters_of(written), notes)


def written_from(words: Mapping[str, str], source: str) -> tuple[Written, tuple[str, ...]]:
    """Return parameters with basis, source and formula, and notes, from entries of a sheet.

    Raises:
        LegwattError: Something is missing, unreadable or contradicts the rest.
    """
    entries = {name: read_entry(name, str(text)) for name, text in words.items()}
    sheet = completed(filled(entries))
    found = converted({name: number.value for name, number in sheet.items()})
    odd = [*contradictions(sheet, found)]
    if wrong := "; ".join(words for off, words, _ in odd if off > REFUSED):
        raise LegwattError(f"{wrong}: correct one of them, or leave it out")
    unsure = [
        f"{name} {n.words}" + (f" ({n.why})" if n.why else "")
        for name, n in sheet.items()
        if n.low < n.high
    ]
    every = [converted(corner) for corner in corners(sheet)]
    out: Written = {}
    for key, value in found.items():
        component, name = key.split(".")
        entry = name if component == "motor" else f"{component}_{name}"
        printed = sheet.get("gear_starting_torque" if entry == "gear_coulomb" else entry)
        unit = printed.unit if printed else si_unit((NUMBERS | MOTOR)[name])
        low, high = (pick(one[key] for one in every) for pick in (min, max))
        same = printed is not None and math.isclose(printed.value, value, rel_tol=1e-12)
        sure = same and low == high and printed is not None and not printed.why
        own = {"value": _short(value, unit), "unit": unit}
        own["basis"] = "assumed" if low < high else "datasheet" if sure else "derived"
        own["source"] = one_line(source)
        if low < high:
            own["source"] = one_line(f"{source}; not printed: {', '.join(unsure)}")
            own["interval"] = [_short(low, unit), _short(high, unit)]
        if not sure:
            own["reason"] = (printed and printed.why) or "by actuators/catalog/README.md"
        out[key] = own
    notes = [f"{name} is not printed: {n.words}, {n.why}" for name, n in sheet.items() if n.why]
    notes += [f"{words}; used: {used}" for off, words, used in odd if off > ROUNDING]
    if of_output(entries):
        notes.append(f"torque_constant {words['torque_constant']} is the output's; speeds are used")
    if "motor_mass" in sheet and "gear_mass" not in sheet and has_gear(sheet):
        notes.append("the mass is the motor's alone; gear_mass adds its gear's")
    return out, tuple(notes)


def parameters_of(written: Written) -> ParameterSet:
    """Return them as parameters, SI."""
    schema = {key: (NUMBERS | MOTOR)[key.partition(".")[2]] for key in written}
    return parameters_from_table(written, schema, "data sheet")


def _short(value: float, unit: str) -> float:
    return float(f"{from_si(value, unit):.9g}")


def _files(name: str, source: str, written: Written) -> dict[str, Any]:
    """What the folder's files hold, by their names."""
    files: dict[str, Any] = {}
    parts = [(key, *key.split(".")) for key in written]
    for part, kind in _KINDS.items():
        own = {number: written[key] for key, component, number in parts if component == part}
        title = f"{part} of {name}: {one_line(source)}"
        files[f"{name}_{part}.toml"] = {"kind": kind, "title": title, "parameters": own}
    ratio = f"{name}_gear.ratio"
    transmission = {"name": "transmission", "law": "ratio", "ratio": ratio}
    entries = [dict(transmission)]
    for part, stage in _STAGES.items():
        for law, arguments in _LAWS.items():
            given = {a: f"{name}_{part}.{a}" for a in arguments if f"{part}.{a}" in written}
            if given:
                entries.append({"name": f"{part}_{law}", "law": law, **given})
        entries[-1] |= stage
    built = {"motor": f"{name}_motor", "ratio": ratio}
    ideal = {"title": f"Ideal: ratio and motor of {name} alone", **built}
    files[ALTERNATIVES_FILE] = {
        _IDEAL: {**ideal, "element": [{**transmission, "stage": "m"}]},
        name: {"title": f"{name} by its data sheet", **built, "element": entries},
    }
    return files
