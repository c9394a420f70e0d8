"""CSV as robots and their tools write it: remarks, a header, a row of units, dates, any separator.

Separator and decimal sign are told by the file itself: the separator is the one that gives as many
cells in the rows as in the header, and a comma inside a number is a decimal one.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Final

from actuators.errors import LegwattError, one_line
from pipeline.logs.names import unit_spelt

#: A space only where nothing else does: it may stand beside any other.
_SEPARATORS: Final = (",", ";", "\t", "|", " ")
#: Rows below the header by which the separator is told, and lines that may stand above it.
_LOOKED_AT, _PREAMBLE = 20, 50
#: Share of those rows that have as many cells as the header.
_ALIKE: Final = 0.4
_ISO: Final = re.compile(
    r"\s*\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d(\.\d{1,9})?)?\s*(Z|[+-]\d\d:?\d\d)?\s*"
)
_DECIMAL_COMMA: Final = re.compile(r"\s*[-+]?\d*,\d+([eE][-+]?\d+)?\s*")


@dataclass(frozen=True)
class CsvHead:
    """What stands above a file's numbers, and how they are written."""

    names: tuple[str, ...]  #: Of the columns, as written.
    skip: int  #: Lines above the first row of numbers.
    units: dict[str, str]  #: By column, where a row of units states them.
    stamps: dict[str, str]  #: Columns of dates and times, with the first of them.
    separator: str
    decimal: str


def read_head(head: bytes, where: str) -> CsvHead:
    """Understand a file's first bytes.

    Lines that begin with ``#`` are remarks, unless the last of them is the header of what follows.

    Raises:
        LegwattError: No text in UTF-8 or Latin-1, no header of names.
    """
    if not head.strip():
        raise LegwattError(f"{where}: the file is empty; give a log as CSV or Parquet")
    if head[:2] in (b"\xff\xfe", b"\xfe\xff") or b"\x00" in head[:4096]:
        raise LegwattError(f"{where}: not UTF-8 text; save the log as CSV in UTF-8 or as Parquet")
    lines = [_decoded(x) for x in re.split(rb"\r\n|\r|\n", head.removeprefix(b"\xef\xbb\xbf"))]
    whole = lines[:-1] or lines  # the last may be cut off
    told = [k for k, x in enumerate(whole) if x.strip() and not x.startswith(("#", "sep="))] or [0]
    # What stands above the header has other cells than what stands below.
    share, first, separator = 0.0, told[0], ","
    for k in range(min(len(told), _PREAMBLE)):
        body = [lines[n] for n in told[k : k + _LOOKED_AT + 1]]
        best = max(_SEPARATORS, key=lambda s: (_fits(body, s)[0], s != " ", _fits(body, s)[1]))
        fits = _fits(body, best)[0]
        if k == 0 or fits > max(share, _ALIKE):
            share, first, separator = fits, told[k], best
        if share > _ALIKE:
            break
    inside = (cell for n in told[: _LOOKED_AT + 1] for cell in _cells(lines[n], separator))
    comma = separator != "," and any(map(_DECIMAL_COMMA.fullmatch, inside))
    decimal = "," if comma else "."
    names, following = _cells(lines[first], separator), first + 1
    if names and all(_is_value(name, decimal) for name in names):
        header = _cells(lines[first - 1].lstrip("# ") if first else "", separator)
        if len(header) != len(names) or all(_is_value(name, decimal) for name in header):
            raise LegwattError(
                f"{where}: line {first + 1} holds numbers; expected a header of column names"
            )
        names, following = header, first
    names = [name.strip().removeprefix("#").strip() for name in names]
    names = [name or f"column {k}" for k, name in enumerate(names, start=1)]
    skip, units = following, dict[str, str]()
    row = _row(lines, skip, separator, len(names))
    if row and not any(_is_value(cell, decimal) for cell in row) and any(map(unit_spelt, row)):
        units = {n: u for n, cell in zip(names, row, strict=True) if (u := unit_spelt(cell))}
        skip += 1
        row = _row(lines, skip, separator, len(names))
    stamps = {n: c.strip() for n, c in zip(names, row, strict=False) if _ISO.fullmatch(c)}
    return CsvHead(tuple(names), skip, units, stamps, separator, decimal)


def read_table(
    opened: Callable[[], Any], head: CsvHead, columns: Sequence[str], where: str
) -> tuple[Any, bool]:
    """Some columns as a pyarrow table, and whether the last row was cut off and left out.

    Args:
        opened: Opens the file for reading bytes, unpacked.
        head: What stands above its numbers.
        columns: That are wanted.
        where: The file's name, for messages.

    Raises:
        LegwattError: A cell is no number, or a row has another length than the header.
    """
    import pyarrow as pa
    import pyarrow.csv as pc

    kinds = {n: pa.string() if n.endswith("__contact") else pa.float64() for n in columns}
    for name, first in head.stamps.items():
        zone = re.search(r"(Z|[+-]\d\d:?\d\d)$", first[10:])
        kinds[name] = pa.timestamp("ns", "UTC" if zone else None)

    def read(stream: Any) -> Any:
        return pc.read_csv(
            stream,
            # A single thread counts rows, so that messages can say where.
            read_options=pc.ReadOptions(
                column_names=list(head.names), skip_rows=head.skip, use_threads=False
            ),
            parse_options=pc.ParseOptions(delimiter=head.separator),
            convert_options=pc.ConvertOptions(
                include_columns=list(columns),
                column_types=kinds,
                decimal_point=head.decimal,
                strings_can_be_null=True,
            ),
        )

    try:
        if head.separator == " ":  # as many as make columns stand below one another
            with opened() as stream:
                rows = [b" ".join(line.split()) for line in stream.read().split(b"\n")]
            return read(io.BytesIO(b"\n".join(rows))), False
        with suppress(pa.ArrowInvalid), opened() as stream:
            return read(stream), False
        # Remarks between rows, and the end of a file that nobody closed, are none of its numbers.
        with opened() as stream:
            lines = stream.read().split(b"\n")
        cells = lines[-1].count(head.separator.encode()) + 1
        cut = len(lines) > head.skip + 2 and bool(lines[-1]) and cells < len(head.names)
        body = [x for x in lines[head.skip : len(lines) - cut] if not x.startswith(b"#")]
        return read(io.BytesIO(b"\n".join([*lines[: head.skip], *body, b""]))), cut
    except pa.ArrowInvalid as error:
        raise LegwattError(f"{where}: {_reason(error, head)}") from None


def _reason(error: Exception, head: CsvHead) -> str:
    """Row, column and cell of what is no table of numbers."""
    text = one_line(error)
    found = re.search(r"Row #(\d+)", text)
    row = f"row {found[1]}" if found else "a row"
    if ragged := re.search(r"Expected (\d+) columns, got (\d+)", text):
        want, got = int(ragged[1]), int(ragged[2])
        doubled = got in (2 * want, 2 * want - 1) and want > 2
        hint = "decimal commas? export it with decimal dots" if doubled else "mend or drop the row"
        return f"{row} has {got} cells, the header {want}; {hint}"
    if cell := re.search(r"column #(\d+): .*invalid value '(.*)'", text):
        comma = _DECIMAL_COMMA.fullmatch(cell[2])
        hint = "a decimal comma; export it with decimal dots" if comma else "expected a number"
        name = one_line(head.names[int(cell[1])])
        return f"{row}, column '{name}' holds '{cell[2][:40]}', {hint}"
    return f"cannot be read: {text}"


def _decoded(line: bytes) -> str:
    try:
        return line.decode("utf-8")
    except UnicodeDecodeError:  # degree signs of older tools
        return line.decode("latin-1")


def _fits(body: Sequence[str], separator: str) -> tuple[float, int]:
    """Share of rows with as many cells as the header, and how many those are."""
    header, *rows = (len(_cells(line, separator)) for line in body)
    return (sum(n == header for n in rows) / max(len(rows), 1) if header > 1 else 0.0), header


def _row(lines: Sequence[str], number: int, separator: str, cells: int) -> list[str]:
    """Cells of one line; none where it is missing, cut off or of another length."""
    row = _cells(lines[number], separator) if number + 1 < len(lines) else []
    return row if len(row) == cells else []


def _cells(line: str, separator: str) -> list[str]:
    if separator == " ":
        return line.split()
    with suppress(csv.Error):
        return next(csv.reader([line], delimiter=separator), [])
    return []


def _is_value(text: str, decimal: str) -> bool:
    """Whether a cell holds a number or a time, not a name."""
    try:
        float(text.replace(decimal, "."))
    except ValueError:
        return bool(_ISO.fullmatch(text))
    return True
