"""A gait ready to walk: every number that a motion is made of, worked out from what is stated.

Speed, period and stroke bind each other: a foot that stands for the share `duty` of the period
moves by speed x duty x period relative to the body. Two of them are stated in ``[gait]``, or taken
from the robot file's parameters, and the third follows; all three stated must agree.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from actuators.arrays import Array
from actuators.errors import LegwattError, one_line
from pipeline.motion.footfall import Footfall, in_turn, named, own
from pipeline.motion.gait_table import GaitTable, by_leg, read_gait_table
from pipeline.motion.motion import Ground
from pipeline.robot.robot import Robot
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
    return read_gait_table(spec.gait, spec.leg_names, str(spec.path))


def gait_of(spec: RobotSpec) -> Gait:
    """The gait of a robot file: its table ``[gait]`` and, for what that leaves out, its parameters.

    Raises:
        LegwattError: A number is missing or contradicts another, or too few feet stand.
    """
    table = gait_table(spec)
    try:
        return _gait(table, spec)
    except LegwattError as error:
        raise LegwattError(f"{spec.path}: {str(error).removeprefix(f'{spec.path}: ')}") from None


def _gait(table: GaitTable, spec: RobotSpec) -> Gait:
    legs = spec.leg_names
    footfall = replace(_footfall(table, spec), least=table.least_feet)
    footfall.stances()  # refuses too few feet before any number is asked for
    neutral, duty = neutral_feet(table, spec), by_leg(footfall.duty, legs)
    twist, stride, period = _numbers(table, spec, duty, neutral)
    lift = lifts(table, spec)
    sway = table.sway or ("least" if footfall.name == "crawl" else "none")
    if sway == "none" and table.stability_margin is not None:
        raise LegwattError(
            "gait.stability_margin is kept by the body's sway; state gait.sway = 'least', too"
        )
    margin = DEFAULT_MARGIN if table.stability_margin is None else table.stability_margin
    # Half the body's way ahead and back; see `pipeline.motion.sway.surge`.
    share = float(np.mean(list(footfall.duty.values())))
    stroke = float(np.hypot(twist[0], twist[1])) * share * period
    rate, height = 4.0 * np.pi / period, -float(neutral[:, 2].mean())  # [rad/s], [m]
    surge = table.surge * spec.parameters["gravity"] / height * stroke / np.pi / rate**2
    return Gait(
        legs=legs,
        footfall=footfall,
        period=period,
        twist=twist,
        stride=stride,
        lift=lift,
        neutral=neutral,
        ground=Ground(table.slope_forward, table.slope_left),
        body=body_rotation(table),
        path=table.transfer_path,
        surge=float(surge),
        margin=margin if sway == "least" else None,
        margin_stated=table.stability_margin is not None,
        source=str(spec.path),
    )


def lifts(table: GaitTable, spec: RobotSpec) -> Array:
    """Height of every foot at the middle of its transfer [m], shape (L,)."""
    return by_leg(_of(table, spec, "lift", "foot_lift"), spec.leg_names)


def neutral_feet(table: GaitTable, spec: RobotSpec) -> Array:
    """Feet at mid-support from the base, axes along the ground [m], shape (L, 3)."""
    feet = np.array([leg.neutral_foot for leg in spec.legs], dtype=np.float64)
    feet[:, :2] -= [table.body_x, table.body_y]
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
    duty = table.duty_factor
    if table.tripods is not None and not table.tripods:
        raise LegwattError("gait.tripods is empty: the robot has no gait; state one")
    if table.phase is not None:
        return own(table.phase, _shares(table, spec.leg_names))
    if isinstance(duty, dict):
        raise LegwattError(
            "gait.duty_factor by leg needs gait.phase by leg, too; a gait by name has one duty "
            "factor"
        )
    sets = table.sets or table.tripods
    if sets:
        return in_turn(sets, duty, "tripod" if table.tripods else "sets in turn")
    return named(table.name or _USUAL.get(len(spec.legs), "wave"), spec.legs, duty)


def _shares(table: GaitTable, legs: tuple[str, ...]) -> dict[str, float]:
    """Duty factors of the user's own phases; strokes by leg give them where none is stated."""
    duty = table.duty_factor
    if isinstance(duty, dict):
        return duty
    if duty is not None:
        return dict.fromkeys(legs, duty)
    if not isinstance(table.stroke, dict):
        raise LegwattError(
            "gait.duty_factor is missing: the share of the period for which a foot stands, one "
            "number or a table by leg"
        )
    if table.speed is None or table.period is None or table.yaw_rate:
        raise LegwattError(
            "gait.stroke by leg without gait.duty_factor needs gait.speed and gait.period, "
            "straight ahead, from which the duty factors follow"
        )
    out = {leg: stroke / (table.speed * table.period) for leg, stroke in table.stroke.items()}
    for leg, share in out.items():
        if not 0 < share < 1:
            raise LegwattError(
                f"gait.stroke of leg '{leg}' is {share:.3g} of the way that the body goes in a "
                "period; expected above 0 and below 1"
            )
    return out


def _of(table: GaitTable, spec: RobotSpec, key: str, parameter: str) -> float | dict[str, float]:
    """A number of ``[gait]``, or the robot file's parameter."""
    value: float | dict[str, float] | None = getattr(table, key)
    if value is None and parameter in spec.parameters:
        value = spec.parameters[parameter]
    if value is None:
        raise LegwattError(
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
    table: GaitTable, spec: RobotSpec, duty: Array, neutral: Array
) -> tuple[Array, Array, float]:
    """Twist, stride and period from what is stated of speed, period and stroke."""
    ahead = np.array([np.cos(table.heading), np.sin(table.heading), 0.0])
    ahead[np.abs(ahead) < 1e-15] = 0.0  # straight is straight
    if table.yaw_rate is None and table.speed is None:
        return _from_stroke(table, spec, ahead, duty)
    twist = (table.speed or 0.0) * ahead + np.array([0.0, 0.0, table.yaw_rate or 0.0])
    if not twist.any():
        raise LegwattError(
            "gait.speed and gait.yaw_rate are both 0: the robot stands; state one, or use `stand`"
        )
    ways = _foot_speeds(twist, neutral) * duty
    period = table.period
    if period is None:
        stroke = _of(table, spec, "stroke", "foot_stroke")
        period = float(np.max(list(stroke.values()) if isinstance(stroke, dict) else stroke))
        period /= float(ways.max())
    else:
        _refuse_other_strokes(table, spec, ways * period)
    return twist, twist * period, period


def _from_stroke(
    table: GaitTable, spec: RobotSpec, ahead: Array, duty: Array
) -> tuple[Array, Array, float]:
    """Stroke and period give the speed."""
    stroke = _of(table, spec, "stroke", "foot_stroke")
    period = _of(table, spec, "period", "gait_period")
    assert isinstance(period, float)
    largest = max(stroke.values()) if isinstance(stroke, dict) else stroke
    share = float(duty.max())
    speed = largest / (share * period)
    # The parameters are those of a foot that stands half the time; so are they held together.
    alone = table.stroke is None and table.period is None and np.all(duty == 0.5)
    if alone and "walking_speed" in spec.parameters:
        speed = spec.parameters["walking_speed"]
        if abs(speed * period * share - largest) > _AGREE * largest:
            raise LegwattError(
                f"at {speed:.4g} m/s a foot on the ground moves {speed * period * share:.4g} m in "
                f"half a period of {period:.4g} s, but foot_stroke is {largest:.4g} m; change one"
            )
    if isinstance(stroke, dict):
        _refuse_other_strokes(table, spec, speed * duty * period)
    return speed * ahead, largest / share * ahead, period


def _refuse_other_strokes(table: GaitTable, spec: RobotSpec, follows: Array) -> None:
    """A stated stroke that speed, duty factor and period contradict."""
    if table.stroke is None:
        return
    names = spec.leg_names
    if isinstance(table.stroke, dict):
        stated, found = by_leg(table.stroke, names), follows
    else:
        stated, found = np.array([table.stroke]), np.array([follows.max()])
        names = (names[int(follows.argmax())],)
    off = np.abs(found - stated) > _AGREE * stated
    if off.any():
        k = int(off.argmax())
        raise LegwattError(
            "at the stated speed, period and duty factor the foot of leg "
            f"'{one_line(names[k])}' moves {found[k]:.4g} m on the ground, but gait.stroke is "
            f"{stated[k]:.4g} m; change one or leave one out"
        )


def with_payload(robot: Robot) -> Robot:
    """The robot with the payload of its ``[gait]`` fixed to the base link; itself without one.

    The load is a point mass: give the place of its centre of mass. The URDF's text stays without.
    """
    table = gait_table(robot.spec)
    if not table.payload_mass:
        return robot
    place = np.array([table.payload_x, table.payload_y, table.payload_z])
    model = robot.model.copy()
    load = pin.Inertia(table.payload_mass, place, np.zeros((3, 3)))
    model.appendBodyToJoint(1 if robot.floating else 0, load, pin.SE3.Identity())
    return replace(robot, model=model)
