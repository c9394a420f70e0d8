"""What may stand in a robot file: its tables, their keys, the numbers that each robot needs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Final, Generic, Literal, Self, TypeVar

from pydantic import AfterValidator, BeforeValidator, Field, Strict, model_validator

from actuators.checked import Names, Number, Table, Text, finite
from actuators.errors import LegwattError
from actuators.parameters import Parameter, ParameterSet

#: Numbers every walking robot needs, with their dimension.
GAIT_SCHEMA: Final = {
    "total_mass": "mass",
    "foot_stroke": "length",
    "foot_lift": "length",
    "walking_speed": "velocity",
    "gait_period": "time",
    "gravity": "acceleration",
}
#: Numbers from which `pipeline.robot.urdf_builder` builds the hexapod and the leg on a stand.
BUILD_SCHEMA: Final = {
    "body_length": "length",
    "robot_width": "length",
    "hip_spacing": "length",
    "joint_1_axis_angle": "angle",
    "joint_2_lateral": "length",
    "body_height": "length",
    "coxa_length": "length",
    "femur_length": "length",
    "tibia_length": "length",
    "trunk_height": "length",
    "link_width": "length",
    "hip_link_mass": "mass",
    "femur_mass": "mass",
    "tibia_mass": "mass",
    "femur_com": "ratio",
    "tibia_com": "ratio",
    "trunk_com_left": "length",
    "joint_1_range": "angle",
    "joint_2_lower": "angle",
    "joint_2_upper": "angle",
    "joint_3_lower": "angle",
    "joint_3_upper": "angle",
    "joint_effort_limit": "torque",
    "joint_velocity_limit": "angular velocity",
}
#: A gait's numbers among the parameters; ``[gait]`` may state its own instead.
GAIT_NUMBERS: Final = frozenset({"foot_stroke", "foot_lift", "walking_speed", "gait_period"})
#: Lengths of walking robots lie between these; outside, a unit is wrong by a thousand [m].
SMALLEST_LENGTH, LARGEST_LENGTH = 1e-3, 10.0
#: No planet pulls more [m/s^2].
LARGEST_GRAVITY: Final = 30.0
#: Lengths that may be zero, or lie on either side.
_ANY_LENGTH: Final = ("coxa_length", "joint_2_lateral", "trunk_com_left")
#: Numbers that may be zero, but not negative.
_NOT_NEGATIVE: Final = ("foot_lift", "coxa_length")
#: Numbers of either sign, or with limits of their own.
_ANY_SIGN: Final = (
    *("joint_1_axis_angle", "joint_2_lateral", "femur_com", "tibia_com", "trunk_com_left"),
    *("joint_2_lower", "joint_2_upper", "joint_3_lower", "joint_3_upper"),
)
#: Joints of a built leg: hip, femur, tibia.
_BUILT_JOINTS: Final = 3


def _file_name(value: str) -> str:
    """Names become columns and files: no separators, nothing invisible."""
    bad = [c for c in value if c in '/\\,;"' or not c.isprintable()]
    if bad or not value.strip():
        what = f"holds {bad[0]!r}" if bad else "is empty"
        raise ValueError(f"a name {what}; names become columns and file names")
    return value


def _numbers(value: object) -> tuple[float, ...]:
    if not isinstance(value, list | tuple):
        raise ValueError("must be a list of numbers")
    return tuple(finite(number) for number in value)


def _place(value: object) -> tuple[float, ...]:
    """A point in the base frame [m]."""
    point = _numbers(value)
    if len(point) != 3:
        raise ValueError(f"must be three numbers, not {len(point)}")
    for k, at in enumerate(point, start=1):
        if abs(at) > LARGEST_LENGTH:
            raise ValueError(
                f"has {at:g} at place {k}; it is written in metres, are these millimetres?"
            )
    return point


def _posture(value: object) -> tuple[float, ...]:
    """Joint positions [rad, m]."""
    posture = _numbers(value)
    for k, angle in enumerate(posture, start=1):
        if abs(angle) > 2 * math.pi:
            raise ValueError(
                f"has {angle:g} at place {k}; it is written in radians, are these degrees "
                f"({math.radians(angle):.4g} rad)?"
            )
    return posture


FileName = Annotated[str, AfterValidator(_file_name)]


class RobotTable(Table):
    """``[robot]``."""

    name: Text
    urdf: Text
    base_link: Text
    base: Literal["floating", "fixed"] = "floating"
    build: Literal["hexapod", "leg_stand"] | None = None
    zero_pose: str = ""
    note: str = ""


class LegTable(Table):
    """``[legs.NAME]``, what every leg has."""

    expected = "joints, foot and side"
    joints: Annotated[tuple[FileName, ...], Strict(False)]
    foot: Text
    side: Literal["left", "right"]
    start_posture: Annotated[tuple[float, ...], BeforeValidator(_posture)] | None = None

    @model_validator(mode="after")
    def _check_joints(self) -> Self:
        if not self.joints:
            raise ValueError("joints is empty; a leg has at least one actuated joint")
        if self.start_posture is not None and len(self.start_posture) != len(self.joints):
            raise ValueError(
                f"start_posture must be as many numbers as there are joints, {len(self.joints)}, "
                f"not {len(self.start_posture)}"
            )
        return self


class OwnLegTable(LegTable):
    """A leg of a URDF of the user's own."""

    neutral_foot: Annotated[tuple[float, float, float], BeforeValidator(_place)]
    station: str = ""


class BuiltLegTable(LegTable):
    """A leg of a robot that is built from numbers."""

    station: Literal["front", "middle", "rear"]
    neutral_foot: Any = None  # follows from the numbers

    @model_validator(mode="after")
    def _check_count(self) -> Self:
        if len(self.joints) != _BUILT_JOINTS:
            raise ValueError(f"names {len(self.joints)} joints; a built leg has {_BUILT_JOINTS}")
        return self


class StandingTable(Table):
    """``[standing]``."""

    feet: Names | None = None


_Leg = TypeVar("_Leg", bound=LegTable)


class FileTable(Table, Generic[_Leg]):
    """A robot file; gait and actuators are read by the rooms that know them."""

    noun: ClassVar[str] = "table"
    robot: RobotTable
    legs: dict[FileName, _Leg]
    held: dict[FileName, Number] = Field(default={})
    gait: dict[str, Any] = Field(default={})
    standing: StandingTable = StandingTable()
    assumed: dict[str, Text] = Field(default={})
    parameters: dict[str, Any]
    actuators: dict[str, Any] = Field(default={})


def check_parameters(parameters: ParameterSet, build: str | None, where: str) -> None:
    """Refuse numbers that no robot or gait can have, after loading and after a change.

    `build`: which builder makes the URDF, or None for a URDF of the user's own.

    Raises:
        LegwattError: A mass, length or period that is not positive, a unit that is wrong by a
            thousand, or a contradiction; all of them.
    """
    schema = GAIT_SCHEMA | BUILD_SCHEMA
    wrong: list[str] = []
    for row in parameters.rows():
        if build or row.name in GAIT_SCHEMA:
            if row.name in _NOT_NEGATIVE and row.value < 0:
                wrong.append(f"parameters.{row.name} must not be negative")
            elif row.name not in (*_NOT_NEGATIVE, *_ANY_SIGN) and row.value <= 0:
                wrong.append(f"parameters.{row.name} = {_written(row)} must be positive")
        wrong += _size(row, schema[row.name])
    if build:
        wrong += [
            f"parameters.{joint}_lower must be below {joint}_upper"
            for joint in ("joint_2", "joint_3")
            if parameters[f"{joint}_lower"] >= parameters[f"{joint}_upper"]
        ]
        wrong += [
            f"parameters.{name} = {parameters[name]:g} lies outside the link; expected 0 to 1, "
            "a fraction of its length"
            for name in ("femur_com", "tibia_com")
            if not 0 <= parameters[name] <= 1
        ]
        if parameters["joint_2_lateral"] < parameters["coxa_length"]:
            wrong.append(
                "joint_2_lateral is smaller than coxa_length, so joint 1 would lie beyond the "
                "mid-plane"
            )
    if wrong:
        raise LegwattError(f"{where}: {'; '.join(wrong)}")


def _size(row: Parameter, dimension: str) -> Iterator[str]:
    """Metres written for millimetres and the reverse, radians for degrees."""
    size, number = abs(row.value), f"{row.value_as_written:g}"
    small = 0 < size < SMALLEST_LENGTH and row.name not in _ANY_LENGTH
    other = ""
    if row.name == "gravity" and size > LARGEST_GRAVITY:
        yield "parameters.gravity is beyond any planet; check its unit"
        return
    if dimension == "angle" and size > 2 * math.pi:
        what, other = "more than a turn", "deg" if row.unit == "rad" else ""
    elif dimension == "length" and (small or size > LARGEST_LENGTH):
        what = f"{'shorter' if small else 'longer'} than in any walking robot"
        other = {("mm", True): "m", ("m", False): "mm"}.get((row.unit, small), "")
    else:
        return
    hint = f"is {number} {other} meant?" if other else "check its unit"
    yield f"parameters.{row.name} = {_written(row)} is {what}; {hint}"


def _written(row: Parameter) -> str:
    return f"{row.value_as_written:g} {row.unit}"
