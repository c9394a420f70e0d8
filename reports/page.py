"""What a page says, and how it is written: one HTML file beside its figures and tables.

A page holds plain texts. Two marks are known in them, ``**bold**`` and `` `code` ``; all else is
shown as it stands.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actuators.errors import LegwattError
from pipeline.atomic import write_text
from pipeline.columns import SEE, about, column, unit_column
from reports.typeset import number, unit_suffix, unit_text
from reports.writer import without_roundoff

if TYPE_CHECKING:
    from markupsafe import Markup
    from pandas import DataFrame, Series

#: What every page ends with.
FOOTER = "datapackage.json: meanings and units of every column, input hashes, versions, options."
#: Tables with more rows than this are closed until a reader opens them.
_LONG = 60
_BOLD = re.compile(r"\*\*(.+?)\*\*")
_CODE = re.compile(r"`([^`]+)`")
#: A product of units, and a name that is too long for a column.
_PRODUCT = re.compile(r"(?<=[A-Za-z])\*(?=[A-Za-z])")
_LONG_NAME = re.compile(r"\w{17,}")


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

    @property
    def numeric(self) -> tuple[bool, ...]:
        """For each column whether it holds numbers only."""
        columns = zip(*self.rows, strict=True) if self.rows else ((),) * len(self.headers)
        return tuple(
            any(_is_number(v) for v in column) and all(v is None or _is_number(v) for v in column)
            for column in columns
        )

    @property
    def long(self) -> bool:
        """Whether it is closed until a reader opens it."""
        return len(self.rows) > _LONG


@dataclass(frozen=True)
class FigureBlock:
    """A picture that stands beside the page."""

    name: str  #: Of its file, without ``.svg``.
    caption: str  #: What to see in it.


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
    answer: tuple[str, ...]  #: A few lines that a reader in a hurry reads and then stops.
    sections: tuple[Section, ...] = ()  #: Tables, figures and what they rest on.
    #: File name (relative) to what it holds, listed at the end.
    files: Mapping[str, str] = field(default_factory=dict)
    notices: tuple[str, ...] = ()  #: What a reader must not overlook, above everything else.
    numbers: tuple[Number, ...] = ()  #: Four at most.
    picture: FigureBlock | None = None  #: Below the answer.


def files_of(tables: Mapping[str, DataFrame]) -> dict[str, str]:
    """Every table's file with what it holds."""
    return {f"{n}.csv": about(n) or ", ".join([*map(str, t)][:6]) for n, t in tables.items()}


def title_of(table: str, header: str) -> str:
    """Heading of a column on a page: words, with the unit in brackets."""
    unit, _, words = column(table, header)
    if not words:
        suffix = unit_suffix(unit)
        words = header.removesuffix(f"_{suffix}") if suffix else header
        owner, apart, quantity = words.partition("__")
        # The owner of a column, a joint or a foot, keeps its name.
        words = f"{owner} {quantity.replace('_', ' ')}" if apart else owner.replace("_", " ")
    if unit in ("", "1") or unit.startswith(SEE):
        return words
    return f"{words} [{unit_text(unit)}]"


def table_block(
    tables: Mapping[str, DataFrame],
    name: str,
    columns: Sequence[str] | Mapping[str, str] | None = None,
    *,
    caption: str = "",
    keep: Sequence[bool] | Series | None = None,
    tones: Mapping[str, str] | None = None,
    digits: int = 4,
) -> TableBlock:
    """Show a table that is also written as CSV, under the headings that it declares.

    Args:
        tables: By name.
        name: Which of them.
        columns: Which columns, all by default; a mapping gives other headings than declared.
        caption: One sentence; the table's description by default.
        keep: Which rows, one flag per row; all by default.

    Raises:
        LegwattError: A column that the table lacks.
    """
    table = tables[name]
    rounded, _ = without_roundoff(name, table)
    shown = [*map(str, columns if columns is not None else table)]
    for header in shown:
        if header not in table:
            raise LegwattError(f"table '{name}' has no column '{header}'")
    given = columns if isinstance(columns, Mapping) else {}
    kept = rounded if keep is None else rounded[list(keep)]
    units = {"unit", *(unit_column(name, str(header)) for header in table)}
    cells = []
    for header in shown:
        values = kept[header].astype(object).where(kept[header].notna(), None).tolist()
        if header in units:  # a pure number has no unit
            cells.append(["" if v in ("1", "", None) else unit_text(str(v)) for v in values])
        else:
            cells.append(values)
    return TableBlock(
        tuple(given.get(header) or title_of(name, header) for header in shown),
        tuple(zip(*cells, strict=True)),
        caption or about(name),
        f"{name}.csv",
        tones or {},
        digits,
        tuple(column(name, header).meaning for header in shown),
    )


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def cell_text(value: Any, digits: int = 4) -> str:
    """A cell as a reader sees it: rounded, a true minus sign, a dash for no value."""
    if value is None:
        return "\N{EN DASH}"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return number(value, digits)
    return str(value).replace("-", "\N{MINUS SIGN}") if _is_number(value) else str(value)


def marked(text: str) -> Markup:
    """Text with its two marks as HTML, all else escaped; long names may break at underscores."""
    from markupsafe import Markup, escape

    pieces = _CODE.split(_BOLD.sub("<strong>\\1</strong>", str(escape(text))))
    pieces[::2] = [_PRODUCT.sub("\N{MIDDLE DOT}", piece) for piece in pieces[::2]]
    pieces[1::2] = [f"<code>{piece}</code>" for piece in pieces[1::2]]
    return Markup(_LONG_NAME.sub(lambda name: name[0].replace("_", "_<wbr>"), "".join(pieces)))


def plain(text: str) -> str:
    """A text without its marks, for a terminal."""
    return text.replace("**", "").replace("`", "")


def write_page(page: Page, folder: Path) -> None:
    """Write a page as ``index.html``; its figures stand in the same folder.

    Raises:
        LegwattError: The folder cannot be written.
    """
    write_text(folder / "index.html", html(page))


def html(page: Page) -> str:
    """The text of a page."""
    return str(_template().render(page=page, footer=FOOTER))


@cache
def _template() -> Any:
    import jinja2

    found = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    found.filters.update(marked=marked, cell=cell_text)
    return found.get_template("page.html")
