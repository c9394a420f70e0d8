"""The hexapod at sets of numbers: what its middle legs ask of their joints, what actuators draw.

Only the two middle legs are followed. Each set of numbers has one column per joint of both, so that
many sets go through a chain at once. The robot's part (geometry, gait, inverse dynamics) costs
fifty times as much as the actuators'.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.chain import Chain, ChainResult, HoldingResult
from actuators.energy.energy import split_integral, stage_energy
from actuators.energy.limits import rms_over_time
from actuators.errors import LegwattError
from actuators.loading.build import Catalog
from actuators.shaft import ShaftSeries
from pipeline.dynamics.joint_demand import motion_demand
from pipeline.motion.walking import walking_motion
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import RobotSpec
from pipeline.simulation.walk_stand import joint_series, stand

Number = TypeVar("Number", float, Array)
MIDDLE_LEGS = ("lm", "rm")
PUBLISHED_LEG = "rm"
JOINTS_PER_LEG = 3
COLUMNS = JOINTS_PER_LEG * len(MIDDLE_LEGS)  # per set of numbers
#: Robot numbers solved from the reaction and the torques of Table III.
POSTURE = ("trunk_com_left", "joint_2_lateral", "body_height")
#: Samples per half period: within 0.2 % of the converged energies, see tests.
SAMPLES = 81
ROBOT = "robot"
#: Of each pair whose product is published, the ratio that is free, and the one that follows.
SPLITS = {"harmonic_drive.ratio": "timing_belt.ratio", "planetary.ratio": "hypoid.ratio"}
_SAMPLED = ("position", "velocity", "acceleration", "torque", "direction")


@dataclass(frozen=True)
class Demand:
    """What W sets of numbers ask of the joints of both middle legs: columns C = 6 W, set by set."""

    series: ShaftSeries  #: Over a cycle (N, C); its time may be (N, C), each column's own [s].
    standing: Array  #: Torques standing on three feet (C,) [N*m].

    @property
    def count(self) -> int:
        """How many sets."""
        return self.standing.size // COLUMNS

    def taken(self, sets: NDArray[np.intp]) -> Demand:
        """Some of the sets, also more than once, by number (W,)."""
        columns = (COLUMNS * sets[:, None] + np.arange(COLUMNS)).ravel()
        s = self.series
        time = s.time if s.time.ndim == 1 else s.time[:, columns]
        arrays = (getattr(s, name)[:, columns] for name in _SAMPLED)
        joints = tuple(s.joints[k] for k in columns)
        return Demand(ShaftSeries(joints, time, *arrays), self.standing[columns])


def joined(demands: Sequence[Demand]) -> Demand:
    """Sets of several robots as one; shorter series repeat their last sample, without width."""
    length = max(d.series.time.size for d in demands)

    def padded(name: str) -> Array:
        every = []
        for d in demands:
            values = getattr(d.series, name)
            columns = np.broadcast_to(values.T, (len(d.series.joints), len(values))).T
            every.append(columns[np.minimum(np.arange(length), len(values) - 1)])
        return np.concatenate(every, axis=1)

    joints = tuple(joint for d in demands for joint in d.series.joints)
    series = ShaftSeries(joints, *(padded(name) for name in ("time", *_SAMPLED)))
    return Demand(series, np.concatenate([d.standing for d in demands]))


@dataclass(frozen=True)
class RobotPart:
    """What a robot asks of its middle legs."""

    robot: Robot  #: With the posture solved.
    reaction: float  #: Vertical force on the middle right foot, standing [N].
    demand: Demand  #: One set.


@dataclass(frozen=True)
class Outcome:
    """What one alternative makes of a demand."""

    chain: Chain  #: The alternative.
    walking: ChainResult  #: Every joint over a cycle.
    holding: HoldingResult  #: Every joint, standing on three feet.
    drawn: Mapping[str, Array]  #: Electrical energy E_el(+) per cycle, by leg, (W,) [J].
    returned: Mapping[str, Array]  #: E_el(-) per cycle, by leg, (W,) [J].
    #: Largest of a motor quantity over its limit, less one, by quantity, (W,).
    excess: Mapping[str, Array]

    def consumed(self, leg: str, *, net: bool = False) -> float:
        """What a leg of one set consumes per cycle [J]: E_el(+), or net of what returns."""
        return float(self.drawn[leg][0] - (self.returned[leg][0] if net else 0.0))

    @property
    def held(self) -> Mapping[str, Array]:
        """Motor torque, current, voltage and power of the printed leg of one set, (3,)."""
        names = ("motor_torque", "current", "voltage", "power")
        return {n: printed_leg(getattr(self.holding, n))[0] for n in names}


def by_leg(values: Array) -> dict[str, Array]:
    """Values of every column (C,) by leg, of each set and joint, (W, 3)."""
    legs = values.reshape(-1, len(MIDDLE_LEGS), JOINTS_PER_LEG)
    return {leg: legs[:, k] for k, leg in enumerate(MIDDLE_LEGS)}


def printed_leg(values: Array) -> Array:
    """Values of the columns (C,) of both legs, for the printed one by set and joint, (W, 3)."""
    return by_leg(values)[PUBLISHED_LEG]


def robot_part(spec: RobotSpec, samples: int = SAMPLES) -> RobotPart:
    """What the robot of a file asks as it stands.

    Raises:
        LegwattError: Out of reach or tipping.
    """
    robot, reaction, torque = standing_state(spec)
    demand = motion_demand(robot, walking_motion(robot, samples=samples))
    return RobotPart(robot, reaction, Demand(joint_series(demand, _joints(spec)), torque))


def standing_state(spec: RobotSpec) -> tuple[Robot, float, Array]:
    """Reaction at the middle right foot [N] and torques of the middle legs (6,) [N*m], standing."""
    robot = load_robot(spec)
    standing = stand(robot, {})
    contacts, torque = standing.contacts, standing.demand.torque[0]
    reaction = float(contacts.force_world[0, contacts.legs.index(PUBLISHED_LEG), 2])
    return robot, reaction, torque[[robot.joints.index(j) for j in _joints(spec)]]


def _joints(spec: RobotSpec) -> tuple[str, ...]:
    legs = {leg.name: leg.joints for leg in spec.legs}
    return tuple(joint for leg in MIDDLE_LEGS for joint in legs[leg])


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
        LegwattError: No posture meets the targets.
    """
    p = spec.parameters
    reaction, torque_2, torque_3 = (float(x) for x in target)
    weight_f, weight_t = p["femur_mass"] * p["gravity"], p["tibia_mass"] * p["gravity"]
    femur, tibia = p["femur_length"], p["tibia_length"]
    sine = torque_3 / ((weight_t * p["tibia_com"] - reaction) * tibia)
    cosine = (torque_2 - torque_3) / ((weight_f * p["femur_com"] + weight_t - reaction) * femur)
    if not (abs(sine) < 1 and 0 < cosine < 1):
        raise LegwattError("no posture of the robot gives the torques of Table III")
    placed = {
        "joint_2_lateral": p["robot_width"] / 2 - femur * cosine - tibia * sine,
        "body_height": tibia * math.sqrt(1 - sine**2) - femur * math.sqrt(1 - cosine**2),
    }
    spec = spec.with_parameters(placed)
    shifts = (0.0, 0.01)
    found = [standing_state(spec.with_parameters({"trunk_com_left": x}))[1] for x in shifts]
    slope = (found[1] - found[0]) / (shifts[1] - shifts[0])
    return spec.with_parameters({"trunk_com_left": (reaction - found[0]) / slope})


def with_splits(values: Mapping[str, Number], ratio: float) -> dict[str, Number]:
    """Numbers of components, the second ratio of each pair following from the total ratio."""
    pairs = {first: second for first, second in SPLITS.items() if first in values}
    return dict(values) | {second: ratio / values[first] for first, second in pairs.items()}


def chain_at(catalog: Catalog, name: str, values: Mapping[str, float | Array]) -> Chain:
    """An alternative for the columns of a demand of W sets.

    `values` stand in for the catalogue's numbers, SI by reference: one, or one per set (W,).
    """
    own = {k: np.repeat(v, COLUMNS) if np.ndim(v) else v for k, v in values.items()}
    return catalog.chain(name, own)


def drawn(demand: Demand, chain: Chain) -> dict[str, Array]:
    """E_el(+) per cycle by leg, (W,) [J], with an alternative made for the demand."""
    power = chain.inverse(demand.series).electrical_power
    forward, _ = split_integral(demand.series.time, power)
    return {leg: energy.sum(axis=1) for leg, energy in by_leg(forward).items()}


def outcome(demand: Demand, chain: Chain) -> Outcome:
    """Take a demand through an alternative made for it."""
    walking = chain.inverse(demand.series)
    energy, motor = stage_energy(walking, "el"), chain.motor
    peaks = {
        "speed": np.abs(walking.motor.velocity).max(axis=0) / motor.max_speed,
        "voltage": np.abs(walking.voltage).max(axis=0) / motor.supply_voltage,
        "current": np.abs(walking.current).max(axis=0) / motor.peak_current,
        "rms_current": rms_over_time(demand.series.time, walking.current)
        / motor.continuous_current,
    }
    both = (energy.forward, energy.reverse)
    forward, reverse = ({k: e.sum(axis=1) for k, e in by_leg(own).items()} for own in both)
    excess = {name: peak.reshape(-1, COLUMNS).max(axis=1) - 1 for name, peak in peaks.items()}
    held = chain.holding(demand.standing)
    return Outcome(chain, walking, held, forward, reverse, excess)


def outcomes(
    demand: Demand, catalog: Catalog, values: Mapping[str, float | Array] | None = None
) -> dict[str, Outcome]:
    """What every alternative makes of a demand; see `chain_at`."""
    return {
        name: outcome(demand, chain_at(catalog, name, values or {}))
        for name in catalog.alternatives
    }
