"""What the modes of a mission ask of the joints, from the one demand that all commands have."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from actuators.elements.position_torque import PositionTorque
from actuators.energy.energy import duration
from actuators.errors import LegwattError, StanceError
from actuators.shaft import ShaftSeries
from pipeline.choice.missions.mission import Mode
from pipeline.effects.bodies import point_mass
from pipeline.motion.gait import gait_of
from pipeline.motion.motion import Motion
from pipeline.robot.robot import Robot
from pipeline.simulation.machine import Machine
from pipeline.simulation.options import LEAST_SAMPLES, SAMPLES
from pipeline.simulation.walk_stand import joint_series


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
    spring: PositionTorque | None = None,
) -> tuple[Load, ...]:
    """Every mode's demand.

    Args:
        machine: From `load`.
        modes: Of the mission.
        added: Mass in addition to the bodies', by joint whose actuator it is [kg].
        samples: Per half period of a gait.
        along: The same modes with other masses, whose motions are kept; by default motions are
            planned for the masses there are.
        spring: Beside the actuators of all joints: torques are those that these have to give, the
            springs' included; with hold none they are not held, either.

    Raises:
        LegwattError: A mode cannot be done; its row is named.
        StanceError: The robot tips or slides in it; likewise.
    """
    out = []
    motions = [load.motion for load in along] or [None] * len(modes)
    for mode, motion in zip(modes, motions, strict=True):
        try:
            own = with_masses(machine.with_values(mode.changes), added)
            load = _load(own, mode, samples, motion)
            if spring is not None and mode.hold != "none":  # else not held, either
                load = replace(load, series=spring.inverse(load.series))
            out.append(load)
        except StanceError as error:
            raise type(error)(f"{mode.where}: {error}") from None
        except LegwattError as error:
            raise LegwattError(f"{mode.where}: {error}") from None
    return tuple(out)


def with_masses(machine: Machine, added: Mapping[str, float] | None) -> Machine:
    """The machine with point masses [kg] at the origins of joints, on the link before each.

    That by the free joint of a floating base sits at the origin of the base.
    """
    if not added or not any(added.values()):
        return machine

    def heavier(robot: Robot) -> Robot:
        model = robot.model.copy()
        for joint, mass in added.items():
            at = model.getJointId(joint)
            body = model.parents[at] or (at if machine.robot.floating else 0)
            more = point_mass(mass, model.jointPlacements[at].translation)
            total = model.inertias[body].toDynamicParameters() + more
            model.inertias[body] = pin.Inertia.FromDynamicParameters(total)
        return replace(robot, model=model)

    return machine.with_robot(heavier)


def _load(machine: Machine, mode: Mode, samples: int, motion: Motion | None) -> Load:
    spec = machine.robot.spec
    weight = machine.edited.mass * spec.parameters["gravity"]  # [N]
    if mode.stands:
        held = machine.walking().stand({}).demand
        torque = np.repeat(held.torque * (mode.hold != "none"), 2, axis=0)
        zero, time = np.zeros_like(torque), np.array([0.0, 1.0])
        posture = np.repeat(held.position, 2, axis=0)
        series = ShaftSeries.at_joint(held.joints, time, posture, zero, zero, torque)
        return Load(mode, series, weight, 0.0)
    own = mode.motion is not None
    speed = 0.0 if own else gait_of(spec).speed
    if motion is not None:
        parts = machine.demand(motion)
        return Load(mode, joint_series(parts), weight, speed, motion)
    asked = machine.walking(motion=mode.motion, samples=SAMPLES if own else samples).planned()
    if own and spec.floating:
        speed = asked.motion.mean_speed
    return Load(mode, asked.series, weight, speed, asked.motion)
