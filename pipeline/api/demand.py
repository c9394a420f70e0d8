"""What a motion demands of the joints, and what that costs: the calls that a search repeats."""

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
from pipeline.dynamics.force_rules import LEAST_TANGENTIAL
from pipeline.dynamics.joint_demand import MotionDemand
from pipeline.motion.motion import Motion
from pipeline.motion.walking import walking_motion
from pipeline.simulation.settings import SAMPLES, regeneration_of
from pipeline.simulation.walk_stand import joint_series
from reports.tables.walking import walking_joint_demand

if TYPE_CHECKING:
    import pandas


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
        return walking_joint_demand(self.joints, self.sliding).frame()


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
        PipelineError: The robot stands on a fixed base, or the motion or an argument cannot be
            used.
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
        PipelineError: The robot has no actuators, or no such regeneration.
        ActuatorError: No such alternative.
    """
    policy, given = regeneration_of(regeneration), machine.ready
    names = [actuator] if actuator else list(given.catalog.alternatives)
    return {
        name: supply(
            given.chain(name).inverse(demand.series), policy.policy, policy.fraction
        ).supplied_energy
        for name in names
    }
