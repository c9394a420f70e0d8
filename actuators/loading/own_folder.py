"""A folder of actuator files from a data sheet: `ideal`, and the actuator after its name."""

import itertools
import math
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from actuators.checked import checked
from actuators.errors import LegwattError, one_line
from actuators.loading.alternatives import ALTERNATIVES_FILE, MOTOR, MOTOR_KIND, NAME, NUMBERS
from actuators.loading.build import load_catalog
from actuators.loading.converted import contradictions, converted
from actuators.loading.data_sheet import completed, read_entry
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
_TRANSMISSION: Final = {"name": "transmission", "law": "ratio", "ratio": "gear.ratio"}


def init_actuator(
    name: str, out: str | Path | None = None, *, source: str, **printed: str
) -> tuple[Path, dict[str, Parameter]]:
    """Write a folder that `--actuators` takes, from what a data sheet prints.

    Args:
        name: Of the alternative: letters, digits, `_` and `-`.
        out: The folder; `name` in the current folder by default. It must not be there.
        source: Which sheet, in words.
        **printed: Entries of `actuators.loading.data_sheet.ENTRIES`, number and unit in one text;
            `LOW to HIGH UNIT` for what is not printed.

    Returns:
        The folder, and its parameters by `component.parameter`.

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
    if folder.exists():
        raise LegwattError(f"{folder}: there is such a file or folder; name another")
    parameters = parameters_of(printed, source)
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".legwatt_") as scratch:
            inside = Path(scratch) / "made"
            inside.mkdir()
            for file, table in _files(name, source, parameters).items():
                (inside / file).write_text(tomlkit.dumps(table), encoding="utf-8")
            load_catalog(inside)  # what is written works
            inside.rename(folder)
    except OSError as error:
        raise LegwattError(f"{folder}: cannot be written ({error.strerror})") from None
    return folder, parameters


def parameters_of(words: Mapping[str, str], source: str) -> dict[str, Parameter]:
    """Return parameters by `component.parameter`, each with basis, source and formula.

    Args:
        words: Entries as written.
        source: Which sheet, in words.

    Raises:
        LegwattError: Something is missing, unreadable or contradicts the rest.
    """
    sheet = completed({name: read_entry(name, str(text)) for name, text in words.items()})
    x = {name: number.value for name, number in sheet.items()}
    found = converted(x)
    if wrong := "; ".join(contradictions(sheet, found)):
        raise LegwattError(f"{wrong}: correct one of them")
    ranged = {name: number for name, number in sheet.items() if number.low < number.high}
    ends = itertools.product(*((number.low, number.high) for number in ranged.values()))
    corners = [converted(x | dict(zip(ranged, end, strict=True))) for end in ends]
    unsure = ", ".join(f"{name} {number.words}" for name, number in ranged.items())
    out = {}
    for key, (value, formula) in found.items():
        component, name = key.split(".")
        entry = name if component == "motor" else f"{component}_{name}"
        printed = sheet.get("gear_starting_torque" if entry == "gear_coulomb" else entry)
        as_printed = printed is not None and math.isclose(printed.value, value, rel_tol=1e-12)
        unit = printed.unit if printed else si_unit((NUMBERS | MOTOR)[name])
        low, high = (pick(corner[key][0] for corner in corners) for pick in (min, max))
        basis = "assumed" if low < high else "datasheet" if as_printed else "derived"
        number = {
            "name": name,
            "value": value,
            "unit": unit,
            "value_as_written": from_si(value, unit),
            "basis": basis,
            "source": f"not printed: {unsure}; the rest: {source}" if low < high else source,
            "interval": (low, high) if low < high else None,
            "reason": "" if basis == "datasheet" else formula or "not printed",
        }
        out[key] = checked(Parameter, number, key)
    return out


def _files(name: str, source: str, parameters: Mapping[str, Parameter]) -> dict[str, Any]:
    """What the folder's files hold, by their names."""
    files: dict[str, Any] = {}
    for part, kind in _KINDS.items():
        own = {p.name: _written(p) for key, p in parameters.items() if key.startswith(f"{part}.")}
        title = f"{part} of {name}: {one_line(source)}"
        files[f"{part}.toml"] = {"kind": kind, "title": title, "parameters": own}
    entries = [dict(_TRANSMISSION)]
    for part, stage in _STAGES.items():
        for law, arguments in _LAWS.items():
            given = {a: f"{part}.{a}" for a in arguments if f"{part}.{a}" in parameters}
            if given:
                entries.append({"name": f"{part}_{law}", "law": law, **given})
        entries[-1] |= stage
    built = {"motor": "motor", "ratio": "gear.ratio"}
    ideal = {"title": f"Ideal: ratio and motor of {name} alone", **built}
    files[ALTERNATIVES_FILE] = {
        _IDEAL: {**ideal, "element": [{**_TRANSMISSION, "stage": "m"}]},
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
