"""What may stand in a robot file: its tables, their keys, the numbers that each robot needs."""

from __future__ import annotations

import math
from typing import Annotated, Any, Final, Literal, Self

from pydantic import AfterValidator, Field, Strict, model_validator

from actuators.checked import Names, Number, Table, Text
from actuators.errors import LegwattError
from actuators.parameters import ParameterSet

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
#: What a number of a dimension may be, SI: lengths of walking robots lie within these, outside a
#: unit is wrong by a thousand; an angle is at most a turn. Other numbers are positive.
_WITHIN: Final = {"length": (1e-3, 10.0), "angle": (-2 * math.pi, 2 * math.pi)}
#: Numbers with limits of their own: what may be zero or lie on either side, ratios of a length, and
#: an acceleration that no planet exceeds.
_OWN: Final = {
    "coxa_length": (0.0, 10.0),
    "joint_2_lateral": (-10.0, 10.0),
    "trunk_com_left": (-10.0, 10.0),
    "joint_1_range": (1e-9, 2 * math.pi),
    "femur_com": (0.0, 1.0),
    "tibia_com": (0.0, 1.0),
    "gravity": (1e-9, 30.0),
}
#: Of a unit the one that it is confused with, and what that makes of a number.
_OTHER: Final = {"m": ("mm", 1e-3), "mm": ("m", 1e3), "rad": ("deg", math.pi / 180)}
#: Joints of a built leg: hip, femur, tibia.
_BUILT_JOINTS: Final = 3


def _file_name(value: str) -> str:
    """Names become columns and files: no separators, nothing invisible."""
    bad = [c for c in value if c in '/\\,;"' or not c.isprintable()]
    if bad or not value.strip():
        what = f"holds {bad[0]!r}" if bad else "is empty"
        raise ValueError(f"a name {what}; names become columns and file names")
    return value


def _no_further(most: float, remark: str) -> AfterValidator:
    """Return the check that no number of a row is larger."""

    def check(row: tuple[float, ...]) -> tuple[float, ...]:
        for k, number in enumerate(row, start=1):
            if abs(number) > most:
                raise ValueError(f"has {number:g} at place {k}; it is written in {remark}?")
        return row

    return AfterValidator(check)


FileName = Annotated[str, AfterValidator(_file_name)]
Place = Annotated[
    tuple[Number, Number, Number],
    Strict(False),
    _no_further(10.0, "metres, are these millimetres"),
]
Posture = Annotated[
    tuple[Number, ...],
    Strict(False),
    _no_further(2 * math.pi, "radians, are these degrees"),
]


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
    """``[legs.NAME]``: `station` of a built robot, `neutral_foot` of a URDF of the user's own."""

    joints: Annotated[tuple[FileName, ...], Strict(False)]
    foot: Text
    side: Literal["left", "right"]
    station: Literal["front", "middle", "rear", ""] = ""
    neutral_foot: Place | None = None
    start_posture: Posture = ()

    @model_validator(mode="after")
    def _check_joints(self) -> Self:
        if not self.joints:
            raise ValueError("joints is empty; a leg has at least one actuated joint")
        if self.start_posture and len(self.start_posture) != len(self.joints):
            raise ValueError(
                f"start_posture must be as many numbers as there are joints, {len(self.joints)}, "
                f"not {len(self.start_posture)}"
            )
        return self


class StandingTable(Table):
    """``[standing]``."""

    feet: Names | None = None


class FileTable(Table):
    """A robot file; gait and actuators are read by the rooms that know them."""

    robot: RobotTable
    legs: dict[FileName, LegTable]
    held: dict[FileName, Number] = Field(default={})
    gait: dict[str, Any] = Field(default={})
    standing: StandingTable = StandingTable()
    assumed: dict[str, Text] = Field(default={})
    parameters: dict[str, Any]
    actuators: dict[str, Any] = Field(default={})

    @model_validator(mode="after")
    def _check_legs(self) -> Self:
        """Each leg says where its foot stands, and each joint belongs to one."""
        if not self.legs:
            raise ValueError("no leg; give one table [legs.NAME] for each")
        owner: dict[str, str] = {}
        for name, leg in self.legs.items():
            if self.robot.build and not leg.station:
                raise ValueError(f"missing: legs.{name}.station")
            if self.robot.build and len(leg.joints) != _BUILT_JOINTS:
                many = len(leg.joints)
                raise ValueError(
                    f"'legs.{name}': names {many} joints; a built leg has {_BUILT_JOINTS}"
                )
            if not self.robot.build and leg.neutral_foot is None:
                raise ValueError(f"missing: legs.{name}.neutral_foot")
            for joint in leg.joints:
                if joint in owner:
                    raise ValueError(f"joint '{joint}' belongs to two legs")
                owner[joint] = name
        for joint in self.held:
            if joint in owner:
                raise ValueError(
                    f"held.{joint}: the joint belongs to leg '{owner[joint]}'; take one"
                )
        return self


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
        low, high = _OWN.get(row.name, _WITHIN.get(schema[row.name], (1e-9, math.inf)))
        allowed = low <= row.value <= high or (row.name == "foot_lift" and row.value == 0)
        if allowed or not (build or row.name in GAIT_SCHEMA):
            continue
        number, unit = f"{row.value_as_written:g}", row.unit
        other, factor = _OTHER.get(unit, ("", 0.0))
        meant = other and low <= row.value * factor <= high
        hint = f"is {number} {other} meant?" if meant else "check its unit"
        reason = f"lies outside {low:.4g} to {high:.4g} (SI); {hint}"
        if row.value <= 0 < low:
            reason = "must be positive"
        wrong.append(f"parameters.{row.name} = {number} {unit} {reason}")
    if build:
        wrong += [
            f"parameters.{joint}_lower must be below {joint}_upper"
            for joint in ("joint_2", "joint_3")
            if parameters[f"{joint}_lower"] >= parameters[f"{joint}_upper"]
        ]
        if parameters["joint_2_lateral"] < parameters["coxa_length"]:
            wrong.append(
                "joint_2_lateral is smaller than coxa_length, so joint 1 would lie beyond the "
                "mid-plane"
            )
    if wrong:
        raise LegwattError(f"{where}: {'; '.join(wrong)}")
