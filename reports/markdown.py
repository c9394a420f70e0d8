"""A page as Markdown, beside the same as HTML: figures and tables are linked relative to it."""

from __future__ import annotations

import os
from pathlib import Path

from pipeline.atomic import write_text
from reports.html import write_html
from reports.page import Block, FigureBlock, Page, TableBlock, cell_text
from reports.typeset import prose


def write_pages(page: Page, folder: Path, name: str) -> None:
    """Write a page as Markdown under a name, and as ``index.html``.

    Raises:
        ReportError: A figure that is missing or neither SVG nor PNG.
        OutputError: The folder cannot be written.
    """
    write_text(folder / name, markdown(page, folder))
    write_html(page, folder / "index.html")


def markdown(page: Page, folder: Path) -> str:
    """The text of a page; `folder` is where it will lie."""
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
        parts.append("## Files")
        listed = (f"- [{name}]({name}): {prose(text)}" for name, text in page.files.items())
        parts.append("\n".join(listed))
    if page.footer:
        parts.append(page.footer)
    return "\n\n".join(parts) + "\n"


def _block(block: Block, folder: Path) -> str:
    if isinstance(block, str):
        return prose(block)
    if isinstance(block, tuple):
        return "\n".join(f"- {item}" for item in map(prose, block))
    if isinstance(block, FigureBlock):
        picture = os.path.relpath(block.file, folder).replace(os.sep, "/")
        caption = prose(block.caption)
        shown = f"![{_cell(prose(block.alt) or caption)}]({picture})"
        return f"{shown}\n\n*{caption}*" if caption else shown
    return _table(block)


def _table(block: TableBlock) -> str:
    rule = " | ".join("---:" if numeric else "---" for numeric in block.numeric)
    lines = [
        "| " + " | ".join(_cell(prose(h)) for h in block.headers) + " |",
        f"| {rule} |",
        *(
            "| " + " | ".join(_cell(cell_text(v, block.digits)) for v in row) + " |"
            for row in block.rows
        ),
    ]
    caption = prose(block.caption)
    if block.file:
        caption = f"{caption} Full numbers: [{block.file}]({block.file}).".strip()
    return "\n".join(lines) + (f"\n\n{caption}" if caption else "")


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")
