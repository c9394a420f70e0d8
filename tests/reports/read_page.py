"""A page as a reader meets it: links, pictures and tables; and what would be wrong with it."""

from __future__ import annotations

import csv
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

from reports.page import cell_text

#: Elements without an end tag.
_VOID = ("meta", "link", "img", "br", "wbr", "input", "hr")


class PageReader(HTMLParser):
    """What stands in a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.ids: list[str] = []
        self.targets: list[str] = []  #: Of links and pictures.
        self.tags: list[str] = []
        self.rows: list[list[tuple[str, str]]] = []  #: Class and text of each cell, by row.
        self.tables: dict[str, list[list[tuple[str, str]]]] = {}  #: Rows by CSV.
        self.open: list[str] = []
        self.texts: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.tags.append(tag)
        self.ids += [given["id"]] if "id" in given else []
        target = given.get("src", given.get("href", ""))
        self.targets += [target] if target and not target.startswith("data:,") else []
        if tag not in _VOID:
            self.open.append(tag)
        if tag == "table":
            self.rows = []
        elif tag == "tr":
            self.rows.append([])
        elif tag == "td":
            self.rows[-1].append(("", ""))
        elif tag == "span" and "td" in self.open:
            self.rows[-1][-1] = (given.get("class", ""), self.rows[-1][-1][1])
        elif tag == "a" and target.endswith(".csv") and self.rows:
            self.tables.setdefault(target, []).extend(self.rows)
            self.rows = []

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag
        if tag == "p":  # a table's caption ends: what is linked later is not its file
            self.rows = []

    def handle_data(self, data: str) -> None:
        if "style" not in self.open:
            self.texts.append(data)
        if "td" in self.open:
            kind, text = self.rows[-1][-1]
            self.rows[-1][-1] = (kind, text + data)


def checked(folder: Path) -> PageReader:
    """Read a run's page: well formed, what it links to is there, its numbers are the CSVs'."""
    page = PageReader((folder / "index.html").read_text(encoding="utf-8"))
    assert page.open == []
    assert len(page.ids) == len({*page.ids})
    assert "script" not in page.tags
    for target in map(unquote, page.targets):
        assert target[1:] in page.ids if target[0] == "#" else (folder / target).is_file(), target
    assert page.tables
    for name, rows in page.tables.items():
        with (folder / name).open(encoding="utf-8", newline="") as file:
            cells = [cell for row in csv.reader(file) for cell in row]
        known = {"\N{EN DASH}", "0"}
        for cell in cells:
            try:
                known |= {cell_text(float(cell), digits) for digits in (3, 4)}
            except ValueError:
                continue
            known |= {cell_text(int(cell))} if cell.lstrip("-").isdigit() else set()
        numbers = [text for row in rows for kind, text in row if kind == "n"]
        assert {*numbers} <= known, name
    return page
