"""Which figures a run draws, and from what."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from pipeline.motion.gait import gait_of, gait_table
from pipeline.simulation.machine import Machine
from pipeline.simulation.walk_stand import IDEAL, Standing, Walking
from reports.figures.demand import (
    gait_figure,
    ground_forces_figure,
    joint_demand_figure,
    motor_limits_figure,
)
from reports.figures.energy import (
    electrical_energy_figure,
    energy_per_minute_figure,
    stage_energy_figure,
)
from reports.figures.robot import robot_figure
from reports.figures.style import Drawings
from reports.pages.robot_page import conditions, gait_and_conditions, short_titles, shown_leg

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame


def drawings(
    given: Machine, standing: Standing, walking: Walking, tables: Mapping[str, DataFrame]
) -> Drawings:
    """Every figure of a run, of its results and the tables of both."""
    spec, gait = given.robot.spec, gait_of(given.robot.spec)
    demand, contacts = tables["walking_joint_demand"], tables["walking_contact_forces"]
    legs = {leg.name: leg.joints for leg in spec.legs}
    places = [part.position for part in walking.demand.contacts if part is not None]
    feet = dict(zip(legs, np.moveaxis(np.concatenate(places), 1, 0), strict=True))
    subtitle = f"{_name(given)}; a line is thin while its leg is in the air"
    path = "; ".join((f"transfer path '{gait.table.transfer_path}'", *conditions(spec)))
    title = "Velocity and torque of every joint over one cycle"
    return {
        "robot": partial(_robot, given, standing),
        "gait": partial(
            gait_figure, contacts, feet, title=f"{spec.name}: {gait.title}", subtitle=path
        ),
        "joint_demand": partial(
            joint_demand_figure, demand, contacts, legs, title=title, subtitle=subtitle
        ),
        "ground_forces": partial(
            ground_forces_figure, contacts, [*legs], title="Ground forces", subtitle=subtitle
        ),
        **_energy(given, walking, tables["walking_stage_energy"]),
    }


def _name(given: Machine) -> str:
    """Robot and gait, which every figure names."""
    return f"{given.robot.spec.name}, {gait_and_conditions(given.robot.spec)}"


def _robot(given: Machine, standing: Standing) -> Figure:
    """The standing robot; dimensions are true along the ground's axes."""
    robot, words = given.robot, ["arrows: axes, positive rotation is right-handed about them"]
    table, posture = gait_table(robot.spec), standing.segment.configuration[0].copy()
    if len(standing.segment.stance) < len(robot.leg_names):
        words.append("the other feet are lifted to mid-transfer")
    if table.slope_forward or table.slope_left:
        back = Rotation.from_matrix(table.ground.T)
        posture[:3] = back.apply(posture[:3])
        posture[3:7] = (back * Rotation.from_quat(posture[3:7])).as_quat()
        words.append("drawn along the ground, which is inclined")
    return robot_figure(
        robot,
        posture,
        title=f"{robot.spec.name}, {standing.segment.name}",
        subtitle="; ".join(words),
    )


def _energy(given: Machine, walking: Walking, stages: DataFrame) -> Drawings:
    """What one leg takes, stage by stage, and its motors within their limits."""
    leg, titles = shown_leg(given.robot), short_titles(given.catalog)
    joints = next(entry.joints for entry in given.robot.spec.legs if entry.name == leg)
    labels = {joint: f"joint {number}" for number, joint in enumerate(joints, start=1)}
    out: Drawings = {}
    electrical = {}
    for name, own in stages.groupby("alternative", sort=False):
        title, result = titles[str(name)], walking.results[str(name)]
        last = own[own["stage"] == own["stage"].iloc[-1]].set_index("joint")
        electrical[titles[str(name)]] = last.loc[[*joints], "forward_J"].to_numpy()
        words: dict[str, Any] = {"title": f"{title}: its motors, leg {leg}"}
        words["subtitle"] = f"{_name(given)}: one cycle; rms over it and its limit above [N·m]"
        motors = result.motor, result.motors, labels
        out[f"motor_limits_{name}"] = partial(motor_limits_figure, *motors, **words)
        words = {"title": title}
        words["subtitle"] = f"{_name(given)}: energy per cycle at each stage, leg {leg}"
        out[f"stage_energy_{name}"] = partial(stage_energy_figure, own, labels, **words)
    lost = given.options.regeneration == "none"
    kept = "what the motors draw; robot_energy.csv has what their return saves"
    subtitle = f"{_name(given)}: one cycle; {'returned energy is lost' if lost else kept}"
    out["electrical_energy"] = partial(
        electrical_energy_figure,
        list(labels.values()),
        electrical,
        reference=titles.get(IDEAL),
        title=f"Electrical energy, leg {leg}",
        subtitle=subtitle,
    )
    return out


def fig_21(tables: Mapping[str, DataFrame], titles: dict[str, str]) -> Drawings:
    """Energy per minute of both middle legs against the fraction of time standing.

    Args:
        tables: Of the judgement, with its lines and their crossing.
        titles: Drivetrain option to its title.
    """
    lines, crossing = tables["energy_per_minute"], tables["break_even"].iloc[0].to_dict()
    known = bool(np.isfinite(crossing["standing_fraction"]))
    bands = (
        "computed anew with changed numbers"
        if lines["prior_low_J"].isna().any()
        else "line: fitted; thin bar: 95 % of what data sheets and literature say; thick bar: "
        "fitted without the drive's own walking figure"
    )
    draw = partial(
        energy_per_minute_figure,
        lines,
        titles,
        title="Energy in one minute: both middle legs, as in Fig. 21",
        subtitle=bands if known else str(crossing["note"]).split(";")[0],
        crossing=crossing if known else None,
    )
    return {"energy_per_minute_middle_legs": draw}
