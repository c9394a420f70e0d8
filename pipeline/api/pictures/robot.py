"""Pictures of the robot and of its gait, out of a run's results."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pipeline.api.pictures.gait import gait_steps_of, gait_stretches
from pipeline.api.pictures.scene import Scenery, mass_centre
from pipeline.motion.gait import gait_of, gait_table
from pipeline.motion.ground import Ground
from pipeline.robot.robot import Robot
from pipeline.simulation.walk_stand import Standing, Walking
from reports.atomic import write_text
from reports.figures.robot.gait_steps import gait_steps
from reports.figures.robot.gait_view import gait_figure
from reports.figures.robot.joint_directions import joint_directions_figure
from reports.figures.robot.robot_view import robot_figure
from reports.figures.several import Drawing
from reports.pages.gait_words import conditions
from reports.pages.names import shown_leg

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]


def robot_drawings(scenery: Scenery, standing: Standing, walking: Walking) -> list[Drawing]:
    """The gait, the robot standing, its zero pose."""
    robot, leg = scenery.robot, shown_leg(scenery.robot)
    posture = _on_level_ground(robot, standing.segment.configuration[0])
    lifted = len(standing.segment.stance) < len(robot.leg_names)
    words = ["the other feet are lifted to mid-transfer"] if lifted else []
    if not _ground(robot).level:
        words.append("drawn along the ground, which is inclined")
    if scenery.load is not None:
        words.append("ball: payload")
    if scenery.shapes.missing:
        count = len(scenery.shapes.missing)
        words.append(f"{count} {'mesh is' if count == 1 else 'meshes are'} missing")

    def standing_robot() -> Figure:
        return robot_figure(
            *scenery.at(posture),
            title=f"{robot.spec.name}, {standing.segment.name}",
            subtitle="; ".join(words),
            mass_centre=mass_centre(robot, posture[None])[0],
        )

    def zero_pose() -> Figure:
        return joint_directions_figure(
            *scenery.at(scenery.zero),
            leg,
            title=f"{robot.spec.name}: zero pose and positive directions",
            zero_pose=robot.spec.zero_pose,
        )

    def gait() -> Figure:
        return gait_figure(
            robot.leg_names,
            gait_stretches(robot, walking),
            shown=leg,
            body=scenery.trunk_outline(),
            title=f"{robot.spec.name}: {gait_of(robot.spec).title}",
            subtitle="; ".join(
                (
                    f"transfer path '{gait_of(robot.spec).path}'",
                    *conditions(robot.spec),
                    *(["arrow: the robot's front"] if conditions(robot.spec) else []),
                )
            ),
        )

    return [
        Drawing("gait", gait),
        Drawing("robot", standing_robot),
        Drawing("zero_pose", zero_pose),
    ]


def _ground(robot: Robot) -> Ground:
    table = gait_table(robot.spec)
    return Ground(table.slope_forward, table.slope_left)


def _on_level_ground(robot: Robot, configuration: Array) -> Array:
    """The same posture with the ground's axes for the world's, along which dimensions are true."""
    ground = _ground(robot)
    if ground.level:
        return configuration
    turned = configuration.copy()
    back = Rotation.from_matrix(ground.rotation.T)
    turned[:3] = back.apply(configuration[:3])
    turned[3:7] = (back * Rotation.from_quat(configuration[3:7])).as_quat()
    return turned


def write_gait_steps(scenery: Scenery, walking: Walking, out: Path) -> None:
    """One cycle as a moving picture, ``gait_steps.svg``.

    Raises:
        OutputError: The folder cannot be written.
    """
    spec = scenery.robot.spec
    title = f"{spec.name}: {gait_of(spec).title}"
    picture = gait_steps(
        gait_steps_of(scenery, walking), title=title, subtitle=", ".join(conditions(spec))
    )
    write_text(out / "gait_steps.svg", picture)
