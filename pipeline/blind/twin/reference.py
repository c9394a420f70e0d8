"""The nominal machine along the planned motion: what a hidden effect's size is measured against."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from pipeline.blind.twin.plant import Plant
from pipeline.blind.twin.setup import Setup
from pipeline.dynamics.joint_demand import motion_demand
from pipeline.motion.motion import Motion, Segment
from pipeline.motion.walking import walking_motion
from pipeline.robot.robot import Robot

Array = NDArray[np.float64]
#: Bandwidth in which an effect's torque is compared with the noise [Hz].
BANDWIDTH = 20.0
_SAMPLES = 121  # of the gait, per segment


@dataclass(frozen=True)
class Reference:
    """Nominal motion and torque, for sizes that stand in a stated proportion to the noise.

    Attributes:
        setup: The nominal machine and its plan.
        motion: Of the nominal robot.
    """

    setup: Setup
    motion: Motion

    @property
    def robot(self) -> Robot:
        """The nominal robot."""
        return self.setup.plant.robot

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the columns."""
        return self.robot.joints

    @cached_property
    def noise_torque(self) -> float:
        """Current noise inside `BANDWIDTH` as a torque at the joint, RMS [N*m]."""
        machine, sensors = self.setup.plant.machine, self.setup.sensors
        share = np.sqrt(min(1.0, 2 * BANDWIDTH / sensors.rate))
        return float(machine.ratio * machine.torque_constant * sensors.noise.current * share)

    @cached_property
    def position(self) -> Array:
        """Shape (N, J) [rad]."""
        return self._joined(lambda s: s.configuration[:, self.robot.position_index])

    @cached_property
    def velocity(self) -> Array:
        """Shape (N, J) [rad/s]."""
        return self._joined(lambda s: s.velocity[:, self.robot.velocity_index])

    @cached_property
    def acceleration(self) -> Array:
        """Shape (N, J) [rad/s^2]."""
        return self._joined(lambda s: s.acceleration[:, self.robot.velocity_index])

    @cached_property
    def torque(self) -> Array:
        """At the links, shape (N, J) [N*m]."""
        return self.torque_of(self.setup.plant)

    @cached_property
    def motor_torque(self) -> Array:
        """At the motors, inertia and rotor friction included, at the joint, shape (N, J) [N*m]."""
        plant = self.setup.plant
        friction = plant.rotor.coulomb * np.sign(self.velocity)
        return self.torque + friction + plant.rotor_inertia * self.acceleration

    def torque_of(self, plant: Plant, shift: Array | None = None) -> Array:
        """Torque that other bodies, gravity or positions would ask of the links, (N, J) [N*m].

        Args:
            plant: Whose bodies and gravity are taken.
            shift: Added to the joint positions, shape (J,) [rad].
        """
        robot = replace(self.robot, model=plant.model)
        motion = self.motion
        if shift is not None:
            moved = []
            for segment in motion.segments:
                configuration = segment.configuration.copy()
                configuration[:, robot.position_index] += shift
                moved.append(replace(segment, configuration=configuration))
            motion = replace(motion, segments=tuple(moved))
        demand = motion_demand(robot, motion)
        return np.concatenate([d.torque for d in demand.segments])

    def change(self, plant: Plant, shift: Array | None = None) -> float:
        """RMS change of the joint most affected [N*m]."""
        return float(rms(self.torque_of(plant, shift) - self.torque).max())

    def rate_of(self, values: Array) -> Array:
        """Time derivative within each segment, shape like `values`."""
        out, start = [], 0
        for segment in self.motion.segments:
            n = segment.time.size
            out.append(np.gradient(values[start : start + n], segment.time, axis=0))
            start += n
        return np.concatenate(out)

    def _joined(self, pick: Callable[[Segment], Array]) -> Array:
        return np.concatenate([pick(segment) for segment in self.motion.segments])


def rms(values: Array) -> Array:
    """Root mean square over samples."""
    result: Array = np.sqrt(np.mean(np.square(values), axis=0))
    return result


def reference(setup: Setup) -> Reference:
    """The nominal motion of a setup: its plan on a stand, one gait cycle where it walks."""
    robot = setup.plant.robot
    if robot.floating:
        motion = walking_motion(robot, samples=_SAMPLES)
        return Reference(setup, motion)
    plan = setup.plan
    every = round(5e-3 / plan.period)
    acceleration = np.gradient(plan.velocity, plan.period, axis=0)
    position = plan.position[::every]
    segment = Segment(
        name="plan",
        time=np.linspace(0.0, (position.shape[0] - 1) * plan.period * every, position.shape[0]),
        configuration=robot.configuration(position),
        velocity=robot.tangent(plan.velocity[::every]),
        acceleration=robot.tangent(acceleration[::every]),
        stance=(),
    )
    return Reference(setup, Motion((segment,)))


def link_of(robot: Robot, joint: str) -> str:
    """Name of the link that a joint carries; the base link for a floating base's joint."""
    if joint == "root_joint":
        return robot.spec.base_link
    index = robot.model.getJointId(joint)
    for frame in robot.model.frames:
        if frame.parentJoint == index and frame.type == pin.FrameType.BODY:
            return str(frame.name)
    return joint
