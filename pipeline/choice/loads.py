"""What the modes of a mission ask of the joints, from the one demand that all commands have."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from actuators.elements.position_torque import ParallelSpring
from actuators.energy.energy import duration
from actuators.shaft import ShaftSeries
from pipeline.api.demand import demand
from pipeline.choice.errors import MissionError
from pipeline.choice.missions.mission import Mode
from pipeline.errors import PipelineError, StanceError
from pipeline.motion.gait import gait_of
from pipeline.motion.motion import Motion
from pipeline.simulation.settings import LEAST_SAMPLES, SAMPLES
from pipeline.simulation.walk_stand import demand_along, joint_series, stand

if TYPE_CHECKING:
    from pipeline.api.machine import Machine

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Load:
    """One mode at the joints."""

    mode: Mode  #: What the robot does.
    series: ShaftSeries  #: Of all joints; standing is two samples a second apart, at rest.
    weight: float  #: Of the robot [N].
    speed: float  #: Of walking [m/s]; 0 standing.
    motion: Motion | None = None  #: That was followed; None standing.

    @property
    def duration(self) -> float:
        """Of the series [s]."""
        return duration(self.series.time)


def loads_of(
    machine: Machine,
    modes: Sequence[Mode],
    added: Mapping[str, float] | None = None,
    samples: int = LEAST_SAMPLES,
    along: Sequence[Load] = (),
    spring: ParallelSpring | None = None,
) -> tuple[Load, ...]:
    """Every mode's demand.

    Args:
        machine: From `load`.
        modes: Of the mission.
        added: Mass beside what the robot's bodies have, by joint whose actuator it is [kg].
        samples: Per half period of a gait.
        along: The same modes with other masses, whose motions are kept; by default motions are
            planned for the masses there are.
        spring: Beside the actuators of all joints, with a stiffness and rest angle for each: the
            torques are those that actuators have to give, the spring's included.

    Raises:
        MissionError: A mode cannot be done; its row is named.
        StanceError: The robot tips or slides in it; likewise.
    """
    out = []
    motions = [load.motion for load in along] or [None] * len(modes)
    for mode, motion in zip(modes, motions, strict=True):
        try:
            own = with_masses(machine.with_values(mode.changes), added)
            load = _load(own, mode, samples, motion)
        except StanceError as error:
            raise type(error)(f"{mode.where}: {error}") from None
        except PipelineError as error:
            raise MissionError(f"{mode.where}: {error}") from None
        out.append(with_spring(load, spring))
    return tuple(out)


def with_spring(load: Load, spring: ParallelSpring | None) -> Load:
    """The mode with springs beside the actuators; with hold none they are not held, either."""
    if spring is None or load.mode.hold == "none":
        return load
    return replace(load, series=spring.inverse(load.series))


def with_masses(machine: Machine, added: Mapping[str, float] | None) -> Machine:
    """The machine with point masses where its joints' actuators sit.

    An actuator sits at the origin of the joint that it moves, on the link before it.

    Args:
        machine: From `load`.
        added: By joint [kg]; less than none takes mass away. By the free joint of a floating base:
            at the origin of the base.
    """
    if not added or not any(added.values()):
        return machine
    given = machine.ready

    def heavier(model: pin.Model) -> pin.Model:
        out = model.copy()
        for joint, mass in added.items():
            at = out.getJointId(joint)
            before, place = out.parents[at], out.jointPlacements[at].translation
            if not before and given.robot.floating:
                before = at
            point = np.concatenate([[mass], mass * place, _second_moments(mass, place)])
            dynamic = out.inertias[before].toDynamicParameters() + point
            out.inertias[before] = pin.Inertia.FromDynamicParameters(dynamic)
        return out

    robot = replace(given.robot, model=heavier(given.robot.model))
    effects = given.effects
    if effects is not None:
        own = replace(effects.robot, model=heavier(effects.robot.model))
        effects = replace(effects, robot=own)
    return replace(machine, loaded=replace(given, robot=robot, effects=effects))


def _second_moments(mass: float, place: Array) -> Array:
    """Of a point mass about the origin in Pinocchio's order: xx, xy, yy, xz, yz, zz [kg*m^2]."""
    x, y, z = place
    return mass * np.array([y * y + z * z, -x * y, x * x + z * z, -x * z, -y * z, x * x + y * y])


def _load(machine: Machine, mode: Mode, samples: int, motion: Motion | None) -> Load:
    given = machine.ready
    spec = given.robot.spec
    weight = given.machine.mass * spec.parameters["gravity"]  # [N]
    if not mode.stands:
        own = mode.motion is not None
        speed = 0.0 if own else gait_of(spec).speed
        if motion is not None:
            moved = machine.ready.walking(walks=False)
            parts = demand_along(moved.machine, motion, adjust=moved.adjust, forces=moved.ground)
            return Load(mode, joint_series(parts), weight, speed, motion)
        asked = demand(machine, mode.motion, samples=SAMPLES if own else samples)
        if own and spec.floating:
            speed = asked.motion.mean_speed
        return Load(mode, asked.series, weight, speed, asked.motion)
    still = machine.walking(walks=False)
    held = stand(still.machine, {}, adjust=still.adjust, forces=still.ground).demand
    torque = np.repeat(held.torque * (mode.hold != "none"), 2, axis=0)
    zero = np.zeros_like(torque)
    position = np.repeat(held.position, 2, axis=0)
    time = np.array([0.0, 1.0])
    series = ShaftSeries.at_joint(held.joints, time, position, zero, zero, torque)
    return Load(mode, series, weight, 0.0)
