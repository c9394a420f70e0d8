"""A folder of actuator files from a data sheet: `ideal`, and the actuator after its name."""

import itertools
import json
import math
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Final

from actuators.checked import checked
from actuators.errors import LegwattError, one_line
from actuators.loading.alternatives import ALTERNATIVES_FILE, KINDS, NAME
from actuators.loading.build import load_catalog
from actuators.loading.converted import contradictions, converted
from actuators.loading.data_sheet import completed, read_entry
from actuators.parameters import Parameter
from actuators.units import from_si, si_unit

_IDEAL: Final = "ideal"
_KINDS: Final = {"motor": "dc_motor", "rotor": "rotating_friction", "gear": "gear"}
_LAWS: Final = {"friction": ("coulomb", "load", "viscous"), "inertia": ("inertia",)}
_STAGES: Final = {
    "gear": {"stage": "g", "shaft": "between rotor and gear"},
    "rotor": {"stage": "m"},
}
Keys = Mapping[str, object]


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
    if not NAME.fullmatch(name) or name == _IDEAL:
        raise LegwattError(
            f"'{one_line(name)}': expected a name of letters a to z, digits, '_' and '-', other "
            f"than '{_IDEAL}': tables and files are called after it"
        )
    if not source.strip():
        raise LegwattError("source is empty: say which data sheet")
    folder = Path(out) if out is not None else Path(name)
    if folder.exists():
        raise LegwattError(f"{folder}: there is such a file or folder; name another")
    parameters = parameters_of(printed, source)
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".legwatt_") as scratch:
            inside = Path(scratch) / "made"
            inside.mkdir()
            for file, text in _texts(name, source, parameters).items():
                (inside / file).write_text(text, encoding="utf-8")
            load_catalog(inside)  # what is written works
            inside.rename(folder)
    except OSError as error:
        raise LegwattError(f"{folder}: cannot be written ({error.strerror})") from None
    return folder, parameters


def parameters_of(words: Mapping[str, str], source: str) -> dict[str, Parameter]:
    """Parameters by `component.parameter`, each with basis, source and formula.

    Args:
        words: Entries as written.
        source: Which sheet, in words.

    Raises:
        LegwattError: Something is missing, unreadable or contradicts the rest.
    """
    sheet = completed({name: read_entry(name, str(text)) for name, text in words.items()})
    x = {name: number.value for name, number in sheet.items()}
    found = converted(x)
    wrong = "; ".join(contradictions(sheet, found))
    if wrong:
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
        unit = printed.unit if printed else si_unit(KINDS[_KINDS[component]][name])
        low, high = (pick(corner[key][0] for corner in corners) for pick in (min, max))
        basis = "assumed" if low < high else "datasheet" if as_printed else "derived"
        written = {
            "name": name,
            "value": value,
            "unit": unit,
            "value_as_written": from_si(value, unit),
            "basis": basis,
            "source": f"not printed: {unsure}; the rest: {source}" if low < high else source,
            "interval": (low, high) if low < high else None,
            "reason": "" if basis == "datasheet" else formula or "not printed",
        }
        out[key] = checked(Parameter, written, key)
    return out


def _texts(name: str, source: str, parameters: Mapping[str, Parameter]) -> dict[str, str]:
    """The files of the folder."""
    texts = {}
    for part, kind in _KINDS.items():
        own = [p for key, p in parameters.items() if key.startswith(f"{part}.")]
        head: Keys = {"kind": kind, "title": f"{part} of {name}: {source}"}
        each = [(f"[parameters.{p.name}]\n", _number(p)) for p in own]
        texts[f"{part}.toml"] = _toml([("", head), *each])
    transmission: Keys = {"name": "transmission", "law": "ratio", "ratio": "gear.ratio"}
    entries = [dict(transmission)]
    for part, stage in _STAGES.items():
        for law, arguments in _LAWS.items():
            given = {a: f"{part}.{a}" for a in arguments if f"{part}.{a}" in parameters}
            if given:
                entries.append({"name": f"{part}_{law}", "law": law, **given})
        entries[-1] |= stage
    built = {"motor": "motor", "ratio": "gear.ratio"}
    said = f"# {name}, by `python -m pipeline init-actuator` from: {one_line(source)}\n"
    texts[ALTERNATIVES_FILE] = _toml(
        [
            (said, {}),
            (f"[{_IDEAL}]\n", {"title": f"Ideal: ratio and motor of {name} alone"} | built),
            (f"[[{_IDEAL}.element]]\n", {**transmission, "stage": "m"}),
            (f"[{name}]\n", {"title": f"{name} by its data sheet"} | built),
            *((f"[[{name}.element]]\n", entry) for entry in entries),
        ]
    )
    return texts


def _number(p: Parameter) -> Keys:
    """A parameter as its file has it."""
    out: dict[str, object] = {"value": p.value_as_written}
    out |= {"unit": p.unit, "basis": p.basis, "source": p.source}
    if p.interval:
        out["interval"] = [from_si(end, p.unit) for end in p.interval]
    return out | ({"reason": p.reason} if p.reason else {})


def _toml(tables: Iterable[tuple[str, Keys]]) -> str:
    """Tables, each behind its head, with texts on one line and nine digits of every number."""

    def text(value: object) -> str:
        if isinstance(value, list):
            return f"[{', '.join(map(text, value))}]"
        if isinstance(value, float):
            return f"{value:.9g}"
        return json.dumps(one_line(value), ensure_ascii=False)

    each = (head + "".join(f"{k} = {text(v)}\n" for k, v in t.items()) for head, t in tables)
    return "\n".join(each)
