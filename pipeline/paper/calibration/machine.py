"""From free numbers to everything the paper prints, fast enough to be called ten thousand times.

The work falls in two: the robot's part (geometry, gait, inverse dynamics) costs fifty times as much
as the actuators' part, which takes a given demand. Only the two middle legs are followed.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from actuators.chain import Chain, ChainResult, HoldingResult
from actuators.energy.energy import stage_energy
from actuators.energy.limits import limit_rows
from actuators.loading.build import Catalog
from actuators.shaft import ShaftSeries
from pipeline.dynamics.joint_demand import motion_demand
from pipeline.motion.walking import walking_motion
from pipeline.paper.errors import CalibrationError
from pipeline.paper.published import Published
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import RobotSpec
from pipeline.simulation.walk_stand import joint_series, stand

Array = NDArray[np.float64]
MIDDLE_LEGS = ("lm", "rm")
PUBLISHED_LEG = "rm"
#: Robot numbers solved from the reaction and the torques of Table III.
POSTURE = ("trunk_com_left", "joint_2_lateral", "body_height")
#: Samples per half period: within 0.2 % of the converged energies, see tests.
SAMPLES = 81
ROBOT = "robot"
#: Of each pair whose product is published, the ratio that is free, and the one that follows.
SPLITS = {"harmonic_drive.ratio": "timing_belt.ratio", "planetary.ratio": "hypoid.ratio"}
Number = TypeVar("Number", float, Array)
_REMEMBERED = 16  # outcomes kept per robot: a derivative changes one actuator at a time


@dataclass(frozen=True)
class RobotPart:
    """What the robot asks of its middle legs.

    Attributes:
        robot: With the posture solved.
        reaction: Vertical force on the middle right foot, standing [N].
        standing_torque: Of the middle right leg's joints, standing [N*m], shape (3,).
        series: Both middle legs' joints over a cycle.
    """

    robot: Robot
    reaction: float
    standing_torque: Array
    series: ShaftSeries
    _outcomes: OrderedDict[tuple[object, ...], Outcome] = field(
        default_factory=OrderedDict, repr=False, compare=False
    )


@dataclass(frozen=True)
class Outcome:
    """What one alternative makes of it.

    Attributes:
        chain: The alternative.
        walking: Both middle legs.
        holding: The middle right leg standing.
        drawn: Electrical energy E_el(+) per cycle, by leg [J].
        returned: E_el(-) per cycle, by leg [J].
        excess: Motor quantity to its peak over its limit, less one.
    """

    chain: Chain
    walking: ChainResult
    holding: HoldingResult
    drawn: Mapping[str, float]
    returned: Mapping[str, float]
    excess: Mapping[str, float]


@dataclass(frozen=True)
class ActuatorPart:
    """What the alternatives make of it.

    Attributes:
        chains: By alternative.
        walking: By alternative, both middle legs.
        holding: By alternative, the middle right leg standing.
        energy: Consumption per cycle, alternative to leg [J]: E_el(+), or net of what returns.
        outcomes: All of it, by alternative.
    """

    chains: Mapping[str, Chain]
    walking: Mapping[str, ChainResult]
    holding: Mapping[str, HoldingResult]
    energy: Mapping[str, Mapping[str, float]]
    outcomes: Mapping[str, Outcome]


def standing_targets(published: Mapping[str, Published]) -> Array:
    """Reaction [N] and torques of joints 2 and 3 [N*m] that fix the posture."""
    names = ("standing_reaction_rm", "standing_torque_2", "standing_torque_3")
    return np.array([published[name].value for name in names])


def standing_state(spec: RobotSpec) -> tuple[Robot, float, Array]:
    """Reaction and torques of the middle right leg, standing."""
    robot = load_robot(spec)
    standing = stand(robot, {})
    contacts, torque = standing.contacts, standing.demand.torque[0]
    reaction = float(contacts.force_world[0, contacts.legs.index(PUBLISHED_LEG), 2])
    columns = [robot.joints.index(j) for j in leg_joints(spec, PUBLISHED_LEG)]
    return robot, reaction, torque[columns]


def leg_joints(spec: RobotSpec, leg: str) -> tuple[str, ...]:
    """Joints of a leg."""
    return next(entry.joints for entry in spec.legs if entry.name == leg)


def solve_posture(spec: RobotSpec, target: Array) -> RobotSpec:
    """Place joint 2, the body's height and the trunk's mass so that standing comes out as printed.

    Statics of the loaded leg in its frontal plane, x outboard, R the reaction, phi the tibia's tilt
    outboard, q2 the femur's rise (moments about joint 3, then about joint 2):

        G3 = (m_t g c_t - R) L_t sin(phi)
        G2 = m_f g c_f L_f cos(q2) + (m_t g - R) L_f cos(q2) + G3

    The trunk's lateral shift then follows from the reaction, which is linear in it.

    Args:
        spec: The robot.
        target: Reaction [N], torque of joint 2 and of joint 3 [N*m].

    Raises:
        CalibrationError: No posture meets the targets.
    """
    p = spec.parameters
    reaction, torque_2, torque_3 = (float(x) for x in target)
    weight_f, weight_t = p["femur_mass"] * p["gravity"], p["tibia_mass"] * p["gravity"]
    femur, tibia = p["femur_length"], p["tibia_length"]
    sine = torque_3 / ((weight_t * p["tibia_com"] - reaction) * tibia)
    cosine = (torque_2 - torque_3) / ((weight_f * p["femur_com"] + weight_t - reaction) * femur)
    if not (abs(sine) < 1 and 0 < cosine < 1):
        raise CalibrationError("no posture of the robot gives the torques of Table III")
    placed = {
        "joint_2_lateral": p["robot_width"] / 2 - femur * cosine - tibia * sine,
        "body_height": tibia * math.sqrt(1 - sine**2) - femur * math.sqrt(1 - cosine**2),
    }
    spec = spec.with_parameters(placed)
    shifts = (0.0, 0.01)
    found = [standing_state(spec.with_parameters({"trunk_com_left": x}))[1] for x in shifts]
    slope = (found[1] - found[0]) / (shifts[1] - shifts[0])
    return spec.with_parameters({"trunk_com_left": (reaction - found[0]) / slope})


def robot_part(spec: RobotSpec, values: Mapping[str, float], target: Array) -> RobotPart:
    """Solve the posture and walk one cycle.

    Args:
        spec: The robot file.
        values: Free numbers; those of the robot are applied.
        target: As for `solve_posture`.

    Raises:
        PipelineError: Out of reach, tipping, or no posture meets the targets.
    """
    own = {key.split(".")[1]: v for key, v in values.items() if key.startswith(ROBOT + ".")}
    return part_of(solve_posture(spec.with_parameters(own), target))


def part_of(spec: RobotSpec, samples: int = SAMPLES) -> RobotPart:
    """The robot's part of a robot file as it stands.

    Raises:
        PipelineError: Out of reach or tipping.
    """
    robot, reaction, torque = standing_state(spec)
    demand = motion_demand(robot, walking_motion(robot, samples=samples))
    joints = tuple(j for leg in MIDDLE_LEGS for j in leg_joints(spec, leg))
    return RobotPart(robot, reaction, torque, joint_series(demand, joints))


def catalog_with(catalog: Catalog, values: Mapping[str, float], ratio: float) -> Catalog:
    """The catalogue with free numbers applied; split ratios keep their product.

    Args:
        catalog: To start from.
        values: Free numbers; those of components are applied.
        ratio: Total ratio of every alternative.
    """
    applied = {key: v for key, v in values.items() if not key.startswith(ROBOT + ".")}
    for key, value in with_splits(applied, ratio).items():
        catalog = catalog.replaced(key, value)
    return catalog


def with_splits(values: Mapping[str, Number], ratio: float) -> dict[str, Number]:
    """Numbers of components, the second ratio of each pair following from the first.

    Args:
        values: By reference.
        ratio: Total ratio of every alternative.
    """
    pairs = {first: second for first, second in SPLITS.items() if first in values}
    return dict(values) | {second: ratio / values[first] for first, second in pairs.items()}


def actuator_part(part: RobotPart, catalog: Catalog, *, net: bool = False) -> ActuatorPart:
    """Take a demand through every alternative.

    Args:
        part: What the robot asks.
        catalog: The alternatives.
        net: Whether consumption is E_el(+) - E_el(-) instead of E_el(+).
    """
    outcomes = {name: _outcome(part, catalog, name) for name in catalog.alternatives}
    energy = {
        name: {leg: o.drawn[leg] - (o.returned[leg] if net else 0.0) for leg in MIDDLE_LEGS}
        for name, o in outcomes.items()
    }
    return ActuatorPart(
        {name: o.chain for name, o in outcomes.items()},
        {name: o.walking for name, o in outcomes.items()},
        {name: o.holding for name, o in outcomes.items()},
        energy,
        outcomes,
    )


def _outcome(part: RobotPart, catalog: Catalog, name: str) -> Outcome:
    """One alternative, remembered with the robot while none of its numbers changes."""
    alternative = catalog.alternatives[name]
    motor = catalog.components[alternative.motor].parameters
    structure = ((e.name, e.law, e.stage, *e.arguments.items()) for e in alternative.elements)
    numbers = (catalog.parameter(r).value for r in alternative.references)
    key = (name, *structure, *motor.values(), *numbers)
    known = part._outcomes.pop(key, None)
    if known is None:
        known = _computed_outcome(part, catalog.chain(name))
    part._outcomes[key] = known
    if len(part._outcomes) > _REMEMBERED:
        part._outcomes.popitem(last=False)
    return known


def _computed_outcome(part: RobotPart, chain: Chain) -> Outcome:
    walking = chain.moving(part.series)
    energy = stage_energy(walking, "el")
    columns = {
        leg: [part.series.joints.index(j) for j in leg_joints(part.robot.spec, leg)]
        for leg in MIDDLE_LEGS
    }
    excess: dict[str, float] = {}
    for row in limit_rows(walking):
        excess[row.quantity] = max(excess.get(row.quantity, -1.0), row.peak / row.limit - 1)
    return Outcome(
        chain,
        walking,
        chain.holding(part.standing_torque),
        {leg: float(energy.forward[c].sum()) for leg, c in columns.items()},
        {leg: float(energy.reverse[c].sum()) for leg, c in columns.items()},
        excess,
    )


def with_transfer_path(spec: RobotSpec, name: str) -> RobotSpec:
    """The robot with another path of the foot through the air."""
    return spec.with_gait(transfer_path=name)
