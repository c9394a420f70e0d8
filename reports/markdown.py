"""A page as Markdown: summary.md and report.md."""

from __future__ import annotations

import os
from pathlib import Path

from reports.atomic import write_text
from reports.page import Block, FigureBlock, Page, Points, TableBlock, Text, cell_text
from reports.typeset import prose


def write_markdown(page: Page, path: Path) -> Path:
    """Write a page as Markdown; figures and tables are linked relative to it.

    Raises:
        OutputError: The folder cannot be written.
    """
    write_text(path, markdown(page, path.parent))
    return path


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
    if isinstance(block, Text):
        return prose(block.text)
    if isinstance(block, Points):
        return "\n".join(f"- {item}" for item in map(prose, block.items))
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
