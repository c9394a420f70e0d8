"""One cycle in a browser, in 3D."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from pipeline.api.pictures.cycle import Cycle, MovingBody
from pipeline.api.pictures.gait import gait_steps_of, rows_of_steps
from pipeline.api.pictures.scene import Scenery
from pipeline.simulation.settings import Settings
from pipeline.simulation.walk_stand import Walking, walk
from reports.figures.robot.solids import Solid
from reports.figures.robot.sticks import bare_legs
from reports.pages.gait_words import gait_and_conditions

if TYPE_CHECKING:
    from pipeline.api.pictures.player import Player

Array = NDArray[np.float64]
#: Steps of a cycle.
STEPS = 120


def player(given: Settings, *, host: str = "127.0.0.1", port: int = 8080) -> Player:
    """Walk one cycle and serve it to a browser.

    Args:
        given: Robot and gait.
        host: Address to listen on.
        port: To listen on; the next free one where it is taken.

    Raises:
        ReportError: The package viser is not installed.
        StanceError: A foot would have to pull or slide.
    """
    from pipeline.api.pictures.player import Player, viser_module

    viser_module()  # said before anything is computed
    walking = walk(
        given.machine,
        {},
        samples=given.samples,
        quasi_static=given.quasi_static,
        adjust=given.adjust,
        forces=given.ground,
    )
    return Player(cycle(Scenery(given.machine), walking), host, port)


def cycle(scenery: Scenery, walking: Walking, count: int = STEPS) -> Cycle:
    """What the player plays.

    Args:
        scenery: Of the robot that walks.
        walking: The cycle.
        count: Steps.
    """
    robot = scenery.robot
    steps = gait_steps_of(scenery, walking, count)
    _, q = rows_of_steps(walking, count)
    joints = tuple(joint for leg in robot.spec.legs for joint in leg.joints)
    sliding = dict(zip(robot.joints, robot.sliding, strict=True))
    return Cycle(
        title=f"{robot.spec.name}, {gait_and_conditions(robot.spec)}",
        bodies=tuple(_bodies(scenery, q, steps.origin)),
        steps=steps,
        joints=joints,
        units=tuple("N" if sliding[joint] else "N·m" for joint in joints),
        ground=walking.motion.segments[0].ground_normal,
    )


def _bodies(scenery: Scenery, q: Array, follow: Array) -> list[MovingBody]:
    """Every moving body with its surfaces, sticks where a leg has none."""
    model = scenery.robot.model
    data = model.createData()
    solids, legs = scenery.at(q[0])
    by_body: dict[int, list[Solid]] = {}
    for solid in solids:
        by_body.setdefault(scenery.carrier[solid.link], []).append(solid)
    for leg in legs:
        if leg.name in bare_legs(solids, legs):
            for body, stick in scenery.sticks(leg, legs):
                by_body.setdefault(body, []).append(stick)
    placed = []
    for row in q:
        pin.forwardKinematics(model, data, row)
        placed.append([data.oMi[body].homogeneous.copy() for body in by_body])
    out = []
    for i, (body, own) in enumerate(by_body.items()):
        first = np.linalg.inv(placed[0][i])
        motion = np.array([at[i] @ first for at in placed])
        name = str(model.names[body]) if body < len(model.names) else str(body)
        out.append(MovingBody(name, tuple(own), motion[:, :3, 3] - follow, motion[:, :3, :3]))
    return out
