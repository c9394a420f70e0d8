"""A robot ready to compute with: Pinocchio model, joint order and leg geometry."""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Self

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from actuators.arrays import Array
from actuators.errors import LegwattError, known, one_line
from actuators.parameters import parameters_from_table
from pipeline.robot.kinematics import LegChains, leg_chains
from pipeline.robot.robot_file import RobotSpec, RobotTable, load_robot_file
from pipeline.robot.urdf import build_urdf, model_of_angles, read_urdf


@dataclass(frozen=True)
class Robot:
    """A robot file together with its Pinocchio model.

    The model is never changed after loading.
    """

    spec: RobotSpec  #: The robot file.
    urdf: str  #: The URDF's text.
    model: pin.Model  #: Pinocchio model; free-flyer base where the robot file says ``floating``.

    @property
    def floating(self) -> bool:
        """Whether the base floats."""
        return self.spec.floating

    @property
    def joints(self) -> tuple[str, ...]:
        """Actuated joints in the robot file's order, the legs' first; the order of every column."""
        return self.spec.joints

    @property
    def mass(self) -> float:
        """Of all bodies, the fixed one at the root included [kg]: what every force rests on."""
        return float(sum(inertia.mass for inertia in self.model.inertias))

    @cached_property
    def leg_names(self) -> tuple[str, ...]:
        """Legs in the robot file's order."""
        return self.spec.leg_names

    @cached_property
    def chains(self) -> LegChains:
        """Geometry of the legs, and their joints among `joints`."""
        legs = [(leg.name, leg.joints, leg.foot) for leg in self.spec.legs]
        return leg_chains(self.model, legs, 1 if self.floating else 0, self.joints)

    @cached_property
    def position_index(self) -> NDArray[np.intp]:
        """Columns of `joints` in Pinocchio's configuration."""
        return np.array([joint.idx_q for joint in self._each], dtype=np.intp)

    @cached_property
    def velocity_index(self) -> NDArray[np.intp]:
        """Columns of `joints` in Pinocchio's tangent vectors."""
        return np.array([joint.idx_v for joint in self._each], dtype=np.intp)

    @cached_property
    def limits(self) -> tuple[Array, Array]:
        """Lower and upper position limits of `joints`, each (J,) [rad, m]; infinite without."""
        at = self.position_index
        return self.model.lowerPositionLimit[at], self.model.upperPositionLimit[at]

    @cached_property
    def held(self) -> Array:
        """Where joints outside the legs are held, zero in the legs, shape (J,) [rad, m]."""
        return np.array([self.spec.held.get(name, 0.0) for name in self.joints])

    @cached_property
    def sliding(self) -> NDArray[np.bool_]:
        """Which of `joints` are prismatic, shape (J,): metres and newtons, not radians."""
        return np.array(["JointModelP" in joint.shortname() for joint in self._each])

    @cached_property
    def sliding_joints(self) -> tuple[str, ...]:
        """Names of the prismatic ones among `joints`."""
        return tuple(np.array(self.joints)[self.sliding].tolist())

    @cached_property
    def start_posture(self) -> Array:
        """Postures that name each leg's branch, shape (L, K) [rad, m]; zero beyond its joints."""
        out = np.zeros(self.chains.columns.shape)
        for row, leg in zip(out, self.spec.legs, strict=True):
            row[: len(leg.start_posture)] = leg.start_posture
        return out

    @cached_property
    def links(self) -> dict[str, str]:
        """Moving link that has mass to the joint that carries it."""
        names, bodies = list(self.model.names), self.model.inertias
        carried = [k for k in range(1, len(names)) if bodies[k].mass > 0]
        return {link_name(self.model, k): str(names[k]) for k in carried}

    @property
    def _each(self) -> list[pin.JointModel]:
        names, where = list(self.model.names)[1:], str(self.spec.urdf)
        found = [known("the URDF has no joint", name, names, where) for name in self.joints]
        return [self.model.joints[self.model.getJointId(name)] for name in found]

    def leg_positions(self, configuration: Array) -> Array:
        """Joint positions by leg: (N, nq) to (N, L, K) [rad, m]."""
        return self.chains.by_leg(configuration[:, self.position_index])

    def joint_positions(self, legs: Array) -> Array:
        """All joints' positions, those outside the legs held: (N, L, K) to (N, J) [rad, m]."""
        return self.chains.by_joint(legs, self.held)

    def with_bodies(self, model: pin.Model) -> Self:
        """The same robot with other inertias; the geometry of its legs stays."""
        out = replace(self, model=model)
        vars(out)["chains"] = self.chains
        return out

    def base_rotation(self, configuration: Array) -> Array:
        """Rotation from a floating base to the world, shape (N, 3, 3)."""
        return np.asarray(Rotation.from_quat(configuration[:, 3:7]).as_matrix())

    def configuration(self, joint_positions: Array, base: Array | None = None) -> Array:
        """Pinocchio configurations, shape (N, nq).

        `joint_positions`: in the order of `joints` [rad, m], shape (N, J). `base`: of a floating
        one its place, shape (N, 3) [m], or place and quaternion x y z w, shape (N, 7).
        """
        q = np.tile(pin.neutral(self.model), (len(joint_positions), 1))
        q[:, self.position_index] = joint_positions
        if self.floating and base is not None:
            q[:, : base.shape[1]] = base
        return q

    def tangent(self, joint_values: Array, base: Array | None = None) -> Array:
        """Pinocchio velocities or accelerations, shape (N, nv).

        `joint_values`: in the order of `joints`, shape (N, J). `base`: of a floating one its linear
        part in its own frame, shape (N, 3), or linear and angular part, shape (N, 6).
        """
        v = np.zeros((len(joint_values), self.model.nv))
        v[:, self.velocity_index] = joint_values
        if self.floating and base is not None:
            v[:, : base.shape[1]] = base
        return v


def inverse_dynamics(model: pin.Model, motion: tuple[Array, Array, Array]) -> Array:
    """Generalised forces without contact, by Pinocchio's RNEA, shape (N, nv) [N, N*m].

    `model`: its armature is zero, reflected rotor inertia being the actuator chain's. `motion`:
    configuration (N, nq), velocity (N, nv) and acceleration (N, nv).
    """
    data = model.createData()
    rows = [pin.rnea(model, data, *row) for row in zip(*motion, strict=True)]
    return np.reshape(rows, (-1, model.nv))


def read_spec(path: Path) -> RobotSpec:
    """A robot file's contents, or what one would say of a URDF: a fixed base, all joints held.

    Raises:
        LegwattError: The file cannot be read or used.
    """
    if path.suffix.lower() not in (".urdf", ".xml"):
        return load_robot_file(path)
    model = model_of_angles(read_urdf(path), str(path), floating=False)
    mass = float(sum(inertia.mass for inertia in model.inertias))
    of = {"basis": "datasheet", "source": path.name}
    numbers = {
        "total_mass": {"value": mass, "unit": "kg", **of},
        "gravity": {"value": 9.81, "unit": "m/s^2", **of},
    }
    kinds = {"total_mass": "mass", "gravity": "acceleration"}
    base = root_link(model)
    return RobotSpec.model_construct(
        path=path,
        robot=RobotTable.model_construct(
            name=path.stem, urdf=path.name, base_link=base, base="fixed"
        ),
        held=dict.fromkeys(map(str, list(model.names)[1:]), 0.0),
        parameters=parameters_from_table(numbers, kinds, str(path)),
    )


def load_robot(spec: RobotSpec) -> Robot:
    """Build the robot of a robot file.

    A robot file with ``build`` gives its URDF from its numbers, so that a changed number counts at
    once; otherwise the URDF file it names is read.

    Raises:
        LegwattError: The URDF is missing or malformed, or lacks a joint or foot the file names.
    """
    if spec.robot.build:
        text = build_urdf(spec)
    else:
        urdf = spec.urdf
        try:
            text = read_urdf(urdf)
        except LegwattError as error:
            raise LegwattError(f"{error}; {spec.path} names it as robot.urdf") from None
    where = str(spec.path if spec.robot.build else spec.urdf)
    model = model_of_angles(text, where, floating=spec.floating)
    model.gravity.linear = np.array([0.0, 0.0, -spec.parameters["gravity"]])
    robot, root = Robot(spec, text, model), root_link(model)
    if spec.robot.base_link != root:  # feet are placed in its frame
        words = f"the root of {spec.urdf.name} is '{root}'; name that, and place feet in its frame"
        raise LegwattError(
            f"{spec.path}: robot.base_link = '{one_line(spec.robot.base_link)}', {words}"
        )
    try:  # every name now: a wrong one is an error on loading and not in the middle
        _ = robot.chains, robot.position_index
    except LegwattError as error:
        raise LegwattError(f"{spec.path}: {error}") from None
    left = [n for n in list(model.names)[2 if robot.floating else 1 :] if n not in robot.joints]
    if left:
        words = f"list them in a leg, hold them ([held] {left[0]} = 0.0), or make them fixed"
        raise LegwattError(
            f"{spec.path}: joints of the URDF in no leg: {', '.join(map(repr, left))}; {words}"
        )
    return robot


def root_link(model: pin.Model) -> str:
    """The link at the root of the URDF's tree."""
    return next(str(frame.name) for frame in model.frames if frame.type == pin.FrameType.BODY)


def link_name(model: pin.Model, joint: int) -> str:
    """Name of the link that a joint carries (of the first, where fixed joints merged several)."""
    for frame in model.frames:
        if frame.type == pin.FrameType.BODY and frame.parentJoint == joint:
            return str(frame.name)
    return str(model.names[joint])
