"""A page as a reader meets it: its links and pictures are there, its numbers are the CSVs'."""

import csv
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import lxml.html

from reports.page import cell_text


class Page:
    """What stands in a page, as HTML is read."""

    def __init__(self, text: str) -> None:
        self.tree: Any = lxml.html.fromstring(text)
        self.tags = {str(node.tag) for node in self.tree.iter()}
        self.targets: list[str] = self.tree.xpath("//img/@src|//a/@href")
        self.text: str = "".join(self.tree.xpath("//text()[not(ancestor::style)]"))

    def rows(self, name: str) -> list[list[tuple[str, str]]]:
        """Class and text of each cell by row, of the tables that show a CSV."""
        captions = self.tree.xpath(f"//p[@class='caption'][a/@href='{name}']")
        every = (row for one in captions for row in one.xpath("preceding::table[1]//tr[td]"))
        return [
            [(cell.xpath("string(span/@class)"), cell.text_content()) for cell in row.xpath("td")]
            for row in every
        ]


def checked(folder: Path) -> Page:
    """Read a run's page: what it links to is there, its tables' numbers are the CSVs'."""
    page = Page((folder / "index.html").read_text(encoding="utf-8"))
    ids = page.tree.xpath("//@id")
    assert len(ids) == len({*ids})
    assert "script" not in page.tags
    for target in map(unquote, page.targets):
        assert target[1:] in ids if target[0] == "#" else (folder / target).is_file(), target
    for name in {*page.tree.xpath("//p[@class='caption']/a/@href")}:
        with (folder / name).open(encoding="utf-8", newline="") as file:
            cells = [cell for row in csv.reader(file) for cell in row]
        known = {"\N{EN DASH}", "0"}
        for cell in cells:
            try:
                known |= {cell_text(float(cell), digits) for digits in (3, 4)}
            except ValueError:
                continue
            known |= {cell_text(int(cell))} if cell.lstrip("-").isdigit() else set()
        numbers = [text for row in page.rows(name) for kind, text in row if kind == "n"]
        assert {*numbers} <= known, name
    return page
