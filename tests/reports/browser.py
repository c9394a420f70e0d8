"""A page as headless Chromium lays it out: widths of what is on it."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

needs_chromium = pytest.mark.skipif(shutil.which("chromium") is None, reason="Chromium is missing")

# A window of the browser is at least 500 px wide, a frame in it may be narrower.
_FRAME = """<!doctype html><body style="margin:0"><iframe id="f" width="{width}" height="900"
style="border:0"></iframe><pre id="m"></pre><script>
const frame = document.getElementById('f');
frame.onload = () => {{
  const d = frame.contentDocument, root = d.documentElement, out = {{}};
  const box = (e) => e.getBoundingClientRect();
  out.window = root.clientWidth;
  out.page = root.scrollWidth;
  out.tables = d.querySelectorAll('.wide').length;
  out.pictures = [...d.images].filter((e) => e.naturalWidth).length;
  out.beyond = [...d.querySelectorAll('body *')].filter((e) => !e.closest('.wide table, figure a')
    && box(e).right > root.clientWidth + 1).map((e) => e.tagName + ' ' + e.className);
  document.getElementById('m').textContent = JSON.stringify(out);
}};
frame.src = {page};
</script></body>"""


@dataclass(frozen=True)
class Layout:
    """What stands where in a window of one width [px]."""

    window: float
    page: float
    tables: int  #: In frames of their own.
    pictures: int  #: That were loaded.
    beyond: list[str]  #: Elements that end right of the window, but for what scrolls in a frame.


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
    frame = folder / "frame.html"
    text = _FRAME.format(width=width, page=json.dumps(page.as_uri()))
    frame.write_text(text, encoding="utf-8")
    dom = run(
        folder,
        "--allow-file-access-from-files",
        "--window-size=1600,1000",
        "--virtual-time-budget=5000",
        "--dump-dom",
        frame.as_uri(),
    )
    found = re.search(r'<pre id="m">(.+?)</pre>', dom, re.DOTALL)
    assert found is not None
    return Layout(**json.loads(html.unescape(found[1])))
