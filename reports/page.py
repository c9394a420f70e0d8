"""What a page says, apart from how it looks: the source of index.html, summary.md and report.md.

Texts may hold four marks of Markdown, which both forms understand: ``**bold**``, ``*emphasis*``,
`` `code` `` and ``[text](target)``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pipeline.errors import ReportError
from reports.roundoff import without_roundoff
from reports.table import Table
from reports.typeset import number, prose, unit_text


@dataclass(frozen=True)
class TableBlock:
    """A table to read."""

    headers: tuple[str, ...]  #: Column titles with their units.
    #: Cells; numbers are aligned to the right, None and NaN shown as a dash.
    rows: tuple[tuple[Any, ...], ...]
    caption: str = ""  #: One sentence.
    file: str = ""  #: CSV with the full numbers, relative to the page; linked from the caption.
    #: Text of a cell to ``good``, ``bad`` or ``quiet``, for verdicts.
    tones: Mapping[str, str] = field(default_factory=dict)
    digits: int = 4  #: Significant digits of numbers.
    #: What each column means, for a reader who points at its heading; empty for none.
    hints: tuple[str, ...] = ()
    sortable: bool = False  #: Whether a reader may sort it by a column and filter its rows.
    anchor: str = ""  #: Before a row's first cell, makes what links lead to; empty for none.

    def __post_init__(self) -> None:
        """Refuse ragged rows.

        Raises:
            ReportError: A row with another number of cells than there are headers.
        """
        for k, row in enumerate(self.rows):
            if len(row) != len(self.headers):
                raise ReportError(
                    f"table '{self.caption}', row {k}: {len(row)} cells under "
                    f"{len(self.headers)} headers"
                )

    @property
    def numeric(self) -> tuple[bool, ...]:
        """For each column whether it holds numbers only."""
        columns = zip(*self.rows, strict=True) if self.rows else ((),) * len(self.headers)
        return tuple(
            any(is_number(v) for v in column) and all(v is None or is_number(v) for v in column)
            for column in columns
        )


@dataclass(frozen=True)
class FigureBlock:
    """A picture that has been written before the page."""

    file: Path  #: SVG or PNG; it must lie in the page's folder or below it.
    caption: str = ""  #: What to see in it; none where its title says so.
    alt: str = ""  #: For those who cannot see it; the caption by default.
    #: Whether two stand side by side where the page is wide: for narrow pictures.
    half: bool = False


#: A paragraph, a list, a table or a figure.
Block = str | tuple[str, ...] | TableBlock | FigureBlock


@dataclass(frozen=True)
class Section:
    """A heading with what stands below it."""

    heading: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Number:
    """A number to see before anything is read."""

    value: str  #: With its unit.
    label: str  #: What it is, in a few words.
    tone: str = "quiet"  #: ``good``, ``bad`` or ``quiet``.


@dataclass(frozen=True)
class Page:
    """A report that gives its answer at first sight."""

    title: str  #: Of the page.
    answer: tuple[str, ...]  #: A few sentences that a reader in a hurry reads and then stops.
    sections: tuple[Section, ...] = ()  #: The rest, the answer in full words first.
    #: File name (relative) to what it holds, listed at the end.
    files: Mapping[str, str] = field(default_factory=dict)
    footer: str = ""  #: A last line, such as versions.
    notices: tuple[str, ...] = ()  #: What a reader must not overlook, above everything else.
    numbers: tuple[Number, ...] = ()  #: Four at most.
    #: Beside the answer; one whose text can be read on a telephone.
    picture: FigureBlock | None = None


#: What every page ends with.
FOOTER = "Every CSV has a .meta.json beside it: meanings, units, input hashes, versions."


def files_of(tables: Iterable[Table]) -> dict[str, str]:
    """Every table's file with what it holds."""
    return {f"{t.name}.csv": t.description or ", ".join(list(t.columns)[:6]) for t in tables}


def table_block(
    table: Table,
    columns: Sequence[str] | Mapping[str, str] | None = None,
    *,
    caption: str = "",
    keep: Sequence[bool] | None = None,
    tones: Mapping[str, str] | None = None,
    digits: int = 4,
) -> TableBlock:
    """Show a table that is also written as CSV, under the headings that it declares.

    Args:
        columns: Which columns, all by default; a mapping gives other headings than declared.
        caption: One sentence; the table's description by default.
        keep: Which rows, one flag per row; all by default.

    Raises:
        ReportError: A column that the table lacks.
    """
    table = without_roundoff(table)
    shown = list(columns if columns is not None else table.columns)
    for header in shown:
        if header not in table.columns:
            raise ReportError(f"table '{table.name}' has no column '{header}'")
    given = columns if isinstance(columns, Mapping) else {}
    units = table.unit_columns
    rows = tuple(
        tuple(
            _unit(table.columns[header][i]) if header in units else _plain(table.columns[header][i])
            for header in shown
        )
        for i in range(table.rows)
        if keep is None or keep[i]
    )
    return TableBlock(
        tuple(given.get(header) or table.title(header) for header in shown),
        rows,
        caption or table.description,
        f"{table.name}.csv",
        tones or {},
        digits,
        tuple(table.meanings[header][0] for header in shown),
    )


def _unit(value: Any) -> str:
    """A unit in a cell; a pure number has none."""
    return "" if value in ("1", "", None) else unit_text(str(value))


def _plain(value: Any) -> Any:
    return value.item() if hasattr(value, "item") else value


def is_number(value: Any) -> bool:
    """Whether a cell holds a number, flags not counted."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def cell_text(value: Any, digits: int = 4) -> str:
    """A cell as a reader sees it: rounded, a true minus sign, a dash for no value."""
    if value is None:
        return "\N{EN DASH}"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return number(value, digits)
    return str(value).replace("-", "\N{MINUS SIGN}") if is_number(value) else prose(str(value))
