"""What may stand in a robot file: its tables, their keys, the numbers that each robot needs."""

from __future__ import annotations

import math
from typing import Annotated, Final, Literal, NamedTuple, Self

from pydantic import AfterValidator, Field, Strict, model_validator

from actuators.checked import Number, Table, Text
from actuators.errors import LegwattError
from actuators.parameters import ParameterSet

#: Periods [s] and speeds [m/s] of a walk: insects take twenty steps a second, no machine fewer than
#: one in a quarter of an hour; the fastest legged robots run at 13 m/s.
PERIODS: Final = (0.05, 1000.0)
FASTEST: Final = 20.0


class Bounds(NamedTuple):
    """What a number of a robot file may be, its ends included [SI]."""

    dimension: str
    low: float = 1e-9
    high: float = math.inf


#: Lengths of walking robots lie within these; outside, a unit is wrong by a thousand.
_LENGTH: Final = Bounds("length", 1e-3, 10.0)
_PLACE: Final = Bounds("length", -10.0, 10.0)
_ANGLE: Final = Bounds("angle", -2 * math.pi, 2 * math.pi)
_MASS: Final = Bounds("mass")
#: Numbers every walking robot needs; no planet that is walked on pulls harder than 30 m/s^2.
GAIT_SCHEMA: Final = {
    "total_mass": _MASS,
    "foot_stroke": _LENGTH,
    "foot_lift": _LENGTH,  # or 0
    "walking_speed": Bounds("velocity", 1e-9, FASTEST),
    "gait_period": Bounds("time", *PERIODS),
    "gravity": Bounds("acceleration", 1e-9, 30.0),
}
#: Numbers from which `pipeline.robot.urdf_builder` builds the hexapod and the leg on a stand.
BUILD_SCHEMA: Final = {
    "body_length": _LENGTH,
    "robot_width": _LENGTH,
    "hip_spacing": _LENGTH,
    "joint_1_axis_angle": _ANGLE,
    "joint_2_lateral": _PLACE,
    "body_height": _LENGTH,
    "coxa_length": Bounds("length", 0.0, 10.0),
    "femur_length": _LENGTH,
    "tibia_length": _LENGTH,
    "trunk_height": _LENGTH,
    "link_width": _LENGTH,
    "hip_link_mass": _MASS,
    "femur_mass": _MASS,
    "tibia_mass": _MASS,
    "femur_com": Bounds("ratio", 0.0, 1.0),
    "tibia_com": Bounds("ratio", 0.0, 1.0),
    "trunk_com_left": _PLACE,
    "joint_1_range": Bounds("angle", 1e-9, 2 * math.pi),
    "joint_2_lower": _ANGLE,
    "joint_2_upper": _ANGLE,
    "joint_3_lower": _ANGLE,
    "joint_3_upper": _ANGLE,
    "joint_effort_limit": Bounds("torque"),
    "joint_velocity_limit": Bounds("angular velocity"),
}
#: A gait's numbers among the parameters; ``[gait]`` may state its own instead.
GAIT_NUMBERS: Final = frozenset({"foot_stroke", "foot_lift", "walking_speed", "gait_period"})


def _file_name(value: str) -> str:
    """Names become columns and files: no separators, nothing invisible."""
    bad = [c for c in value if c in '/\\,;"' or not c.isprintable()]
    if bad or not value.strip():
        what = f"holds {bad[0]!r}" if bad else "is empty"
        raise ValueError(f"a name {what}; names become columns and file names")
    return value


FileName = Annotated[str, AfterValidator(_file_name)]
#: Metres and radians of a robot; what lies beyond was written in millimetres or degrees.
_Metres = Annotated[Number, Field(ge=-10.0, le=10.0)]
_Radians = Annotated[Number, Field(ge=-2 * math.pi, le=2 * math.pi)]
Place = Annotated[tuple[_Metres, _Metres, _Metres], Strict(False)]
Posture = Annotated[tuple[_Radians, ...], Strict(False)]


class RobotTable(Table):
    """``[robot]``."""

    name: Text
    urdf: Text
    base_link: Text
    base: Literal["floating", "fixed"] = "floating"
    build: Literal["hexapod", "leg_stand"] | None = None
    zero_pose: str = ""
    note: str = ""


class LegSpec(Table):
    """``[legs.NAME]``: one leg."""

    name: str = ""  #: The table's, e.g. ``"rm"``.
    #: From the base outward; more are no leg.
    joints: Annotated[tuple[FileName, ...], Strict(False), Field(min_length=1, max_length=7)]
    foot: Text  #: Frame at the foot point.
    side: Literal["left", "right"]
    station: Literal["front", "middle", "rear", ""] = ""  #: Of a built robot; empty for others.
    #: Foot at mid-stroke in the base frame [m]; that of a built robot follows from its numbers.
    neutral_foot: Place = (0.0, 0.0, 0.0)
    #: Joint positions that name the knee's branch [rad, m], one for each joint; empty where none is
    #: stated, and zero is taken.
    start_posture: Posture = ()

    @model_validator(mode="after")
    def _check_posture(self) -> Self:
        if self.start_posture and len(self.start_posture) != len(self.joints):
            count = f"as many numbers as there are joints, {len(self.joints)}"
            raise ValueError(f"start_posture must be {count}, not {len(self.start_posture)}")
        return self


def check_parameters(parameters: ParameterSet, build: str | None, where: str) -> None:
    """Refuse numbers that no robot or gait can have, after loading and after a change; all of them.

    `build`: which builder makes the URDF, or None for a URDF of the user's own.
    """
    wrong: list[str] = []
    for row in parameters.rows():
        if not build and row.name not in GAIT_SCHEMA:
            continue
        _, low, high = (GAIT_SCHEMA | BUILD_SCHEMA)[row.name]
        if not low <= row.value <= high and not (row.name == "foot_lift" and row.value == 0):
            number = f"{row.value_as_written:g} {row.unit} lies outside {low:.4g} to {high:.4g}"
            wrong.append(f"parameters.{row.name} = {number} (SI); check its unit")
    if build and parameters["joint_2_lateral"] < parameters["coxa_length"]:
        wrong.append(
            "joint_2_lateral is smaller than coxa_length, so joint 1 would lie beyond the mid-plane"
        )
    if wrong:
        raise LegwattError(f"{where}: {'; '.join(wrong)}")
