"""Standing and walking, and what a motion demands of the joints and costs: one call each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from actuators.energy.energy import supply
from actuators.shaft import ShaftSeries
from pipeline.api.machine import Machine
from pipeline.api.result import Result
from pipeline.api.run import inputs_of, said_of
from pipeline.dynamics.force_rules import LEAST_TANGENTIAL
from pipeline.dynamics.joint_demand import MotionDemand
from pipeline.machine.joint import Actuators
from pipeline.motion.motion import Motion
from pipeline.motion.walking import walking_motion
from pipeline.simulation.settings import SAMPLES, Settings, regeneration_of
from pipeline.simulation.tables import tables_of_standing, tables_of_walking, walking_joint_demand
from pipeline.simulation.walk_stand import IDEAL, Standing, Walking, joint_series

if TYPE_CHECKING:
    import pandas

    from actuators.arrays import Array


@dataclass(frozen=True, eq=False)
class Stand(Result):
    """The robot standing still."""

    shown = "standing_energy"
    result: Standing  #: Arrays: posture, demand, contacts, what holds, by alternative.

    @property
    def holding(self) -> pandas.DataFrame:
        """Torque, current, voltage and power of every joint and alternative."""
        return self.table("standing")

    @property
    def energy(self) -> pandas.DataFrame:
        """Energy by leg and alternative [J]."""
        return self.table("standing_energy")

    @property
    def contacts(self) -> pandas.DataFrame:
        """Feet and ground forces."""
        return self.table("standing_contacts")


@dataclass(frozen=True, eq=False)
class Walk(Result):
    """The robot over one gait cycle."""

    shown = "robot_energy"
    #: Arrays: motion, demand, margins, stages and supplies, by alternative.
    result: Walking

    @property
    def demand(self) -> pandas.DataFrame:
        """Position, velocity, acceleration and torque of every joint over time."""
        return self.table("walking_joint_demand")

    @property
    def energy(self) -> pandas.DataFrame:
        """Electrical energy of one cycle by alternative and leg [J]."""
        return self.table("walking_energy")

    @property
    def stages(self) -> pandas.DataFrame:
        """E(+) and E(-) at every stage of every actuator [J]."""
        return self.table("walking_stage_energy")


def stand(
    machine: Machine,
    actuator: str | None = None,
    *,
    forces: str = LEAST_TANGENTIAL,
    friction_coefficient: float | None = None,
) -> Stand:
    """Stand still and hold, as the robot file says.

    Args:
        machine: From `load`, with a floating base.
        actuator: Name of an alternative; all by default.
        forces: Rule of the ground's forces: ``least_tangential`` or ``least_torque``.
        friction_coefficient: Greatest tangential over normal force of a foot [1]; no limit by
            default.

    Raises:
        StanceError: A foot would have to pull or slide.
        LegwattError: The robot stands on a fixed base. No such alternative.
    """
    given = machine.walking(forces=forces, friction_coefficient=friction_coefficient)
    return stood(given, actuator)


def stood(given: Settings, actuator: str | None = None) -> Stand:
    """Standing as settings say; see `stand`."""
    result = given.stand(_beside_ideal(given, actuator))
    tables = tables_of_standing(given, result)
    return Stand("stand", tables, said_of(given), inputs_of(given), result)


def walk(
    machine: Machine,
    actuator: str | None = None,
    *,
    motion: str | Path | pandas.DataFrame | Array | None = None,
    samples: int = SAMPLES,
    quasi_static: bool = False,
    regeneration: str = "none",
    forces: str = LEAST_TANGENTIAL,
    friction_coefficient: float | None = None,
) -> Walk:
    """Walk one cycle of the robot file's gait, or move as given.

    Args:
        machine: From `load`, with a floating base.
        actuator: Name of an alternative, which the ideal one is put beside, since ratios refer to
            it; all alternatives by default.
        motion: CSV file, table or array of time, joint positions and contacts in place of the
            gait, for a robot on a fixed base, too; see `pipeline.simulation.own_motion` for its
            columns.
        samples: Per half period of the gait.
        quasi_static: Leave out the links' inertial terms.
        regeneration: What becomes of returned energy: ``none``, ``bus`` or a fraction.
        forces: Rule of the ground's forces: ``least_tangential`` or ``least_torque``.
        friction_coefficient: Greatest tangential over normal force of a foot [1]; no limit by
            default.

    Raises:
        StanceError: A foot would have to pull or slide.
        LegwattError: The robot stands on a fixed base, or an argument is out of range. No such
            alternative.
    """
    given = machine.walking(
        motion=motion,
        samples=samples,
        quasi_static=quasi_static,
        regeneration=regeneration,
        forces=forces,
        friction_coefficient=friction_coefficient,
    )
    return walked(given, actuator)


def walked(given: Settings, actuator: str | None = None) -> Walk:
    """Walking as settings say; see `walk`."""
    result = given.walk(_beside_ideal(given, actuator))
    return Walk("walk", tables_of_walking(given, result), said_of(given), inputs_of(given), result)


def _beside_ideal(given: Settings, actuator: str | None) -> Mapping[str, Actuators]:
    if actuator is None:
        return given.chains()
    given.chain(actuator)  # refuses one that there is not
    return given.chains(*(n for n in given.catalog.alternatives if n in (IDEAL, actuator)))


@dataclass(frozen=True, eq=False)
class Demand:
    """What a motion demands of the joints."""

    motion: Motion = field(repr=False)  #: Base and joints over time.
    #: Position, velocity, acceleration and torque by segment.
    joints: MotionDemand = field(repr=False)
    #: Names of the prismatic joints: metres and newtons, not radians.
    sliding: tuple[str, ...] = ()

    @cached_property
    def series(self) -> ShaftSeries:
        """The joints' side of the actuators, with a sample at every zero of a velocity."""
        return joint_series(self.joints)

    def frame(self) -> pandas.DataFrame:
        """Position, velocity, acceleration and torque over time, units in the column names."""
        return walking_joint_demand(self.joints, self.sliding)


def demand(
    machine: Machine,
    motion: str | Path | pandas.DataFrame | NDArray[np.float64] | None = None,
    *,
    samples: int = SAMPLES,
    quasi_static: bool = False,
    forces: str = LEAST_TANGENTIAL,
    friction_coefficient: float | None = None,
) -> Demand:
    """What one cycle of a machine's gait, or another motion, demands of its joints.

    It holds for every machine whose bodies, gait and effects on bodies are the same: other
    actuators do not change it.

    Args:
        machine: From `load`, with a floating base where it walks its gait.
        motion: CSV file, table or array of time, joint positions and contacts in place of the
            gait, for a robot on a fixed base, too; see `pipeline.simulation.own_motion` for its
            columns.
        samples: Per half period of the gait.
        quasi_static: Leave out the links' inertial terms.
        forces: Rule of the ground's forces: ``least_tangential`` or ``least_torque``.
        friction_coefficient: Greatest tangential over normal force of a foot [1]; no limit by
            default.

    Raises:
        StanceError: A foot would have to pull or slide.
        LegwattError: The robot stands on a fixed base, or the motion or an argument cannot be used.
    """
    given = machine.walking(
        samples=samples,
        quasi_static=quasi_static,
        motion=motion,
        forces=forces,
        friction_coefficient=friction_coefficient,
    )
    moved = given.motion or walking_motion(given.machine, samples=samples)
    return Demand(moved, given.demand(moved), given.robot.sliding_joints)


def energy(
    machine: Machine, demand: Demand, actuator: str | None = None, *, regeneration: str = "none"
) -> Mapping[str, NDArray[np.float64]]:
    """Electrical energy that a demand takes from the supply.

    No file is read and no table made: for 51 samples of 18 joints 0.2 to 0.7 ms per alternative.

    Args:
        machine: Whose actuators answer.
        demand: From `demand`, of this machine or of one that differs in actuators alone.
        actuator: Name of an alternative; all by default.
        regeneration: What becomes of returned energy: ``none``, ``bus`` or a fraction.

    Returns:
        By alternative, for each joint (J,) [J]; one number (1,) for joints that share a bus.

    Raises:
        LegwattError: The robot has no actuators, or no such regeneration. No such alternative.
    """
    policy, given = regeneration_of(regeneration), machine.ready
    names = [actuator] if actuator else list(given.catalog.alternatives)
    return {
        name: supply(
            given.chain(name).inverse(demand.series), policy.policy, policy.fraction
        ).supplied_energy
        for name in names
    }
