"""What a model file's effects change in standing and walking.

Bodies, ground, springs, ripples and what was found of a motor count in every drivetrain option.
What was found of a drivetrain belongs to the option it was found against: found against a motor's
data sheet alone, it is all that the machine's gears lose. Other options have gears with losses of
their own in the catalogue, to which it cannot be added; so there it does not count, and it is said.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from actuators.chain import Chain
from pipeline.dynamics.joint_demand import JointDemand
from pipeline.effects.model_file import ModelFile
from pipeline.machine.drivetrains import Drivetrains
from pipeline.machine.machine import MachineModel

_SENSOR: Final = "it acts on a sensor"
#: Effects that standing and walking do not see, and why.
LEFT_OUT: Final = {
    **dict.fromkeys(("effort_offset", "effort_gain", "position_offset", "time_delay"), _SENSOR),
    "joint_elasticity": "the motor's own motion differs by the wind-up only",
    "backlash": "the motor's own motion differs by the gap only",
    "warming_friction": "friction is that of the temperature which its file states",
    "winding_heating": "one cycle is too short to warm a winding; numbers are for cold motors",
}


def other_drivetrains(bare: MachineModel, found: MachineModel) -> tuple[str, ...]:
    """Joints whose drivetrain the effects change."""
    pairs = zip(bare.actuators, found.actuators, strict=True)
    return tuple(new.name for old, new in pairs if _drivetrain(old) != _drivetrain(new))


def with_found(bare: MachineModel, found: MachineModel, *, counts: bool) -> Drivetrains:
    """A drivetrain option with the effects in it; itself where none is.

    `counts`: whether what was found of a drivetrain counts in it.
    """
    pairs = [*zip(bare.actuators, found.actuators, strict=True)]
    if not counts:
        pairs = [
            (a, replace(b, elements=a.elements, output=(), coupled_to="", coupling=0.0))
            for a, b in pairs
        ]
    if all(_drivetrain(a) == _drivetrain(b) and a.motor is b.motor for a, b in pairs):
        return bare.drivetrains
    return replace(bare.drivetrains, joints=tuple(new for _, new in pairs))


def _drivetrain(actuator: Chain) -> tuple[object, ...]:
    """What stands between joint and motor."""
    elements = (*actuator.output, *actuator.elements)
    return (*map(id, elements), actuator.coupled_to, actuator.coupling)


def demand_with(found: MachineModel, demand: JointDemand) -> JointDemand:
    """Demand of bodies and ground with springs and ripples."""
    torque = np.array(demand.torque)
    for k, actuator in enumerate(found.actuators):
        torque[:, k] = actuator.drive_load(demand.position[:, k], torque[:, k])
    return replace(demand, torque=torque)


def remarks(file: ModelFile, joints: tuple[str, ...]) -> Iterator[str]:
    """What of the file does not hold, and which effects leave standing and walking be.

    `joints`: from `other_drivetrains`.
    """
    yield from file.changed
    names = dict.fromkeys(edit.effect for edit in file.edits)
    yield from (f"{n} is left out: {LEFT_OUT[n]}" for n in names if n in LEFT_OUT)
    if joints:
        against = f"'{file.alternative}'" if file.alternative else "no actuator at all"
        yield (
            f"what was found of the drivetrain of {', '.join(joints)} was found against {against} "
            "and counts there alone: other actuators have gears with losses of their own, to which "
            "it cannot be added"
        )
