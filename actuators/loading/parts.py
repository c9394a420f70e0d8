"""Parts that can be bought: what their data sheets print, a row each in one CSV per kind.

The file's name says the kind; `actuators/components/README.md` has the format. What a sheet does
not print is a range, taken from parts of its class that print it, so that no part wins by saying
less.
"""

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Final, Literal

from pydantic import SkipValidation

from actuators.checked import Table, Text, checked, read_bytes, utf8
from actuators.errors import LegwattError, known, one_line
from actuators.loading.data_sheet import (
    GEARS,
    KINDS,
    ONE,
    TOLERANCE,
    Number,
    completed,
    contradictions,
    converted,
    read_entry,
)
from actuators.parameters import spelt

#: The parts that come with the project.
PARTS: Final = Path(__file__).resolve().parents[1] / "components"
#: Motor and gear that a maker's table lists together, in a folder of parts.
PAIRS: Final = Path("fits") / "pairs.csv"
#: Driver and battery if no other is named.
DRIVER: Final = "moteus_x1"
PACK: Final = "aspilsan_13s4p"
_ABOUT: Final = ("name", "title", "part_number", "built_into", "basis", "source", "read", "note")
Basis = Literal["datasheet", "derived", "identified", "assumed"]
#: Entry, its role (the number itself, an end of its range, its own basis) and unit of a column.
_Column = tuple[str, str, str]


class Part(Table):
    """A part by its data sheet, a row of a CSV."""

    name: Text
    kind: str  #: One of `KINDS`.
    title: Text  #: What it is.
    part_number: str = ""
    built_into: str = ""  #: The product inside which alone it is sold; empty if sold by itself.
    basis: Basis  #: Of its numbers.
    source: Text  #: Where they were read.
    read: str = ""  #: When.
    note: str = ""  #: What is doubtful or filled in from its class.
    bases: Mapping[str, Basis] = {}  #: Of entries whose basis is not that of the others.
    printed: SkipValidation[Mapping[str, Number]]

    @property
    def where(self) -> str:
        """File and name, for messages."""
        return f"{self.kind}.csv: {self.name}"

    @property
    def filled(self) -> tuple[str, ...]:
        """Entries that the sheet does not print: ranges of the class."""
        return tuple(name for name, n in self.printed.items() if n.low < n.high)


def load_parts(folder: Path = PARTS) -> dict[str, Part]:
    """Load every part of a folder with a CSV for each kind, in the order of files and rows.

    Raises:
        LegwattError: No such folder, an unknown kind or column, a wrong cell, or two parts of one
            name. A file cannot be read.
    """
    if not folder.is_dir():
        raise LegwattError(f"{one_line(folder)}: no such folder of parts")
    out: dict[str, Part] = {}
    for path in sorted(folder.glob("*.csv")):
        for part in read_parts(path):
            if part.name in out:
                raise LegwattError(f"{part.where}: another part has this name")
            out[part.name] = part
    if not out:
        raise LegwattError(f"{one_line(folder)}: no parts; expected KIND.csv, such as motor.csv")
    return out


def listed_pairs(folder: Path) -> frozenset[tuple[str, str]]:
    """Motor and gear that a maker's table lists together; none where the folder has no table.

    Raises:
        LegwattError: The table cannot be read, or lacks a column.
    """
    if not (path := folder / PAIRS).is_file():
        return frozenset()
    try:
        rows = csv.DictReader(utf8(read_bytes(path)).splitlines())
        return frozenset((row["motor"], row["gear"]) for row in rows)
    except (KeyError, LegwattError):
        raise LegwattError(f"{path}: expected a CSV with columns motor, gear, source") from None


def read_parts(path: Path) -> Iterator[Part]:
    """Read the parts of one file; its name says their kind. Errors are those of `load_parts`."""
    import io

    import pandas as pd  # not above: the command line starts without it

    kind, file = path.stem, one_line(path.name)
    known("unknown kind", kind, KINDS, file)
    try:
        text = io.StringIO(utf8(read_bytes(path)))
        table = pd.read_csv(text, dtype=str, keep_default_na=False, skip_blank_lines=False)
    except ValueError as error:
        raise LegwattError(f"{file}: no table that can be read: {one_line(error)}") from None
    if not isinstance(table.index, pd.RangeIndex):
        raise LegwattError(f"{file}: rows have more cells than there are columns")
    columns = {header: _column(header, kind, file) for header in table.columns}
    for line, row in enumerate(table.fillna("").to_dict("records"), start=2):
        cells = {str(header): str(cell).strip() for header, cell in row.items()}
        if any(cells.values()):
            yield _part(kind, cells, columns, f"{file}, line {line}")


def _column(header: str, kind: str, file: str) -> _Column | None:
    """What a column holds; None for one that says something of the whole part."""
    if header in _ABOUT:
        return None
    # The longest name that fits: `voltage_swing_low` is of `voltage_swing`, not of `voltage`.
    names = "|".join(sorted(KINDS[kind], key=len, reverse=True))
    if not (found := re.fullmatch(rf"({names})(?:_(low|high|basis))?(?:_(.+))?", header)):
        known("unknown column", header, [*_ABOUT, *KINDS[kind]], file)
        return None
    entry, role, unit = found.groups(default="")
    try:
        return entry, role, spelt(unit.replace("_", "/")) if unit else ""
    except LegwattError as error:
        raise LegwattError(f"{file}: column '{one_line(header)}': {error}") from None


def _part(
    kind: str, cells: Mapping[str, str], columns: Mapping[str, _Column | None], where: str
) -> Part:
    about: dict[str, object] = {"kind": kind, "bases": {}, "printed": {}}
    found: dict[str, dict[str, str]] = {}
    for header, column in columns.items():
        if column is None:
            about[header] = cells[header]
        elif cells[header]:
            entry, role, unit = column
            found.setdefault(entry, {})[role] = f"{cells[header]} {unit}".strip()
    about["bases"] = {entry: of.pop("basis") for entry, of in found.items() if "basis" in of}
    part = checked(Part, about, where)
    try:
        printed = {entry: _number(entry, of, kind) for entry, of in found.items() if of}
    except LegwattError as error:
        raise LegwattError(f"{where} ({one_line(part.name)}): {error}") from None
    return part.model_copy(update={"printed": printed})


def _number(entry: str, of: Mapping[str, str], kind: str) -> Number:
    """An entry by its cells: a number, a range, or a number with a range of its own."""
    number = read_entry(entry, of[""], KINDS[kind]) if "" in of else None
    ends = [of[role] for role in ("low", "high") if role in of]
    if not ends and number:
        return number
    if len(ends) != 2:
        raise LegwattError(f"{entry}: a range needs both columns, {entry}_low and {entry}_high")
    low, high = ends
    unit = high.partition(" ")[2]
    span = read_entry(entry, f"{low.removesuffix(f' {unit}')} to {high}", KINDS[kind])
    if number is None:
        return span
    if not span.low <= number.value <= span.high:
        raise LegwattError(f"{entry}: {number.words} lies outside its range {span.words}")
    return number._replace(low=span.low, high=span.high)


#: What a gear's sheet has in this order, from the least on, and what says nothing without the rest.
_RISING: Final = (
    ("gear_life_torque", "gear_continuous_torque", "gear_peak_torque", "gear_momentary_torque"),
    ("gear_mean_speed", "gear_max_speed"),
)
_LIFE: Final = ("gear_life", "gear_life_torque", "gear_life_speed")


def odd(part: Part, share: float = TOLERANCE) -> Sequence[str]:
    """Return where a part's numbers contradict each other, or what they lack.

    A motor's may differ by a share [1]; a gear's rated, average, repeated and momentary torque
    rise, its life is stated with torque and speed.
    """
    if part.kind in GEARS:
        x = part.printed
        pairs = [pair for names in _RISING for pair in pairwise(n for n in names if n in x)]
        lacking = [name for name in _LIFE if name not in x]
        alone = lacking[:1] if len(lacking) < len(_LIFE) else []
        return [
            *(f"{low} exceeds {high}" for low, high in pairs if x[low].low > x[high].high),
            *(f"a life is not used without {name}" for name in alone),
        ]
    if part.kind != "motor":
        return ()
    try:
        sheet = completed({"gear_ratio": ONE, **part.printed})
        found = converted({name: number.value for name, number in sheet.items()})
    except LegwattError as error:
        return (str(error),)
    return tuple(words for off, words, _ in contradictions(sheet, found) if off > share)
