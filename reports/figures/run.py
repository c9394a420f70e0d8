"""Which figures a run draws, and from what."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from actuators.arrays import Array
from actuators.energy.energy import stage_energies
from pipeline.motion.gait import gait_of, gait_table
from pipeline.robot.robot import Robot
from pipeline.simulation.machine import Machine
from pipeline.simulation.walk_stand import IDEAL, Standing, Walking
from reports.figures.bars import electrical_energy_figure, energy_limits, stage_energy_figure
from reports.figures.demand import (
    Stretch,
    ground_forces_figure,
    joint_demand_figure,
    joint_torques_figure,
)
from reports.figures.gait import gait_figure
from reports.figures.lines import energy_per_minute_figure
from reports.figures.motor_limits import motor_limits_figure
from reports.figures.robot import joint_directions_figure, robot_figure
from reports.pages.robot_page import (
    conditions,
    gait_and_conditions,
    leg_words,
    short_titles,
    shown_leg,
)
from reports.scene import Scene, mass_centre

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

#: File name without ending to what makes the figure; nothing is drawn before it is called.
Drawings = dict[str, Callable[[], "Figure"]]


def drawings(
    scene: Scene, given: Machine, standing: Standing, walking: Walking, *, paper: bool = False
) -> Drawings:
    """Every figure of a run.

    Args:
        scene: The run's robot.
        given: The run.
        standing: Its result.
        walking: Its result.
        paper: Whether the run is held against the paper, whose figures are then named.
    """
    parts = stretches(given.robot, walking)
    robot, spec, (leg, labels) = given.robot, given.robot.spec, _joints(given)
    table, posture, words = gait_table(spec), standing.segment.configuration[0].copy(), []
    if len(standing.segment.stance) < len(robot.leg_names):
        words.append("the other feet are lifted to mid-transfer")
    ground = table.ground
    if not ground.level:  # dimensions are true along the ground's axes
        back = Rotation.from_matrix(ground.rotation.T)
        posture[:3] = back.apply(posture[:3])
        posture[3:7] = (back * Rotation.from_quat(posture[3:7])).as_quat()
        words.append("drawn along the ground, which is inclined")
    words += ["ball: payload"] * bool(table.payload_mass) + ["meshes missing"] * bool(scene.remark)
    out: Drawings = {
        "gait": partial(
            gait_figure,
            robot.leg_names,
            parts,
            title=f"{spec.name}: {gait_of(spec).title}",
            subtitle="; ".join(
                (f"transfer path '{gait_of(spec).table.transfer_path}'", *conditions(spec))
            ),
        ),
        "robot": lambda: robot_figure(
            *scene.at(posture),
            title=f"{spec.name}, {standing.segment.name}",
            subtitle="; ".join(words),
            mass_centre=mass_centre(robot, posture[None])[0],
        ),
        "zero_pose": lambda: joint_directions_figure(
            *scene.at(scene.zero),
            leg,
            title=f"{spec.name}: zero pose and positive directions",
            zero_pose=spec.zero_pose,
        ),
        **_energy(given, walking),
        "joint_torques": partial(
            joint_torques_figure,
            parts,
            robot.joints,
            {leg.name: leg.joints for leg in spec.legs},
            sliding=robot.sliding_joints,
            title="Torque of every joint over one cycle",
            subtitle=f"{_name(given)}; a line is thin while its leg is in the air",
        ),
        "ground_forces": partial(
            ground_forces_figure,
            parts,
            robot.leg_names,
            title="Ground forces and static stability",
            subtitle=f"{_name(given)}: one cycle",
        ),
    }
    for number, (joint, label) in enumerate(labels.items(), start=2):
        as_in = f", as in Fig. {number} of the paper" if paper else ""
        out[f"joint_demand_{joint}"] = partial(
            joint_demand_figure,
            parts,
            robot.joints.index(joint),
            leg,
            title=f"{label.capitalize()} of the {leg_words(leg)}",
            subtitle=f"{_name(given)}: demand over one cycle{as_in}",
            slides=joint in robot.sliding_joints,
        )
    return out


def _name(given: Machine) -> str:
    """Robot and gait, which every figure names."""
    return f"{given.robot.spec.name}, {gait_and_conditions(given.robot.spec)}"


def _joints(given: Machine) -> tuple[str, dict[str, str]]:
    """The leg that is shown, and its joints with their labels."""
    leg = shown_leg(given.robot)
    joints = next(entry.joints for entry in given.robot.spec.legs if entry.name == leg)
    return leg, {joint: f"joint {number}" for number, joint in enumerate(joints, start=1)}


def _energy(given: Machine, walking: Walking) -> Drawings:
    leg, labels = _joints(given)
    support = [
        (float(part.time[0]), float(part.time[-1]))
        for part in walking.demand.contacts
        if part is not None and leg in part.stance
    ]
    stages = {name: stage_energies(result) for name, result in walking.results.items()}
    limits = energy_limits(stages.values(), labels)
    out: Drawings = {}
    electrical: dict[str, Array] = {}
    for name, result in walking.results.items():
        alternative = given.catalog.alternatives[name]
        columns = [result.joint.joints.index(joint) for joint in labels]
        electrical[name] = stages[name][-1].forward[columns]
        out[f"motor_limits_{name}"] = partial(
            motor_limits_figure,
            result.motor,
            result.motors,
            labels,
            support,
            title=f"{alternative.title}: its motors, {leg_words(leg)}",
            subtitle=f"{_name(given)}: one gait cycle; rms over it and its limit above [N·m]",
        )
        out[f"stage_energy_{name}"] = partial(
            stage_energy_figure,
            stages[name],
            labels,
            places=alternative.stage_names,
            title=alternative.title,
            subtitle=f"{_name(given)}: energy per cycle through each stage, {leg_words(leg)}; "
            "one scale for all options",
            limits=limits,
        )
    subtitle = (
        "returned energy is lost"
        if given.options.regeneration == "none"
        else "what the motors draw; robot_energy.csv has what their return saves"
    )
    if IDEAL not in given.catalog.alternatives:
        subtitle += f"; no ratio: there is no option '{IDEAL}'"
    titles = short_titles(given.catalog)
    out["electrical_energy"] = partial(
        electrical_energy_figure,
        list(labels.values()),
        {titles[name]: energy for name, energy in electrical.items()},
        reference=titles.get(IDEAL),
        title=f"Electrical energy, {leg_words(leg)}",
        subtitle=f"{_name(given)}: one cycle; {subtitle}",
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
    note = "" if known else str(crossing["note"]).split(";")[0]
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
        subtitle=note or bands,
        crossing=crossing if known else None,
    )
    return {"energy_per_minute_middle_legs": draw}


def stretches(robot: Robot, walking: Walking) -> list[Stretch]:
    """What figures show of every segment."""
    out = []
    for segment, demand, contacts, margin in zip(
        walking.motion.segments,
        walking.demand.segments,
        walking.demand.contacts,
        walking.margins,
        strict=True,
    ):
        assert contacts is not None
        centre = mass_centre(robot, segment.configuration) - segment.configuration[:, :3]
        rotation = robot.base_rotation(segment.configuration)
        if rotation is not None:
            centre = np.einsum("nji,nj->ni", rotation, centre)  # world -> base
        stands = [leg in contacts.stance for leg in robot.leg_names]
        out.append(
            Stretch(
                time=segment.time,
                stance=segment.stance,
                velocity=demand.velocity,
                torque=demand.torque,
                feet=contacts.position,
                normal=np.where(stands, contacts.force_world @ segment.ground_normal, 0.0),
                friction=contacts.friction_needed,
                mass_centre=centre,
                margin=margin,
            )
        )
    return out
