"""A folder of actuator files from a data sheet: `ideal`, and the actuator after its name.

What a sheet does not print is derived from what it does, else the range of its class. Rules are
tried in order; one whose formula reads what does not stand there by then is passed over. The range
of a class is what the middle four fifths of the parts in `actuators/components` print.
"""

import itertools
import math
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple

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
    CHOICES,
    EVERY,
    ONE,
    REFUSED,
    ROUNDING,
    Number,
    Sheet,
    completed,
    contradictions,
    converted,
    has_gear,
    missing,
    read_entry,
)
from actuators.parameters import ParameterSet, from_si, parameters_from_table, si_unit

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
            or a range of its class; see `actuators.loading.own_folder`.

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
