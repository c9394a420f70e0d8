"""A folder of actuator files from a data sheet: `ideal`, and the actuator after its name."""

import itertools
import json
import math
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from actuators.errors import DataSheetError, one_line
from actuators.loading.alternatives import ALTERNATIVES_FILE, NAME
from actuators.loading.build import load_catalog
from actuators.loading.components import KINDS
from actuators.loading.converted import contradictions, converted
from actuators.loading.data_sheet import option, read_sheet
from actuators.parameters import Parameter
from actuators.units import from_si, si_unit

_IDEAL: Final = "ideal"
_KINDS: Final = {"motor": "dc_motor", "rotor": "rotating_friction", "gear": "gear"}
_LAWS: Final = {"friction": ("coulomb", "load", "viscous"), "inertia": ("inertia",)}


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
        DataSheetError: Something is missing, unreadable or contradicts the rest, or the folder
            cannot be written; nothing is.
    """
    if not NAME.fullmatch(name) or name == _IDEAL:
        raise DataSheetError(
            f"'{one_line(name)}': expected a name of letters a to z, digits, '_' and '-', other "
            f"than '{_IDEAL}': tables and files are called after it"
        )
    if not source.strip():
        raise DataSheetError("--source is empty: say which data sheet")
    folder = Path(out) if out is not None else Path(name)
    if folder.exists():
        raise DataSheetError(f"{folder}: there is such a file or folder; name another with --out")
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
        raise DataSheetError(f"{folder}: cannot be written ({error.strerror})") from None
    return folder, parameters


def parameters_of(words: Mapping[str, str], source: str) -> dict[str, Parameter]:
    """Parameters by `component.parameter`, each with basis, source and formula.

    Args:
        words: Entries as written.
        source: Which sheet, in words.

    Raises:
        DataSheetError: Something is missing, unreadable or contradicts the rest.
    """
    sheet = read_sheet({name: str(text) for name, text in words.items()})
    x = {name: number.value for name, number in sheet.items()}
    found = converted(x)
    wrong = "; ".join(contradictions(sheet, found))
    if wrong:
        raise DataSheetError(f"{wrong}: correct one of them")
    ranged = {name: number for name, number in sheet.items() if number.low < number.high}
    ends = itertools.product(*((number.low, number.high) for number in ranged.values()))
    corners = [converted(x | dict(zip(ranged, end, strict=True))) for end in ends]
    unsure = ", ".join(f"{option(name)} {number.words}" for name, number in ranged.items())
    out = {}
    for key, (value, formula) in found.items():
        component, name = key.split(".")
        entry = name if component == "motor" else f"{component}_{name}"
        printed = sheet.get("gear_starting_torque" if entry == "gear_coulomb" else entry)
        as_printed = printed is not None and math.isclose(printed.value, value, rel_tol=1e-12)
        unit = printed.unit if printed else si_unit(KINDS[_KINDS[component]][name])
        low, high = (pick(corner[key][0] for corner in corners) for pick in (min, max))
        basis = "assumed" if low < high else "datasheet" if as_printed else "derived"
        out[key] = Parameter(
            name=name,
            value=value,
            unit=unit,
            value_as_written=from_si(value, unit),
            basis=basis,
            source=f"not printed: {unsure}; the rest: {source}" if low < high else source,
            interval=(low, high) if low < high else None,
            reason="" if basis == "datasheet" else formula or "not printed",
        )
    return out


def _component(title: str, kind: str, parameters: Sequence[Parameter]) -> str:
    """The file of one component."""
    out = f"kind = {_text(kind)}\ntitle = {_text(title)}\n"
    for p in parameters:
        out += f"\n[parameters.{p.name}]\nvalue = {_digits(p.value_as_written)}\n"
        out += "".join(f"{k} = {_text(getattr(p, k))}\n" for k in ("unit", "basis", "source"))
        if p.interval:
            out += "interval = [{}, {}]\n".format(
                *(_digits(from_si(v, p.unit)) for v in p.interval)
            )
        if p.reason:
            out += f"reason = {_text(p.reason)}\n"
    return out


def _texts(name: str, source: str, parameters: Mapping[str, Parameter]) -> dict[str, str]:
    """The files of the folder."""
    texts = {}
    for part, kind in _KINDS.items():
        own = [p for key, p in parameters.items() if key.startswith(f"{part}.")]
        texts[f"{part}.toml"] = _component(f"{part} of {name}: {source}", kind, own)
    elements = [_element(name, "transmission", "ratio", ["gear.ratio"])]
    between = 'stage = "g"\nshaft = "between rotor and gear"\n'
    for part, stage in (("gear", between), ("rotor", 'stage = "m"\n')):
        for law, arguments in _LAWS.items():
            given = [key for a in arguments if (key := f"{part}.{a}") in parameters]
            if given:
                elements.append(_element(name, f"{part}_{law}", law, given))
        elements[-1] += stage
    texts[ALTERNATIVES_FILE] = (
        f"# {name}, by `python -m pipeline init-actuator` from: {one_line(source)}\n"
        + _head(_IDEAL, f"Ideal: ratio and motor of {name} alone")
        + _element(_IDEAL, "transmission", "ratio", ["gear.ratio"])
        + 'stage = "m"\n'
        + _head(name, f"{name} by its data sheet")
        + "".join(elements)
    )
    return texts


def _head(name: str, title: str) -> str:
    return f'\n[{name}]\ntitle = {_text(title)}\nmotor = "motor"\nratio = "gear.ratio"\n'


def _element(alternative: str, name: str, law: str, arguments: Sequence[str]) -> str:
    lines = (f'{key.split(".")[1]} = "{key}"\n' for key in arguments)
    return f'\n[[{alternative}.element]]\nname = "{name}"\nlaw = "{law}"\n' + "".join(lines)


def _text(text: str) -> str:
    return json.dumps(one_line(text), ensure_ascii=False)


def _digits(value: float) -> str:
    return f"{value:.9g}"
