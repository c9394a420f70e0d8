"""The page of a choice of actuators: the answer, pictures, tables, every part's source."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from reports.figures.bars import day_figure
from reports.figures.lines import front_figure
from reports.figures.style import save_figures
from reports.page import write_page
from reports.typeset import number

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

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
#: Tables that have a section each where they have rows.
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
    measured: DataFrame,
) -> int:
    """Write pictures and ``index.html``.

    Args:
        tables: Of the choice, by name; at least the answer.
        parts: By name; those that no table names are left out.
        lines: The answer in words.
        out: Folder.
        title: Of the page.
        measured: Predicted over measured power of other robots, a row for each quantity.

    Returns:
        How many files.
    """
    import pandas

    drawings = _drawings(tables)
    files = save_figures(drawings, out)
    named = {
        str(name)
        for table in tables.values()
        for column in _PARTS
        for name in table.get(column, ())
        if name in parts
    }
    sources = [{"part": name} | asdict(parts[name]) for name in sorted(named)]
    ends = zip(measured["measured"], measured["measured_to"], strict=True)
    spans = [" to ".join(dict.fromkeys(map(number, pair))) for pair in ends]
    bands = measured[["robot", "quantity", "unit", "least", "likeliest", "greatest", "source"]]
    bands.insert(2, "measured", spans)
    write_page(
        "choice",
        out,
        tables,
        title=title,
        answer=lines,
        figures=drawings,
        sections={name: text for name, text in _HEADINGS.items() if len(tables.get(name, ()))}
        | {"parts": "Parts and their sources", "measured": "Robots whose power others measured"},
        whole=_robot(tables["answer"]).iloc[0].to_dict(),
        columns={
            n: [c for c in map(str, t) if c not in _LEFT.get(n, ())] for n, t in tables.items()
        },
        parts=pandas.DataFrame(sources),
        measured=bands,
    )
    return files + 1


def _robot(table: DataFrame) -> DataFrame:
    """Rows of the whole robot."""
    return table[table["group"] == "robot"]


def _drawings(tables: Mapping[str, DataFrame]) -> dict[str, Callable[[], Figure]]:
    """What makes each picture, of the tables that there are."""
    out: dict[str, Callable[[], Figure]] = {}
    if len(tables.get("front", ())):
        columns = ["actuator_mass_kg", "power_W"]
        mass, power = tables["front"][columns].to_numpy(float).T
        answer = _robot(tables["answer"])[columns].to_numpy(float)[0]
        out["front_map"] = partial(front_figure, mass, power, (float(answer[0]), float(answer[1])))
    if len(tables.get("day", ())):  # the groups together; the electronics' load is the robot's
        modes = _robot(tables["day"])
        hours = modes["hours"].to_numpy(float)
        energy = {name: hours * modes[column].to_numpy(float) for name, column in _LOSSES.items()}
        taken = {name: own for name, own in energy.items() if np.abs(own).max() > 0}
        out["day_energy"] = partial(day_figure, [*map(str, modes["mode"])], taken, hours.tolist())
    return out
