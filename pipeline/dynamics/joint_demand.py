"""Torque demanded of every joint: inverse dynamics minus what the ground supplies."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.dynamics.contact_forces import (
    LEAST_TORQUE,
    PAPER,
    ContactForces,
    FeetOnGround,
    GroundForces,
    ground_frame,
    least_torque_forces,
    refuse_falling,
)
from pipeline.motion.footfall import LEAST_FEET
from pipeline.motion.gait import gait_of
from pipeline.motion.motion import Motion, Segment
from pipeline.motion.walking import stability_margins, walking_motion
from pipeline.robot.check import Finding
from pipeline.robot.kinematics import foot_positions
from pipeline.robot.robot import Robot, inverse_dynamics

#: In half a period: enough to see limits and balance, too few for energies.
_SAMPLES: Final = 51
#: Over the stroke: a foot that leaves its path further walks another gait than is stated.
_ASTRAY: Final = 0.25


@dataclass(frozen=True)
class JointDemand:
    """Motion and torque of the actuated joints over one segment."""

    joints: tuple[str, ...]  #: Names, in the robot file's order; they label the columns.
    time: Array  #: Shape (N,) [s].
    position: Array  #: Shape (N, J) [rad].
    velocity: Array  #: Shape (N, J) [rad/s].
    acceleration: Array  #: Shape (N, J) [rad/s^2].
    torque: Array  #: What the actuator must apply to the joint, shape (N, J) [N*m].
    name: str  #: The segment's.


def segment_demand(
    robot: Robot, segment: Segment, *, forces: GroundForces = PAPER
) -> tuple[JointDemand, ContactForces | None]:
    """Joint torques over one segment, with the contact forces they rest on.

    `robot`: with floating base the ground carries it; with fixed base there is no contact. Returns
    the demand and the contact forces (None for a fixed base).

    Raises:
        StanceError: A foot would have to pull or slide; names foot, instant, force and margin.
        LegwattError: Fewer than three feet stand.
    """
    q, v, a = segment.configuration, segment.velocity, segment.acceleration
    generalised = inverse_dynamics(robot.model, (q, v, a))
    own, ground = robot.velocity_index, None
    torque = generalised[:, own]
    if robot.floating:
        ground, supplied = _carried(robot, segment, generalised, forces)
        torque -= supplied
    series = (q[:, robot.position_index], v[:, own], a[:, own], torque)
    return JointDemand(robot.joints, segment.time, *series, segment.name), ground


def _carried(
    robot: Robot, segment: Segment, generalised: Array, forces: GroundForces
) -> tuple[ContactForces, Array]:
    """What the ground does to the feet, and through them to the joints, shape (N, J) [N*m]."""
    q, limit, count = segment.configuration, forces.friction_coefficient, len(segment.stance)
    least = 2 if segment.rocks and count == 2 else LEAST_FEET
    if count < least:
        words = f"{count} feet; a statically stable stance needs at least {LEAST_FEET}"
        raise LegwattError(f"segment '{segment.name}' stands on {words}")
    tilt = ground_frame(segment.ground_normal)
    feet = FeetOnGround(robot.chains, robot.leg_positions(q), tilt @ robot.base_rotation(q))
    stance = [robot.leg_names.index(leg) for leg in segment.stance]
    standing = np.zeros((segment.time.size, len(robot.leg_names)), dtype=np.bool_)
    standing[:, stance] = True
    force = feet.least_tangential(generalised[:, :6], standing, limit, least)
    refuse_falling(robot, segment, force[:, stance], limit)
    if forces.rule == LEAST_TORQUE:
        units = np.zeros((3 * count, *force.shape))
        for row, unit in enumerate(units):
            unit[:, stance[row // 3], row % 3] = 1.0
        each = np.stack([robot.chains.by_joint(feet.torque(unit)) for unit in units], axis=-1)
        asked = generalised[:, robot.velocity_index]
        force[:, stance] = least_torque_forces(
            force[:, stance], feet.points[:, stance], asked, each, limit
        )
    names = robot.leg_names, segment.stance
    contacts = ContactForces(
        *names, segment.time, feet.in_base, force @ tilt, segment.ground_normal
    )
    return contacts, robot.chains.by_joint(feet.torque(force))


@dataclass(frozen=True)
class MotionDemand:
    """Demand and contact forces of a whole motion, segment by segment."""

    segments: tuple[JointDemand, ...]  #: Demand at the joints.
    contacts: tuple[ContactForces | None, ...]  #: Forces of the ground; None for a fixed base.

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the columns."""
        return self.segments[0].joints

    @property
    def duration(self) -> float:
        """From the first sample to the last [s]; of a gait its period."""
        return float(self.segments[-1].time[-1] - self.segments[0].time[0])


def motion_demand(robot: Robot, motion: Motion, *, forces: GroundForces = PAPER) -> MotionDemand:
    """Joint demand along a motion; see `segment_demand`."""
    parts = [segment_demand(robot, segment, forces=forces) for segment in motion.segments]
    demands, contacts = zip(*parts, strict=True)
    return MotionDemand(demands, contacts)


def check_gait(robot: Robot) -> list[Finding]:
    """Walk one cycle and say whether it can be walked.

    `robot`: one with fewer than three legs or on a fixed base walks nowhere, and nothing is judged.
    """
    spec, check = robot.spec, "gait can be walked"
    if not robot.floating or len(spec.legs) < LEAST_FEET:
        return []
    try:
        for swayed in (False, True):  # no sway mends legs that do not step forward
            motion = walking_motion(robot, samples=_SAMPLES, swayed=swayed)
            off, stroke = _off_path(robot, motion), float(gait_of(spec).strokes.max())
            if off > _ASTRAY * stroke:
                detail = (
                    f"feet leave their paths by {1e3 * off:.3g} mm of a stroke of "
                    f"{1e3 * stroke:.3g} mm: the legs do not move them along x, which is forward; "
                    "turn the URDF's root, or change stance or gait.heading"
                )
                return [Finding(spec.name, check, False, detail)]
        motion_demand(robot, motion)  # feet that would have to pull are refused
    except LegwattError as error:
        return [Finding(spec.name, check, False, str(error).removeprefix(f"{spec.path}: "))]
    least = min(float(stability_margins(robot, part).min()) for part in motion.segments)
    detail = f"{gait_of(spec).title}: least margin of static stability {1e3 * least:.3g} mm"
    return [Finding(spec.name, check, True, detail)]


def _off_path(robot: Robot, motion: Motion) -> float:
    """By how much feet leave their paths [m]."""
    off = 0.0
    for part in motion.segments:
        assert part.foot_target is not None
        feet = foot_positions(robot.chains, robot.leg_positions(part.configuration))
        off = max(off, float(np.linalg.norm(feet - part.foot_target, axis=-1).max()))
    return off
