"""The page of measured robots, with its tables and figure."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

from pipeline.measured.evaluate import ROBOTS, predicted
from pipeline.measured.facts import FACTS, Facts, read_facts
from pipeline.measured.tables import (
    Measured,
    MeasuredRatio,
    Predictions,
    UnknownMoves,
    measured_rows,
    ratio_rows,
    unknown_rows,
)
from pipeline.progress import Progress
from reports.figures.ranges import Range, ranges_figure
from reports.figures.save import save_figures
from reports.folder import staged
from reports.html import write_html
from reports.page import FigureBlock, Page, Section, Text, table_block
from reports.table import Table, table_of
from reports.typeset import number_text
from reports.writer import write_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIGURE = "measured"
ANSWER = (
    "**No number was fitted.** Every watt is computed from robot files and actuator files as they "
    "are; no watt is a pass mark. Ground forces towards the hips, slower trots and an upright "
    "Tytan were added to what is varied after a first comparison lay above the measurements.",
    "**The range** is the least and the greatest of every combination of what is not published; "
    "the likeliest of each is listed with it. Where the measured power lies outside, something is "
    "missing that the page does not vary.",
    "**Not varied:** the body keeps its height and the feet go on straight paths, while the "
    "measured controllers were trained to take little power. On two feet the moment about their "
    "line, by which the body rocks, is left out.",
)


def write_measured(
    out: Path,
    decimal: str = ".",
    progress: Progress | None = None,
    folder: Path = FACTS,
) -> list[str]:
    """Predict every measured robot, and write tables, figure and page.

    Args:
        out: Folder to write.
        decimal: As for `write_table`.
        progress: Told what is being done.
        folder: Of the facts.

    Returns:
        Lines for a terminal.

    Raises:
        PipelineError: Facts or a robot cannot be used.
        ReportError: `out` cannot be written.
    """
    every = read_facts(folder)
    found = {
        name: {q.name: predicted(facts, q, progress) for q in facts.quantity if q.does}
        for name, facts in every.items()
    }
    tables = tables_of(every, found)
    inputs = [*sorted(folder.glob("*.toml")), *(ROBOTS / f.robot for f in every.values())]
    meta = {
        "inputs_sha256": {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in inputs},
        "versions": {"legwatt": version("legwatt")},
    }
    with staged(out, "measured") as target:
        for table in tables.values():
            write_table(table, target, meta=meta, decimal=decimal)
        save_figures({FIGURE: lambda: _figure(tables["measured"])}, target)
        write_html(page(every, tables, target), target / "index.html")
    return [*_lines(tables["measured"]), f"3 tables, a figure and index.html in {out}"]


def tables_of(every: Mapping[str, Facts], found: Mapping[str, Predictions]) -> dict[str, Table]:
    """The three tables.

    Args:
        every: Facts by robot.
        found: Predictions by robot and quantity.
    """
    rows: list[tuple[Any, Any]] = [
        (Measured, measured_rows),
        (UnknownMoves, unknown_rows),
        (MeasuredRatio, ratio_rows),
    ]
    tables = [
        table_of(kind, [row for name, facts in every.items() for row in make(facts, found[name])])
        for kind, make in rows
    ]
    return {table.name: table for table in tables}


def page(every: Mapping[str, Facts], tables: Mapping[str, Table], folder: Path) -> Page:
    """The page.

    Args:
        every: Facts by robot.
        tables: From `tables_of`.
        folder: That holds the figure.
    """
    measured, unknowns = tables["measured"], tables["unknowns"]
    sections = [
        Section(
            "Ratios, in which much of what is not known cancels",
            (table_block(tables["measured_ratios"]),),
        )
    ]
    columns = ("quantity", "measured_W", "measured_to_W", "low_W", "nominal_W", "high_W", "note")
    moves = ("quantity", "unknown", "low", "high", "moves_by_W")
    for facts in every.values():
        mine, moved = (
            [robot == facts.title for robot in table.columns["robot"]]
            for table in (measured, unknowns)
        )
        said = zip(measured.columns["assumed"], mine, strict=True)
        likeliest = dict.fromkeys(text for text, own in said if own and text)
        sections.append(
            Section(
                facts.title,
                (
                    Text(f"Measured: {facts.source}. {facts.note}"),
                    table_block(measured, columns, keep=mine, digits=3),
                    *(Text(f"**Likeliest:** {text}.") for text in likeliest),
                    table_block(unknowns, moves, keep=moved, digits=3),
                ),
            )
        )
    return Page(
        title="Electrical power of measured robots, predicted before any fit",
        answer=(*_sentences(measured), *ANSWER),
        picture=FigureBlock(folder / f"{FIGURE}.svg", alt="Ranges predicted and power measured."),
        sections=tuple(sections),
        files={f"{t.name}.csv": t.description for t in tables.values()},
        footer="Every CSV has a .meta.json beside it: meanings, units, input hashes, versions.",
    )


def _computed(measured: Table) -> list[dict[str, Any]]:
    """Rows of which something is predicted."""
    columns = list(measured.columns.values())
    rows = [dict(zip(measured.columns, row, strict=True)) for row in zip(*columns, strict=True)]
    return [row for row in rows if row["nominal_W"] is not None]


def _watts(row: Mapping[str, Any], *names: str) -> str:
    shown = [number_text(float(row[name])) for name in names if row[name] is not None]
    return f"{' to '.join(shown)} W"


def _sentences(measured: Table) -> tuple[str, ...]:
    """What is predicted and measured of each robot's first computed quantity."""
    first: dict[str, str] = {}
    for row in _computed(measured):
        told = _watts(row, "measured_W", "measured_to_W") if row["measured_W"] else "not told"
        likely = _watts(row, "nominal_W")
        first.setdefault(
            str(row["robot"]),
            f"{row['robot']}, {row['quantity']}: predicted **{_watts(row, 'low_W', 'high_W')}** "
            f"(likeliest {likely}), measured **{told}**.",
        )
    return tuple(first.values())


def _lines(measured: Table) -> list[str]:
    return [text.replace("**", "") for text in _sentences(measured)]


def _figure(measured: Table) -> Figure:
    rows = []
    for row in _computed(measured):
        watts = [float(row[n]) for n in ("measured_W", "measured_to_W") if row[n] is not None]
        label = f"{row['robot']}:\n{fill(str(row['quantity']), 24)}"
        span = (float(row["low_W"]), float(row["nominal_W"]), float(row["high_W"]))
        rows.append(Range(label, span, watts))
    return ranges_figure(
        rows, title="Predicted before any fit, and measured", unit="electrical power [W]"
    )
