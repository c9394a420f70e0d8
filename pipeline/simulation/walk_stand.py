"""Ties the rooms together: a robot's demand through every actuator alternative."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from actuators.chain import ChainResult, HoldingResult
from actuators.energy.regeneration import Supply, supply
from actuators.reversals import split_at_reversals
from actuators.shaft import ShaftSeries
from pipeline.dynamics.contact_forces import ContactForces
from pipeline.dynamics.joint_demand import JointDemand, MotionDemand, motion_demand, segment_demand
from pipeline.dynamics.stability import stability_margins
from pipeline.machine.drivetrains import Actuators
from pipeline.motion.motion import Motion, Segment
from pipeline.motion.standing import standing_posture
from pipeline.motion.walking import walking_motion
from pipeline.robot.robot import Robot

Array = NDArray[np.float64]
#: From the demand of bodies and ground to that on the actuators.
Adjust = Callable[[Segment, JointDemand], JointDemand]


@dataclass(frozen=True)
class Regeneration:
    """What becomes of electrical energy that flows back from a motor.

    Attributes:
        policy: ``none``, ``fraction`` or ``bus``.
        fraction: Share that is used again, for ``fraction``.
    """

    policy: str = "none"
    fraction: float = 0.0


@dataclass(frozen=True)
class Standing:
    """The robot standing still.

    Attributes:
        segment: The posture.
        demand: Torques to hold, one sample.
        contacts: Ground forces, one sample.
        holding: By alternative; arrays of shape (J,).
    """

    segment: Segment
    demand: JointDemand
    contacts: ContactForces
    holding: Mapping[str, HoldingResult]


@dataclass(frozen=True)
class Walking:
    """The robot over one gait cycle.

    Attributes:
        motion: The gait.
        demand: At the joints.
        margins: Static stability by segment [m].
        results: By alternative.
        supplies: What each alternative takes from the supply.
    """

    motion: Motion
    demand: MotionDemand
    margins: tuple[Array, ...]
    results: Mapping[str, ChainResult]
    supplies: Mapping[str, Supply]


def joint_series(demand: MotionDemand, joints: Sequence[str] | None = None) -> ShaftSeries:
    """The joints' side of the actuators: segments in a row, split at velocity zeros.

    Args:
        demand: Of all joints.
        joints: Those to follow; all by default.
    """
    names = tuple(joints or demand.joints)
    columns = [demand.joints.index(joint) for joint in names]

    def joined(name: str) -> Array:
        parts = [getattr(part, name) for part in demand.segments]
        return np.concatenate([part[:, columns] if joints else part for part in parts])

    time = np.concatenate([part.time for part in demand.segments])
    return split_at_reversals(
        ShaftSeries.at_joint(
            names, time, *(joined(n) for n in ("position", "velocity", "acceleration", "torque"))
        )
    )


def stand(
    robot: Robot,
    chains: Mapping[str, Actuators],
    feet: tuple[str, ...] | None = None,
    adjust: Adjust | None = None,
) -> Standing:
    """Stand still and hold.

    Args:
        robot: With a floating base.
        chains: By alternative.
        feet: Legs that stand; the robot file's by default.
        adjust: Changes the demand on the actuators; see `pipeline.simulation.edited`.

    Raises:
        TippingError: A foot would have to pull.
    """
    segment = standing_posture(robot, feet)
    demand, contacts = segment_demand(robot, segment)
    assert contacts is not None
    if adjust is not None:
        demand = adjust(segment, demand)
    torque = demand.torque[0]
    return Standing(
        segment, demand, contacts, {name: chain.holding(torque) for name, chain in chains.items()}
    )


def walking_demand(
    robot: Robot, *, samples: int, quasi_static: bool = False, adjust: Adjust | None = None
) -> tuple[Motion, MotionDemand]:
    """One cycle and what it demands of the joints; see `walk`."""
    motion = walking_motion(robot, samples=samples)
    demand = motion_demand(robot, motion, quasi_static=quasi_static)
    if adjust is not None:
        pairs = zip(motion.segments, demand.segments, strict=True)
        demand = replace(demand, segments=tuple(adjust(segment, part) for segment, part in pairs))
    return motion, demand


def walk(
    robot: Robot,
    chains: Mapping[str, Actuators],
    *,
    samples: int,
    quasi_static: bool = False,
    regeneration: Regeneration | None = None,
    adjust: Adjust | None = None,
) -> Walking:
    """Walk one cycle.

    Args:
        robot: With a floating base.
        chains: By alternative.
        samples: Per half period.
        quasi_static: Leave out the links' inertial terms.
        regeneration: What becomes of returned energy; none by default.
        adjust: Changes the demand on the actuators; see `pipeline.simulation.edited`.

    Raises:
        TippingError: A foot would have to pull.
    """
    policy = regeneration or Regeneration()
    motion, demand = walking_demand(
        robot, samples=samples, quasi_static=quasi_static, adjust=adjust
    )
    series = joint_series(demand)
    results = {name: chain.moving(series) for name, chain in chains.items()}
    return Walking(
        motion,
        demand,
        tuple(stability_margins(robot, segment) for segment in motion.segments),
        results,
        {name: supply(r, policy.policy, policy.fraction) for name, r in results.items()},
    )
