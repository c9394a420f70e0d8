"""The page of a choice of actuators: what to buy, pictures, tables, every part's source."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from textwrap import shorten
from typing import TYPE_CHECKING, Final

import numpy as np

from reports.figures.style import (
    BLUE,
    CYCLE,
    GREEN,
    INK,
    ORANGE,
    QUIET,
    VERMILION,
    Drawings,
    house_style,
    key,
    new_figure,
    save_figures,
)
from reports.page import number, write_page

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

_MARKS = {"moves": (".", BLUE), "load case": ("x", ORANGE), "stands": ("o", VERMILION)}


@house_style()
def front_figure(front: DataFrame, answers: DataFrame) -> Figure:
    """The Pareto front of mass and mean power, with the answers and today's, by their tables."""
    figure = new_figure(
        3.8,
        "Less mass costs energy",
        "Pareto front of mass and mean power; open markers exceed a limit",
    )
    axes = figure.subplots()
    order = front.sort_values("actuator_mass_kg")
    axes.plot(order["actuator_mass_kg"], order["power_W"], "o-", color=BLUE, markersize=3)
    middle = order["actuator_mass_kg"].mean()
    known = answers[answers["actuator_mass_kg"] > 0]  # of some of today's it is not stated
    for _, rows in known.groupby(["actuator_mass_kg", "power_W"], sort=False):
        row, best = rows.iloc[0], rows["recommended"].any()
        today, at = row["answer"].startswith("today"), (row["actuator_mass_kg"], row["power_W"])
        color = QUIET if today else VERMILION if best else INK
        over, size = bool(row["limit_use"] > 1.0), 7 if best else 5
        axes.plot(
            *at, "s" if today else "D", color=color, markersize=size, mfc="none" if over else None
        )
        words = ", ".join(rows["answer"]) + " (recommended)" * int(best)
        note = axes.annotate(words, at, (6, 5), textcoords="offset points", color=color)
        free = best and at[0] > middle and rows["answer"].isin(front["answer"]).any()
        below = {"position": (-7, -13), "ha": "right"} if free else {}
        note.set(fontsize=8.5, **below)
    axes.margins(x=0.18, y=0.12)
    axes.set_xlabel("mass of all actuators [kg]")
    axes.set_ylabel("mean power over the day [W]")
    return figure


@house_style()
def standing_figure(rows: DataFrame) -> Figure:
    """Mean power of the best robot of each family, by table ``standing_share``."""
    figure = new_figure(3.6, "Lock or not", "each robot chosen anew at every share of standing")
    axes = figure.subplots()
    for (name, own), color in zip(rows.groupby("family", sort=False), CYCLE, strict=False):
        style = "--" if name == "any" else "-"
        axes.plot(100 * own["share"], own["power_W"], style, marker=".", color=color, label=name)
    axes.set_xlabel("share of the time standing [%]")
    axes.set_ylabel("mean power [W]")
    axes.set_ylim(bottom=0)
    figure.legend(loc="outside lower center", ncols=3)
    return figure


@house_style()
def plane_figure(points: DataFrame, outlines: DataFrame) -> Figure:
    """What each group's actuator can give over speed at the joint, and where the day needs it.

    `points`: table ``working_points``. `outlines`: table ``motor_outlines``.
    """
    groups = [*dict.fromkeys(points["group"])]
    figure = new_figure(2.7 * len(groups) + 1.0, "What the actuators can give, at the joint",
                        "magnitudes, driving; margins included")  # fmt: skip
    panels = figure.subplots(len(groups), 1, squeeze=False)[:, 0]
    for axes, group in zip(panels, groups, strict=True):
        lines = outlines[outlines["group"] == group]
        for (name, curve), own in lines.groupby(["design", "curve"], sort=False):
            speed, torque = own["speed_rad_s"], own["torque_Nm"]
            if not own["recommended"].iloc[0]:
                axes.plot(speed, torque, color=QUIET, lw=0.9, ls=":", label="next best, peak")
                continue
            color = GREEN if curve == "continuous" else INK
            style = "--" if curve == "momentary" else "-"
            axes.plot(speed, torque, style, color=color, lw=1.4, label=str(curve))
            if curve == "continuous":
                axes.fill_between(speed, torque, color="#dff3ec")
            axes.set_title(f"{group}: {shorten(str(name), 44)}", fontsize=9)
        own = points[points["group"] == group]
        for kind, (mark, color) in _MARKS.items():
            some = own[own["kind"] == kind]
            at = np.abs(some["speed_rad_s"]), np.abs(some["torque_Nm"])
            size, face = (7, "none") if mark == "o" else (4, color)
            axes.plot(*at, mark, color=color, ms=size, mfc=face, label=kind, clip_on=False)
        fastest = np.abs(own["speed_rad_s"]).max()
        reach, most = lines.loc[lines["recommended"], ["speed_rad_s", "torque_Nm"]].max()
        axes.set_xlim(-0.02 * fastest, min(reach * 1.02, 2.5 * fastest) if fastest else reach)
        axes.set_ylim(0, 1.08 * most)
        axes.set_ylabel("torque [N·m]")
    panels[-1].set_xlabel("joint speed [rad/s]")
    key(figure, 3)
    return figure


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
