"""Words of the pages, from one template each: a macro is a paragraph."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from reports.page import (
    Block,
    FigureBlock,
    Section,
    TableBlock,
    table_block,
)
from reports.table import Table
from reports.typeset import number

TEMPLATES = Path(__file__).parent / "templates"
_FIGURE = re.compile(r"!\[(.*)\]\((.+)\)( half)?")


class Words:
    """The paragraphs of one template."""

    def __init__(self, template: str, **names: Any) -> None:
        """Keep what to load when a paragraph is first asked for.

        Args:
            names: What its macros use besides their arguments.
        """
        self._template, self._names = template, names

    def __call__(self, paragraph: str, *arguments: Any) -> str:
        """A paragraph on one line; empty where there is nothing to say."""
        return " ".join(self.text(paragraph, *arguments).split())

    def text(self, macro: str, *arguments: Any) -> str:
        """What a macro writes, with its line ends."""
        module = environment().get_template(f"{self._template}.jinja").make_module(self._names)
        return str(getattr(module, macro)(*arguments))


class Shown:
    """Tables that a template shows: `table` writes a line that `sections` reads."""

    def __init__(self, tables: Mapping[str, Table]) -> None:
        """Show none yet."""
        self.tables = tables
        self.blocks: list[TableBlock] = []

    def table(self, given: str | TableBlock, columns: Any = None, **more: Any) -> str:
        """Show a table of the run, or one made for the page; see `table_block`."""
        if isinstance(given, str):
            given = table_block(self.tables[given], columns, **more)
        self.blocks.append(given)
        return f"\n\n[table {len(self.blocks) - 1}]\n\n"


def sections(text: str, shown: Shown, folder: Path) -> tuple[Section, ...]:
    """Sections of a page, from Markdown of headings, paragraphs, lists, figures and tables.

    Args:
        text: Parts are apart by empty lines; ``half`` after a figure puts two side by side.
    """
    out: list[tuple[str, list[Block]]] = []
    for part in filter(None, (part.strip() for part in re.split(r"\n[ \n]*\n", text))):
        if part.startswith("## "):
            out.append((part[3:], []))
            continue
        blocks = out[-1][1]
        if part.startswith("- "):
            items = re.split(r"\n- ", part[2:])
            blocks.append(tuple(" ".join(item.split()) for item in items))
        elif part.startswith("[table "):
            blocks.append(shown.blocks[int(part[7:-1])])
        elif _FIGURE.match(part):
            figures = (
                match.groups() for match in map(_FIGURE.fullmatch, part.splitlines()) if match
            )
            blocks += [FigureBlock(folder / f, text, half=bool(half)) for text, f, half in figures]
        else:
            blocks.append(" ".join(part.split()))
    return tuple(Section(heading, tuple(blocks)) for heading, blocks in out)


@cache
def environment() -> Any:
    """Jinja's settings for all templates: those of HTML escape what they show."""
    import jinja2

    found = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES),
        autoescape=jinja2.select_autoescape(["html"]),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    found.filters.update(number=number, percent=percent, listed=listed, few=few)
    return found


def percent(share: float, digits: int = 0) -> str:
    """A share in percent."""
    return f"{100 * share:.{digits}f} %"


def listed(items: Iterable[str]) -> str:
    """One, two and three."""
    *most, last = items
    return f"{', '.join(most)} and {last}" if most else last


def few(count: int) -> str:
    """A small number as a word."""
    return {1: "one", 2: "two", 3: "three", 4: "four"}.get(count, str(count))
