"""The table ``[gait]`` as written: of a robot file, or ``--set gait.KEY=VALUE``.

Dimensional numbers carry their unit in the text (``"240 mm"``), shares are bare numbers.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator
from scipy.spatial.transform import Rotation

from actuators.arrays import Array
from actuators.checked import Table, checked, parsed_toml
from actuators.errors import LegwattError, known, one_line
from actuators.units import dimension, quantity, to_si
from pipeline.motion.footfall import GAITS, TRANSFER_PATHS
from pipeline.robot.robot_file import RobotSpec, merged_gait
from pipeline.robot.robot_tables import FASTEST, PERIODS


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
