"""A page is one Jinja template of `templates/`, into which numbers, tables and figures are put.

Texts are plain. Two marks are known in them, ``**bold**`` and `` `code` ``; all else is shown as it
stands. A page is one HTML file without script or network; its figures stand beside it.

Numbers and units are written in one way: for readers on pages and figures, as words in headers.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actuators.checked import write_text
from actuators.errors import known
from pipeline.columns import SEE, about, column
from reports.folder import without_roundoff

if TYPE_CHECKING:
    from markupsafe import Markup
    from pandas import DataFrame, Series

MINUS, DOT, TIMES = "\N{MINUS SIGN}", "\N{MIDDLE DOT}", "\N{MULTIPLICATION SIGN}"
_RAISED = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
_SYMBOLS = {"ohm": "Ω", "deg": "°", "degC": "°C"}
#: Below and from here on a power of ten is written out.
_SMALL, _LARGE = 1e-4, 1e6


def number(value: float, digits: int = 3) -> str:
    """A number as it is where it is short, else rounded to significant digits, zeros kept.

    A true minus sign; a power of ten only far from 1. So 0.6, as it stands in a file, is ``0.6``,
    and 0.59996 with three digits is ``0.600``: who sees zeros at the end sees a rounded number.
    """
    value = float(value)
    if not math.isfinite(value):
        return "\N{EN DASH}" if math.isnan(value) else f"{MINUS if value < 0 else ''}\N{INFINITY}"
    if value == 0:
        return "0"
    short = f"{value:.{digits}g}"
    rounded = short if float(short) == value else f"{value:#.{digits}g}"
    size = abs(float(rounded))
    if size < _SMALL or size >= _LARGE:
        mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
        if float(short) == value and "." in mantissa:
            mantissa = mantissa.rstrip("0").rstrip(".")
        text = f"{mantissa}{TIMES}10{str(int(exponent)).translate(_RAISED)}"
    elif "e" in rounded:  # more digits before the point than are significant
        text = f"{float(rounded):.0f}"
    else:
        text = rounded.rstrip(".")
    return text.replace("-", MINUS)


def unit_text(unit: str) -> str:
    """A unit as people write it: ``N*m`` is ``N·m``, ``rad/s^2`` is ``rad/s²``."""
    text = re.sub(r"\^(-?\d)", lambda match: match[1].translate(_RAISED), unit)
    text = re.sub(r"[A-Za-z]+", lambda match: _SYMBOLS.get(match[0], match[0]), text)
    return text.replace("*", DOT)


def unit_suffix(unit: str) -> str:
    """A unit as a word in a header: ``"N*m"`` is ``Nm``, ``"rad/s^2"`` is ``rad_s2``."""
    if unit in ("", "1"):
        return ""
    return unit.replace("*", "").replace("/", "_").replace("^", "")


def percent(share: float, digits: int = 0) -> str:
    """A share in percent."""
    return f"{100 * share:.{digits}f} %"


#: Tables with more rows than this are closed until a reader opens them.
_LONG = 60
#: Texts up to this stay on one line, those from this on have a column of some width.
_SHORT, _WIDE = 16, 40
_BOLD = re.compile(r"\*\*(.+?)\*\*")
_CODE = re.compile(r"`([^`]+)`")
#: A product of units, and a name that is too long for a column.
_PRODUCT = re.compile(r"(?<=[A-Za-z])\*(?=[A-Za-z])")
_LONG_NAME = re.compile(r"\w{17,}")
#: Verdicts to how they look.
_TONES = {
    **dict.fromkeys(("accepted", "confirmed", "noise", "ok", "reproduced"), "good"),
    **dict.fromkeys(("unexplained", "warning", "refused", "suspected"), "bad"),
    **dict.fromkeys(("not reproduced", "contradicted"), "bad"),
    **dict.fromkeys(("rejected", "not identifiable on this motion", "masked"), "quiet"),
}


def write_page(
    template: str, folder: Path, tables: Mapping[str, DataFrame], **content: Any
) -> None:
    """Write a page as ``index.html``; see `html`.

    Raises:
        LegwattError: The folder cannot be written.
    """
    write_text(folder / "index.html", html(template, tables, **content))


def html(template: str, tables: Mapping[str, DataFrame], **content: Any) -> str:
    """The text of a page.

    Args:
        template: Its name in `templates/`, without ending.
        tables: By name; the template shows them by `table`, and lists all.
        content: What else the template names.
    """
    files = {f"{name}.csv": about(name) for name in tables} | content.pop("files", {})
    given = {"notices": (), "table": partial(table, tables), "tables": tables, "files": files}
    made = _templates().get_template(f"{template}.html")
    return str(made.render(given | {"plain_table": plain_table} | content))


def rendered(template: str, **content: Any) -> list[str]:
    """Lines of a template of plain text, empty ones left out."""
    text = _templates().get_template(template).render(content)
    return [line for line in str(text).splitlines() if line.strip()]


@cache
def _templates() -> Any:
    import jinja2

    found = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=jinja2.select_autoescape(["html"]),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    found.filters.update(marked=marked, number=number, percent=percent, unit=unit_text)
    return found


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


def cell_text(value: Any, digits: int = 4) -> str:
    """A cell as a reader sees it: rounded, a true minus sign, a dash for no value."""
    if value is None or value != value:
        return "\N{EN DASH}"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return number(value, digits)
    return str(value).replace("-", "\N{MINUS SIGN}") if isinstance(value, int) else str(value)


def table(
    tables: Mapping[str, DataFrame],
    name: str,
    columns: Sequence[str] | None = None,
    *,
    caption: str = "",
    keep: Sequence[bool] | Series | None = None,
    digits: int = 4,
) -> Markup:
    """Show a table that is also written as CSV, under the headings that it declares.

    Args:
        tables: By name.
        name: Which of them.
        columns: Which columns, all by default; those that it lacks are left out.
        caption: One sentence; the table's description by default.
        keep: Which rows, one flag per row; all by default.
        digits: Significant digits of numbers.

    Raises:
        LegwattError: No such table.
    """
    frame = without_roundoff(name, tables[known("no table", name, tables)])
    frame = frame if keep is None else frame[[*keep]]
    kinds = (column(name, str(header)).unit for header in frame)
    units = {"unit", *(kind.removeprefix(SEE) for kind in kinds if kind.startswith(SEE))}
    shown = [c for c in (columns or map(str, frame)) if c in frame]
    heads = {c: title_of(name, c) for c in shown}
    meanings = {c: column(name, c).meaning for c in shown}
    file = f'Full numbers: <a href="{name}.csv">{name}.csv</a>'
    return _table(frame[shown], heads, meanings, units, digits, caption or about(name), file)


def plain_table(frame: DataFrame, caption: str, digits: int = 3) -> Markup:
    """Show a table that stands on the page alone, under the names of its columns."""
    heads = {str(name): str(name) for name in frame}
    return _table(frame, heads, {}, {"unit"}, digits, caption, "")


def _table(
    frame: DataFrame,
    heads: Mapping[str, str],
    meanings: Mapping[str, str],
    units: Collection[str],
    digits: int,
    caption: str,
    file: str,
) -> Markup:
    """A table of cells by what they hold: numbers, units, texts."""
    import pandas
    from markupsafe import Markup, escape

    cells = {}
    for header, title in heads.items():
        values = frame[header].astype(object).where(frame[header].notna(), None).tolist()
        known = [value for value in values if value is not None]
        numeric = bool(known) and not any(isinstance(v, bool | str) for v in known)
        kind, tip = "n" if numeric else "", escape(meanings.get(header, ""))
        heading = f'<span class="{kind}" title="{tip}">{escape(title)}</span>'
        cells[heading] = [_cell(value, header in units, kind, digits) for value in values]
    with pandas.option_context("display.max_colwidth", None):
        text = pandas.DataFrame(cells).to_html(index=False, escape=False, border=0)
    text = f'<div class="wide" tabindex="0" role="region" aria-label="Table">{text}</div>'
    if len(frame) > _LONG:
        text = f"<details><summary>{len(frame)} rows</summary>{text}</details>"
    return Markup(f'{text}\n<p class="caption">{marked(caption)} {file}</p>')


def _cell(value: Any, is_unit: bool, kind: str, digits: int) -> str:
    """The HTML of a cell."""
    if is_unit:  # a pure number has none
        value = "" if value in ("1", "", None) else unit_text(str(value))
    text = cell_text(value, digits)
    if text in _TONES:
        return f'<span class="tone {_TONES[text]}">{text}</span>'
    kind = kind or ("s" if len(text) <= _SHORT else "l" if len(text) > _WIDE else "")
    return f'<span class="{kind}">{marked(text)}</span>'
