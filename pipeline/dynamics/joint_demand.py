"""Torque demanded of every joint: inverse dynamics minus what the ground supplies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from pipeline.dynamics.contact_forces import ContactForces, least_tangential_forces
from pipeline.dynamics.stability import stability_margins
from pipeline.errors import GaitError, TippingError
from pipeline.motion.motion import Motion, Segment
from pipeline.robot.kinematics import posture_at
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


def contact_forces(robot: Robot, segment: Segment, generalised: Array) -> ContactForces:
    """Ground forces that supply the wrench demanded of the base.

    Args:
        robot: A robot with a floating base.
        segment: The motion.
        generalised: From `inverse_dynamics`, shape (N, nv).

    Raises:
        TippingError: A foot would have to pull; names foot, instant, force and margin.
        GaitError: Fewer than three feet stand.
    """
    return _ground(robot, segment, generalised)[0]


def _ground(robot: Robot, segment: Segment, generalised: Array) -> tuple[ContactForces, Array]:
    """Ground forces, and the torques (N, K, 3) they put into the joints of the K standing legs."""
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
    rotation = robot.base_rotation(segment.configuration)  # base -> world, (N, 3, 3) or None
    n, k = segment.time.size, len(stance)
    feet = np.empty((n, len(legs), 3))
    force = np.zeros_like(feet)
    force_world = force if rotation is None else np.zeros_like(feet)
    torque = np.empty((n, k, columns.shape[1]))
    for s in _blocks(n):
        posture = posture_at(chains, segment.configuration[s].T[columns])
        feet[s, order] = posture.feet
        turn = None if rotation is None else rotation[s]
        in_base, in_world = _supplied(generalised[s, :6], posture.feet[:, :k], turn)
        force_world[s, stance] = in_world
        force[s, stance] = in_base
        torque[s] = posture.force_torques(in_base)
    _refuse_pulling(robot, segment, force_world[:, stance, 2])
    contacts = ContactForces(legs, segment.stance, segment.time, feet, force, force_world)
    return contacts, torque


def _supplied(wrench: Array, feet: Array, rotation: Array | None) -> tuple[Array, Array]:
    """Forces on the standing feet in the base and in the world frame, for a wrench on the base."""
    if rotation is None:
        force = least_tangential_forces(wrench, feet)
        return force, force
    parts = [np.einsum("nij,nj->ni", rotation, part) for part in (wrench[:, :3], wrench[:, 3:])]
    world_feet = np.einsum("nij,nfj->nfi", rotation, feet)
    force = least_tangential_forces(np.concatenate(parts, axis=1), world_feet)
    return np.einsum("nji,nfj->nfi", rotation, force), force


def _refuse_pulling(robot: Robot, segment: Segment, normal: Array) -> None:
    lowest = float(normal.min())  # NaN where any force is
    if not np.isfinite(lowest):
        raise TippingError(
            f"the robot tips: in '{segment.name}' the feet stand in one line and carry no moment "
            "across it; stand on feet of both sides"
        )
    # A foot that is exactly unloaded (a tripod at the edge of its stability) still stands.
    if lowest < -1e-9 * max(1.0, float(np.abs(normal).max())):
        sample, foot = np.unravel_index(int(normal.argmin()), normal.shape)
        margin = stability_margins(robot, segment)[sample]
        raise TippingError(
            f"the robot tips at t = {segment.time[sample]:.4g} s ({segment.name}): the foot of leg "
            f"'{segment.stance[foot]}' would have to pull with {-lowest:.1f} N, static margin "
            f"{1e3 * margin:.1f} mm; widen the hip spacing or shorten the stroke"
        )


def _blocks(n: int) -> list[slice]:
    return [slice(i, min(i + _BLOCK, n)) for i in range(0, n, _BLOCK)]


def _columns(values: Array, index: NDArray[np.intp]) -> Array:
    """Columns of an array, without a copy where they lie side by side."""
    first, count = int(index[0]), index.size
    if np.array_equal(index, np.arange(first, first + count)):
        return values[:, first : first + count]
    return values[:, index]


def segment_demand(
    robot: Robot, segment: Segment, *, quasi_static: bool = False, threads: int = 1
) -> tuple[JointDemand, ContactForces | None]:
    """Joint torques over one segment, with the contact forces they rest on.

    Args:
        robot: With floating base the ground carries it; with fixed base there is no contact.
        segment: The motion.
        quasi_static: Leave out the links' inertial terms.
        threads: For Pinocchio's thread pool.

    Returns:
        The demand and the contact forces (None for a fixed base).

    Raises:
        TippingError: A foot would have to pull.
    """
    generalised = inverse_dynamics(robot, segment, quasi_static=quasi_static, threads=threads)
    torque = _columns(generalised, robot.velocity_index)
    contacts = None
    if robot.floating:
        contacts, from_ground = _ground(robot, segment, generalised)
        for i, leg in enumerate(segment.stance):
            columns = robot.layout.of(robot.leg_names.index(leg))
            torque[:, columns] -= from_ground[:, i, : columns.size]
    demand = JointDemand(
        joints=robot.joints,
        time=segment.time,
        position=_columns(segment.configuration, robot.position_index),
        velocity=_columns(segment.velocity, robot.velocity_index),
        acceleration=_columns(segment.acceleration, robot.velocity_index),
        torque=torque,
        segment=segment.name,
    )
    return demand, contacts


@dataclass(frozen=True)
class MotionDemand:
    """Demand and contact forces of a whole motion, segment by segment."""

    segments: tuple[JointDemand, ...]
    contacts: tuple[ContactForces | None, ...]
    period: float | None

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the columns."""
        return self.segments[0].joints


def motion_demand(
    robot: Robot, motion: Motion, *, quasi_static: bool = False, threads: int = 1
) -> MotionDemand:
    """Joint demand along a motion; see `segment_demand`."""
    parts = [
        segment_demand(robot, segment, quasi_static=quasi_static, threads=threads)
        for segment in motion.segments
    ]
    return MotionDemand(
        tuple(demand for demand, _ in parts),
        tuple(contacts for _, contacts in parts),
        motion.period,
    )
