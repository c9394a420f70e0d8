"""A page as one self-contained HTML file: no network, pictures inside, a script only to sort."""

from __future__ import annotations

import base64
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.atomic import write_text
from pipeline.errors import ReportError
from reports.page import Page, TableBlock, cell_text
from reports.typeset import prose

if TYPE_CHECKING:
    from markupsafe import Markup

_TEMPLATES = Path(__file__).parent / "templates"
_MIME = {".svg": "image/svg+xml", ".png": "image/png"}
_LINK = re.compile(r"\[([^\]]+)\]\(([^)\s]+)\)")
_BOLD = re.compile(r"\*\*(.+?)\*\*")
_EMPHASIS = re.compile(r"(?<!\w)\*(?=\S)(.+?)(?<=\S)\*(?!\w)")
_CODE = re.compile(r"`([^`]+)`")
#: The space between a number and its unit, at which no line ends.
_UNIT = re.compile(r"(?<=\d) (?=(?:%|[mk]?N·m|[kmµ]?[NAVWJ]|[ckm]?m|kg|g|s|rad|Hz|K|Ω)(?![\w·]))")
_TAG = re.compile(r"(<[^>]*>)")
_TARGET = re.compile(r"(?:https?://|#|(?![a-zA-Z][\w+.-]*:)(?!/))[^\s*<>]*")


def write_html(page: Page, path: Path) -> Path:
    """Write a page as HTML.

    Raises:
        ReportError: A figure that is missing or neither SVG nor PNG.
        OutputError: The folder cannot be written.
    """
    write_text(path, html(page, path.parent))
    return path


def html(page: Page, folder: Path) -> str:
    """The text of a page; `folder` is where it will lie, for links to the pictures' files."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters.update(marked=marked, cell=cell_text, breakable=breakable, prose=prose)
    environment.filters.update(
        data=_data, link=lambda file: os.path.relpath(file, folder).replace(os.sep, "/")
    )
    return environment.get_template("page.html").render(page=page, script=_script(page))


def _script(page: Page) -> str:
    """What sorts and filters tables, where the page has such; empty else."""
    blocks = (block for section in page.sections for block in section.blocks)
    if not any(isinstance(block, TableBlock) and block.sortable for block in blocks):
        return ""
    return (_TEMPLATES / "sort.js").read_text(encoding="utf-8")


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
    for i in range(1, len(pieces), 2):
        pieces[i] = f"<code>{pieces[i]}</code>"
    return Markup("".join(pieces))


def breakable(text: str) -> Markup:
    """Marked text whose long names may break after an underscore, for the cells of a table."""
    from markupsafe import Markup

    pieces = _TAG.split(str(marked(text)))
    pieces[::2] = [re.sub(r"(?<=\w)_(?=\w)", "_<wbr>", piece) for piece in pieces[::2]]
    return Markup("".join(pieces))
