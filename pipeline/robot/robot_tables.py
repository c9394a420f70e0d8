"""What may stand in a robot file: its tables, their keys and what each of them may say."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Final, Generic, Literal, Self, TypeVar

from pydantic import AfterValidator, BeforeValidator, Field, Strict, model_validator

from actuators.checked import Names, Number, Table, Text, finite
from pipeline.robot.robot_numbers import LARGEST_LENGTH

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
