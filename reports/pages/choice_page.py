"""The page of a choice of actuators: the answer, pictures, tables, every part's source."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from pipeline.columns import about
from reports.figures.bars import day_figure
from reports.figures.lines import front_figure
from reports.figures.style import save_figures
from reports.page import Block, FigureBlock, Page, Section, TableBlock, table_block, write_page

if TYPE_CHECKING:
    from pandas import DataFrame

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

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
    "answers": "Least power, knee and lightest",
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
    tables: Mapping[str, DataFrame],
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
        for name in table.get(column, ())
        if name in parts
    }
    sections = []
    for name, heading in _HEADINGS.items():
        if name not in tables or tables[name].empty:
            continue
        figures = [f"{name}_map", f"{name}_energy"] if name != "front" else []
        columns = [str(c) for c in tables[name] if c not in _LEFT.get(name, ())]
        blocks: list[Block] = [FigureBlock(f, f"{heading}.") for f in figures if f in drawings]
        sections.append(Section(heading, (*blocks, table_block(tables, name, columns, digits=3))))
    if named:
        headers = ("part", "what it is", "basis", "source", "note")
        caption = (
            "Where the numbers of every part on this page come from. What no sheet prints is a "
            "range of the part's class; the note says so."
        )
        known = [(name, parts[name]) for name in sorted(named)]
        rows = tuple((name, p.title, p.basis, p.source, p.note) for name, p in known)
        sections.append(Section("Parts and their sources", (TableBlock(headers, rows, caption),)))
    if measured is not None:
        sections.append(Section(_MEASURED, _measured(measured)))
    page = Page(
        title=title,
        answer=tuple(lines),
        picture=FigureBlock("front_map", f"{_HEADINGS['front']}.")
        if "front_map" in drawings
        else None,
        sections=tuple(sections),
        files={f"{n}.csv": about(n) or _HEADINGS.get(n, "") for n in tables},
    )
    write_page(page, out)
    return files + 1


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


def _drawings(tables: Mapping[str, DataFrame]) -> dict[str, Callable[[], Figure]]:
    """What makes each picture, of the tables that there are."""
    frames = {name: table for name, table in tables.items() if len(table)}
    out: dict[str, Callable[[], Figure]] = {}
    if "front" in frames:
        columns = ["actuator_mass_kg", "power_W"]
        mass, power = frames["front"][columns].to_numpy(float).T
        answer = frames["answer"].query("group == 'robot'")[columns].to_numpy(float)[0]
        out["front_map"] = partial(front_figure, mass, power, (float(answer[0]), float(answer[1])))
    if "day" in frames:  # the modes of the groups together; the hotel load is the robot's
        modes = frames["day"].query("group == 'robot'")
        hours = modes["hours"].to_numpy(float)
        energy = {name: hours * modes[column].to_numpy(float) for name, column in _LOSSES.items()}
        taken = {name: own for name, own in energy.items() if np.abs(own).max() > 0}
        out["day_energy"] = partial(day_figure, [*map(str, modes["mode"])], taken, hours.tolist())
    return out
