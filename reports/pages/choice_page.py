"""The page of a choice of actuators: the answer, pictures, tables to sort, every part's source."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from reports.figures.bars import day_figure
from reports.figures.break_even import front_figure
from reports.figures.save import save_figures
from reports.forms import write_pages
from reports.page import FOOTER, Block, FigureBlock, Page, Section, TableBlock, table_block
from reports.table import Table

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

ANCHOR: Final = "part-"
_PARTS: Final = ("motor", "gear", "brake", "driver", "battery", "part")
_LOSSES: Final = {
    "mechanical": "mechanical_W",
    "windings": "winding_W",
    "gears and rotors": "friction_W",
    "drivers": "driver_W",
    "brakes": "brakes_W",
    "returned and lost": "returned_W",
    "idle and electronics": "idle_W",
}
_HEADINGS: Final = {
    "answer": "The answer, group by group",
    "ten_best": "The ten best of each group, and why the others lost",
    "front": "Robots that none beats in energy and mass",
    "unknowns": "What to measure next",
    "day": "The day, mode by mode",
    "excluded": "What the limits forbid",
    "reversible_or_not": "Can be driven back, or locks",
}
_MEASURED: Final = "Robots whose power others measured: bands set after a first comparison"
#: Columns that the page leaves to the CSV.
_LEFT: Final = {
    "day": ("mechanical_W", "returned_W", "gear_rms_Nm", "gear_continuous_Nm", "gear_peak_Nm",
            "gear_most_Nm", "voltage_V", "most_voltage_V", "share_of_day", "peak_current_A",
            "most_current_A", "speed_rad_s", "most_speed_rad_s"),
    "answer": ("not_printed", "searched_power_W"),
    "ten_best": ("not_printed", "nominal_power_W"),
}  # fmt: skip


@dataclass(frozen=True)
class PartSource:
    """Where the numbers of a part come from."""

    title: str  #: What it is.
    basis: str  #: Of its numbers.
    source: str  #: Where they were read.
    note: str = ""  #: What is doubtful or filled in.


def write_choice_page(
    tables: Mapping[str, Table],
    parts: Mapping[str, PartSource],
    lines: Sequence[str],
    out: Path,
    *,
    title: str,
    measured: pd.DataFrame | None = None,
) -> int:
    """Write pictures and ``index.html``.

    Args:
        tables: Of the choice, by name, rows as in `reports.tables.choice`; at least the answer.
        parts: By name; those that no table names are left out.
        measured: Predicted over measured power of other robots, a row for each quantity.

    Returns:
        How many files.
    """
    drawings = _drawings(tables)
    files = save_figures(drawings, out) if drawings else 0
    named = {
        str(name)
        for table in tables.values()
        for column in _PARTS
        for name in table.columns.get(column, ())
        if name in parts
    }
    sections = []
    for name, heading in _HEADINGS.items():
        if name not in tables or not tables[name].rows:
            continue
        blocks: list[Block] = [_sortable(tables[name], named)]
        if f"{name}_energy" in drawings:
            blocks.insert(0, FigureBlock(out / f"{name}_energy.svg", alt=heading, half=True))
        sections.append(Section(heading, tuple(blocks)))
    if named:
        sections.append(Section("Parts and their sources", _sources(parts, named)))
    if measured is not None:
        sections.append(Section(_MEASURED, _measured(measured)))
    picture = FigureBlock(out / "front_map.svg", alt=_HEADINGS["front"])
    page = Page(
        title=title,
        answer=tuple(lines),
        picture=picture if "front_map" in drawings else None,
        sections=tuple(sections),
        files={f"{n}.csv": t.description or _HEADINGS.get(n, "") for n, t in tables.items()},
        footer=FOOTER,
    )
    write_pages(page, out)
    return files + 1


def _sortable(table: Table, named: set[str]) -> TableBlock:
    """A table to sort and filter, whose parts lead to their sources."""
    columns = [c for c in table.columns if c not in _LEFT.get(table.name, ())]
    block = table_block(table, columns, digits=3)
    rows = tuple(
        tuple(
            f"[{value}](#{ANCHOR}{value})" if column in _PARTS and value in named else value
            for column, value in zip(columns, row, strict=True)
        )
        for row in block.rows
    )
    return replace(block, rows=rows, sortable=True)


def _sources(parts: Mapping[str, PartSource], named: set[str]) -> tuple[Block, ...]:
    rows = tuple(
        (name, parts[name].title, parts[name].basis, parts[name].source, parts[name].note)
        for name in sorted(named)
    )
    table = TableBlock(
        ("part", "what it is", "basis", "source", "note"),
        rows,
        "Where the numbers of every part on this page come from.",
        sortable=True,
        anchor=ANCHOR,
    )
    return "What no sheet prints is a range of the part's class; the note says so.", table


def _measured(robots: pd.DataFrame) -> tuple[Block, ...]:
    rows = tuple(
        (
            own["robot"],
            own["quantity"],
            " to ".join(f"{x:g}" for x in dict.fromkeys((own["measured"], own["measured_to"]))),
            "" if own["unit"] == "1" else own["unit"],
            *(own["least"], own["likeliest"], own["greatest"]),
            own["source"],
        )
        for own in robots.to_dict("records")
    )
    headings = ("robot", "power, or quotient of two", "measured", "unit")
    text = (
        "The same model's power of other robots, predicted over measured: 1 is as measured. "
        "Nothing was fitted to them, but **the widths of the bands were set after the first "
        "comparison**, which lay above the measurements: ground forces towards the hips, slower "
        "trots and an upright Tytan were added to what is varied. A band around 1 is therefore no "
        "blind proof."
    )
    caption = "From the least to the greatest over everything that is not published of a robot."
    more = ("least", "likeliest", "greatest", "who measured")
    return text, TableBlock((*headings, *more), rows, caption, digits=2)


def _drawings(tables: Mapping[str, Table]) -> dict[str, Callable[[], Figure]]:
    """What makes each picture, of the tables that there are."""
    out: dict[str, Callable[[], Figure]] = {}
    if "front" in tables and tables["front"].rows:
        out["front_map"] = lambda: _front(tables["front"], tables["answer"])
    if "day" in tables and tables["day"].rows:
        out["day_energy"] = lambda: _day(tables["day"])
    return out


def _front(front: Table, answer: Table) -> Figure:
    columns = ["actuator_mass_kg", "power_W"]
    mass, power = front.frame()[columns].to_numpy(float).T
    chosen = answer.frame().query("group == 'robot'")[columns].to_numpy(float)[0]
    return front_figure(mass, power, (float(chosen[0]), float(chosen[1])))


def _day(day: Table) -> Figure:
    """Energy of each mode of the groups together; the hotel load is the robot's."""
    modes = day.frame().query("group == 'robot'")
    hours = modes["hours"].to_numpy(float)
    energy = {name: hours * modes[column].to_numpy(float) for name, column in _LOSSES.items()}
    taken = {name: own for name, own in energy.items() if np.abs(own).max() > 0}
    return day_figure(list(map(str, modes["mode"])), taken, hours.tolist())
