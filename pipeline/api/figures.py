"""Which figures a run draws, and from what."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from actuators.energy.energy import stage_energies
from pipeline.api.pictures.actuators import actuator_drawings
from pipeline.api.pictures.gait import legs_stretches
from pipeline.api.pictures.robot import robot_drawings, write_gait_steps
from pipeline.api.pictures.scene import Scenery
from pipeline.paper.judgement.fig_21 import EnergyPerMinute
from pipeline.paper.judgement.judge import Judgement
from pipeline.simulation.edited import IDEAL
from pipeline.simulation.settings import Settings
from pipeline.simulation.walk_stand import Standing, Walking
from reports.figures.energy.all_legs import ground_forces_figure, joint_torques_figure
from reports.figures.energy.electrical_energy import electrical_energy_figure
from reports.figures.energy.energy_per_minute import BreakEven, EnergyLine, energy_per_minute_figure
from reports.figures.energy.joint_demand import joint_demand_figure, stretches
from reports.figures.energy.motor_limits import SUBTITLE, common_scale, motor_limits_figure
from reports.figures.energy.stage_energy import energy_limits, stage_energy_figure
from reports.figures.several import Drawing, save_figures
from reports.figures.style import NARROW
from reports.pages.gait_words import gait_and_conditions
from reports.pages.names import leg_words, short_titles, shown_leg

Array = NDArray[np.float64]
#: File name of each subject's Fig. 21.
SUBJECT_TITLES = {
    "middle_legs": "both middle legs, as in Fig. 21",
    "robot_on_3_feet": "whole robot, standing on three feet",
    "robot_on_6_feet": "whole robot, standing on six feet",
}


def write_figures(
    given: Settings,
    standing: Standing,
    walking: Walking,
    out: Path,
    *,
    paper: bool = False,
    done: Callable[[float], None] | None = None,
) -> int:
    """Draw and save every figure of a run.

    Args:
        given: The run.
        standing: Its result.
        walking: Its result.
        out: Folder.
        paper: Whether the run is held against the paper, whose figures are then named.
        done: Told the share that is drawn.

    Returns:
        How many.
    """
    write_gait_steps(Scenery(given.robot), walking, out)
    every = drawings(given, standing, walking, paper=paper)
    return 1 + save_figures(every, out, done=done)


def drawings(
    given: Settings, standing: Standing, walking: Walking, *, paper: bool = False
) -> list[Drawing]:
    """Every figure of a run, the longest first, so that two processes end together."""
    return [
        *robot_drawings(Scenery(given.robot), standing, walking),
        *_energy(given, walking),
        *_all_legs(given, walking),
        *_demand(given, walking, paper),
        *actuator_drawings(given),
    ]


def _name(given: Settings) -> str:
    """Robot and gait, which every figure names."""
    return f"{given.robot.spec.name}, {gait_and_conditions(given.robot.spec)}"


def _joints(given: Settings) -> tuple[str, dict[str, str]]:
    """The leg that is shown, and its joints with their labels."""
    leg = shown_leg(given.robot)
    joints = next(entry.joints for entry in given.robot.spec.legs if entry.name == leg)
    return leg, {joint: f"joint {number}" for number, joint in enumerate(joints, start=1)}


def _demand(given: Settings, walking: Walking, paper: bool) -> list[Drawing]:
    leg, joints = _joints(given)
    sliding = dict(zip(given.robot.joints, given.robot.sliding, strict=True))
    return [
        Drawing(
            f"joint_demand_{joint}",
            partial(
                joint_demand_figure,
                joint,
                stretches(walking.demand, joint, leg),
                title=f"{label.capitalize()} of the {leg_words(leg)}: velocity and torque",
                subtitle=f"{_name(given)}: demand over one cycle"
                + (f", as in Fig. {number} of the paper" if paper else ""),
                slides=bool(sliding[joint]),
            ),
        )
        for number, (joint, label) in enumerate(joints.items(), start=2)
    ]


def _all_legs(given: Settings, walking: Walking) -> list[Drawing]:
    robot = given.robot
    parts = legs_stretches(robot, walking)
    slide = [name for name, one in zip(robot.joints, robot.sliding, strict=True) if one]
    legs = {leg.name: leg.joints for leg in robot.spec.legs}
    words = "a line is thin while its leg is in the air"
    return [
        Drawing(
            "joint_torques",
            partial(
                joint_torques_figure,
                parts,
                walking.demand.joints,
                legs,
                sliding=slide,
                title="Torque of every joint over one cycle",
                subtitle=f"{_name(given)}; {words}",
            ),
        ),
        Drawing(
            "ground_forces",
            partial(
                ground_forces_figure,
                parts,
                robot.leg_names,
                title="Ground forces and static stability over one cycle",
                subtitle=_name(given),
            ),
        ),
    ]


def _energy(given: Settings, walking: Walking) -> list[Drawing]:
    leg, labels = _joints(given)
    support = [
        (float(part.time[0]), float(part.time[-1]))
        for part in walking.demand.contacts
        if part is not None and leg in part.stance
    ]
    scale = common_scale([(r.motor, r.motors) for r in walking.results.values()], labels)
    stages = {name: stage_energies(result) for name, result in walking.results.items()}
    limits = energy_limits(stages.values(), labels)
    titles = short_titles(given.catalog)
    out, electrical = [], {}
    for name, result in walking.results.items():
        title = given.catalog.alternatives[name].title
        columns = [result.joint.joints.index(joint) for joint in labels]
        electrical[titles[name]] = stages[name][-1].forward[columns]
        out += [
            Drawing(
                f"motor_limits_{name}",
                partial(
                    motor_limits_figure,
                    result.motor,
                    result.motors,
                    labels,
                    support,
                    title=f"{title}: its motors, {leg_words(leg)}",
                    subtitle=f"{_name(given)}: {SUBTITLE}",
                    scale=scale,
                ),
            ),
            Drawing(
                f"stage_energy_{name}",
                partial(
                    stage_energy_figure,
                    stages[name],
                    labels,
                    places=given.catalog.alternatives[name].stage_names,
                    title=title,
                    subtitle=f"{_name(given)}: energy per cycle through each stage, "
                    f"{leg_words(leg)}; one scale for all alternatives",
                    limits=limits,
                ),
            ),
        ]
    return [*out, *_electrical(given, leg, list(labels.values()), electrical)]


def _electrical(
    given: Settings, leg: str, labels: list[str], electrical: dict[str, Array]
) -> list[Drawing]:
    """What every alternative draws, wide and narrow."""
    subtitle = (
        "returned energy is lost"
        if given.regeneration.policy == "none"
        else "what the motors draw; robot_energy.csv has what their return saves"
    )
    if IDEAL not in given.catalog.alternatives:
        subtitle += f"; no ratio: there is no alternative '{IDEAL}'"
    ideal = short_titles(given.catalog).get(IDEAL)
    figure = partial(electrical_energy_figure, labels, electrical, reference=ideal)
    wide = partial(
        figure,
        title=f"Electrical energy per cycle, {leg_words(leg)}",
        subtitle=f"{_name(given)}; {subtitle}",
    )
    narrow = partial(
        figure,
        title=f"Energy per cycle, {leg_words(leg)}",
        subtitle=f"\N{MULTIPLICATION SIGN}: times that of the {ideal}" if ideal else "",
        width=NARROW,
    )
    return [Drawing("electrical_energy", wide), Drawing("electrical_energy_narrow", narrow)]


def write_fig_21(judgement: Judgement, titles: dict[str, str], out: Path) -> int:
    """Energy per minute against the fraction of time standing, for every subject.

    Args:
        judgement: With its curves and crossings.
        titles: Alternative to its title.
        out: Folder.

    Returns:
        How many figures.
    """
    every = []
    crossings = {row.subject: row for row in judgement.break_even}
    for subject in SUBJECT_TITLES:
        curves = [c for c in judgement.per_minute if c.subject == subject]
        share, row = curves[0].fraction, crossings.get(subject)
        mark, note = None, ""
        if row is None:
            note = "no break-even: that is between the reversible and the irreversible actuator"
        elif np.isnan(row.fraction):
            note = row.note.split(";")[0]
        else:
            reference = next(c for c in curves if c.alternative == "reversible")
            energy = float(np.interp(row.fraction, share, reference.energy))
            known = (v if np.isfinite(v) else None for v in row.prior)
            mark = BreakEven(row.fraction, energy, *known)
        figure = partial(
            energy_per_minute_figure,
            share,
            [
                EnergyLine(
                    titles[c.alternative],
                    c.energy,
                    *(c.prior if c.prior is not None else (None, None)),
                    *(c.left_out if c.left_out is not None else (None, None)),
                )
                for c in curves
            ],
            title=f"Energy in one minute: {SUBJECT_TITLES[subject]}",
            subtitle=note or _bands(curves),
            break_even=mark,
        )
        every.append(Drawing(f"energy_per_minute_{subject}", figure))
    return save_figures(every, out)


def _bands(curves: list[EnergyPerMinute]) -> str:
    """What the lines and bands are."""
    if any(c.prior is None for c in curves):
        return "computed anew with changed numbers"
    return (
        "line: fitted; faint band: 95 % of what data sheets and literature say; strong band: "
        "fitted without the drive's own walking figure"
    )
