"""What a model file's effects change in standing and walking.

Bodies and ground change what is demanded of the joints; so do springs and ripples, which act beside
the actuators. Friction, inertia and motors change the actuators of the joints they sit in, in every
alternative but the ideal one, which has none by definition.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from actuators.chain import Chain
from pipeline.app.edited_chain import edited_chain
from pipeline.gap.model import MachineModel, machine_of_robot
from pipeline.gap.rigid import changed_model
from pipeline.joint_demand import JointDemand
from pipeline.kinematics import foot_force_torques
from pipeline.motion import Segment
from pipeline.robot import Robot

Array = NDArray[np.float64]
#: The alternative that stays without losses.
IDEAL = "ideal"
#: What acts on sensors alone.
SENSORS = ("effort_offset", "position_offset", "time_delay")
#: What moves the motor by so little, or changes so slowly, that one cycle does not see it.
LEFT_OUT = {
    "joint_elasticity": "the motor's own motion differs by the wind-up only",
    "backlash": "the motor's own motion differs by the gap only",
    "winding_heating": "one cycle is too short to warm a winding; numbers are for cold motors",
}


@dataclass(frozen=True)
class Effects:
    """A model file's effects, ready for standing and walking.

    Attributes:
        robot: With the bodies and the ground that the effects change.
        file: The model file's name.
        names: Of the effects in order.
        apply: Puts them into a machine.
    """

    robot: Robot
    file: str
    names: tuple[str, ...]
    apply: Callable[[MachineModel], MachineModel]
    _machine: MachineModel

    def chain(self, chain: Chain) -> Chain:
        """The chain of one alternative with the effects in it."""
        if chain.name == IDEAL:
            return chain
        edited = self.apply(machine_of_robot(self.robot, chain))
        return edited_chain(chain, edited.actuators)

    def chains(self, chains: Mapping[str, Chain]) -> dict[str, Chain]:
        """Every alternative with the effects in it."""
        return {name: self.chain(chain) for name, chain in chains.items()}

    def demand(self, segment: Segment, demand: JointDemand) -> JointDemand:
        """What the actuators supply besides: springs, ripples, feet that squeeze the ground.

        Args:
            segment: The motion.
            demand: Of the bodies and the ground.
        """
        torque = np.array(demand.torque)
        for k, actuator in enumerate(self._machine.actuators):
            for law in actuator.position_torques:
                torque[:, k] += law.torque(demand.position[:, k])
        squeeze = self._machine.bodies.squeeze
        if squeeze and segment.stance:
            robot = self.robot
            force = np.zeros((segment.time.size, len(robot.leg_names), 3))
            for side, sign in (("left", 1.0), ("right", -1.0)):
                legs = [leg for leg in robot.spec.legs if leg.side == side]
                standing = [leg.name for leg in legs if leg.name in segment.stance]
                for name in standing:
                    force[:, robot.leg_names.index(name), 1] = sign * squeeze / len(standing)
            q = robot.leg_positions(segment.configuration)
            part = foot_force_torques(robot.chains, q, force)
            torque[:, robot.leg_columns.ravel()] -= part.reshape(part.shape[0], -1)
        return replace(demand, torque=torque)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Which effects leave standing and walking as they are, and why."""
        out = [
            f"{name} acts on a sensor: standing and walking stay as they are"
            for name in self.names
            if name in SENSORS
        ]
        out += [f"{n} is left out: {LEFT_OUT[n]}" for n in self.names if n in LEFT_OUT]
        return tuple(dict.fromkeys(out))


def effects(
    robot: Robot,
    chain: Chain,
    apply: Callable[[MachineModel], MachineModel],
    names: tuple[str, ...],
    file: str,
) -> Effects:
    """Effects on a robot.

    Args:
        robot: As its file states it.
        chain: Of any alternative with a motor.
        apply: Puts the effects into a machine.
        names: Of the effects in order.
        file: The model file's name.

    Raises:
        GapError: An effect does not fit the robot.
    """
    machine = apply(machine_of_robot(robot, chain))
    model = changed_model(robot.model, machine.bodies)
    edited = robot if model is robot.model else replace(robot, model=model)
    return Effects(edited, file, names, apply, machine)
