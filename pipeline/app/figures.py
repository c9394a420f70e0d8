"""Which figures a run draws, and from what."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from actuators.energy import stage_energies
from pipeline.app.compute import Standing, Walking
from pipeline.app.settings import Settings
from pipeline.calibration.fig_21 import EnergyPerMinute
from pipeline.calibration.judge import Judgement
from pipeline.robot import Robot
from reports.figures.electrical_energy import electrical_energy_figure
from reports.figures.energy_per_minute import BreakEven, EnergyLine, energy_per_minute_figure
from reports.figures.gait_view import GaitStretch, gait_figure
from reports.figures.joint_demand import joint_demand_figure, stretches
from reports.figures.joint_directions import joint_directions_figure
from reports.figures.motor_limits import motor_limits_figure
from reports.figures.robot_view import Leg, legs_of, robot_figure
from reports.figures.save import save_figure
from reports.figures.stage_energy import stage_energy_figure
from reports.figures.visuals import Primitive, joint_marks, primitives

Array = NDArray[np.float64]
#: The leg the paper follows; the first leg of a robot that has no such leg.
SHOWN_LEG = "rm"
#: File name of each subject's Fig. 21.
SUBJECT_TITLES = {
    "middle_legs": "both middle legs, as in Fig. 21",
    "robot_on_3_feet": "whole robot, standing on three feet",
    "robot_on_6_feet": "whole robot, standing on six feet",
}


def shown_leg(robot: Robot) -> str:
    """The leg whose figures are drawn."""
    return SHOWN_LEG if SHOWN_LEG in robot.leg_names else robot.leg_names[0]


def write_figures(given: Settings, standing: Standing, walking: Walking, out: Path) -> int:
    """Draw and save every figure of a run.

    Returns:
        How many.
    """
    count = _demand(given, walking, out)
    count += _energy(given, walking, out)
    return count + _robot(given, standing, walking, out)


def _demand(given: Settings, walking: Walking, out: Path) -> int:
    leg = shown_leg(given.robot)
    joints = next(entry.joints for entry in given.robot.spec.legs if entry.name == leg)
    for number, joint in enumerate(joints, start=1):
        figure = joint_demand_figure(
            joint,
            stretches(walking.demand, joint, leg),
            subtitle=f"one gait cycle, as in Fig. {number + 1} of the paper",
        )
        save_figure(figure, out, f"joint_demand_{joint}")
    return len(joints)


def _energy(given: Settings, walking: Walking, out: Path) -> int:
    leg = shown_leg(given.robot)
    joints = next(entry.joints for entry in given.robot.spec.legs if entry.name == leg)
    labels = {joint: f"joint {number}" for number, joint in enumerate(joints, start=1)}
    electrical = {}
    for name, result in walking.results.items():
        title = given.catalog.alternatives[name].title
        figure = stage_energy_figure(
            stage_energies(result),
            labels,
            title=title,
            subtitle=f"energy per cycle through each stage, leg {leg}",
        )
        save_figure(figure, out, f"stage_energy_{name}")
        columns = [result.joint.joints.index(joint) for joint in joints]
        electrical[title.split(": ")[-1]] = stage_energies(result)[-1].forward[columns]
        chain = given.catalog.chain(name)
        save_figure(
            motor_limits_figure(result.motor, chain.motor, labels, title=title),
            out,
            f"motor_limits_{name}",
        )
    figure = electrical_energy_figure(
        list(labels.values()),
        electrical,
        title=f"Electrical energy per cycle, leg {leg}",
        subtitle="returned energy is lost"
        if given.regeneration.policy == "none"
        else "what the motors draw; robot_energy.csv has what their return saves",
    )
    save_figure(figure, out, "electrical_energy")
    return 2 * len(walking.results) + 1


def _scene(robot: Robot, configuration: Array) -> tuple[list[Primitive], list[Leg]]:
    """The robot's visual primitives and legs in one posture."""
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, configuration)
    links = {
        frame.name: data.oMf[i].homogeneous.copy()
        for i, frame in enumerate(robot.model.frames)
        if frame.type == pin.FrameType.BODY
    }
    marks = joint_marks(robot.urdf, links)
    legs = {leg.name: (leg.joints, leg.foot) for leg in robot.spec.legs}
    return primitives(robot.urdf, links), legs_of(legs, marks, links)


def _robot(given: Settings, standing: Standing, walking: Walking, out: Path) -> int:
    robot = given.robot
    posture = standing.segment.configuration[0]
    scene, legs = _scene(robot, posture)
    data = robot.model.createData()
    centre = pin.centerOfMass(robot.model, data, posture).copy()
    figure = robot_figure(
        scene,
        legs,
        title=f"{robot.spec.name}, {standing.segment.name}",
        subtitle="the other feet are lifted to mid-transfer",
        mass_centre=centre,
    )
    save_figure(figure, out, "robot")
    zero = robot.configuration(np.zeros((1, len(robot.joints))), np.zeros((1, 3)))[0]
    scene, legs = _scene(robot, zero)
    figure = joint_directions_figure(
        scene,
        legs,
        shown_leg(robot),
        title=f"{robot.spec.name}: zero pose and positive directions",
        zero_pose=robot.spec.zero_pose,
    )
    save_figure(figure, out, "zero_pose")
    stretches_ = []
    for segment, contacts, margin in zip(
        walking.motion.segments, walking.demand.contacts, walking.margins, strict=True
    ):
        assert contacts is not None
        centres = [
            pin.centerOfMass(robot.model, data, row).copy() - row[:3]
            for row in segment.configuration
        ]
        stretches_.append(
            GaitStretch(segment.time, contacts.position, segment.stance, np.array(centres), margin)
        )
    trunk = next((p for p in scene if p.link == robot.spec.base_link), None)
    body = (0.0, 0.0) if trunk is None else (float(trunk.size[0]), float(trunk.size[1]))
    figure = gait_figure(
        robot.leg_names,
        stretches_,
        shown=shown_leg(robot),
        body=body,
        title=f"{robot.spec.name}: tripod gait",
        subtitle=f"transfer path '{robot.spec.transfer_path}'",
    )
    save_figure(figure, out, "gait")
    return 3


def write_fig_21(judgement: Judgement, titles: dict[str, str], out: Path) -> int:
    """Energy per minute against the fraction of time standing, for every subject.

    Args:
        judgement: With its curves and crossings.
        titles: Alternative to its title.
        out: Folder.

    Returns:
        How many figures.
    """
    for row in judgement.break_even:
        curves = [c for c in judgement.per_minute if c.subject == row.subject]
        share = curves[0].fraction
        mark = None
        if not np.isnan(row.fraction):
            reference = next(c for c in curves if c.alternative == "reversible")
            energy = float(np.interp(row.fraction, share, reference.energy))
            known = (v if np.isfinite(v) else None for v in row.prior)
            mark = BreakEven(row.fraction, energy, *known)
        figure = energy_per_minute_figure(
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
            title=f"Energy in one minute: {SUBJECT_TITLES[row.subject]}",
            subtitle=row.note.split(";")[0] if mark is None else _bands(curves),
            break_even=mark,
        )
        save_figure(figure, out, f"energy_per_minute_{row.subject}")
    return len(judgement.break_even)


def _bands(curves: list[EnergyPerMinute]) -> str:
    """What the lines and bands are."""
    if any(c.prior is None for c in curves):
        return "computed anew with changed numbers"
    return (
        "line: fitted; faint band: 95 % of what data sheets and literature say; strong band: "
        "fitted without the drive's own walking figure"
    )
