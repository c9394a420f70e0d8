"""The robot file: a robot and its gait as data (TOML), checked against a schema on loading."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from actuators.errors import closest, one_line
from actuators.parameters import REQUIRED_KEYS, ParameterSet, parameters_from_table
from actuators.text_file import UnreadableTextError, read_toml_file
from actuators.units import si_unit
from pipeline.errors import RobotFileError
from pipeline.robot.published import SCHEME, published_names, urdf_path

#: Numbers every walking robot needs, with their dimension.
#: Of the project, from the folder it is run in.
DEFAULT_ROBOT: Final = Path("urdf/hexapod.toml")
GAIT_SCHEMA = {
    "total_mass": "mass",
    "foot_stroke": "length",
    "foot_lift": "length",
    "walking_speed": "velocity",
    "gait_period": "time",
    "gravity": "acceleration",
}
#: Numbers from which `pipeline.robot.urdf_builder` builds the hexapod and the leg on a stand.
BUILD_SCHEMA = {
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
BUILDS = ("hexapod", "leg_stand")
#: Joints of a built leg: hip, femur, tibia.
BUILT_JOINTS = 3
#: Lengths of walking robots lie between these; outside, a unit is wrong by a thousand [m].
SMALLEST_LENGTH, LARGEST_LENGTH = 1e-3, 10.0
#: No planet pulls more [m/s^2].
LARGEST_GRAVITY = 30.0
#: Lengths that may be nothing, or lie on either side.
_ANY_LENGTH = ("coxa_length", "joint_2_lateral", "trunk_com_left")
STATIONS = {"front": 1.0, "middle": 0.0, "rear": -1.0}

_TOP_KEYS = {
    *("extends", "robot", "parameters", "legs", "held", "gait", "standing", "assumed"),
    "actuators",
}
_ROBOT_KEYS = {"name", "urdf", "base_link", "base", "build", "zero_pose", "note"}
_LEG_KEYS = {"joints", "foot", "side", "station", "neutral_foot", "start_posture"}
_STANDING_KEYS = {"feet"}
#: A gait's numbers among the parameters; ``[gait]`` may state its own instead.
GAIT_NUMBERS = frozenset({"foot_stroke", "foot_lift", "walking_speed", "gait_period"})
#: Keys of ``[gait]`` that say which legs stand when, the duty factor aside.
FOOTFALLS = ("name", "sets", "tripods", "phase")
_MOST_EXTENDED = 20
_COUNTS = {1: "one", 2: "two", 3: "three", 4: "four", 5: "five", 6: "six", 7: "seven"}


@dataclass(frozen=True)
class LegSpec:
    """One leg as the robot file names it.

    Attributes:
        name: Short name, e.g. ``"rm"``.
        joints: From the base outward.
        foot: Frame at the foot point.
        side: ``"left"`` or ``"right"``.
        station: ``"front"``, ``"middle"`` or ``"rear"``; empty for a URDF of the user's own.
        neutral_foot: Foot at mid-stroke in the base frame [m].
        start_posture: Joint positions that name the knee's branch [rad, m], one for each joint;
            zero where none is stated.
        start_stated: Whether the robot file states them.
    """

    name: str
    joints: tuple[str, ...]
    foot: str
    side: str
    station: str
    neutral_foot: tuple[float, float, float]
    start_posture: tuple[float, ...]
    start_stated: bool = False


@dataclass(frozen=True)
class RobotSpec:
    """A robot file after loading.

    Attributes:
        path: The file.
        sources: The file and those it extends, for hashes.
        name: Of the robot.
        urdf: The URDF's path.
        base_link: Root link.
        floating: Whether the base floats on its legs or is fixed to a stand.
        build: Which builder makes the URDF, or None for a URDF of the user's own.
        zero_pose: Zero pose and positive directions, in words.
        parameters: Numbers with unit, basis and source, SI on reading.
        legs: In order.
        gait: Table ``[gait]`` as written; `pipeline.motion.gait_table` reads it.
        standing_feet: Legs that stand in the standing mode.
        held: Joints outside the legs and where they are held [rad, m].
        assumed: Keys of the file that are guesses, each with its reason.
        actuator_table: What joints have of their own, as written; `pipeline.machine` reads it.
    """

    path: Path
    sources: tuple[Path, ...]
    name: str
    urdf: Path
    base_link: str
    floating: bool
    build: str | None
    zero_pose: str
    parameters: ParameterSet
    legs: tuple[LegSpec, ...]
    gait: Mapping[str, Any]
    standing_feet: tuple[str, ...]
    held: tuple[tuple[str, float], ...] = ()
    assumed: tuple[tuple[str, str], ...] = ()
    actuator_table: Mapping[str, Any] = field(default_factory=dict)

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

        Args:
            values: Name to value in SI units.

        Raises:
            actuators.errors.ActuatorError: A name is unknown or a value out of bounds.
        """
        parameters = self.parameters
        for name, value in values.items():
            parameters = parameters.replaced(name, value)
        legs = self.legs
        if self.build:
            legs = tuple(
                replace(leg, neutral_foot=built_neutral_foot(parameters, leg.side, leg.station))
                for leg in legs
            )
        return replace(self, parameters=parameters, legs=legs)


def built_neutral_foot(
    parameters: ParameterSet, side: str, station: str
) -> tuple[float, float, float]:
    """Foot at mid-stroke of a built robot, in the base frame [m].

    The base frame's origin lies in the mid-plane at the height of joints 1 and 2; the feet stand
    at the robot's overall width.
    """
    sign = 1.0 if side == "left" else -1.0
    return (
        STATIONS[station] * parameters["hip_spacing"],
        sign * parameters["robot_width"] / 2,
        -parameters["body_height"],
    )


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file.

    Raises:
        RobotFileError: Missing, unreadable or malformed; the message names file and line.
    """
    try:
        return read_toml_file(path)
    except UnreadableTextError as error:
        hint = "; name a robot file (TOML)" if str(error) == "no such file" else ""
        raise RobotFileError(f"{path}: {error}{hint}") from None


def load_robot_file(path: Path) -> RobotSpec:
    """Load and check a robot file.

    Args:
        path: TOML file.

    Raises:
        RobotFileError: Missing file, malformed TOML, unknown or missing key, contradiction.
        actuators.errors.ActuatorError: A parameter lacks unit, basis or source, or is out of
            bounds.
    """
    if path.suffix.lower() in (".urdf", ".xml", ".xacro"):
        raise RobotFileError(
            f"{path}: a URDF says nothing of legs and gait; give a robot file (TOML) that names it "
            f"as robot.urdf, as urdf/hexapod.toml does: `python -m pipeline init {path}` writes one"
        )
    if not path.exists() and str(path).removeprefix(SCHEME) in published_names():
        raise RobotFileError(
            f"{path}: no such file; `python -m pipeline init {path}` writes one for that robot"
        )
    table, sources = _extended(path, ())
    where = str(path)
    _known_keys(table, _TOP_KEYS, where, "table")
    _refuse_missing(table, where)
    robot = table["robot"]
    _known_keys(robot, _ROBOT_KEYS, where, "key of [robot]")
    build = robot.get("build")
    if build is not None and build not in BUILDS:
        raise RobotFileError(f"{where}: robot.build = '{build}'; {closest(str(build), BUILDS)}")
    base = robot.get("base", "floating")
    if base not in ("floating", "fixed"):
        raise RobotFileError(f"{where}: robot.base = '{base}'; expected 'floating' or 'fixed'")
    schema = GAIT_SCHEMA | (BUILD_SCHEMA if build else {})
    parameters = parameters_from_table(
        table["parameters"], schema, f"{where}: parameters", optional=GAIT_NUMBERS
    )
    check_parameters(parameters, build, where)
    legs = _legs(table["legs"], parameters, build, where)
    names = [leg.name for leg in legs]
    held = _held(table.get("held", {}), legs, where)
    standing = table.get("standing", {})
    _known_keys(standing, _STANDING_KEYS, where, "key of [standing]")
    return RobotSpec(
        path=path,
        sources=sources,
        name=_text(robot, "name", where),
        urdf=urdf_path(_text(robot, "urdf", where), path),
        base_link=_text(robot, "base_link", where),
        floating=base == "floating",
        build=build,
        zero_pose=str(robot.get("zero_pose", "")),
        parameters=parameters,
        legs=legs,
        gait=table.get("gait", {}),
        standing_feet=leg_list(standing.get("feet", names), names, f"{where}: standing.feet"),
        held=held,
        assumed=_assumed(table.get("assumed", {}), where),
        actuator_table=table.get("actuators", {}),
    )


def _extended(path: Path, seen: tuple[Path, ...]) -> tuple[dict[str, Any], tuple[Path, ...]]:
    table = read_toml(path)  # first, so that a name that is no file's is told as such
    if path.resolve() in [p.resolve() for p in seen]:
        raise RobotFileError(f"{path}: extends itself through {seen[-1]}")
    if len(seen) >= _MOST_EXTENDED:
        raise RobotFileError(f"{path}: extends a chain of more than {_MOST_EXTENDED} files")
    if "extends" not in table:
        return table, (path,)
    if not isinstance(table["extends"], str):
        raise RobotFileError(f"{path}: extends must be the name of another robot file")
    parent, sources = _extended(path.parent / table["extends"], (*seen, path))
    own = {key: value for key, value in table.items() if key != "extends"}
    return _merged(parent, own), (path, *sources)


def _merged(below: dict[str, Any], above: dict[str, Any]) -> dict[str, Any]:
    # Legs are replaced as a whole: a stand with one leg must not inherit the other five.
    out = dict(below)
    for key, value in above.items():
        deep = key != "legs" and isinstance(value, dict) and isinstance(out.get(key), dict)
        merged = merged_gait if key == "gait" else _merged
        out[key] = merged(out[key], value) if deep else value
    return out


def merged_gait(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """One table ``[gait]`` over another: what the upper states counts.

    A footfall is replaced as a whole, since a name does not go with another gait's phases; a duty
    factor alone changes that of the footfall below.
    """
    new = any(key in above for key in FOOTFALLS)
    kept = {k: v for k, v in below.items() if not (new and k in (*FOOTFALLS, "duty_factor"))}
    return kept | dict(above)


def _refuse_missing(table: Mapping[str, Any], where: str) -> None:
    """All keys that are missing, in one line: whoever writes a file need not run it for each.

    Raises:
        RobotFileError: At least one is missing, or a table is none.
    """

    def under(key: str) -> Mapping[str, Any]:
        value = table.get(key, {})
        return value if isinstance(value, dict) else {}

    built = "build" in under("robot")
    schema = GAIT_SCHEMA | (BUILD_SCHEMA if built else {})
    leg_keys = ("joints", "foot", "side", "station" if built else "neutral_foot")
    missing = [f"robot.{key}" for key in ("name", "urdf", "base_link") if key not in under("robot")]
    if not under("legs"):
        missing.append(f"[legs.NAME] with {', '.join(leg_keys)}")
    for leg, entry in under("legs").items():
        if isinstance(entry, dict):
            missing += [f"legs.{leg}.{key}" for key in leg_keys if key not in entry]
    # A gait that states numbers of its own is asked for the rest when it walks.
    own = set(under("gait")) - {"transfer_path", "tripods"}
    missing += [
        f"parameters.{name} [{si_unit(kind)}]"
        for name, kind in schema.items()
        if name not in under("parameters") and not (own and name in GAIT_NUMBERS)
    ]
    for name, entry in under("parameters").items():
        if isinstance(entry, dict):
            missing += [f"parameters.{name}.{key}" for key in REQUIRED_KEYS if key not in entry]
    tables = ("robot", "legs", "held", "gait", "parameters", "standing", "assumed", "actuators")
    wrong = [k for k in tables if not isinstance(table.get(k, {}), dict)]
    if wrong:
        raise RobotFileError(f"{where}: {wrong[0]} must be a table, [{wrong[0]}]")
    if missing:
        raise RobotFileError(f"{where}: missing: {', '.join(missing)}; see urdf/hexapod.toml")


def _known_keys(table: Mapping[str, Any], known: set[str], where: str, what: str) -> None:
    for key in table:
        if key not in known:
            raise RobotFileError(f"{where}: unknown {what} '{key}'; {closest(key, sorted(known))}")


def _text(table: Mapping[str, Any], key: str, where: str) -> str:
    value = table.get(key)
    if not isinstance(value, str) or not value:
        raise RobotFileError(f"{where}: '{key}' is missing or not a text")
    return value


def leg_list(value: Any, names: list[str], where: str) -> tuple[str, ...]:
    """A list of leg names, each known and named once.

    Args:
        value: As TOML gives it.
        names: Of the robot's legs.
        where: File and key, for messages.

    Raises:
        RobotFileError: It is something else.
    """
    if not isinstance(value, list) or not all(isinstance(name, str) for name in value):
        raise RobotFileError(f"{where}: expected a list of leg names")
    for name in value:
        if name not in names:
            raise RobotFileError(f"{where}: leg '{name}' is not known; {closest(name, names)}")
    if len(set(value)) != len(value):
        raise RobotFileError(f"{where}: a leg is named twice")
    return tuple(value)


def _legs(
    table: dict[str, Any], parameters: ParameterSet, build: str | None, where: str
) -> tuple[LegSpec, ...]:
    legs = [_leg(name, entry, parameters, build, where) for name, entry in table.items()]
    if not legs:
        raise RobotFileError(f"{where}: [legs] names no leg")
    joints_seen = [joint for leg in legs for joint in leg.joints]
    for joint in joints_seen:
        if joints_seen.count(joint) > 1:
            raise RobotFileError(f"{where}: joint '{joint}' belongs to two legs")
    return tuple(legs)


def _leg(
    name: str, entry: object, parameters: ParameterSet, build: str | None, where: str
) -> LegSpec:
    place = f"{where}: legs.{one_line(name)}"
    _refuse_name(name, place)
    if not isinstance(entry, dict):
        raise RobotFileError(f"{place}: expected a table with joints, foot and side")
    _known_keys(entry, _LEG_KEYS, where, f"key of [legs.{name}]")
    joints = _leg_joints(entry, place)
    side = entry.get("side")
    if side not in ("left", "right"):
        raise RobotFileError(f"{place}: side = '{side}'; expected 'left' or 'right'")
    station = entry.get("station", "")
    if build:
        if not isinstance(station, str) or station not in STATIONS:
            raise RobotFileError(
                f"{place}: station = '{one_line(station)}'; {closest(str(station), list(STATIONS))}"
            )
        if len(joints) != BUILT_JOINTS:
            raise RobotFileError(
                f"{place}: names {len(joints)} joints; a built leg has {BUILT_JOINTS}"
            )
        neutral = built_neutral_foot(parameters, side, station)
    else:
        x, y, z = _numbers(entry, "neutral_foot", 3, None, place)
        neutral = (x, y, z)
    for k, at in enumerate(neutral):
        if abs(at) > LARGEST_LENGTH:
            raise RobotFileError(
                f"{place}: neutral_foot has {at:g} at place {k + 1}; it is written in metres, "
                "are these millimetres?"
            )
    start = _numbers(entry, "start_posture", len(joints), (0.0,) * len(joints), place)
    for k, angle in enumerate(start):
        if abs(angle) > 2 * math.pi:
            raise RobotFileError(
                f"{place}: start_posture has {angle:g} at place {k + 1}; it is written in "
                f"radians, are these degrees ({math.radians(angle):.4g} rad)?"
            )
    return LegSpec(
        name,
        joints,
        _text(entry, "foot", place),
        side,
        station,
        neutral,
        start,
        "start_posture" in entry,
    )


def _leg_joints(entry: Mapping[str, Any], place: str) -> tuple[str, ...]:
    joints = entry.get("joints")
    if not isinstance(joints, list) or not all(isinstance(j, str) for j in joints):
        raise RobotFileError(f"{place}: joints must be a list of names, base outward")
    if not joints:
        raise RobotFileError(f"{place}: joints is empty; a leg has at least one actuated joint")
    for joint in joints:
        _refuse_name(joint, f"{place}: joints")
    return tuple(joints)


def _refuse_name(name: str, place: str) -> None:
    """Names become columns and files: no separators, nothing invisible.

    Raises:
        RobotFileError: It holds one.
    """
    bad = [c for c in name if c in '/\\,;"' or not c.isprintable()]
    if not name.strip() or bad:
        what = f"holds {bad[0]!r}" if bad else "is empty"
        raise RobotFileError(f"{place}: a name {what}; names become columns and file names")


def _numbers(
    entry: Mapping[str, Any], key: str, count: int, default: tuple[float, ...] | None, where: str
) -> tuple[float, ...]:
    value = entry.get(key, default)
    some = _COUNTS.get(count, str(count))
    if not isinstance(value, (list, tuple)) or not all(_is_number(x) for x in value):
        raise RobotFileError(f"{where}: {key} must be {some} numbers")
    if len(value) != count:
        raise RobotFileError(f"{where}: {key} must be {some} numbers, not {len(value)}")
    return tuple(_finite(x, f"{where}: {key} must be {some} finite numbers") for x in value)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _finite(value: Any, else_said: str) -> float:
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise RobotFileError(else_said)
    return number


def _held(
    table: Mapping[str, Any], legs: tuple[LegSpec, ...], where: str
) -> tuple[tuple[str, float], ...]:
    """Joints outside the legs and where they are held [rad, m]."""
    of_leg = {joint: leg.name for leg in legs for joint in leg.joints}
    out = []
    for joint, value in table.items():
        place = f"{where}: held.{one_line(joint)}"
        _refuse_name(joint, place)
        if joint in of_leg:
            raise RobotFileError(f"{place}: the joint belongs to leg '{of_leg[joint]}'; take one")
        if not _is_number(value):
            raise RobotFileError(f"{place}: expected the position it is held at [rad, m]")
        out.append((joint, _finite(value, f"{place}: expected a finite number")))
    return tuple(out)


def _assumed(table: Mapping[str, Any], where: str) -> tuple[tuple[str, str], ...]:
    """Guesses and their reasons."""
    for key, reason in table.items():
        if not isinstance(reason, str) or not reason.strip():
            raise RobotFileError(f"{where}: assumed.{one_line(key)}: expected the reason, a text")
    return tuple((key, reason) for key, reason in table.items())


def check_parameters(parameters: ParameterSet, build: str | None, where: str) -> None:
    """Refuse numbers that no robot or gait can have, after loading and after a change.

    Args:
        parameters: All of a robot file's.
        build: Which builder makes the URDF, or None for a URDF of the user's own.
        where: For the message.

    Raises:
        RobotFileError: A mass, length or period that is not positive, or a contradiction.
    """
    sizes = ("total_mass", "foot_stroke", "walking_speed", "gait_period", "gravity")
    _positive(parameters, tuple(name for name in sizes if name in parameters), where)
    if "foot_lift" in parameters and parameters["foot_lift"] < 0:
        raise RobotFileError(f"{where}: parameters.foot_lift must not be negative")
    if parameters["gravity"] > LARGEST_GRAVITY:
        raise RobotFileError(f"{where}: parameters.gravity is beyond any planet; check its unit")
    if build:
        _check_build(parameters, where)
    _check_lengths(parameters, where)


def _check_lengths(parameters: ParameterSet, where: str) -> None:
    """Refuse metres written for millimetres and the reverse, and angles beyond a turn."""
    for name, kind in (GAIT_SCHEMA | BUILD_SCHEMA).items():
        if kind == "angle" and name in parameters and abs(parameters[name]) > 2 * math.pi:
            row = parameters.parameter(name)
            number = f"{row.value_as_written:g}"
            hint = f"is {number} deg meant?" if row.unit == "rad" else "check its unit"
            raise RobotFileError(
                f"{where}: parameters.{name} = {number} {row.unit} is more than a turn; {hint}"
            )
        if kind != "length" or name not in parameters:
            continue
        size, row = abs(parameters[name]), parameters.parameter(name)
        small = 0 < size < SMALLEST_LENGTH and name not in _ANY_LENGTH
        if small or size > LARGEST_LENGTH:
            what = "shorter" if small else "longer"
            number = f"{row.value_as_written:g}"
            other = {("mm", True): "m", ("m", False): "mm"}.get((row.unit, small))
            hint = f"is {number} {other} meant?" if other else "check its unit"
            raise RobotFileError(
                f"{where}: parameters.{name} = {number} {row.unit} is {what} than in any walking "
                f"robot; {hint}"
            )


def _positive(parameters: ParameterSet, names: tuple[str, ...], where: str) -> None:
    for name in names:
        if parameters[name] <= 0:
            written = parameters.parameter(name)
            raise RobotFileError(
                f"{where}: parameters.{name} = {written.value_as_written:g} {written.unit} must be "
                "positive"
            )


def _check_build(parameters: ParameterSet, where: str) -> None:
    _positive(
        parameters,
        (
            *("body_length", "robot_width", "hip_spacing", "body_height", "femur_length"),
            *("tibia_length", "hip_link_mass", "femur_mass", "tibia_mass", "trunk_height"),
            *("link_width", "joint_1_range", "joint_effort_limit", "joint_velocity_limit"),
        ),
        where,
    )
    if parameters["coxa_length"] < 0:
        raise RobotFileError(f"{where}: parameters.coxa_length must not be negative")
    for joint in ("joint_2", "joint_3"):
        if parameters[f"{joint}_lower"] >= parameters[f"{joint}_upper"]:
            raise RobotFileError(f"{where}: parameters.{joint}_lower must be below {joint}_upper")
    for name in ("femur_com", "tibia_com"):
        if not 0 <= parameters[name] <= 1:
            raise RobotFileError(
                f"{where}: parameters.{name} = {parameters[name]:g} lies outside the link; "
                "expected 0 to 1, a fraction of its length"
            )
    if parameters["joint_2_lateral"] < parameters["coxa_length"]:
        raise RobotFileError(
            f"{where}: joint_2_lateral is smaller than coxa_length, so joint 1 would lie beyond "
            "the mid-plane"
        )
