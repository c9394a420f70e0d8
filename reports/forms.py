"""The two forms of a page: a self-contained HTML file, and the same as Markdown.

The HTML file needs no network: pictures are inside, a script only sorts tables.
"""

from __future__ import annotations

import base64
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.atomic import write_text
from pipeline.errors import ReportError
from reports.page import Block, FigureBlock, Page, TableBlock, cell_text
from reports.typeset import prose
from reports.words import TEMPLATES, environment

if TYPE_CHECKING:
    from markupsafe import Markup

_MIME = {".svg": "image/svg+xml", ".png": "image/png"}
_LINK = re.compile(r"\[([^\]]+)\]\(([^)\s]+)\)")
_BOLD = re.compile(r"\*\*(.+?)\*\*")
_EMPHASIS = re.compile(r"(?<!\w)\*(?=\S)(.+?)(?<=\S)\*(?!\w)")
_CODE = re.compile(r"`([^`]+)`")
#: The space between a number and its unit, at which no line ends.
_UNIT = re.compile(r"(?<=\d) (?=(?:%|[mk]?N·m|[kmµ]?[NAVWJ]|[ckm]?m|kg|g|s|rad|Hz|K|Ω)(?![\w·]))")
_TAG = re.compile(r"(<[^>]*>)")
_TARGET = re.compile(r"(?:https?://|#|(?![a-zA-Z][\w+.-]*:)(?!/))[^\s*<>]*")


def write_pages(page: Page, folder: Path, name: str = "") -> None:
    """Write a page as ``index.html`` and, where a name is given, as Markdown under it.

    Raises:
        ReportError: A figure that is missing or neither SVG nor PNG.
        OutputError: The folder cannot be written.
    """
    if name:
        write_text(folder / name, markdown(page, folder))
    write_text(folder / "index.html", html(page, folder))


def html(page: Page, folder: Path) -> str:
    """The text of a page as HTML; `folder` is where it will lie, for links to pictures' files."""
    own = environment()
    own.filters.update(marked=marked, cell=cell_text, breakable=breakable, prose=prose, data=_data)
    own.filters.update(link=lambda file: _link(file, folder))
    blocks = (block for section in page.sections for block in section.blocks)
    sorts = any(isinstance(block, TableBlock) and block.sortable for block in blocks)
    script = (TEMPLATES / "sort.js").read_text(encoding="utf-8") if sorts else ""
    return str(own.get_template("page.html").render(page=page, script=script))


def _link(file: Path, folder: Path) -> str:
    return os.path.relpath(file, folder).replace(os.sep, "/")


def _data(file: Path) -> str:
    mime = _MIME.get(file.suffix.lower())
    if mime is None:
        raise ReportError(f"{file}: a page shows SVG or PNG pictures only")
    try:
        content = file.read_bytes()
    except OSError as error:
        raise ReportError(
            f"{file}: cannot be read ({error.strerror}); draw the figure before the page"
        ) from None
    return f"data:{mime};base64,{base64.b64encode(content).decode('ascii')}"


def marked(text: str) -> Markup:
    """Text with its four marks as HTML, all else escaped."""
    from markupsafe import Markup, escape

    def link(match: re.Match[str]) -> str:
        label, target = match.groups()
        # Anything but a relative or web address (a script, a machine's path) stays plain text.
        return f'<a href="{target}">{label}</a>' if _TARGET.fullmatch(target) else label

    escaped = _UNIT.sub("\N{NO-BREAK SPACE}", str(escape(prose(text))))
    pieces = _CODE.split(escaped)  # every second piece is code and keeps its other marks
    for i in range(0, len(pieces), 2):
        bold = _BOLD.sub(r"<strong>\1</strong>", _LINK.sub(link, pieces[i]))
        pieces[i] = _EMPHASIS.sub(r"<em>\1</em>", bold)
    pieces[1::2] = [f"<code>{piece}</code>" for piece in pieces[1::2]]
    return Markup("".join(pieces))


def breakable(text: str) -> Markup:
    """Marked text whose long names may break after an underscore, for the cells of a table."""
    from markupsafe import Markup

    pieces = _TAG.split(str(marked(text)))
    pieces[::2] = [re.sub(r"(?<=\w)_(?=\w)", "_<wbr>", piece) for piece in pieces[::2]]
    return Markup("".join(pieces))


def markdown(page: Page, folder: Path) -> str:
    """The text of a page as Markdown; `folder` is where it will lie."""
    parts = [f"# {prose(page.title)}", *map(prose, page.notices)]
    if page.numbers:
        parts.append("\n".join(f"- **{prose(n.value)}** {prose(n.label)}" for n in page.numbers))
    parts += map(prose, page.answer)
    if page.picture:
        parts.append(_block(page.picture, folder))
    for section in page.sections:
        parts.append(f"## {prose(section.heading)}")
        parts += [_block(block, folder) for block in section.blocks]
    if page.files:
        listed = (f"- [{name}]({name}): {prose(text)}" for name, text in page.files.items())
        parts += ["## Files", "\n".join(listed)]
    if page.footer:
        parts.append(page.footer)
    return "\n\n".join(parts) + "\n"


def _block(block: Block, folder: Path) -> str:
    if isinstance(block, str):
        return prose(block)
    if isinstance(block, tuple):
        return "\n".join(f"- {item}" for item in map(prose, block))
    if isinstance(block, FigureBlock):
        caption = prose(block.caption)
        shown = f"![{_cell(prose(block.alt) or caption)}]({_link(block.file, folder)})"
        return f"{shown}\n\n*{caption}*" if caption else shown
    return _table(block)


def _table(block: TableBlock) -> str:
    rows = [
        [prose(header) for header in block.headers],
        *([cell_text(value, block.digits) for value in row] for row in block.rows),
    ]
    lines = [f"| {' | '.join(map(_cell, row))} |" for row in rows]
    rule = " | ".join("---:" if numeric else "---" for numeric in block.numeric)
    lines.insert(1, f"| {rule} |")
    caption = prose(block.caption)
    if block.file:
        caption = f"{caption} Full numbers: [{block.file}]({block.file}).".strip()
    return "\n".join(lines) + (f"\n\n{caption}" if caption else "")


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")
