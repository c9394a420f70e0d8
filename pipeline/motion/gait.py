"""A gait ready to walk: every number that a motion is made of, worked out from what is stated.

Speed, period and stroke bind each other: a foot that stands for the share `duty` of the period
moves by speed x duty x period relative to the body. Two of them are stated in ``[gait]``, or taken
from the robot file's parameters, and the third follows; all three stated must agree.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from actuators.arrays import Array
from actuators.errors import one_line
from pipeline.errors import GaitError
from pipeline.motion.footfall import Footfall, in_turn, named, own
from pipeline.motion.gait_table import GaitTable, by_leg, read_gait_table
from pipeline.motion.ground import Ground
from pipeline.robot.robot_file import RobotSpec

#: Speed, period and stroke agree within this share.
_AGREE = 1e-6
#: Margin of the least sway where none is stated [m], or half of what there is to have.
DEFAULT_MARGIN = 0.01
#: By number of legs, where the robot file names no gait; others walk the wave gait.
_USUAL = {4: "crawl", 6: "tripod"}


@dataclass(frozen=True)
class Gait:
    """Everything a motion over one period is made of."""

    legs: tuple[str, ...]  #: In the robot file's order.
    footfall: Footfall  #: Which legs stand when.
    period: float  #: Of the gait [s].
    #: Velocity of the unswayed body in its own axes: x and y [m/s], yaw rate [rad/s], shape (3,).
    twist: Array
    #: What that adds up to over a period if the axes stood still [m, m, rad], shape (3,).
    stride: Array
    lift: Array  #: By leg [m], shape (L,).
    #: Feet at mid-support from the unswayed base, axes along the ground [m], shape (L, 3).
    neutral: Array
    ground: Ground  #: The plane it walks on.
    body: Array  #: Rotation from the base to the ground's axes at zero heading, shape (3, 3).
    path: str  #: Name of the foot's path through the air.
    #: Distance from every edge of the support that the body's sway keeps [m]; None where the body
    #: does not sway.
    margin: float | None
    #: Whether it must be that one; else it may be half of what there is to have.
    margin_stated: bool
    source: str  #: File, for messages.
    surge: float = 0.0  #: Path of the body ahead of its even course and back, twice a period [m].

    @property
    def speed(self) -> float:
        """Of the unswayed body over the ground [m/s]."""
        return float(np.hypot(self.twist[0], self.twist[1]))

    @property
    def title(self) -> str:
        """Name of the gait, for people."""
        return f"{self.footfall.name} gait"

    @property
    def strokes(self) -> Array:
        """Path of every foot relative to the body while it stands [m], shape (L,)."""
        duty = by_leg(self.footfall.duty, self.legs)
        return _foot_speeds(self.twist, self.neutral) * duty * self.period


def gait_table(spec: RobotSpec) -> GaitTable:
    """The robot file's table ``[gait]``, checked."""
    names = tuple(leg.name for leg in spec.legs)
    return read_gait_table(spec.gait, names, str(spec.path))


def gait_of(spec: RobotSpec) -> Gait:
    """The gait of a robot file.

    `spec`: with legs; its table ``[gait]`` and, for what that leaves out, its parameters.

    Raises:
        GaitError: A number is missing or contradicts another, or too few feet stand.
    """
    table = gait_table(spec)
    legs = tuple(leg.name for leg in spec.legs)
    if not table.tripods and table.tripods is not None:
        raise GaitError(f"{spec.path}: gait.tripods is empty: the robot has no gait; state one")
    try:
        footfall = replace(_footfall(table, spec), least=table.least_feet)
        footfall.stances()  # refuses too few feet before any number is asked for
    except GaitError as error:
        raise GaitError(f"{spec.path}: {str(error).removeprefix(f'{spec.path}: ')}") from None
    ground = Ground(table.slope_forward, table.slope_left)
    neutral = neutral_feet(table, spec)
    twist, stride, period = _numbers(table, spec, footfall, neutral)
    lift = lifts(table, spec)
    sway = table.sway or ("least" if footfall.name == "crawl" else "none")
    if sway == "none" and table.stability_margin is not None:
        raise GaitError(
            f"{spec.path}: gait.stability_margin is kept by the body's sway; state "
            "gait.sway = 'least', too"
        )
    margin = DEFAULT_MARGIN if table.stability_margin is None else table.stability_margin
    return Gait(
        legs=legs,
        footfall=footfall,
        period=period,
        twist=twist,
        stride=stride,
        lift=lift,
        neutral=neutral,
        ground=ground,
        body=body_rotation(table),
        path=table.transfer_path,
        surge=_surge(table, spec, footfall, twist, period, neutral),
        margin=margin if sway == "least" else None,
        margin_stated=table.stability_margin is not None,
        source=str(spec.path),
    )


def _surge(
    table: GaitTable,
    spec: RobotSpec,
    footfall: Footfall,
    twist: Array,
    period: float,
    neutral: Array,
) -> float:
    """Half the body's way ahead and back [m]; see `pipeline.motion.base_motion.surge`."""
    if not table.surge:
        return 0.0
    duty = float(np.mean(list(footfall.duty.values())))
    stroke, height = (
        float(np.hypot(twist[0], twist[1])) * duty * period,
        -float(neutral[:, 2].mean()),
    )
    rate = 4.0 * np.pi / period  # [rad/s]
    return float(table.surge * spec.parameters["gravity"] / height * stroke / np.pi / rate**2)


def lifts(table: GaitTable, spec: RobotSpec) -> Array:
    """Height of every foot at the middle of its transfer [m], shape (L,)."""
    return by_leg(_of(table, spec, "lift", "foot_lift"), tuple(leg.name for leg in spec.legs))


def neutral_feet(table: GaitTable, spec: RobotSpec) -> Array:
    """Feet at mid-support from the base, axes along the ground [m], shape (L, 3)."""
    feet = np.array([leg.neutral_foot for leg in spec.legs], dtype=np.float64)
    feet[:, 0] -= table.body_x
    feet[:, 1] -= table.body_y
    if table.body_height is not None:
        feet[:, 2] = -table.body_height
    return feet


def body_rotation(table: GaitTable) -> Array:
    """From the base to the ground's axes at zero heading: pitch after roll, shape (3, 3)."""
    if table.body_roll == 0 and table.body_pitch == 0:
        return np.eye(3)
    (cr, sr), (cp, sp) = ((np.cos(x), np.sin(x)) for x in (table.body_roll, table.body_pitch))
    pitch = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    return pitch @ np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])


def _footfall(table: GaitTable, spec: RobotSpec) -> Footfall:
    legs = tuple(leg.name for leg in spec.legs)
    duty = table.duty_factor
    if isinstance(duty, dict) and table.phase is None:
        raise GaitError(
            f"{spec.path}: gait.duty_factor by leg needs gait.phase by leg, too; a gait by name "
            "has one duty factor"
        )
    common = duty if isinstance(duty, float) else None
    sets = table.sets if table.sets is not None else table.tripods
    if sets is not None:
        name = "tripod" if table.tripods is not None else "sets in turn"
        return in_turn(sets, common, name)
    if table.phase is None:
        return named(table.name or _USUAL.get(len(legs), "wave"), spec.legs, common)
    shares = _shares(table, spec, legs)
    return own(table.phase, shares)


def _shares(table: GaitTable, spec: RobotSpec, legs: tuple[str, ...]) -> dict[str, float]:
    """Duty factors of the user's own phases; strokes by leg give them where none is stated."""
    duty = table.duty_factor
    if isinstance(duty, dict):
        return duty
    if duty is not None:
        return dict.fromkeys(legs, duty)
    if not isinstance(table.stroke, dict):
        raise GaitError(
            f"{spec.path}: gait.duty_factor is missing: the share of the period for which a foot "
            "stands, one number or a table by leg"
        )
    if table.speed is None or table.period is None or table.yaw_rate:
        raise GaitError(
            f"{spec.path}: gait.stroke by leg without gait.duty_factor needs gait.speed and "
            "gait.period, straight ahead, from which the duty factors follow"
        )
    out = {leg: stroke / (table.speed * table.period) for leg, stroke in table.stroke.items()}
    for leg, share in out.items():
        if not 0 < share < 1:
            raise GaitError(
                f"{spec.path}: gait.stroke of leg '{leg}' is {share:.3g} of the way that the body "
                "goes in a period; expected above 0 and below 1"
            )
    return out


def _of(table: GaitTable, spec: RobotSpec, key: str, parameter: str) -> float | dict[str, float]:
    """A number of ``[gait]``, or the robot file's parameter."""
    value: float | dict[str, float] | None = getattr(table, key)
    if value is None and parameter in spec.parameters:
        value = spec.parameters[parameter]
    if value is None:
        raise GaitError(
            f"{spec.path}: gait.{key} is missing; write it with its unit, or parameters.{parameter}"
        )
    return value


def _foot_speeds(twist: Array, neutral: Array) -> Array:
    """Speed of every standing foot relative to a body that moves with a twist, shape (L,).

    It is the same all along: relative to the body the foot runs on a circle about the point about
    which the body turns.
    """
    x = twist[0] - twist[2] * neutral[:, 1]
    y = twist[1] + twist[2] * neutral[:, 0]
    speed: Array = np.hypot(x, y)
    return speed


def _numbers(
    table: GaitTable, spec: RobotSpec, footfall: Footfall, neutral: Array
) -> tuple[Array, Array, float]:
    """Twist, stride and period from what is stated of speed, period and stroke."""
    legs = tuple(leg.name for leg in spec.legs)
    duty = by_leg(footfall.duty, legs)
    ahead = np.array([np.cos(table.heading), np.sin(table.heading), 0.0])
    ahead[np.abs(ahead) < 1e-15] = 0.0  # straight is straight
    if table.yaw_rate is None and table.speed is None:
        return _from_stroke(table, spec, ahead, duty)
    twist = (table.speed or 0.0) * ahead + np.array([0.0, 0.0, table.yaw_rate or 0.0])
    speeds = _foot_speeds(twist, neutral)
    if not twist.any():
        raise GaitError(
            f"{spec.path}: gait.speed and gait.yaw_rate are both 0: the robot stands; state one, "
            "or use `stand`"
        )
    if table.period is None:
        stroke = _largest(_of(table, spec, "stroke", "foot_stroke"))
        period = stroke / float((speeds * duty).max())
    else:
        period = table.period
        _refuse_other_strokes(table, spec, legs, speeds * duty * period)
    return twist, twist * period, period


def _largest(stroke: float | dict[str, float]) -> float:
    return max(stroke.values()) if isinstance(stroke, dict) else stroke


def _from_stroke(
    table: GaitTable, spec: RobotSpec, ahead: Array, duty: Array
) -> tuple[Array, Array, float]:
    """Stroke and period give the speed."""
    stroke = _of(table, spec, "stroke", "foot_stroke")
    period = table.period
    if period is None:
        stated = _of(table, spec, "period", "gait_period")
        assert isinstance(stated, float)
        period = stated
    share = float(duty.max())
    largest = _largest(stroke)
    speed = largest / (share * period)
    # The parameters are those of a foot that stands half the time; so are they held together.
    alone = table.stroke is None and table.period is None and np.all(duty == 0.5)
    if alone and "walking_speed" in spec.parameters:
        speed = spec.parameters["walking_speed"]
        if abs(speed * period * share - largest) > _AGREE * largest:
            raise GaitError(
                f"{spec.path}: at {speed:.4g} m/s a foot on the ground moves "
                f"{speed * period * share:.4g} m in half a period of {period:.4g} s, "
                f"but foot_stroke is {largest:.4g} m; change one"
            )
    if isinstance(stroke, dict):
        legs = tuple(leg.name for leg in spec.legs)
        _refuse_other_strokes(table, spec, legs, speed * duty * period)
    return speed * ahead, largest / share * ahead, period


def _refuse_other_strokes(
    table: GaitTable, spec: RobotSpec, legs: tuple[str, ...], follows: Array
) -> None:
    """A stated stroke that speed, duty factor and period contradict."""
    if table.stroke is None:
        return
    if isinstance(table.stroke, dict):
        stated, found, names = by_leg(table.stroke, legs), follows, legs
    else:
        stated, found = np.array([table.stroke]), np.array([follows.max()])
        names = (legs[int(follows.argmax())],)
    off = np.abs(found - stated) > _AGREE * stated
    if off.any():
        k = int(off.argmax())
        raise GaitError(
            f"{spec.path}: at the stated speed, period and duty factor the foot of leg "
            f"'{one_line(names[k])}' moves {found[k]:.4g} m on the ground, but gait.stroke is "
            f"{stated[k]:.4g} m; change one or leave one out"
        )
