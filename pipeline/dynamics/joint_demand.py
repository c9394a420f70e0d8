"""Torque demanded of every joint: inverse dynamics minus what the ground supplies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from pipeline.dynamics.contact_forces import ContactForces, least_tangential_forces
from pipeline.dynamics.falling import refuse_falling
from pipeline.dynamics.force_rules import PAPER, GroundForces, Stance
from pipeline.dynamics.ground_frames import GroundFrames
from pipeline.errors import GaitError
from pipeline.motion.motion import Motion, Segment
from pipeline.robot.kinematics import LegPosture, posture_at
from pipeline.robot.robot import Robot

Array = NDArray[np.float64]
#: Samples per block of leg kinematics: small enough for the cache, large enough for numpy.
_BLOCK = 2048


@dataclass(frozen=True)
class JointDemand:
    """Motion and torque of the actuated joints over one segment.

    Attributes:
        joints: Names, in the robot file's order; they label the columns.
        time: Shape (N,) [s].
        position: Shape (N, J) [rad].
        velocity: Shape (N, J) [rad/s].
        acceleration: Shape (N, J) [rad/s^2].
        torque: What the actuator must apply to the joint, shape (N, J) [N*m].
        segment: The segment's name.
    """

    joints: tuple[str, ...]
    time: Array
    position: Array
    velocity: Array
    acceleration: Array
    torque: Array
    segment: str


def inverse_dynamics(
    robot: Robot, segment: Segment, *, quasi_static: bool = False, threads: int = 1
) -> Array:
    """Generalised forces without contact, by Pinocchio's RNEA over the batch.

    Args:
        robot: The robot; its model's armature is zero, reflected rotor inertia being the actuator
            chain's.
        segment: The motion.
        quasi_static: Leave out the links' inertial terms: gravity alone.
        threads: For Pinocchio's thread pool.

    Returns:
        Generalised forces, shape (N, nv) [N, N*m].
    """
    q, v, a = segment.configuration, segment.velocity, segment.acceleration
    if quasi_static:
        v = np.zeros_like(v)
        a = np.zeros_like(a)
    pool = robot.pool(threads)
    # Pinocchio drops the sample axis of a single sample.
    return np.asarray(pin.rneaInParallel(threads, pool, q.T, v.T, a.T)).T.reshape(v.shape)


def contact_forces(
    robot: Robot, segment: Segment, generalised: Array, choice: GroundForces = PAPER
) -> ContactForces:
    """Ground forces that supply the wrench demanded of the base.

    Args:
        robot: A robot with a floating base.
        segment: The motion.
        generalised: From `inverse_dynamics`, shape (N, nv).
        choice: Rule and friction.

    Raises:
        StanceError: A foot would have to pull or slide; names foot, instant, force and margin.
        GaitError: Fewer than three feet stand.
    """
    return _ground(robot, segment, generalised, choice)[0]


def _ground(
    robot: Robot, segment: Segment, generalised: Array, choice: GroundForces
) -> tuple[ContactForces, Array]:
    """Ground forces, and the torques (N, K, M) they put into the joints of the K standing legs."""
    if len(segment.stance) < 3:
        raise GaitError(
            f"segment '{segment.name}' stands on {len(segment.stance)} feet; a statically stable "
            "stance needs at least 3"
        )
    legs = robot.leg_names
    stance = [legs.index(leg) for leg in segment.stance]
    # Standing legs first: forces and torques are then worked out on a leading part of the arrays.
    order = stance + [i for i in range(len(legs)) if i not in stance]
    chains = robot.chains.of(order)
    columns = robot.position_index[robot.leg_columns[order]]
    frames = GroundFrames(robot, segment)
    n, k = segment.time.size, len(stance)
    feet = np.empty((n, len(legs), 3))
    force = np.zeros_like(feet)
    torque = np.empty((n, k, columns.shape[1]))
    in_ground, standing = np.empty((n, k, 3)), np.empty((n, k, 3))
    unit_torque = None if choice.rule is None else np.empty((n, k, 3, columns.shape[1]))
    for s in _blocks(n):
        posture = posture_at(chains, segment.configuration[s].T[columns])
        feet[s, order] = posture.feet
        standing[s] = points = frames.to_ground(posture.feet[:, :k], s)
        in_ground[s] = least_tangential_forces(
            frames.wrench_to_ground(generalised[s, :6], s), points, choice.friction_coefficient
        )
        if unit_torque is None:
            force[s, stance] = in_base = frames.to_base(in_ground[s], s)
            torque[s] = posture.force_torques(in_base)
        else:
            unit_torque[s] = _unit_torques(posture, frames, s, k)
    refuse_falling(robot, segment, in_ground, standing, choice.friction_coefficient)
    if choice.rule is not None and unit_torque is not None:
        seen = Stance(
            segment,
            *_motion_and_torque(robot, segment, generalised),
            robot.leg_columns[stance],
            robot.layout.real[stance],
            unit_torque,
            standing,
            in_ground,
            choice.friction_coefficient,
        )
        in_ground = choice.rule.forces(seen)
        force[:, stance] = frames.to_base(in_ground)
        torque = seen.leg_torque(in_ground)
    force_world = force
    if not frames.same:
        force_world = np.zeros_like(force)
        force_world[:, stance] = frames.to_world(in_ground)
    contacts = ContactForces(
        legs, segment.stance, segment.time, feet, force, force_world, segment.ground_normal
    )
    return contacts, torque


def _unit_torques(posture: LegPosture, frames: GroundFrames, rows: slice, count: int) -> Array:
    """Joint torques of unit forces along the ground's axes, shape (n, K, 3, M) [N*m/N]."""
    along = np.zeros((posture.feet.shape[0], count, 3))
    parts = []
    for axis in range(3):
        along[:] = 0.0
        along[..., axis] = 1.0
        parts.append(posture.force_torques(frames.to_base(along, rows)))
    return np.stack(parts, axis=2)


def _blocks(n: int) -> list[slice]:
    return [slice(i, min(i + _BLOCK, n)) for i in range(0, n, _BLOCK)]


def _columns(values: Array, index: NDArray[np.intp]) -> Array:
    """Columns of an array, without a copy where they lie side by side."""
    first, count = int(index[0]), index.size
    if np.array_equal(index, np.arange(first, first + count)):
        return values[:, first : first + count]
    return values[:, index]


def _motion_and_torque(
    robot: Robot, segment: Segment, generalised: Array
) -> tuple[tuple[str, ...], Array, Array, Array, Array]:
    """Joints, their position, velocity, acceleration and generalised force."""
    return (
        robot.joints,
        _columns(segment.configuration, robot.position_index),
        _columns(segment.velocity, robot.velocity_index),
        _columns(segment.acceleration, robot.velocity_index),
        _columns(generalised, robot.velocity_index),
    )


def segment_demand(
    robot: Robot,
    segment: Segment,
    *,
    forces: GroundForces = PAPER,
    quasi_static: bool = False,
    threads: int = 1,
) -> tuple[JointDemand, ContactForces | None]:
    """Joint torques over one segment, with the contact forces they rest on.

    Args:
        robot: With floating base the ground carries it; with fixed base there is no contact.
        segment: The motion.
        forces: How the ground's forces are chosen.
        quasi_static: Leave out the links' inertial terms.
        threads: For Pinocchio's thread pool.

    Returns:
        The demand and the contact forces (None for a fixed base).

    Raises:
        StanceError: A foot would have to pull or slide.
    """
    generalised = inverse_dynamics(robot, segment, quasi_static=quasi_static, threads=threads)
    bare = _motion_and_torque(robot, segment, generalised)
    joints, position, velocity, acceleration, torque = bare
    contacts = None
    if robot.floating:
        contacts, from_ground = _ground(robot, segment, generalised, forces)
        for i, leg in enumerate(segment.stance):
            columns = robot.layout.of(robot.leg_names.index(leg))
            torque[:, columns] -= from_ground[:, i, : columns.size]
    demand = JointDemand(
        joints, segment.time, position, velocity, acceleration, torque, segment.name
    )
    return demand, contacts


@dataclass(frozen=True)
class MotionDemand:
    """Demand and contact forces of a whole motion, segment by segment.

    Attributes:
        segments: Demand at the joints.
        contacts: Forces of the ground; None for a fixed base.
        period: Of the motion [s]; None where it does not repeat.
        forces: How the ground's forces were chosen.
    """

    segments: tuple[JointDemand, ...]
    contacts: tuple[ContactForces | None, ...]
    period: float | None
    forces: GroundForces = PAPER

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the columns."""
        return self.segments[0].joints


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
