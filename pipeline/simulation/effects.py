"""What a model file's effects change in standing and walking.

Bodies, ground, springs, ripples and what was found of a motor count in every drivetrain option.
What was found of a drivetrain belongs to the option it was found against: found against a motor's
data sheet alone, it is all that the machine's gears lose. Other options have gears with losses of
their own in the catalogue, to which it cannot be added; so there it does not count, and it is said.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from actuators.chain import Chain
from pipeline.dynamics.joint_demand import JointDemand
from pipeline.effects.model_file import ModelFile, apply_edits
from pipeline.machine.drivetrains import Drivetrains
from pipeline.machine.machine import MachineModel
from pipeline.motion.motion import Segment
from pipeline.robot.kinematics import leg_posture
from pipeline.robot.robot import Robot
from pipeline.simulation.on_ground import outward
from pipeline.simulation.walk_stand import IDEAL

_SENSOR: Final = "it acts on a sensor"
#: Effects that standing and walking do not see, and why.
LEFT_OUT: Final = {
    **dict.fromkeys(("effort_offset", "effort_gain", "position_offset", "time_delay"), _SENSOR),
    "joint_elasticity": "the motor's own motion differs by the wind-up only",
    "backlash": "the motor's own motion differs by the gap only",
    "warming_friction": "friction is that of the temperature which its file states",
    "winding_heating": "one cycle is too short to warm a winding; numbers are for cold motors",
}


@dataclass(frozen=True)
class Effects:
    """A model file's effects, ready for standing and walking."""

    file: ModelFile
    robot: Robot  #: With the bodies and the ground that the effects change.
    bare: MachineModel  #: As the robot's file states it.
    machine: MachineModel  #: With the effects.

    @property
    def names(self) -> tuple[str, ...]:
        """Of the effects in order."""
        return tuple(edit.effect for edit in self.file.edits)

    @property
    def of_drivetrain(self) -> tuple[str, ...]:
        """Joints whose drivetrain the effects change."""
        pairs = zip(self.bare.actuators, self.machine.actuators, strict=True)
        return tuple(new.name for old, new in pairs if _drivetrain(old) != _drivetrain(new))

    def counts_in(self, alternative: str) -> bool:
        """Whether all that the effects change in actuators counts in an alternative.

        The ideal one has no losses by definition; there is nothing to report about it.
        """
        return alternative in (IDEAL, self.file.alternative) or not self.of_drivetrain

    def chain(self, actuators: Drivetrains) -> Drivetrains:
        """One alternative with the effects in it that count there; itself where none does."""
        if actuators.name == IDEAL:
            return actuators
        bare = MachineModel(self.robot, actuators)
        pairs = [*zip(bare.actuators, apply_edits(bare, self.file.edits).actuators, strict=True)]
        if not self.counts_in(actuators.name):
            pairs = [
                (a, replace(b, elements=a.elements, output=(), coupled_to="", coupling=0.0))
                for a, b in pairs
            ]
        if all(_drivetrain(a) == _drivetrain(b) and a.motor is b.motor for a, b in pairs):
            return actuators
        return Drivetrains(actuators.name, tuple(new for _, new in pairs))

    def demand(self, segment: Segment, demand: JointDemand) -> JointDemand:
        """Demand of bodies and ground with springs, ripples, and feet that squeeze the ground."""
        torque = np.array(demand.torque)
        for k, actuator in enumerate(self.machine.actuators):
            torque[:, k] = actuator.drive_load(demand.position[:, k], torque[:, k])
        squeeze = self.machine.bodies.squeeze
        if squeeze and segment.stance:
            robot = self.robot
            standing = [[leg in segment.stance for leg in robot.leg_names]]
            force = np.zeros((segment.time.size, len(robot.leg_names), 3))
            force[..., 1] = squeeze * outward(robot, np.array(standing))
            q = robot.leg_positions(segment.configuration)
            part = leg_posture(robot.chains, q).force_torques(force)
            torque -= robot.chains.by_joint(part)
        return replace(demand, torque=torque)

    @property
    def remarks(self) -> tuple[str, ...]:
        """What of the file does not hold, and which effects leave standing and walking be."""
        left = [f"{n} is left out: {LEFT_OUT[n]}" for n in self.names if n in LEFT_OUT]
        if self.of_drivetrain:
            found_with = self.file.alternative
            against = f"'{found_with}'" if found_with else "no actuator at all"
            left.append(
                f"what was found of the drivetrain of {', '.join(self.of_drivetrain)} was found "
                f"against {against} and counts there alone: other actuators have gears with losses "
                "of their own, to which it cannot be added"
            )
        return tuple(dict.fromkeys((*self.file.changed, *left)))


def _drivetrain(actuator: Chain) -> tuple[object, ...]:
    """What stands between joint and motor."""
    elements = (*actuator.output, *actuator.elements)
    return (*map(id, elements), actuator.coupled_to, actuator.coupling)


def effects_on(robot: Robot, actuators: Drivetrains, file: ModelFile) -> Effects:
    """A model file's effects on a robot as its file states it.

    `actuators`: of the alternative they were found against, or of any with a motor.
    """
    bare = MachineModel(robot, actuators)
    machine = apply_edits(bare, file.edits)
    edited = robot if machine.rigid is robot.model else replace(robot, model=machine.rigid)
    return Effects(file, edited, bare, machine)
