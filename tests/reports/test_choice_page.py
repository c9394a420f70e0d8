"""The page of a choice: pictures, parts that lead to sources, tables that sort in a browser."""

from __future__ import annotations

import html
import json
import re
from dataclasses import fields
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from reports.pages.choice_page import PartSource, write_choice_page
from reports.table import Table
from reports.tables.choice import AnswerRow, BestRow, DayRow, FrontRow
from tests.reports.browser import needs_chromium, run

PARTS = {
    "motor_a": PartSource("Motor A", "datasheet", "maker's page <1>", "peak current is a range"),
    "motor_b": PartSource("Motor B", "assumed", "nobody's"),
    "motor_c": PartSource("Motor C, in no table", "datasheet", "elsewhere"),
}
#: Presses the heading of a column twice, then filters; what stands in the first column after each.
PRESSED = """<script>
const table = document.querySelectorAll("table.sortable")[1], said = [];
const read = () => [...table.tBodies[0].rows].filter((r) => !r.hidden)
  .map((r) => r.cells[1].textContent);
const button = [...table.querySelectorAll("th button")].find(
  (b) => b.textContent.startsWith("power"));
said.push(read());
for (const time of [1, 2]) { button.click(); said.push(read()); }
said.push([button.parentElement.getAttribute("aria-sort"), document.activeElement.tagName]);
const field = table.closest(".wide").previousElementSibling.querySelector("input");
field.value = "MOTOR_B"; field.dispatchEvent(new Event("input")); said.push(read());
const pre = document.createElement("pre"); pre.id = "said";
pre.textContent = JSON.stringify(said); document.body.append(pre);
</script>"""


def table(kind: Any, rows: list[dict[str, Any]]) -> Table:
    """Columns that a row does not state are zero or empty."""
    names = {field.name: field.metadata["column"] for field in fields(kind)}
    columns = {
        name: [row.get(name, 0.0 if meaning[1] else "") for row in rows]
        for name, meaning in names.items()
    }
    return Table(kind.table, columns, names)


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    mass = {"actuator_mass_kg": 3.0, "power_W": 12.0}
    best = [
        {"group": "hip", "rank": 1, "motor": "motor_a", "power_W": 9.0},
        {"group": "hip", "rank": 2, "motor": "motor_b", "power_W": 10.0},
        {"group": "hip", "rank": 3, "motor": "motor_a", "power_W": None},
        {"group": "hip", "rank": 4, "motor": "motor_b", "power_W": 100.0},
    ]
    tables = [
        table(AnswerRow, [{"group": "hip", "motor": "motor_a"}, {"group": "robot"} | mass]),
        table(BestRow, best),
        table(FrontRow, [mass, {"actuator_mass_kg": 2.0, "power_W": 20.0}]),
        table(DayRow, [{"mode": "walk", "group": "robot", "hours": 24.0, "winding_W": 12.0}]),
    ]
    out = tmp_path_factory.mktemp("choice")
    lines = ["Build **motor A**.", "How sure.", "What next."]
    ranges = {"robot": "Tytan", "quantity": "all", "unit": "W", "source": "nobody"}
    ranges |= {"measured": 236, "measured_to": 236, "least": 1.0, "likeliest": 2.9, "greatest": 8.0}
    named = {t.name: t for t in tables}
    robots = pd.DataFrame([ranges])
    more = {"title": "Which actuators", "measured": robots}
    assert write_choice_page(named, PARTS, lines, out, **more) == 3
    return out / "index.html"


def test_every_part_leads_to_its_source_and_others_are_left_out(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    for name in ("motor_a", "motor_b"):
        assert f'href="#part-{name}"' in text
        assert text.count(f'id="part-{name}"') == 1
    assert "motor_c" not in text
    assert "maker\u2019s page &lt;1&gt;" in text or "maker&#39;s page &lt;1&gt;" in text
    assert "<script src" not in text
    assert "http" not in re.sub(r"data:image/svg[^\"]*", "", text)
    assert {path.stem for path in page.parent.glob("*.svg")} == {"front_map", "day_energy"}


def test_other_robots_are_shown_and_said_to_be_no_blind_proof(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert "236" in text
    assert "bands set after a first comparison" in text
    assert "widths of the bands were set after the first comparison" in text


@needs_chromium
def test_headings_sort_and_the_field_filters_without_a_message(page: Path, tmp_path: Path) -> None:
    pressed = tmp_path / "pressed.html"
    text = page.read_text(encoding="utf-8").replace("</body>", f"{PRESSED}</body>")
    pressed.write_text(text, encoding="utf-8")
    options = ("--enable-logging=stderr", "--virtual-time-budget=3000", "--dump-dom")
    dom = run(tmp_path, *options, pressed.as_uri())  # refuses a message on the console
    found = re.search(r'<pre id="said">(.+?)</pre>', dom)
    assert found is not None
    before, up, down, sorted_as, filtered = json.loads(html.unescape(found[1]))
    assert before == ["1", "2", "3", "4"]
    assert up == ["1", "2", "4", "3"]  # as numbers, and what has none last
    assert down == ["4", "2", "1", "3"]
    assert sorted_as[0] == "descending"
    assert filtered == ["4", "2"]


@needs_chromium
def test_a_message_on_the_console_is_noticed(tmp_path: Path) -> None:
    bad = tmp_path / "bad.html"
    bad.write_text("<script>nothing.there</script>", encoding="utf-8")
    options = ("--enable-logging=stderr", "--virtual-time-budget=3000", "--dump-dom")
    with pytest.raises(AssertionError):
        run(tmp_path, *options, bad.as_uri())
