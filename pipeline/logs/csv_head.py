"""What stands above the numbers of a CSV file: remarks, a header, units, the writing of time."""

from __future__ import annotations

import csv
import io
import re
from typing import Final

from actuators.errors import LegwattError
from actuators.units import spelt
from pipeline.logs.mapping import CsvTable

#: Columns, lines above the numbers, units by column, and the first time of columns of times.
CsvHead = tuple[tuple[str, ...], int, dict[str, str], dict[str, str]]
_REMARK: Final = "#"
_ISO: Final = re.compile(
    r"\s*\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d(\.\d{1,9})?)?\s*(Z|[+-]\d\d:?\d\d)?\s*"
)
#: Units as people write them, and as `actuators.units` does.
_SPELT: Final = {
    **dict.fromkeys(("nm", "n.m", "n m", "n·m", "newton metre", "n-m"), "N*m"),
    **dict.fromkeys(("mnm", "mn.m", "mn m", "mn·m"), "mN*m"),
    **dict.fromkeys(("ncm", "n.cm"), "N*cm"),
    **dict.fromkeys(("radians", "radian", "rads"), "rad"),
    **dict.fromkeys(("degrees", "degree", "°"), "deg"),
    **dict.fromkeys(("rads/s", "rad/sec", "rad_s", "radps", "rad s-1"), "rad/s"),
    **dict.fromkeys(("°/s", "degrees/s", "deg/sec", "deg_s", "dps", "degps"), "deg/s"),
    **dict.fromkeys(("seconds", "second", "sec", "secs"), "s"),
    **dict.fromkeys(("milliseconds", "msec"), "ms"),
    **dict.fromkeys(("microseconds", "usec", "µs"), "us"),
    **dict.fromkeys(("nanoseconds", "nsec"), "ns"),
    **dict.fromkeys(("amps", "amp", "ampere"), "A"),
    **dict.fromkeys(("milliamps", "milliampere"), "mA"),
    **dict.fromkeys(("volts", "volt"), "V"),
    **dict.fromkeys(("watts", "watt"), "W"),
    **dict.fromkeys(("°c", "c", "celsius", "deg c"), "degC"),
    **dict.fromkeys(("-", "none", "bool"), "1"),
}


def unit_spelt(text: str) -> str:
    """The unit that a text means, as `actuators.units` writes it; empty where it is none."""
    plain = text.strip().strip("[]()").strip()
    for name in (plain, _SPELT.get(plain.lower(), ""), plain.replace("_", "/")):
        try:
            return spelt(name)
        except LegwattError:
            continue
    return ""


def read_head(head: bytes, dialect: CsvTable, where: str) -> CsvHead:
    """Understand a file's first bytes.

    Lines that begin with ``#`` are remarks, unless the last of them is the header of what follows.

    Returns:
        Columns as written, lines above the first row of numbers, the units that a row of units
        states by column, and columns of dates and times with the first of them.

    Raises:
        LegwattError: No text in UTF-8, no header of names.
    """
    if head[:2] in (b"\xff\xfe", b"\xfe\xff") or b"\x00" in head[:4096]:
        raise LegwattError(f"{where}: not UTF-8 text; save the log as CSV in UTF-8 or as Parquet")
    lines = head.removeprefix(b"\xef\xbb\xbf").split(b"\n")
    first = next((k for k, x in enumerate(lines) if x.strip() and not x.startswith(b"#")), 0)
    names = _cells(lines[first], dialect, where, first)
    if len(names) == 1 and dialect.delimiter == ",":
        for other in (";", "\t"):
            if other in names[0]:
                raise LegwattError(
                    f"{where}: columns are separated by {other!r}, expected commas; export it with "
                    "commas and decimal dots, or give [csv] delimiter and decimal in a mapping file"
                )
    following = first + 1
    if names and all(_is_value(name, dialect) for name in names):
        above = lines[first - 1].lstrip(b"# ") if first else b""
        header = _cells(above, dialect, where, first - 1) if above.strip() else []
        if len(header) != len(names) or all(_is_value(name, dialect) for name in header):
            raise LegwattError(
                f"{where}: line {first + 1} holds numbers; expected a header of column names"
            )
        names, following = header, first
    names = [name.strip().removeprefix(_REMARK).strip() for name in names]
    skip, units = following, dict[str, str]()
    row = _row(lines, following, len(names), dialect, where)
    if row and not any(_is_value(cell, dialect) for cell in row) and any(map(unit_spelt, row)):
        units = {n: u for n, cell in zip(names, row, strict=True) if (u := unit_spelt(cell))}
        skip = following + 1
        row = _row(lines, skip, len(names), dialect, where)
    stamps = {n: c.strip() for n, c in zip(names, row, strict=True) if _ISO.fullmatch(c)}
    return tuple(names), skip, units, stamps


def _row(lines: list[bytes], number: int, cells: int, dialect: CsvTable, where: str) -> list[str]:
    """Cells of one line; as many empty ones where it is missing, cut off or of another length."""
    if number + 1 < len(lines):
        try:
            row = _cells(lines[number], dialect, where, number)
        except LegwattError:
            row = []
        if len(row) == cells:
            return row
    return [""] * cells


def _cells(line: bytes, dialect: CsvTable, where: str, number: int) -> list[str]:
    try:
        text = line.decode("utf-8").rstrip("\r")
        return next(csv.reader(io.StringIO(text), delimiter=dialect.delimiter, strict=True), [])
    except (UnicodeDecodeError, csv.Error):
        raise LegwattError(
            f"{where}: line {number + 1} is no header of column names in UTF-8; save the log as "
            "CSV in UTF-8"
        ) from None


def _is_value(text: str, dialect: CsvTable) -> bool:
    """Whether a cell holds a number or a time, not a name."""
    try:
        float(text.replace(dialect.decimal, "."))
    except ValueError:
        return bool(_ISO.fullmatch(text))
    return True
