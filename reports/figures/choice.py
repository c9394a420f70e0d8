"""Figures of a choice: its front, the share of standing, the plane of speed and torque."""

from __future__ import annotations

from textwrap import shorten
from typing import TYPE_CHECKING

import numpy as np

from reports.figures.style import (
    BLUE,
    CYCLE,
    GREEN,
    INK,
    ORANGE,
    QUIET,
    VERMILION,
    house_style,
    key,
    new_figure,
)

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
