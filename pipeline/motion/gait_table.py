"""The table ``[gait]`` as written: of a robot file, a gait file, or ``--set gait.KEY=VALUE``.

Dimensional numbers carry their unit in the text (``"240 mm"``), shares are bare numbers, and what a
leg may have of its own is written either once for all or as a table by leg.
"""

from __future__ import annotations

import contextlib
import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path as FilePath
from typing import Annotated, Any, Final, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationError

from actuators.errors import LegwattError, closest, one_line
from actuators.text_file import parsed, read_toml_file
from actuators.units import quantity
from pipeline.motion.footfall import known_gait, transfer_path
from pipeline.robot.robot_file import FOOTFALLS, RobotSpec, load_robot_file, merged_gait

_HEADINGS: Final = {"forward": 0.0, "left": 90.0, "backward": 180.0, "right": -90.0}
#: No walking robot is larger or steps further [m], none leans or climbs beyond [rad].
_LONGEST, _STEEPEST = 10.0, math.radians(89.0)

Legs = list[list[str]]


def _worded(read: Callable[[Any], Any]) -> BeforeValidator:
    """What the project's readers refuse, as pydantic wants it said."""

    def validate(written: object) -> object:
        try:
            return read(written)
        except LegwattError as error:
            raise ValueError(str(error)) from None

    return BeforeValidator(validate)


def _size(
    dimension: str, low: float, high: float, words: str = "", *, low_too: bool = False
) -> Callable[[object], float]:
    """A check of one number: of this dimension, within bounds."""

    def check(written: object) -> float:
        value = quantity(written, dimension)
        if not (low < value < high or (low_too and value == low)):
            raise ValueError(f"{one_line(written)}: {words}")
        return value

    return check


def _each(check: Callable[[object], float]) -> BeforeValidator:
    """The check for one number for all legs, or a table with one for each."""

    def of_legs(written: object) -> float | dict[str, float]:
        if not isinstance(written, dict):
            return check(written)
        out = {}
        for leg, value in written.items():
            try:
                out[str(leg)] = check(value)
            except (LegwattError, ValueError) as error:
                raise ValueError(f"({one_line(leg)}) {error}") from None
        return out

    return _worded(of_legs)


def _direction(written: object) -> float:
    if isinstance(written, str) and written in _HEADINGS:
        return math.radians(_HEADINGS[written])
    try:
        return quantity(written, "angle")
    except LegwattError:
        raise ValueError(
            f"{one_line(written)}: expected {', '.join(_HEADINGS)}, or an angle to the left such "
            "as '30 deg'"
        ) from None


_LENGTH = _size("length", 0, _LONGEST, "must lie above 0 and below 10 m")
_HEIGHT = _size("length", 0, _LONGEST, "must not be negative, and below 10 m", low_too=True)
_SHARE = _size(
    *("ratio", 0, 1),
    "a foot stands for a share above 0 and below 1 of the period: at 0 it never carries, at 1 it "
    "never steps; give a number such as 0.75",
)
_SPEED = _size("velocity", 0, 100.0, "must not be negative, and below 100 m/s", low_too=True)
_MASS = _size("mass", 0, 1e5, "must not be negative, and below 1e5 kg", low_too=True)
_FRICTION = _size("ratio", 0, math.inf, "must lie above 0: give a number such as 0.6")
_SURGE = _size("ratio", 0, 2.0, "must lie from 0 to below 2", low_too=True)
_OFFSET = _size("length", -_LONGEST, _LONGEST, "must lie within 10 m")
_TILT = _size("angle", -_STEEPEST, _STEEPEST, "must lie within 89 deg")
_TIME = _size("time", 1e-3, 1e6, "must lie above 1 ms and below 1e6 s")
_RATE = _size("angular velocity", -100.0, 100.0, "must lie within 100 rad/s")
Name = Annotated[str, _worded(known_gait)]
Path = Annotated[str, _worded(lambda name: transfer_path(str(name)).name)]
Phases = Annotated[dict[str, float], _each(_size("ratio", -math.inf, math.inf))]
Shares = Annotated[float | dict[str, float], _each(_SHARE)]
Lengths = Annotated[float | dict[str, float], _each(_LENGTH)]
Heights = Annotated[float | dict[str, float], _each(_HEIGHT)]
Direction = Annotated[float, BeforeValidator(_direction)]
Length = Annotated[float, _worded(_LENGTH)]
Height = Annotated[float, _worded(_HEIGHT)]
Offset = Annotated[float, _worded(_OFFSET)]
Tilt = Annotated[float, _worded(_TILT)]
Time = Annotated[float, _worded(_TIME)]
Speed = Annotated[float, _worded(_SPEED)]
Rate = Annotated[float, _worded(_RATE)]
Mass = Annotated[float, _worded(_MASS)]
Friction = Annotated[float, _worded(_FRICTION)]
Surge = Annotated[float, _worded(_SURGE)]


class GaitTable(BaseModel):
    """What a table ``[gait]`` may state; everything has a default or follows from the rest."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: Name | None = None  #: Of a known gait: `pipeline.motion.footfall.GAITS`.
    sets: Legs | None = None  #: Sets of legs that swing in turn.
    tripods: Legs | None = None  #: The same with two sets, half a period each.
    phase: Phases | None = None  #: Touch-down of each leg as a share of the period.
    #: Feet that stand at any time, at least: 3, or 2, when the moment about the line of two feet is
    #: left out and the body would rock.
    least_feet: Literal[2, 3] = 3
    #: Share of the period for which a foot stands, of all or by leg.
    duty_factor: Shares | None = None
    transfer_path: Path = "harmonic"  #: Of the foot through the air.
    period: Time | None = None  #: Of the gait [s].
    speed: Speed | None = None  #: Of the body along `heading` [m/s].
    heading: Direction = 0.0  #: Where to, from the x axis to the left [rad].
    yaw_rate: Rate | None = None  #: Of the body, to the left [rad/s].
    #: Path of a foot relative to the body while it stands, of the longest or by leg [m].
    stroke: Lengths | None = None
    lift: Heights | None = None  #: Height of a foot at the middle of its transfer [m].
    body_height: Length | None = None  #: Of the base's origin over the ground [m].
    body_x: Offset = 0.0  #: Shift of the base over its feet, forward [m].
    body_y: Offset = 0.0  #: To the left [m].
    body_roll: Tilt = 0.0  #: Of the base against the ground, right side down [rad].
    body_pitch: Tilt = 0.0  #: Nose down [rad].
    slope_forward: Tilt = 0.0  #: Angle by which the ground rises ahead [rad].
    slope_left: Tilt = 0.0  #: By which it rises to the left [rad].
    #: Of the ground: greatest tangential over normal force of a foot [1]; no limit by default.
    friction_coefficient: Friction | None = None
    payload_mass: Mass = 0.0  #: Of a load on the body [kg].
    payload_x: Offset = 0.0  #: Place of its centre of mass in the base's axes [m].
    payload_y: Offset = 0.0  #: Likewise.
    payload_z: Offset = 0.0  #: Likewise.
    #: Share of slowing and speeding up with every step with which the ground's forces point from
    #: the feet to the hips; 0, the default, for constant speed.
    surge: Surge = 0.0
    #: Path of the body over its feet: ``none``, or the ``least`` that keeps the margin.
    sway: Literal["none", "least"] | None = None
    #: Distance that the sway keeps from every edge of the support [m].
    stability_margin: Height | None = None


#: Keys under which a leg may have a number of its own.
BY_LEG: Final = ("phase", "duty_factor", "stroke", "lift")


def read_gait_table(table: Mapping[str, Any], legs: tuple[str, ...], where: str) -> GaitTable:
    """Check a table ``[gait]``.

    Raises:
        LegwattError: An unknown key or leg, a value that is none, or two ways to say one thing; one
            line with all of it.
    """
    try:
        read = GaitTable.model_validate(dict(table))
    except ValidationError as error:
        raise LegwattError(f"{where}: {'; '.join(_words(error, legs))}") from None
    ways = [key for key in FOOTFALLS if getattr(read, key) is not None]
    if len(ways) > 1:
        raise LegwattError(
            f"{where}: gait.{ways[0]} and gait.{ways[1]} both say which legs stand when; keep one"
        )
    for key in (*BY_LEG, "sets", "tripods"):
        value, place = getattr(read, key), f"{where}: gait.{key}"
        sets = value if isinstance(value, list) else []
        names = list(value) if isinstance(value, dict) else [name for own in sets for name in own]
        for name in names:
            if name not in legs:
                hint = closest(name, legs)
                raise LegwattError(f"{place}: leg '{one_line(name)}' is not known; {hint}")
        missing = [leg for leg in legs if leg not in names]
        if isinstance(value, dict) and missing:
            few = ", ".join(missing)
            raise LegwattError(f"{place}: says nothing of {few}; give every leg a number")
        two = key == "tripods"
        if value is None or isinstance(value, float | dict) or (two and not sets):
            continue  # no tripods is no gait at all, said where one is asked for
        if len(sets) < 2 or (two and len(sets) != 2) or sorted(names) != sorted(legs):
            parts = "two sets" if two else "two or more sets"
            raise LegwattError(f"{place} must part the legs {', '.join(legs)} in {parts}")
    return read


def _words(error: ValidationError, legs: tuple[str, ...]) -> list[str]:
    """One part of the line for every key at fault."""
    out: dict[str, str] = {}
    for fault in error.errors():
        key = str(fault["loc"][0])
        if fault["type"] == "extra_forbidden":
            known = sorted(GaitTable.model_fields)
            words = f"unknown key of [gait] '{one_line(key)}'; {closest(key, known)}"
        elif fault["type"] == "value_error":
            words = f"gait.{key} = {fault['ctx']['error']}"
        elif key in ("sets", "tripods"):
            example = json.dumps([legs[::2], legs[1::2]])
            two = "two " if key == "tripods" else ""
            words = f"gait.{key}: must be {two}lists of leg names such as {example}"
        elif key == "phase":
            example = ", ".join(f"{leg} = {k / len(legs):.3g}" for k, leg in enumerate(legs))
            words = f"gait.phase: must be a table with a number for each leg such as {{{example}}}"
        else:
            words = f"gait.{key}: {fault['msg'][0].lower()}{fault['msg'][1:]}"
        out.setdefault(key, words)
    return list(out.values())


def read_gait_file(path: FilePath) -> dict[str, Any]:
    """The table ``[gait]`` of a file that holds nothing else.

    Raises:
        LegwattError: Missing, malformed, or without that table.
    """
    try:
        whole = read_toml_file(path)
    except LegwattError as error:
        raise LegwattError(f"{path}: {error}") from None
    others = [key for key in whole if key != "gait"]
    table = whole.get("gait")
    if others or not isinstance(table, dict):
        what = f"holds '{one_line(others[0])}'" if others else "has none"
        raise LegwattError(f"{path}: {what}; a gait file holds one table, [gait]")
    return table


def spec_with_gait(robot: FilePath, gait: FilePath | None) -> RobotSpec:
    """A robot file with a gait file's table instead of its own.

    `gait`: gait file; None for the robot file's own gait.

    Raises:
        LegwattError: The robot file cannot be used. The gait file cannot be used.
    """
    spec = load_robot_file(robot)
    if gait is None:
        return spec
    table = read_gait_file(gait)
    read_gait_table(table, spec.leg_names, str(gait))
    return spec.with_gait(**table)


def changed_table(table: Mapping[str, Any], key: str, value: object) -> dict[str, Any]:
    """The table with one key changed as ``--set gait.KEY=VALUE`` writes it.

    `key`: without ``gait.``; ``KEY.LEG`` for one leg of a number by leg. `value`: as TOML gives it,
    or as written there; a bare number is a share.

    Raises:
        LegwattError: A list or table that TOML does not read.
    """
    first, _, leg = key.partition(".")
    new: Any = value
    if isinstance(value, str):
        with contextlib.suppress(ValueError):
            new = float(value)
        if value.startswith(("[", "{")):
            try:
                new = parsed(f"value = {value}")["value"]
            except LegwattError as error:
                raise LegwattError(f"gait.{key}: {error}") from None
    if not leg:
        return merged_gait(table, {first: new})
    known = table.get(first)
    own = dict(known) if isinstance(known, dict) else {}
    return dict(table) | {first: own | {leg: new}}


def by_leg(value: float | Mapping[str, float], legs: tuple[str, ...]) -> np.ndarray:
    """A number for all, or by leg, as an array, shape (L,)."""
    if isinstance(value, Mapping):
        return np.array([value[leg] for leg in legs])
    return np.full(len(legs), float(value))


def gait_keys() -> tuple[str, ...]:
    """What ``--set`` may change, as it is written there."""
    return tuple(f"gait.{key}" for key in GaitTable.model_fields)
