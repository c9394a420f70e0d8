"""The page of measured robots, with its tables and figure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import pandas as pd

from pipeline.api.result import by_name, run_meta
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
from reports.figures.bars import Range, ranges_figure
from reports.figures.save import save_figures
from reports.folder import staged
from reports.forms import write_pages
from reports.page import FigureBlock, Page, Section, table_block
from reports.table import Table, table_of
from reports.typeset import number
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


def write_measured(out: Path, decimal: str = ".", folder: Path = FACTS) -> list[str]:
    """Predict every measured robot, write tables, figure and page; return lines for a terminal.

    Raises:
        PipelineError: Facts or a robot cannot be used.
        ReportError: `out` cannot be written.
    """
    every = read_facts(folder)
    found = {
        name: {q.name: predicted(facts, q) for q in facts.quantity if q.does}
        for name, facts in every.items()
    }
    tables = tables_of(every, found)
    inputs = [*sorted(folder.glob("*.toml")), *(ROBOTS / f.robot for f in every.values())]
    meta = run_meta(inputs, ("legwatt",))
    with staged(out, "measured", decimal=decimal) as target:
        for table in tables.values():
            write_table(table, target, meta=meta, decimal=decimal)
        save_figures({FIGURE: lambda: _figure(tables["measured"])}, target)
        write_pages(_page(every, tables, target), target)
    lines = [text.replace("**", "") for text in _sentences(tables["measured"])]
    return [*lines, f"3 tables, a figure and index.html in {out}"]


def tables_of(every: Mapping[str, Facts], found: Mapping[str, Predictions]) -> dict[str, Table]:
    """The three tables of facts, and of predictions by quantity, by robot."""
    kinds = ((Measured, measured_rows), (UnknownMoves, unknown_rows), (MeasuredRatio, ratio_rows))
    tables = [
        table_of(kind, [row for name, facts in every.items() for row in rows(facts, found[name])])
        for kind, rows in kinds
    ]
    return by_name(tables)


def _page(every: Mapping[str, Facts], tables: Mapping[str, Table], folder: Path) -> Page:
    measured, unknowns = tables["measured"], tables["unknowns"]
    ratios = (table_block(tables["measured_ratios"]),)
    sections = [Section("Ratios, in which much of what is not known cancels", ratios)]
    columns = ("quantity", "measured_W", "measured_to_W", "low_W", "nominal_W", "high_W", "note")
    moves = ("quantity", "unknown", "low", "high", "moves_by_W")
    for facts in every.values():
        own, moved = (
            [robot == facts.title for robot in table.columns["robot"]]
            for table in (measured, unknowns)
        )
        assumed = zip(measured.columns["assumed"], own, strict=True)
        likeliest = dict.fromkeys(text for text, mine in assumed if mine and text)
        blocks: tuple[Any, ...] = (
            f"Measured: {facts.source}. {facts.note}",
            table_block(measured, columns, keep=own, digits=3),
            *(f"**Likeliest:** {text}." for text in likeliest),
            table_block(unknowns, moves, keep=moved, digits=3),
        )
        sections.append(Section(facts.title, blocks))
    return Page(
        title="Electrical power of measured robots, predicted before any fit",
        answer=(*_sentences(measured), *ANSWER),
        picture=FigureBlock(folder / f"{FIGURE}.svg", alt="Ranges predicted and power measured."),
        sections=tuple(sections),
        files={f"{t.name}.csv": t.description for t in tables.values()},
        footer="Every CSV has a .meta.json beside it: meanings, units, input hashes, versions.",
    )


def _computed(measured: Table) -> Iterator[tuple[str, str, list[float], list[float]]]:
    """Robot, quantity, watts predicted (least, likeliest, greatest) and measured of each row."""
    for row in measured.frame().to_dict("records"):
        if pd.notna(row["nominal_W"]):
            watts = [row["measured_W"], row["measured_to_W"]]
            span = [float(row[name]) for name in ("low_W", "nominal_W", "high_W")]
            yield row["robot"], row["quantity"], span, [float(w) for w in watts if pd.notna(w)]


def _sentences(measured: Table) -> list[str]:
    """What is predicted and measured of each robot's first computed quantity."""
    first: dict[str, str] = {}
    for robot, quantity, (low, nominal, high), watts in _computed(measured):
        told = f"{' to '.join(map(number, watts))} W" if watts else "not told"
        first.setdefault(
            robot,
            f"{robot}, {quantity}: predicted **{number(low)} to {number(high)} W** "
            f"(likeliest {number(nominal)} W), measured **{told}**.",
        )
    return list(first.values())


def _figure(measured: Table) -> Figure:
    rows = [
        Range(f"{robot}:\n{fill(quantity, 24)}", (span[0], span[1], span[2]), watts)
        for robot, quantity, span, watts in _computed(measured)
    ]
    return ranges_figure(
        rows, title="Predicted before any fit, and measured", unit="electrical power [W]"
    )
