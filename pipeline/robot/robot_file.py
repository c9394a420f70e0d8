"""The robot file: a robot and its gait as data (TOML), checked against a schema on loading.

Robots are known by name, too: URDFs that ``example-robot-data`` ships, and motors of some.
"""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, Self

from pydantic import AfterValidator, ConfigDict, Field, Strict, model_validator

from actuators.checked import Names, Number, Table, Text, checked, read_toml
from actuators.errors import LegwattError, known
from actuators.parameters import ParameterSet, parameters_from_table

#: How a robot file writes such a URDF: ``example-robot-data:solo12``.
SCHEME: Final = "example-robot-data:"
#: Folders of actuator files of robots, and the table that says whose they are.
KNOWN: Final = Path(__file__).resolve().parents[2] / "urdf" / "actuators"
TABLE: Final = KNOWN / "known.toml"
#: How a robot file names such a folder: ``known:solo12``.
KNOWN_SCHEME: Final = "known:"


@dataclass(frozen=True)
class RobotSource:
    """A URDF and what lies beside it."""

    name: str  #: Of the robot; by which the package calls it where it is published.
    urdf: Path
    srdf: Path | None = None  #: Poses with names; None without.
    pose: str = ""  #: Name of the pose that the publisher refers to; empty where there is none.
    published: bool = False  #: Whether it is known by name and not by its place.

    def reference(self, out: Path) -> str:
        """How a robot file at `out` names the URDF."""
        if self.published:
            return SCHEME + self.name
        return Path(os.path.relpath(self.urdf.absolute(), out.absolute().parent)).as_posix()


@cache
def loaders() -> dict[str, Any]:
    """Every robot that the package knows, by name."""
    from example_robot_data.robots_loader import ROBOTS

    return dict(ROBOTS)


def robot_source(given: str) -> RobotSource:
    """A URDF by its path, or by its robot's name in the package, with or without `SCHEME`.

    An SRDF is looked for beside a file, and in a folder ``srdf`` beside its folder.

    Raises:
        LegwattError: It is neither, or a robot without a URDF.
    """
    path, name = Path(given), given.removeprefix(SCHEME)
    if name == given and (path.is_file() or path.suffix or len(path.parts) > 1):
        beside = (path.with_suffix(".srdf"), path.parent.parent / "srdf" / f"{path.stem}.srdf")
        return RobotSource(path.stem, path, next((p for p in beside if p.is_file()), None))
    loader = loaders()[known("no file, and no robot of example-robot-data, is", name, loaders())]
    from example_robot_data.robots_loader import getModelPath

    if not loader.urdf_filename:
        raise LegwattError(f"{name}: example-robot-data has no URDF of it")
    folder = Path(getModelPath(loader.path)) / loader.path
    urdf = folder / loader.urdf_subpath / loader.urdf_filename
    srdf = folder / loader.srdf_subpath / (loader.srdf_filename or "none")
    poses = srdf if srdf.is_file() else None
    return RobotSource(name, urdf, poses, loader.ref_posture or "", published=True)


def urdf_path(text: str, robot_file: Path) -> Path:
    """Where ``robot.urdf`` lies: a path beside the robot file, or ``example-robot-data:NAME``."""
    if not text.startswith(SCHEME):
        return robot_file.parent / text
    try:
        return robot_source(text).urdf
    except LegwattError as error:
        raise LegwattError(f"{robot_file}: robot.urdf: {error}") from None


def known_motors(names: Sequence[str], joints: Sequence[str]) -> Mapping[str, Any] | None:
    """``[actuators]`` of a robot's file; None where nobody knows its motors.

    `names`: by which it was asked for, and the URDF's own. `joints`: of its legs; they and those
    whose motors are known must be the same.
    """
    for name, robot in read_toml(TABLE).items():
        each = [[fnmatchcase(joint, pattern) for joint in joints] for pattern in robot["joints"]]
        whole = all(map(any, each)) and all(map(any, zip(*each, strict=True)))
        if whole and not set(names).isdisjoint(robot["robots"]):
            table = {key: robot[key] for key in ("alternative", "source", "joint") if key in robot}
            return {"folder": KNOWN_SCHEME + name, **table}
    return None


#: Dimension of a number of a robot file, and what it may be, its ends included [SI].
Bounds = tuple[str, float, float]


def _numbers(of: str) -> dict[str, Bounds]:
    with Path(__file__).with_name("numbers.csv").open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.reader(file) if row[-1] == of]
    return {name: (kind, float(low), float(high or "inf")) for name, kind, low, high, _ in rows}


#: Numbers every walking robot needs. Lengths of walking robots lie within a millimetre and 10 m:
#: outside, a unit is wrong by a thousand. Insects take twenty steps a second, no machine fewer than
#: one in a quarter of an hour, the fastest legged robots run at 13 m/s; no planet that is walked on
#: pulls harder than 30 m/s^2.
GAIT_SCHEMA: Final = _numbers("gait")
#: Numbers from which `pipeline.robot.urdf` builds the hexapod and the leg on a stand.
BUILD_SCHEMA: Final = _numbers("build")
PERIODS: Final = GAIT_SCHEMA["gait_period"][1:]  # of a walk [s]
FASTEST: Final = GAIT_SCHEMA["walking_speed"][2]  # [m/s]
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


#: Of the project, from the folder it is run in.
DEFAULT_ROBOT: Final = Path("urdf/hexapod.toml")
#: Hips of a built robot along x, in units of `hip_spacing`.
STATIONS: Final = {"front": 1.0, "middle": 0.0, "rear": -1.0}
#: Keys of ``[gait]`` that say which legs stand when, the duty factor aside.
FOOTFALLS: Final = ("name", "phase")


def _named(legs: dict[str, LegSpec]) -> tuple[LegSpec, ...]:
    return tuple(leg.model_copy(update={"name": name}) for name, leg in legs.items())


if TYPE_CHECKING:
    Legs = tuple[LegSpec, ...]
else:  # tables by name in the file
    Legs = Annotated[dict[FileName, LegSpec], AfterValidator(_named)]


class RobotSpec(Table):
    """A robot file: its tables, numbers in SI; gait and actuators are read by who knows them."""

    model_config = ConfigDict(arbitrary_types_allowed=True)

    path: Path = Field(default=Path(), exclude=True)  #: The file.
    #: The file and those it extends, for hashes; none of a URDF without one.
    sources: tuple[Path, ...] = Field(default=(), exclude=True)
    robot: RobotTable
    legs: Legs = ()  #: In order.
    #: Joints outside the legs and where they are held [rad, m].
    held: dict[FileName, Number] = Field(default={})
    gait: dict[str, Any] = Field(default={})
    standing: dict[Literal["feet"], Names] = Field(default={})
    assumed: dict[str, Text] = Field(default={})
    #: Numbers with unit, basis and source, SI on reading.
    parameters: ParameterSet
    actuators: dict[str, Any] = Field(default={})

    @model_validator(mode="after")
    def _check_legs(self) -> Self:
        """Each leg says where its foot stands, and each joint belongs to one."""
        if not self.legs and (self.floating or not self.held):
            raise ValueError("missing: legs; a robot without any has base = 'fixed', and [held]")
        owner: dict[str, str] = {}
        for leg in self.legs:
            key = "station" if self.robot.build else "neutral_foot"
            if key not in leg.model_fields_set:
                raise ValueError(f"missing: legs.{leg.name}.{key}")
            if self.robot.build and len(leg.joints) != 3:  # hip, femur, tibia
                raise ValueError(
                    f"'legs.{leg.name}': a built leg has 3 joints, not {len(leg.joints)}"
                )
            for joint in leg.joints:
                if joint in owner:
                    raise ValueError(f"joint '{joint}' belongs to two legs")
                owner[joint] = leg.name
        for joint in self.held:
            if joint in owner:
                raise ValueError(f"held.{joint}: the joint belongs to leg '{owner[joint]}'")
        return self

    @property
    def name(self) -> str:
        """Of the robot."""
        return self.robot.name

    @property
    def urdf(self) -> Path:
        """Where the URDF lies."""
        return urdf_path(self.robot.urdf, self.path)

    @property
    def floating(self) -> bool:
        """Whether the base floats on its legs or is fixed to a stand."""
        return self.robot.base == "floating"

    @property
    def standing_feet(self) -> tuple[str, ...]:
        """Legs that stand in the standing mode."""
        return self.standing.get("feet", self.leg_names)

    @property
    def leg_names(self) -> tuple[str, ...]:
        """Legs in order."""
        return tuple(leg.name for leg in self.legs)

    @property
    def joints(self) -> tuple[str, ...]:
        """All actuated joints: the legs' leg by leg, then those that are held."""
        legs = (joint for leg in self.legs for joint in leg.joints)
        return (*legs, *self.held)

    def with_gait(self, **changes: Any) -> RobotSpec:
        """The same robot with another gait: keys of ``[gait]`` as the file would write them."""
        return self.model_copy(update={"gait": merged_gait(self.gait, changes)})

    def with_parameters(self, values: Mapping[str, float]) -> RobotSpec:
        """The same robot with some parameters at other values.

        Raises:
            LegwattError: A name is unknown or a value out of bounds.
        """
        parameters = self.parameters
        for name, value in values.items():
            parameters = parameters.replaced(name, value)
        return self.model_copy(update={"parameters": parameters}).on_feet()

    def on_feet(self) -> RobotSpec:
        """Legs of a built robot with their feet at mid-stroke in the base frame [m].

        The base frame's origin lies in the mid-plane at the height of joints 1 and 2; the feet
        stand at the robot's overall width.
        """
        if not self.robot.build:
            return self
        p, out, legs = self.parameters, {"left": 0.5, "right": -0.5}, []
        for leg in self.legs:
            x, y = STATIONS[leg.station] * p["hip_spacing"], out[leg.side] * p["robot_width"]
            legs.append(leg.model_copy(update={"neutral_foot": (x, y, -p["body_height"])}))
        return self.model_copy(update={"legs": tuple(legs)})


def load_robot_file(path: Path) -> RobotSpec:
    """Load and check a robot file.

    Raises:
        LegwattError: It cannot be read, or something in it is unknown, missing or out of bounds.
    """
    return spec_of(*_extended(path, ()), path)


def spec_of(table: dict[str, Any], sources: tuple[Path, ...], path: Path) -> RobotSpec:
    """What a robot file says that is, or will be, at `path`; see `load_robot_file`."""
    robot, where = table.get("robot"), str(path)
    built = isinstance(robot, dict) and robot.get("build")
    if "parameters" in table:
        numbers = GAIT_SCHEMA | BUILD_SCHEMA if built else GAIT_SCHEMA
        table["parameters"] = parameters_from_table(
            table["parameters"],
            {name: kind for name, (kind, *_) in numbers.items()},
            f"{where}: parameters",
            optional=GAIT_NUMBERS,  # asked for when it walks
        )
    spec = checked(RobotSpec, table, where).model_copy(update={"path": path, "sources": sources})
    check_parameters(spec.parameters, spec.robot.build, where)
    leg_list(list(spec.standing_feet), list(spec.leg_names), f"{where}: standing.feet")
    return spec.on_feet()


def _extended(path: Path, seen: tuple[Path, ...]) -> tuple[dict[str, Any], tuple[Path, ...]]:
    table = read_toml(path)  # first: a name that is no file is reported as such
    if path.resolve() in [p.resolve() for p in seen]:
        raise LegwattError(f"{path}: extends itself through {seen[-1]}")
    if "extends" not in table:
        return table, (path,)
    if not isinstance(table["extends"], str):
        raise LegwattError(f"{path}: extends must be the name of another robot file")
    parent, sources = _extended(path.parent / table["extends"], (*seen, path))
    own = {key: value for key, value in table.items() if key != "extends"}
    return _merged(parent, own), (path, *sources)


def _merged(below: dict[str, Any], above: dict[str, Any]) -> dict[str, Any]:
    # Legs are replaced as a whole: a stand with one leg must not inherit the other five.
    out = dict(below) | above
    for key in (below.keys() & above.keys()) - {"legs"}:
        if isinstance(below[key], dict) and isinstance(above[key], dict):
            out[key] = (merged_gait if key == "gait" else _merged)(below[key], above[key])
    return out


def usual_gait(legs: int) -> str:
    """Where a robot file names none: the slowest of the usual ones; six walk in two tripods."""
    return {4: "crawl", 6: "tripod"}.get(legs, "wave")


def merged_gait(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """One table ``[gait]`` over another: what the upper states counts.

    A footfall is replaced as a whole, since a name does not go with another gait's phases; a duty
    factor alone changes that of the footfall below.
    """
    new = any(key in above for key in FOOTFALLS)
    kept = {k: v for k, v in below.items() if not (new and k in (*FOOTFALLS, "duty_factor"))}
    return kept | dict(above)


def leg_list(value: Any, names: list[str], where: str) -> tuple[str, ...]:
    """A list of leg names, each known and named once; else a `LegwattError`."""
    if not isinstance(value, list):
        raise LegwattError(f"{where}: expected a list of leg names")
    for name in value:
        known("no leg", name, names, where)
    if len(set(value)) != len(value):
        raise LegwattError(f"{where}: a leg is named twice")
    return tuple(value)
