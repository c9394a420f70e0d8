"""Torque demanded of every joint: inverse dynamics minus what the ground supplies."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.dynamics.contact_forces import (
    ContactForces,
    FeetOnGround,
    ground_frame,
    inverse_dynamics,
)
from pipeline.dynamics.force_rules import (
    LEAST_TORQUE,
    PAPER,
    GroundForces,
    least_torque_forces,
    refuse_falling,
)
from pipeline.motion.gait import gait_of
from pipeline.motion.motion import Motion, Segment
from pipeline.motion.support import stability_margins
from pipeline.motion.walking import walking_motion
from pipeline.robot.check import check_file, check_robot
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from pipeline.robot.urdf_check import Finding


@dataclass(frozen=True)
class JointDemand:
    """Motion and torque of the actuated joints over one segment."""

    joints: tuple[str, ...]  #: Names, in the robot file's order; they label the columns.
    time: Array  #: Shape (N,) [s].
    position: Array  #: Shape (N, J) [rad].
    velocity: Array  #: Shape (N, J) [rad/s].
    acceleration: Array  #: Shape (N, J) [rad/s^2].
    torque: Array  #: What the actuator must apply to the joint, shape (N, J) [N*m].
    segment: str  #: The segment's name.


def segment_demand(
    robot: Robot,
    segment: Segment,
    *,
    forces: GroundForces = PAPER,
    quasi_static: bool = False,
    threads: int = 1,
) -> tuple[JointDemand, ContactForces | None]:
    """Joint torques over one segment, with the contact forces they rest on.

    `robot`: with floating base the ground carries it; with fixed base there is no contact. Returns
    the demand and the contact forces (None for a fixed base).

    Raises:
        StanceError: A foot would have to pull or slide; names foot, instant, force and margin.
        LegwattError: Fewer than three feet stand.
    """
    q, v, a = segment.configuration, segment.velocity, segment.acceleration
    inertial = (np.zeros_like(v), np.zeros_like(a)) if quasi_static else (v, a)
    generalised = inverse_dynamics(robot.model, (q, *inertial), robot.pool(threads), threads)
    joints = robot.velocity_index
    demand = JointDemand(
        robot.joints,
        segment.time,
        q[:, robot.position_index],
        v[:, joints],
        a[:, joints],
        generalised[:, joints],
        segment.name,
    )
    if not robot.floating:
        return demand, None
    turn, to_ground = ground_frame(segment.ground_normal), robot.base_rotation(q)
    if turn is not None:
        to_ground = turn @ (np.eye(3)[None] if to_ground is None else to_ground)
    feet = FeetOnGround(robot.chains, robot.leg_positions(q), to_ground)
    rocks = segment.rocks and len(segment.stance) == 2
    if len(segment.stance) < 3 and not rocks:
        raise LegwattError(
            f"segment '{segment.name}' stands on {len(segment.stance)} feet; a statically stable "
            "stance needs at least 3"
        )
    limit, least = forces.friction_coefficient, len(segment.stance) if rocks else 3
    stance = [robot.leg_names.index(leg) for leg in segment.stance]
    standing = np.zeros((segment.time.size, len(robot.leg_names)), dtype=np.bool_)
    standing[:, stance] = True
    force = feet.least_tangential(generalised[:, :6], standing, limit, least)
    points = feet.points[:, stance]
    refuse_falling(robot, segment, force[:, stance], points, limit)
    if forces.rule == LEAST_TORQUE:
        own = robot.layout.real[stance]
        force[:, stance] = least_torque_forces(
            force[:, stance],
            points,
            demand.torque[:, robot.leg_columns[stance][own]],
            feet.unit_torque()[:, stance][:, own],
            np.nonzero(own)[0],
            limit,
        )
    demand.torque[:] -= robot.layout.by_joint(feet.torque(force))
    contacts = ContactForces(
        robot.leg_names,
        segment.stance,
        segment.time,
        feet.in_base,
        feet.to_base(force),
        force if turn is None else force @ turn,
        segment.ground_normal,
    )
    return demand, contacts


@dataclass(frozen=True)
class MotionDemand:
    """Demand and contact forces of a whole motion, segment by segment."""

    segments: tuple[JointDemand, ...]  #: Demand at the joints.
    contacts: tuple[ContactForces | None, ...]  #: Forces of the ground; None for a fixed base.
    period: float | None  #: Of the motion [s]; None where it does not repeat.
    forces: GroundForces = PAPER  #: How the ground's forces were chosen.

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the columns."""
        return self.segments[0].joints

    @property
    def duration(self) -> float:
        """From the first sample to the last [s]; of a gait its period."""
        return float(self.segments[-1].time[-1] - self.segments[0].time[0])


def motion_demand(
    robot: Robot,
    motion: Motion,
    *,
    forces: GroundForces = PAPER,
    quasi_static: bool = False,
    threads: int = 1,
) -> MotionDemand:
    """Joint demand along a motion; see `segment_demand`."""
    parts = [
        segment_demand(robot, segment, forces=forces, quasi_static=quasi_static, threads=threads)
        for segment in motion.segments
    ]
    return MotionDemand(
        tuple(demand for demand, _ in parts),
        tuple(contacts for _, contacts in parts),
        motion.period,
        forces,
    )


#: In half a period: enough to see limits and balance, too few for energies.
_SAMPLES = 51


def check_gait(robot: Robot) -> list[Finding]:
    """Walk one cycle and say whether it can be walked.

    `robot`: with legs; one on a fixed base walks nowhere, and nothing is judged.
    """
    spec = robot.spec
    if not robot.floating or not spec.legs:
        return []
    try:
        gait = gait_of(spec)
        motion = walking_motion(robot, samples=_SAMPLES)
        motion_demand(robot, motion)  # feet that would have to pull are refused
    except LegwattError as error:
        said = str(error).removeprefix(f"{spec.path}: ")
        return [Finding(spec.name, "gait can be walked", False, said)]
    least = min(float(stability_margins(robot, part).min()) for part in motion.segments)
    detail = f"{gait.title}: least margin of static stability {1e3 * least:.3g} mm"
    return [Finding(spec.name, "gait can be walked", True, detail)]


def check_with_gait(path: Path) -> list[Finding]:
    """Check a robot file and its gait, or a bare URDF.

    `path`: ``.toml`` robot file, URDF, or the name of a robot in ``example-robot-data``.

    Raises:
        LegwattError: The file cannot be read at all.
    """
    if path.suffix.lower() != ".toml":
        return check_file(path)
    robot = load_robot(load_robot_file(path))
    return [*check_robot(robot), *check_gait(robot)]
