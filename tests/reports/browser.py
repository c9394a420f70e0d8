"""A page as headless Chromium lays it out: widths of what is on it, and the words of its print."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

needs_chromium = pytest.mark.skipif(shutil.which("chromium") is None, reason="Chromium is missing")
needs_poppler = pytest.mark.skipif(shutil.which("pdftotext") is None, reason="Poppler is missing")

# A window of the browser is at least 500 px wide, a frame in it may be narrower.
_FRAME = """<!doctype html><body style="margin:0"><iframe id="f" width="{width}" height="900"
style="border:0"></iframe><pre id="m"></pre><script>
const frame = document.getElementById('f');
frame.onload = () => {{
  const d = frame.contentDocument, root = d.documentElement, out = {{}};
  const box = (e) => e.getBoundingClientRect();
  out.window = root.clientWidth;
  out.page = root.scrollWidth;
  out.tables = [...d.querySelectorAll('.wide')].map((e) => ({{
    frame: e.clientWidth, table: e.scrollWidth, right: box(e).right,
    scrolls: d.defaultView.getComputedStyle(e).overflowX,
    columns: Object.fromEntries([...e.querySelectorAll('th')].map(
      (h) => [h.textContent, box(h).right])) }}));
  out.pictures = [...d.images].map((e) => ({{ left: box(e.parentElement).left,
    right: box(e.parentElement).right, scale: box(e).width / e.naturalWidth,
    shape: (box(e).width / box(e).height) / (e.naturalWidth / e.naturalHeight) }}));
  out.beyond = [...d.querySelectorAll('body *')].filter((e) => !e.closest('.wide table, figure a')
    && box(e).right > root.clientWidth + 1).map((e) => e.tagName + ' ' + e.className);
  out.numbers = d.querySelectorAll('.numbers li').length;
  out.first = box(d.querySelector('.first')).bottom;
  document.getElementById('m').textContent = JSON.stringify(out);
}};
frame.srcdoc = {page};
</script></body>"""


@dataclass(frozen=True)
class Layout:
    """What stands where in a window of one width [px]; pictures by their frames."""

    window: float
    page: float
    tables: list[dict[str, Any]]
    pictures: list[dict[str, float]]
    beyond: list[str]
    numbers: int
    first: float

    def at_first_sight(self) -> bool:
        """Four numbers, the picture and the answer: one screen, two of a telephone."""
        return self.numbers == 4 and self.first <= (800 if self.window > 640 else 1600)

    @property
    def letters(self) -> float:
        """Height of the letters of the smallest picture, of which 12 px are the usual [px]."""
        return 12 * min(picture["scale"] for picture in self.pictures)


def run(folder: Path, *options: str) -> str:
    """Start the browser with a profile of its own; what it prints."""
    command = [
        *("chromium", "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run"),
        *("--disable-background-networking", f"--user-data-dir={folder / 'profile'}"),
    ]
    done = subprocess.run(
        [*command, *options], capture_output=True, text=True, timeout=120, check=True
    )
    assert "CONSOLE" not in done.stderr
    return done.stdout


def layout(page: Path, width: int, folder: Path) -> Layout:
    """Lay the page out in a window of that width."""
    source = json.dumps(page.read_text(encoding="utf-8")).replace("</", "<\\/")
    frame = folder / "frame.html"
    frame.write_text(_FRAME.format(width=width, page=source), encoding="utf-8")
    dom = run(
        folder,
        "--window-size=1600,1000",
        "--virtual-time-budget=5000",
        "--dump-dom",
        frame.as_uri(),
    )
    found = re.search(r'<pre id="m">(.+?)</pre>', dom, re.DOTALL)
    assert found is not None
    return Layout(**json.loads(html.unescape(found[1])))


@dataclass(frozen=True)
class Word:
    """A printed word and where it ends, as shares of the sheet's width and height."""

    text: str
    right: float
    bottom: float


def printed(page: Path, folder: Path) -> list[Word]:
    """Every word of the page printed to PDF, in reading order."""
    pdf = folder / "page.pdf"
    run(folder, "--no-pdf-header-footer", f"--print-to-pdf={pdf}", page.as_uri())
    command = ["pdftotext", "-bbox", str(pdf), "-"]
    xml = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True).stdout
    words = []
    for sheet in re.findall(r"<page .*?</page>", xml, re.DOTALL):
        size = re.search(r'width="([\d.]+)" height="([\d.]+)"', sheet)
        assert size is not None
        words += [
            Word(html.unescape(text), float(x) / float(size[1]), float(y) / float(size[2]))
            for x, y, text in re.findall(
                r'<word xMin=".*?" yMin=".*?" xMax="(.*?)" yMax="(.*?)">(.*?)</word>', sheet
            )
        ]
    return words
