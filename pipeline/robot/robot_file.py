"""The robot file: a robot and its gait as data (TOML), checked against a schema on loading."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from actuators.checked import checked, read_toml
from actuators.errors import LegwattError, known
from actuators.parameters import ParameterSet, parameters_from_table
from pipeline.robot.published import urdf_path
from pipeline.robot.robot_tables import (
    BUILD_SCHEMA,
    GAIT_NUMBERS,
    GAIT_SCHEMA,
    FileTable,
    LegSpec,
    check_parameters,
)

#: Of the project, from the folder it is run in.
DEFAULT_ROBOT: Final = Path("urdf/hexapod.toml")
#: Hips of a built robot along x, in units of `hip_spacing`.
STATIONS: Final = {"front": 1.0, "middle": 0.0, "rear": -1.0}
#: Keys of ``[gait]`` that say which legs stand when, the duty factor aside.
FOOTFALLS: Final = ("name", "phase")


@dataclass(frozen=True)
class RobotSpec:
    """A robot file after loading."""

    path: Path  #: The file.
    #: The file and those it extends, for hashes; none of a URDF without one.
    sources: tuple[Path, ...]
    name: str  #: Of the robot.
    urdf: Path  #: The URDF's path.
    base_link: str  #: Root link.
    parameters: ParameterSet  #: Numbers with unit, basis and source, SI on reading.
    legs: tuple[LegSpec, ...]  #: In order.
    floating: bool = True  #: Whether the base floats on its legs or is fixed to a stand.
    build: str | None = None  #: Which builder makes the URDF, or None for a URDF of the user's own.
    zero_pose: str = ""  #: Zero pose and positive directions, in words.
    #: Table ``[gait]`` as written; `pipeline.motion.gait_table` reads it.
    gait: Mapping[str, Any] = field(default_factory=dict)
    standing_feet: tuple[str, ...] = ()  #: Legs that stand in the standing mode.
    #: Joints outside the legs and where they are held [rad, m].
    held: tuple[tuple[str, float], ...] = ()
    #: What joints have of their own, as written; `pipeline.machine` reads it.
    actuator_table: Mapping[str, Any] = field(default_factory=dict)

    @property
    def leg_names(self) -> tuple[str, ...]:
        """Legs in order."""
        return tuple(leg.name for leg in self.legs)

    @property
    def joints(self) -> tuple[str, ...]:
        """All actuated joints: the legs' leg by leg, then those that are held."""
        legs = (joint for leg in self.legs for joint in leg.joints)
        return (*legs, *(joint for joint, _ in self.held))

    def with_gait(self, **changes: Any) -> RobotSpec:
        """The same robot with another gait: keys of ``[gait]`` as the file would write them."""
        return replace(self, gait=merged_gait(self.gait, changes))

    def with_parameters(self, values: Mapping[str, float]) -> RobotSpec:
        """The same robot with some parameters at other values.

        Raises:
            LegwattError: A name is unknown or a value out of bounds.
        """
        parameters = self.parameters
        for name, value in values.items():
            parameters = parameters.replaced(name, value)
        legs = _on_feet(self.legs, parameters) if self.build else self.legs
        return replace(self, parameters=parameters, legs=legs)


def _on_feet(legs: Iterable[LegSpec], parameters: ParameterSet) -> tuple[LegSpec, ...]:
    """Legs of a built robot with their feet at mid-stroke in the base frame [m].

    The base frame's origin lies in the mid-plane at the height of joints 1 and 2; the feet stand
    at the robot's overall width.
    """
    p, out = parameters, {"left": 0.5, "right": -0.5}
    return tuple(
        leg.model_copy(
            update={
                "neutral_foot": (
                    STATIONS[leg.station] * p["hip_spacing"],
                    out[leg.side] * p["robot_width"],
                    -p["body_height"],
                )
            }
        )
        for leg in legs
    )


def load_robot_file(path: Path) -> RobotSpec:
    """Load and check a robot file.

    Raises:
        LegwattError: It cannot be read, or something in it is unknown, missing or out of bounds.
    """
    table, sources = _extended(path, ())
    where = str(path)
    file = checked(FileTable, table, where)
    build, names = file.robot.build, list(file.legs)
    numbers = GAIT_SCHEMA | BUILD_SCHEMA if build else GAIT_SCHEMA
    parameters = parameters_from_table(
        file.parameters,
        {name: bounds.dimension for name, bounds in numbers.items()},
        f"{where}: parameters",
        optional=GAIT_NUMBERS,  # asked for when it walks
    )
    check_parameters(parameters, build, where)
    legs = tuple(leg.model_copy(update={"name": name}) for name, leg in file.legs.items())
    feet = list(file.standing.get("feet", names))
    return RobotSpec(
        path=path,
        sources=sources,
        name=file.robot.name,
        urdf=urdf_path(file.robot.urdf, path),
        base_link=file.robot.base_link,
        floating=file.robot.base == "floating",
        build=build,
        zero_pose=file.robot.zero_pose,
        parameters=parameters,
        legs=_on_feet(legs, parameters) if build else legs,
        gait=file.gait,
        standing_feet=leg_list(feet, names, f"{where}: standing.feet"),
        held=tuple(file.held.items()),
        actuator_table=file.actuators,
    )


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
