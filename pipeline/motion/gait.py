"""A gait: the table ``[gait]`` as written, and every number of a motion worked out from it.

In a robot file, or ``--set gait.KEY=VALUE``, dimensional numbers carry their unit in the text
(``"240 mm"``), shares are bare numbers. A foot that stands for the share `duty` of the period moves
by speed x duty x period relative to the body: two of speed, period and stroke are stated, and the
third follows; all three must agree.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, Final, Literal

import numpy as np
import pinocchio as pin
from pydantic import AfterValidator, BeforeValidator
from scipy.spatial.transform import Rotation

from actuators.arrays import Array
from actuators.checked import Table, checked, parsed_toml
from actuators.errors import LegwattError, known, one_line
from actuators.parameters import dimension, quantity, to_si
from pipeline.motion.footfall import GAITS, LEAST_FEET, TRANSFER_PATHS, Footfall
from pipeline.robot.robot import Robot
from pipeline.robot.robot_file import FASTEST, PERIODS, RobotSpec, merged_gait, usual_gait


def _between(low: float, high: float, unit: str, *, above: bool = False) -> BeforeValidator:
    """Reads a number with its unit from `low` to `high` in `unit`; `above`: more than `low`."""

    def read(written: object) -> float:
        try:
            value = quantity(written, dimension(unit))
        except LegwattError as error:
            raise ValueError(f"= {error}") from None
        if not to_si(low, unit) <= value <= to_si(high, unit) or (above and value == low):
            bounds = f"{'above' if above else 'from'} {low:g} to {high:g} {unit}"
            raise ValueError(f"= {one_line(written)}: must be {bounds.removesuffix(' 1')}")
        return value

    return BeforeValidator(read)


Name = Annotated[str, AfterValidator(lambda name: known("no gait", name, GAITS))]
Path = Annotated[str, AfterValidator(lambda name: known("no path", name, TRANSFER_PATHS))]
Phase = Annotated[float, _between(-math.inf, math.inf, "1")]
Share = Annotated[float, _between(0, 1, "1", above=True)]
# No walking robot is larger or steps further, none leans or climbs beyond.
Length = Annotated[float, _between(0, 10, "m", above=True)]
Height = Annotated[float, _between(0, 10, "m")]
Offset = Annotated[float, _between(-10, 10, "m")]
Angle = Annotated[float, _between(-360, 360, "deg")]
Tilt = Annotated[float, _between(-89, 89, "deg")]
Time = Annotated[float, _between(*PERIODS, "s")]
Speed = Annotated[float, _between(0, FASTEST, "m/s")]
Rate = Annotated[float, _between(-100, 100, "rad/s")]
Mass = Annotated[float, _between(0, 1e5, "kg")]
Friction = Annotated[float, _between(0, 1000, "1", above=True)]
Surge = Annotated[float, _between(0, 2, "1")]


class GaitTable(Table):
    """What a table ``[gait]`` may state; everything has a default or follows from the rest."""

    name: Name | None = None  #: Of a known gait: `pipeline.motion.footfall.GAITS`.
    phase: dict[str, Phase] | None = None  #: Touch-down of each leg as a share of the period.
    #: Feet that stand at any time, at least: 3, or 2, when the moment about the line of two feet is
    #: left out and the body would rock.
    least_feet: Literal[2, 3] = 3
    duty_factor: Share | None = None  #: Share of the period for which a foot stands.
    transfer_path: Path = "harmonic"  #: Of the foot in the air.
    period: Time | None = None  #: Of the gait [s].
    speed: Speed | None = None  #: Of the body along `heading` [m/s].
    heading: Angle = 0.0  #: Where to, from the x axis to the left [rad].
    yaw_rate: Rate | None = None  #: Of the body, to the left [rad/s].
    #: Path of a foot relative to the body while it stands, of the longest [m].
    stroke: Length | None = None
    lift: Height | None = None  #: Height of a foot at the middle of its transfer [m].
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

    @property
    def ground(self) -> Array:
        """Rotation from the axes of the plane it walks on to the world's, shape (3, 3).

        z is the normal; x lies in the plane above the world's x axis, so that walking straight
        ahead on ground that rises forward is walking straight uphill.
        """
        rise = np.array([np.tan(self.slope_forward), np.tan(self.slope_left)])
        normal = np.array([-rise[0], -rise[1], 1.0]) / np.sqrt(1 + rise @ rise)
        ahead = np.array([np.cos(self.slope_forward), 0.0, np.sin(self.slope_forward)])
        return np.stack([ahead, np.cross(normal, ahead), normal], axis=1)

    @property
    def body(self) -> Array:
        """From the base to the ground's axes at zero heading: pitch after roll, shape (3, 3)."""
        return Rotation.from_euler("xy", [self.body_roll, self.body_pitch]).as_matrix()


def gait_table(spec: RobotSpec) -> GaitTable:
    """The robot file's table ``[gait]``, checked.

    Raises:
        LegwattError: An unknown key or leg, a value that is none, or two ways to say one thing; one
            line with all of it.
    """
    where = str(spec.path)
    read = checked(GaitTable, dict(spec.gait), f"{where}: gait")
    if read.phase is not None:
        if read.name is not None:
            raise LegwattError(f"{where}: gait.name and gait.phase both say which legs stand")
        for name in read.phase:
            known("no leg", name, spec.leg_names, f"{where}: gait.phase")
        if missing := ", ".join(leg for leg in spec.leg_names if leg not in read.phase):
            raise LegwattError(f"{where}: gait.phase: says nothing of {missing}")
    return read


def changed_table(table: Mapping[str, Any], key: str, value: object) -> dict[str, Any]:
    """The table with one key changed as ``--set gait.KEY=VALUE`` writes it.

    `key`: without ``gait.``; ``phase.LEG`` for one leg. `value`: as TOML gives it,
    or as written there; a bare number is a share.

    Raises:
        LegwattError: A list or table that TOML does not read.
    """
    first, _, leg = key.partition(".")
    if isinstance(value, str):
        try:
            value = parsed_toml(f"value = {value}")["value"] if value[:1] in "[{" else float(value)
        except LegwattError as error:
            raise LegwattError(f"gait.{key}: {error}") from None
        except ValueError:  # a quantity or a name
            pass
    if not leg:
        return merged_gait(table, {first: value})
    whole = table.get(first)
    return {**table, first: {**(whole if isinstance(whole, dict) else {}), leg: value}}


def gait_keys() -> tuple[str, ...]:
    """What ``--set`` may change, as it is written there."""
    return tuple(f"gait.{key}" for key in GaitTable.model_fields)


#: Speed, period and stroke agree within this share.
_AGREE: Final = 1e-6
#: Margin of the least sway where none is stated [m], or half of what there is to have.
DEFAULT_MARGIN: Final = 0.01


@dataclass(frozen=True)
class Gait:
    """Everything a motion over one period is made of."""

    legs: tuple[str, ...]  #: In the robot file's order.
    footfall: Footfall  #: Which legs stand when.
    period: float  #: Of the gait [s].
    #: Velocity of the unswayed body in its own axes: x and y [m/s], yaw rate [rad/s], shape (3,).
    twist: Array
    lift: float  #: Height of a foot at the middle of its transfer [m].
    #: Feet at mid-support from the unswayed base, axes along the ground [m], shape (L, 3).
    neutral: Array
    table: GaitTable  #: What is stated: ground, attitude of the body, path of the feet.
    source: str  #: File, for messages.
    surge: float = 0.0  #: Path of the body ahead of its even course and back, twice a period [m].

    @property
    def margin(self) -> float | None:
        """Distance from every edge of the support that the sway keeps [m]; None without sway."""
        if (self.table.sway or ("least" if self.footfall.name == "crawl" else "none")) == "none":
            return None
        stated = self.table.stability_margin
        return DEFAULT_MARGIN if stated is None else stated

    @property
    def stride(self) -> Array:
        """What the twist adds up to over a period if the axes stood still [m, m, rad], (3,)."""
        return self.twist * self.period

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
        return _foot_speeds(self.twist, self.neutral) * self.footfall.duty * self.period


def gait_of(spec: RobotSpec) -> Gait:
    """The gait of a robot file: its table ``[gait]`` and, for what that leaves out, its parameters.

    Raises:
        LegwattError: A number is missing or contradicts another, or too few feet stand.
    """
    try:
        return _gait(gait_table(spec), spec)
    except LegwattError as error:
        raise LegwattError(f"{spec.path}: {str(error).removeprefix(f'{spec.path}: ')}") from None


def _gait(table: GaitTable, spec: RobotSpec) -> Gait:
    if len(spec.legs) < LEAST_FEET:
        words = f"{len(spec.legs)} legs have no statically stable gait, which needs three feet down"
        raise LegwattError(f"{words}; give a motion of its own")
    if table.phase is None:
        name, duty = table.name or usual_gait(len(spec.legs)), table.duty_factor
        count, usual, phases = GAITS[name]
        if count not in (None, len(spec.legs)):
            words = f"is for {count} legs, the robot has {len(spec.legs)}"
            raise LegwattError(f"gait.name = '{name}' {words}; wave is for any number")
        duty = usual(len(spec.legs)) if duty is None else duty
        footfall = Footfall(name, phases(spec.legs, duty), duty)
    elif table.duty_factor is None:
        raise LegwattError("gait.duty_factor is missing: the share for which a foot stands")
    else:
        phase = {leg: float(np.mod(p, 1.0)) for leg, p in table.phase.items()}  # of any size
        footfall = Footfall("own", phase, table.duty_factor)
    footfall = replace(footfall, least=table.least_feet)
    footfall.stances()  # refuses too few feet before any number is asked for
    neutral, duty = neutral_feet(table, spec), footfall.duty
    twist, period = _twist_and_period(table, spec, duty, neutral)
    speed = float(np.hypot(twist[0], twist[1]))
    if not PERIODS[0] <= period <= PERIODS[1] or speed > FASTEST:
        walks = f"walks have up to {FASTEST:g} m/s and {PERIODS[0]:g} to {PERIODS[1]:g} s"
        raise LegwattError(f"{speed:.4g} m/s and a period of {period:.4g} s follow; {walks}")
    # Half the body's way ahead and back; see `pipeline.motion.motion.surge`.
    stroke = speed * duty * period
    rate, height = 4.0 * np.pi / period, -float(neutral[:, 2].mean())  # [rad/s], [m]
    surge = table.surge * spec.parameters["gravity"] / height * stroke / np.pi / rate**2
    rest = (foot_lift(table, spec), neutral, table, str(spec.path), surge)
    gait = Gait(spec.leg_names, footfall, period, twist, *rest)
    if gait.margin is None and table.stability_margin is not None:
        raise LegwattError("gait.stability_margin is kept by sway; state gait.sway = 'least', too")
    return gait


def foot_lift(table: GaitTable, spec: RobotSpec) -> float:
    """Height of a foot at the middle of its transfer [m]."""
    return _parameter(spec, "lift", "foot_lift") if table.lift is None else table.lift


def neutral_feet(table: GaitTable, spec: RobotSpec) -> Array:
    """Feet at mid-support from the base, axes along the ground [m], shape (L, 3)."""
    feet = np.array([leg.neutral_foot for leg in spec.legs], dtype=np.float64)
    feet[:, :2] -= [table.body_x, table.body_y]
    if table.body_height is not None:
        feet[:, 2] = -table.body_height
    return feet


def _parameter(spec: RobotSpec, key: str, parameter: str) -> float:
    """The robot file's parameter for a number that ``[gait]`` leaves out."""
    if parameter not in spec.parameters:
        raise LegwattError(f"gait.{key} is missing; write it, or parameters.{parameter}")
    return spec.parameters[parameter]


def _foot_speeds(twist: Array, neutral: Array) -> Array:
    """Speed of every standing foot relative to a body that moves with a twist, shape (L,).

    It is the same all along: the foot runs on a circle about the point about which the body turns.
    """
    x, y = twist[0] - twist[2] * neutral[:, 1], twist[1] + twist[2] * neutral[:, 0]
    return np.asarray(np.hypot(x, y))


def _twist_and_period(
    table: GaitTable, spec: RobotSpec, duty: float, neutral: Array
) -> tuple[Array, float]:
    """Twist, shape (3,), and period [s] from what is stated of speed, period and stroke."""
    ahead = np.array([np.cos(table.heading), np.sin(table.heading), 0.0])
    ahead[np.abs(ahead) < 1e-15] = 0.0  # straight is straight
    period, stroke = table.period, table.stroke
    moves = table.speed is not None or table.yaw_rate is not None
    if stroke is None and not (moves and period is not None):
        stroke = _parameter(spec, "stroke", "foot_stroke")
    if moves:
        twist = (table.speed or 0.0) * ahead + np.array([0.0, 0.0, table.yaw_rate or 0.0])
        if not twist.any():
            raise LegwattError("gait.speed and gait.yaw_rate are both 0: the robot stands")
    else:
        assert stroke is not None
        period = _parameter(spec, "period", "gait_period") if period is None else period
        # The parameters are those of a foot that stands half the time; so are they held together.
        alone = table.stroke is None and table.period is None and duty == 0.5
        speed = stroke / (duty * period)
        if alone and "walking_speed" in spec.parameters:
            speed = spec.parameters["walking_speed"]
        twist = speed * ahead
    rate = float((_foot_speeds(twist, neutral) * duty).max())  # [m/s]
    if period is None:
        assert stroke is not None
        return twist, stroke / rate
    if stroke is not None and abs(rate * period - stroke) > _AGREE * stroke:
        key = "foot_stroke" if table.stroke is None else "gait.stroke"
        raise LegwattError(
            f"at the stated speed, period and duty factor a foot moves {rate * period:.4g} m on "
            f"the ground, but {key} is {stroke:.4g} m; change one or leave one out"
        )
    return twist, period


def with_payload(robot: Robot) -> Robot:
    """The robot with the payload of its ``[gait]``, a point mass, fixed to the base link.

    Itself without one; the URDF's text stays without.
    """
    table = gait_table(robot.spec)
    if not table.payload_mass:
        return robot
    place = np.array([table.payload_x, table.payload_y, table.payload_z])
    model = robot.model.copy()
    load = pin.Inertia(table.payload_mass, place, np.zeros((3, 3)))
    model.appendBodyToJoint(1 if robot.floating else 0, load, pin.SE3.Identity())
    return robot.with_bodies(model)
