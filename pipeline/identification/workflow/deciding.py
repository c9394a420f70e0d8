"""The deciding motion of a run: for the first found effect that has rivals."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from actuators.arrays import Array
from pipeline.effects.registry import effect_named
from pipeline.identification.results import Found
from pipeline.identification.selection.deciding_motion import RATE, Deciding, Rival, deciding_motion
from pipeline.identification.workflow.setup import Setup
from pipeline.logs.prepared.measurement import Measurement
from pipeline.machine.machine import MachineModel
from pipeline.motion.gait import gait_of
from pipeline.motion.support import standing_posture
from pipeline.robot.kinematics import foot_positions
from pipeline.robot.robot import Robot

#: Of a moving foot from the ground and from other feet [m].
CLEARANCE, APART = 0.01, 0.12


def decide(
    given: Setup, model: MachineModel, measurements: Sequence[Measurement], found: Sequence[Found]
) -> tuple[Deciding, str] | None:
    """The motion that separates a found effect from its rivals, and it in words.

    Args:
        given: Robot and actuators.
        model: Before any effect.
        measurements: One per log.
        found: Accepted effects.

    Returns:
        None where nothing is undecided, or no motion inside the limits decides.
    """
    for f in found:
        # Bodies have no size of their own that a motion could be planned for.
        rivals = [Rival(effect_named(name), place) for name, place in f.rivals if place]
        if not rivals or f.members:
            continue
        named = Rival(effect_named(f.effect), f.place, f.values)
        m = measurements[0]
        posture, movable, stance = None, None, None
        if given.legged:
            posture, movable, stance = _lifted(given, _joints(model, f))
        motion = deciding_motion(
            model,
            m,
            given.expected,
            named,
            rivals,
            posture=posture,
            movable=movable,
            stance=stance,
            allowed=_clear(given.robot, stance) if given.robot and stance else None,
        )
        if motion is None:
            continue
        where = (
            "other legs stand, the legs named above hang in the air and move"
            if given.legged
            else "the robot on its stand"
        )
        words = (
            f"{motion.name}, {motion.time[-1]:.0f} s at {RATE:.0f} Hz ({where}); the best-fitting "
            f"rival would miss by {motion.misfit:.3g} times the noise floor, root mean square"
        )
        return motion, words
    return None


def _joints(model: MachineModel, f: Found) -> list[str]:
    """Joints at which the effect and its rivals act."""
    places = [f.place, *(place for _, place in f.rivals)]
    out: list[str] = []
    for name in (name for place in places for name in place):
        joint = name if name in model.joints else model.links.get(name, "")
        if joint in model.joints and joint not in out:
            out.append(joint)
    return out


def _lifted(
    given: Setup, joints: Sequence[str]
) -> tuple[Array | None, list[int] | None, tuple[str, ...] | None]:
    """Posture, joints that may move and legs that stand, so that these joints' legs hang free."""
    robot = given.robot
    assert robot is not None
    free = {leg.name for leg in robot.spec.legs if set(leg.joints) & set(joints)}
    for _, _, stance in gait_of(robot.spec).footfall.stances():
        if not free & set(stance):
            segment = standing_posture(robot, stance)
            posture = segment.configuration[0, robot.position_index]
            legs = [leg for leg in robot.spec.legs if leg.name in free or not free]
            legs = [leg for leg in legs if leg.name not in stance]
            movable = [robot.joints.index(j) for leg in legs for j in leg.joints]
            return posture, movable, stance
    return None, None, None


def _clear(robot: Robot, stance: Sequence[str]) -> Callable[[Array], bool]:
    """Whether lifted feet stay above the ground and away from other feet."""
    legs = [robot.leg_names.index(name) for name in stance]
    lifted = [k for k in range(len(robot.leg_names)) if k not in legs]

    def allowed(q: Array) -> bool:
        feet = foot_positions(robot.chains, q[:, robot.leg_columns])
        ground = feet[:, legs, 2].min(axis=1, keepdims=True)
        if (feet[:, lifted, 2] < ground + CLEARANCE).any():
            return False
        for k in lifted:
            others = [i for i in range(feet.shape[1]) if i != k]
            if np.linalg.norm(feet[:, others] - feet[:, [k]], axis=2).min() < APART:
                return False
        return True

    return allowed
