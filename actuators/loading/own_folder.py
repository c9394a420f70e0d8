"""A folder of actuator files from a data sheet: `ideal`, and the actuator after its name."""

import math
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from actuators.checked import checked
from actuators.errors import LegwattError, one_line
from actuators.loading.alternatives import ALTERNATIVES_FILE, MOTOR, MOTOR_KIND, NAME, NUMBERS
from actuators.loading.build import load_catalog
from actuators.loading.converted import (
    REFUSED,
    ROUNDING,
    contradictions,
    converted,
)
from actuators.loading.data_sheet import completed, has_gear, read_entry
from actuators.loading.filled import corners, filled
from actuators.parameters import Parameter
from actuators.units import from_si, si_unit

_IDEAL: Final = "ideal"
#: Components, and the stage after each that has elements besides the ratio.
_KINDS: Final = {"motor": MOTOR_KIND, "rotor": "rotating_friction", "gear": "gear"}
_STAGES: Final = {
    "gear": {"stage": "g", "shaft": "between rotor and gear"},
    "rotor": {"stage": "m"},
}
_LAWS: Final = {"friction": ("coulomb", "load", "viscous"), "inertia": ("inertia",)}


@dataclass(frozen=True)
class OwnActuator:
    """A folder of actuator files and what stands in it."""

    folder: Path  #: That `--actuators` takes.
    parameters: Mapping[str, Parameter]  #: By `component.parameter`.
    notes: tuple[str, ...]  #: What the sheet does not print, and where it contradicts itself.

    def __str__(self) -> str:
        """Its numbers, a line per component; their reasons are in `notes` and in the files."""
        parts: dict[str, list[str]] = {}
        for key, p in self.parameters.items():
            component, name = key.split(".")
            told = "" if p.basis == "datasheet" else f" ({p.basis})"
            unit = "" if p.unit == "1" else f" {p.unit}"
            number = f"{name} {p.value_as_written:.6g}{unit}{told}"
            parts.setdefault(component, []).append(number)
        lines = [f"{component}: {', '.join(numbers)}" for component, numbers in parts.items()]
        return "\n".join([f"{self.folder}, {len(self.notes)} notes", *lines])


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
            or a range of its class, where there is a rule for it; see `actuators.loading.filled`.

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
    parameters, notes = parameters_of(printed, source)
    files = _files(name, source, parameters)
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".legwatt_") as scratch:
            inside = Path(scratch)
            list_ = tomlkit.document()
            if there:
                shutil.copytree(folder, inside, dirs_exist_ok=True)
                list_ = tomlkit.parse((folder / ALTERNATIVES_FILE).read_text(encoding="utf-8"))
            for key, alternative in files.pop(ALTERNATIVES_FILE).items():
                list_.setdefault(key, alternative)  # the ideal one is that of the first
            for file, content in {**files, ALTERNATIVES_FILE: list_}.items():
                (inside / file).write_text(tomlkit.dumps(content), encoding="utf-8")
            load_catalog(inside)  # what is written works
            folder.mkdir(exist_ok=True)
            for file in (*files, ALTERNATIVES_FILE):  # the list of alternatives last
                (inside / file).replace(folder / file)
    except OSError as error:
        raise LegwattError(f"{folder}: cannot be written ({error.strerror})") from None
    return OwnActuator(folder, parameters, notes)


def parameters_of(
    words: Mapping[str, str], source: str
) -> tuple[dict[str, Parameter], tuple[str, ...]]:
    """Return parameters by `component.parameter`, each with basis, source and formula, and notes.

    Args:
        words: Entries as written.
        source: Which sheet, in words.

    Raises:
        LegwattError: Something is missing, unreadable or contradicts the rest.
    """
    sheet = completed(filled({name: read_entry(name, str(text)) for name, text in words.items()}))
    x = {name: number.value for name, number in sheet.items()}
    found = converted(x)
    odd = [*contradictions(sheet, found)]
    if wrong := "; ".join(words for off, words, _ in odd if off > REFUSED):
        raise LegwattError(f"{wrong}: correct one of them")
    ranged = {name: number for name, number in sheet.items() if number.low < number.high}
    every = [converted(corner) for corner in corners(sheet)]
    moved = {
        name: (converted(x | {name: n.low}), converted(x | {name: n.high}))
        for name, n in ranged.items()
    }
    out = {}
    for key, (value, formula) in found.items():
        component, name = key.split(".")
        entry = name if component == "motor" else f"{component}_{name}"
        printed = sheet.get("gear_starting_torque" if entry == "gear_coulomb" else entry)
        as_printed = printed is not None and math.isclose(printed.value, value, rel_tol=1e-12)
        unit = printed.unit if printed else si_unit((NUMBERS | MOTOR)[name])
        low, high = (pick(one[key][0] for one in every) for pick in (min, max))
        unsure = [
            f"{of} {sheet[of].words}" + (f" ({sheet[of].why})" if sheet[of].why else "")
            for of, (one, other) in moved.items()
            if one[key][0] != other[key][0]
        ]
        sure = printed is not None and as_printed and not (printed.why or unsure)
        basis = "assumed" if low < high else "datasheet" if sure else "derived"
        number = {
            "name": name,
            "value": value,
            "unit": unit,
            "value_as_written": from_si(value, unit),
            "basis": basis,
            "source": f"not printed: {', '.join(unsure)}; the rest: {source}" if unsure else source,
            "interval": (low, high) if low < high else None,
            "reason": "" if sure else (printed and printed.why) or formula or "not printed",
        }
        out[key] = checked(Parameter, number, key)
    notes = [f"{name} is not printed: {n.words}, {n.why}" for name, n in sheet.items() if n.why]
    notes += [f"{words}; used: {used}" for off, words, used in odd if off > ROUNDING]
    if "motor_mass" in sheet and "gear_mass" not in sheet and has_gear(sheet):
        notes.append("the mass is the motor's alone; gear_mass adds its gear's")
    return out, tuple(notes)


def _files(name: str, source: str, parameters: Mapping[str, Parameter]) -> dict[str, Any]:
    """What the folder's files hold, by their names."""
    files: dict[str, Any] = {}
    for part, kind in _KINDS.items():
        own = {p.name: _written(p) for key, p in parameters.items() if key.startswith(f"{part}.")}
        title = f"{part} of {name}: {one_line(source)}"
        files[f"{name}_{part}.toml"] = {"kind": kind, "title": title, "parameters": own}
    ratio = f"{name}_gear.ratio"
    transmission = {"name": "transmission", "law": "ratio", "ratio": ratio}
    entries = [dict(transmission)]
    for part, stage in _STAGES.items():
        for law, arguments in _LAWS.items():
            given = {a: f"{name}_{part}.{a}" for a in arguments if f"{part}.{a}" in parameters}
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


def _written(p: Parameter) -> dict[str, object]:
    """A parameter as its file has it, with nine digits."""

    def short(value: float) -> float:
        return float(f"{value:.9g}")

    out = {"value": short(p.value_as_written), "unit": p.unit, "basis": p.basis}
    out |= {"source": one_line(p.source)}
    if p.interval:
        out["interval"] = [short(from_si(end, p.unit)) for end in p.interval]
    return out | ({"reason": p.reason} if p.reason else {})
