"""A robot ready to compute with: Pinocchio model, joint order and leg geometry."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from actuators.errors import closest, one_line
from pipeline.errors import UrdfError
from pipeline.robot.leg_chains import LegChains, leg_chains
from pipeline.robot.robot_file import RobotSpec
from pipeline.robot.urdf_builder import build_urdf
from pipeline.robot.urdf_source import read_elements, read_urdf

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Robot:
    """A robot file together with its Pinocchio model.

    The model is never changed after loading.

    Attributes:
        spec: The robot file.
        urdf: The URDF's text.
        model: Pinocchio model; free-flyer base where the robot file says ``floating``.
    """

    spec: RobotSpec
    urdf: str
    model: pin.Model

    @property
    def floating(self) -> bool:
        """Whether the base floats."""
        return self.spec.floating

    @property
    def joints(self) -> tuple[str, ...]:
        """Actuated joints in the robot file's order; the order of every column."""
        return self.spec.joints

    @property
    def mass(self) -> float:
        """Of all bodies, the fixed one at the root included [kg]: what every force rests on."""
        return float(sum(inertia.mass for inertia in self.model.inertias))

    @cached_property
    def leg_names(self) -> tuple[str, ...]:
        """Legs in the robot file's order."""
        return tuple(leg.name for leg in self.spec.legs)

    @cached_property
    def chains(self) -> LegChains:
        """Constant geometry of the legs."""
        legs = [(leg.name, leg.joints, leg.foot) for leg in self.spec.legs]
        return leg_chains(self.model, legs, base_joint=1 if self.floating else 0)

    @cached_property
    def position_index(self) -> NDArray[np.intp]:
        """Columns of `joints` in Pinocchio's configuration."""
        return np.array([self._joint(name).idx_q for name in self.joints], dtype=np.intp)

    @cached_property
    def velocity_index(self) -> NDArray[np.intp]:
        """Columns of `joints` in Pinocchio's tangent vectors."""
        return np.array([self._joint(name).idx_v for name in self.joints], dtype=np.intp)

    @cached_property
    def leg_columns(self) -> NDArray[np.intp]:
        """Columns of each leg's joints among `joints`, shape (L, 3)."""
        return np.arange(len(self.joints), dtype=np.intp).reshape(len(self.leg_names), -1)

    def _joint(self, name: str) -> pin.JointModel:
        if not self.model.existJointName(name):
            raise UrdfError(
                f"{self.spec.urdf}: joint '{name}' is not in the URDF; "
                f"{closest(name, list(self.model.names)[1:])}"
            )
        return self.model.joints[self.model.getJointId(name)]

    def leg_positions(self, configuration: Array) -> Array:
        """Joint positions by leg: (N, nq) to (N, L, 3) [rad]."""
        q = configuration[:, self.position_index]
        return q.reshape(q.shape[0], len(self.leg_names), -1)

    def base_rotation(self, configuration: Array) -> Array | None:
        """Rotation from base to world, shape (N, 3, 3), or None where it is the identity."""
        quaternion = configuration[:, 3:7]
        if np.array_equal(quaternion, np.broadcast_to([0.0, 0.0, 0.0, 1.0], quaternion.shape)):
            return None
        x, y, z, w = quaternion.T
        return np.stack(
            [
                np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], -1),
                np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], -1),
                np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], -1),
            ],
            axis=-2,
        )

    def configuration(self, joint_positions: Array, base_position: Array | None = None) -> Array:
        """Assemble Pinocchio configurations.

        Args:
            joint_positions: In the order of `joints` [rad], shape (N, J).
            base_position: Of a floating base that stays upright [m], shape (N, 3).

        Returns:
            Shape (N, nq).
        """
        n = joint_positions.shape[0]
        q = np.tile(pin.neutral(self.model), (n, 1))
        q[:, self.position_index] = joint_positions
        if self.floating and base_position is not None:
            q[:, :3] = base_position
        return q

    def tangent(self, joint_values: Array, base_linear: Array | None = None) -> Array:
        """Assemble Pinocchio velocities or accelerations.

        Args:
            joint_values: In the order of `joints`, shape (N, J).
            base_linear: Linear part of a floating base in its own frame, shape (N, 3).

        Returns:
            Shape (N, nv).
        """
        v = np.zeros((joint_values.shape[0], self.model.nv))
        v[:, self.velocity_index] = joint_values
        if self.floating and base_linear is not None:
            v[:, :3] = base_linear
        return v

    def pool(self, threads: int) -> pin.ModelPool:
        """Workspace for Pinocchio's batch functions, made once per number of threads."""
        pools: dict[int, pin.ModelPool] = self.__dict__.setdefault("_pools", {})
        if threads not in pools:
            pools[threads] = pin.ModelPool(self.model, threads)
        return pools[threads]


def load_robot(spec: RobotSpec) -> Robot:
    """Build the robot of a robot file.

    A robot file with ``build`` gives its URDF from its numbers, so that a changed number counts at
    once; otherwise the URDF file it names is read.

    Raises:
        UrdfError: The URDF is missing or malformed, or lacks a joint or foot the file names.
    """
    if spec.build:
        text = build_urdf(spec)
    else:
        try:
            text = read_urdf(spec.urdf)
        except UrdfError as error:
            raise UrdfError(f"{error}; {spec.path} names it as robot.urdf") from None
        read_elements(text, str(spec.urdf))
    where = str(spec.path if spec.build else spec.urdf)
    model = parse_urdf(text, where, floating=spec.floating)
    model.gravity.linear = np.array([0.0, 0.0, -spec.parameters["gravity"]])
    robot = Robot(spec, text, model)
    _refuse_other_base(robot)
    # Resolve every name now, so that a wrong one is an error on loading and not in the middle.
    _ = robot.position_index, robot.velocity_index
    try:
        _ = robot.chains
    except UrdfError as error:
        raise UrdfError(f"{spec.path}: {error}") from None
    actuated = set(robot.joints)
    for name in list(model.names)[2 if spec.floating else 1 :]:
        if name not in actuated:
            raise UrdfError(
                f"{spec.path}: joint '{name}' of the URDF belongs to no leg; list it or fix it"
            )
    return robot


def _refuse_other_base(robot: Robot) -> None:
    """Feet are placed in the frame of the base link, which Pinocchio takes to be the root.

    Raises:
        UrdfError: The robot file names another link.
    """
    first = 2 if robot.floating else 1  # after the universe and the free flyer
    root = next(
        str(frame.name)
        for frame in robot.model.frames[first - 1 :]
        if frame.type == pin.FrameType.BODY
    )
    if robot.spec.base_link != root:
        raise UrdfError(
            f"{robot.spec.path}: robot.base_link = '{one_line(robot.spec.base_link)}', the root of "
            f"{robot.spec.urdf.name} is '{root}'; name that, and place the feet in its frame"
        )


@contextmanager
def _parser_heard() -> Iterator[list[str]]:
    """Keep the C++ parser from writing to the process's standard error; gather what it says."""
    sys.stderr.flush()
    saved = os.dup(2)
    said: list[str] = []
    with tempfile.TemporaryFile() as sink:
        os.dup2(sink.fileno(), 2)
        try:
            yield said
        finally:
            os.dup2(saved, 2)
            os.close(saved)
            sink.seek(0)
            for line in sink.read().decode("utf-8", "replace").splitlines():
                if line.startswith("Error:"):
                    said.append(" ".join(line.removeprefix("Error:").split()))


def parse_urdf(text: str, where: str, *, floating: bool) -> pin.Model:
    """A Pinocchio model from URDF text.

    Pinocchio reads on where a number is none; `urdf_source.read_elements` looks first.

    Raises:
        UrdfError: The text is not a URDF; one line with what Pinocchio's parser said.
    """
    said: list[str] = []
    try:
        with _parser_heard() as said:
            if floating:
                return pin.buildModelFromXML(text, pin.JointModelFreeFlyer())
            return pin.buildModelFromXML(text)
    except (ValueError, RuntimeError) as error:
        reason = one_line(said[0] if said else error)[:160]
        raise UrdfError(f"{where}: not a URDF that Pinocchio can read ({reason})") from None
