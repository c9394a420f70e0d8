"""The page of a choice of actuators: what to buy, pictures, tables, every part's source."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from reports.figures.choice import front_figure, plane_figure, standing_figure
from reports.figures.style import Drawings, save_figures
from reports.page import number, write_page

if TYPE_CHECKING:
    from pandas import DataFrame

_PARTS: Final = ("motor", "gear", "brake", "driver", "battery", "part")
#: Sections in their order: table, its heading, and its figures with their captions.
_SECTIONS: Final = {
    "answers": ("Robots to choose from",),
    "answer": ("The recommended robot, group by group",),
    "day": ("Where the day's energy goes",),
    "limits": ("Speed, torque and how near the limits are",
               ("motor_planes", "What the recommended actuators can give, what the day needs.")),
    "standing_share": ("Lock or not",
                       ("standing_share", "The best robot that locks, and that does not.")),
    "unknowns": ("What to measure next",),
    "alternatives": ("Alternatives for each group, and why they are not it",),
    "front": ("The front of energy and mass",),
}  # fmt: skip
#: Columns that the page leaves to the CSV, and tables that are drawn alone.
_LEFT: Final = {
    "day": ("share_of_day",),
    "answer": ("power_low_W", "power_high_W", "driver",
               "battery", "bus_V", "battery_h", "battery_kg"),
    "alternatives": ("nearest_limit", "price_EUR"),
    "answers": ("recommended", "price_EUR"),
}  # fmt: skip
_DRAWN: Final = ("standing_share", "limits")
_UNKNOWNS: Final = 15  # rows on the page


def write_choice_page(
    tables: Mapping[str, DataFrame],
    parts: DataFrame,
    out: Path,
    *,
    title: str,
    trust: tuple[str, str],
    buy: Sequence[str],
    notes: Sequence[str],
    measured: DataFrame,
) -> None:
    """Write pictures and ``index.html``.

    Args:
        tables: Of the choice, by name.
        parts: What each is and where its numbers come from (title, basis, source, note), by name;
            those that no table names are left out.
        out: Folder.
        title: Of the page.
        trust: What robots took over what is said, in a few words, and the sentence of it.
        buy: What to buy, a line for each group and the drivers.
        notes: What else the result says, a sentence each.
        measured: Measured over predicted power of other robots, a row for each quantity.
    """
    drawings: Drawings = {
        "front": partial(front_figure, tables["front"], tables["answers"]),
        "motor_planes": partial(plane_figure, tables["working_points"], tables["motor_outlines"]),
    }
    if "standing_share" in tables:
        drawings["standing_share"] = partial(standing_figure, tables["standing_share"])
    save_figures(drawings, out)
    # Rows of long tables: where each limit is used most, what matters most.
    limits, unknowns = tables["limits"], tables["unknowns"]
    most = limits.sort_values("use", ascending=False).drop_duplicates(["group", "limit"]).index
    first = (np.arange(len(unknowns)) < _UNKNOWNS).tolist()
    keep = {"limits": limits.index.isin(most).tolist(), "unknowns": first}
    named = {
        str(name)
        for table in tables.values()
        for column in _PARTS
        for name in table.get(column, ())
        if name in parts.index
    }
    ends = zip(measured["measured"], measured["measured_to"], strict=True)
    spans = [" to ".join(dict.fromkeys(map(number, pair))) for pair in ends]
    bands = measured[["robot", "quantity", "unit", "least", "likeliest", "greatest", "source"]]
    bands.insert(2, "measured", spans)
    missed = (measured["least"] > 1.0) | (measured["greatest"] < 1.0)
    whole = tables["answer"].iloc[-1].to_dict()
    shown = {name: table for name, table in tables.items() if len(table)}
    write_page(
        "choice",
        out,
        tables,
        title=title,
        figures=drawings,
        sections={name: own[0] for name, own in _SECTIONS.items() if name in shown}
        | {"parts": "Parts and their sources", "measured": "Robots whose power others measured"},
        pictures={name: own[1:] for name, own in _SECTIONS.items()},
        buy=buy,
        whole=whole,
        pack=parts["title"][whole["battery"]],
        best=tables["answers"].iloc[0].to_dict(),
        today=bool(tables["answers"]["answer"].str.startswith("today").any()),
        trust=trust,
        notes=notes,
        drawn=_DRAWN,
        keep=keep,
        bars=limits.pivot_table("use", ["group", "limit"], "kind", "max", sort=False),
        columns={
            n: [c for c in map(str, t) if c not in _LEFT.get(n, ())] for n, t in shown.items()
        },
        parts=parts.loc[sorted(named)].rename_axis("part").reset_index(),
        measured=bands,
        missed=int(missed.sum()),
    )
