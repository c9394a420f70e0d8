"""The hexapod at sets of numbers: what its middle legs ask, what actuators draw, what is printed.

Only the two middle legs are followed. Each set of numbers has one column per joint of both, so that
many sets go through a chain at once. The robot's part (geometry, gait, inverse dynamics) costs
fifty times as much as the actuators'.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.chain import Chain, ChainResult, HoldingResult
from actuators.elements.element import gearing
from actuators.energy import rms_over_time, split_integral
from actuators.errors import LegwattError
from actuators.loading.build import Catalog
from actuators.shaft import ShaftSeries
from pipeline.dynamics.joint_demand import motion_demand, segment_demand
from pipeline.motion.walking import standing_posture, walking_motion
from pipeline.paper.published import ALTERNATIVES, CYCLE, EVEN, EXTRA, PAIR
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import RobotSpec
from pipeline.simulation.walk_stand import break_even, joint_series

MIDDLE_LEGS = ("lm", "rm")
JOINTS = (1, 2, 3)
COLUMNS = len(JOINTS) * len(MIDDLE_LEGS)  # per set of numbers
#: The leg of which the paper prints numbers, among the middle legs.
PRINTED = MIDDLE_LEGS.index("rm")
#: Samples per half period: within 0.2 % of the converged energies, see tests.
SAMPLES = 81
#: Of each pair whose product is published, the ratio that is free, and the one that follows.
SPLITS = {"harmonic_drive.ratio": "timing_belt.ratio", "planetary.ratio": "hypoid.ratio"}
#: Id of a printed input to the number of the robot file.
_INPUTS = {
    **{x: x for x in ("body_length", "robot_width", "femur_length", "tibia_length")},
    **{"robot_mass": "total_mass", "foot_stroke_longitudinal": "foot_stroke"},
    **{"foot_stroke_vertical": "foot_lift", "walking_speed": "walking_speed"},
    "gait_period": "gait_period",
}
_SAMPLED = ("position", "velocity", "acceleration", "torque", "direction")


@dataclass(frozen=True)
class Demand:
    """What W sets of numbers ask of the joints of both middle legs: columns C = 6 W, set by set."""

    series: ShaftSeries  #: Over a cycle (N, C); its time may be (N, C), each column's own [s].
    standing: Array  #: Torques standing on three feet (C,) [N*m].

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
    """What an alternative makes of W sets, each quantity computed when it is asked for."""

    demand: Demand
    chain: Chain  #: Made for the demand, see `chain_at`.

    @cached_property
    def walking(self) -> ChainResult:
        """Every joint over a cycle."""
        return self.chain.inverse(self.demand.series)

    @cached_property
    def holding(self) -> HoldingResult:
        """Every joint, standing on three feet."""
        return self.chain.holding(self.demand.standing)

    @cached_property
    def energy(self) -> tuple[Array, Array]:
        """E_el(+) and E_el(-) per cycle by set and leg, (W, 2) each [J]."""
        forward, reverse = split_integral(self.demand.series.time, self.walking.electrical_power)
        return by_leg(forward).sum(axis=2), by_leg(reverse).sum(axis=2)

    @property
    def drawn(self) -> Array:
        """E_el(+) per cycle by set and leg, (W, 2) [J]: what flows back is lost."""
        return self.energy[0]

    @cached_property
    def excess(self) -> dict[str, Array]:
        """Largest of a motor quantity over its limit, less one, by quantity, (W,)."""
        walking, motor = self.walking, self.chain.driven
        rms = rms_over_time(self.demand.series.time, walking.current)
        peaks = {
            "speed": np.abs(walking.motor.velocity).max(axis=0) / motor.max_speed,
            "voltage": np.abs(walking.voltage).max(axis=0) / motor.supply_voltage,
            "current": np.abs(walking.current).max(axis=0) / motor.peak_current,
            "rms_current": rms / motor.continuous_current,
        }
        return {name: peak.reshape(-1, COLUMNS).max(axis=1) - 1 for name, peak in peaks.items()}


def by_leg(values: Array) -> Array:
    """Values of every column (C,) by set, leg and joint, (W, 2, 3)."""
    return values.reshape(-1, len(MIDDLE_LEGS), len(JOINTS))


def printed_leg(values: Array) -> Array:
    """Values of every column (C,), those of the printed leg by set and joint, (W, 3)."""
    return by_leg(values)[:, PRINTED]


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
    demand, contacts = segment_demand(robot, standing_posture(robot))
    assert contacts is not None
    torque = demand.torque[0]
    reaction = float(contacts.force_world[0, contacts.legs.index(MIDDLE_LEGS[PRINTED]), 2])
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


def chain_at(catalog: Catalog, name: str, values: Mapping[str, float | Array]) -> Chain:
    """An alternative for the columns of a demand of W sets.

    `values` stand in for the catalogue's numbers, SI by reference: one, or one per set (W,). The
    second ratio of each pair of `SPLITS` follows from the first and the total ratio.
    """
    own = {k: np.repeat(v, COLUMNS) if np.ndim(v) else v for k, v in values.items()}
    for first, second in SPLITS.items():
        if first in own:
            own[second] = catalog.parameter("requirement.ratio").value / own[first]
    return catalog.chain(name, own)


def outcomes(
    demand: Demand, catalog: Catalog, values: Mapping[str, float | Array] | None = None
) -> dict[str, Outcome]:
    """What every alternative makes of a demand; see `chain_at`."""
    return {n: Outcome(demand, chain_at(catalog, n, values or {})) for n in catalog.alternatives}


def figures(found: Mapping[str, Outcome]) -> dict[str, Array]:
    """What the paper prints of its alternatives, by id, and `EXTRA`, of each set (W,), SI."""
    out: dict[str, Array] = {}
    for name in ALTERNATIVES:
        held = found[name].holding
        if name != "irreversible":
            for kind in ("motor_torque", "current", "voltage", "power"):
                values = printed_leg(getattr(held, kind))
                out |= {f"{name}_{kind}_{j}": values[:, j - 1] for j in (2, 3)}
        out[f"{name}_leg_energy_3s"] = printed_leg(held.power).sum(axis=1) * CYCLE
        if name != "ideal":
            both = (found[n].drawn[:, PRINTED] for n in (name, "ideal"))
            out[f"walking_ratio_{name}"] = np.divide(*both)
    # Fig. 21 adds up both middle legs: walking, both take their energy per cycle; standing, the
    # loaded one takes the reversible actuator's power, the irreversible one nothing.
    reversible, irreversible = (found[name].drawn for name in PAIR)
    out[EXTRA] = (irreversible - reversible).mean(axis=1)
    pairs = zip(2 * out[EXTRA], out["reversible_leg_energy_3s"], strict=True)
    return out | {EVEN: np.array([break_even(*pair) for pair in pairs])}


def computed(part: RobotPart, found: Mapping[str, Outcome]) -> dict[str, float]:
    """Every printed quantity, and `EXTRA`, of one robot, by id, SI."""
    parameters = part.robot.spec.parameters
    out = {name: parameters[key] for name, key in _INPUTS.items()}
    out["standing_reaction_rm"] = part.reaction
    (torques,) = printed_leg(part.demand.standing)
    out |= {f"standing_torque_{j}": float(torques[j - 1]) for j in JOINTS}
    out["transmission_ratio"] = float(np.ravel(gearing(found["reversible"].chain.elements))[0])
    return out | {name: float(value[0]) for name, value in figures(found).items()}
