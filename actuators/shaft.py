"""A shaft of a set of joints' actuators: its motion and torque, and the motor that drives the last.

Sign convention: ratios are positive, so torque and velocity keep the joint's positive sense at
every shaft; torque times velocity is positive where power flows from the supply to the joint.

sgn(0) is decided here and nowhere else, as `ShaftSeries.direction`:

- A repeated time stamp is a break between two closed blocks and carries both limits.
- Where velocity keeps its sign in a block, every sample has it, also where the velocity is zero.
- A block whose speed stays below `REST_SPEED` is at rest: direction and velocity are zero.
- Where velocity changes sign (not yet split by `split_at_reversals`) a sample below `REST_SPEED`
  takes the direction of the sample before it, at the block's start of the one after.

At its end a permanent-magnet DC motor converts electrical into mechanical power (Fig. 5):

    I = torque / k        U = R I + k velocity        P = U I = torque velocity + R I^2
"""

import math
from collections.abc import Sequence
from dataclasses import MISSING, dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from actuators.arrays import Array, Scalars
from actuators.errors import LegwattError
from actuators.parameters import Numbers, number, require

REST_SPEED: Final = 1e-9  # [rad/s]
#: Fields of a series that have a column per joint.
BY_JOINT: Final = ("position", "velocity", "acceleration", "torque", "direction")


@dataclass(frozen=True, eq=False)
class ShaftSeries:
    """Samples of every joint at one shaft; build it with `at_joint`."""

    joints: tuple[str, ...]  #: Names of the J joints.
    time: Array  #: (N,) [s], not decreasing; a repeated stamp is a break.
    position: Array  #: (N, J) [rad].
    velocity: Array  #: (N, J) [rad/s].
    acceleration: Array  #: (N, J) [rad/s^2].
    torque: Array  #: (N, J) [N*m].
    direction: Array  #: (N, J) in {-1, 0, +1}: sgn(velocity) as decided by this module.

    @classmethod
    def at_joint(
        cls,
        joints: Sequence[str],
        time: ArrayLike,
        position: ArrayLike,
        velocity: ArrayLike,
        acceleration: ArrayLike,
        torque: ArrayLike,
    ) -> "ShaftSeries":
        """Return a checked series with its directions decided; arguments as its fields.

        Raises:
            LegwattError: Shapes differ, a value is not finite, or time runs backwards.
        """
        names = tuple(joints)
        if len(set(names)) != len(names) or not names:
            raise LegwattError(f"joints {names}: expected at least one name, none of them twice")
        t = np.asarray(time, dtype=float)
        if t.ndim != 1 or t.size == 0:
            raise LegwattError(f"time has shape {t.shape}: expected (N,) with N >= 1")
        shape = (t.size, len(names))
        given = {"position": position, "velocity": velocity}
        given |= {"acceleration": acceleration, "torque": torque}
        arrays = {name: np.asarray(values, dtype=float) for name, values in given.items()}
        for name, array in arrays.items():
            if array.shape != shape:
                raise LegwattError(f"{name} has shape {array.shape}: expected {shape}")
            if not np.isfinite(array).all():
                row, column = np.argwhere(~np.isfinite(array))[0]
                raise LegwattError(f"{name} of '{names[column]}' is not finite in sample {row}")
        if not np.isfinite(t).all() or (np.diff(t) < 0.0).any():
            raise LegwattError("time must be finite and never decrease: sort the samples")
        direction, rest = directions(t, arrays["velocity"])
        arrays["velocity"] = np.where(rest, 0.0, arrays["velocity"])
        return cls(joints=names, time=t, direction=direction, **arrays)

    @property
    def power(self) -> Array:
        """Power through the shaft towards the joint, (N, J) [W]."""
        return self.torque * self.velocity

    def of(self, joints: Sequence[str]) -> "ShaftSeries":
        """Return the series of some joints, by name."""
        which = [self.joints.index(joint) for joint in joints]
        arrays = {name: getattr(self, name).take(which, axis=1) for name in BY_JOINT}
        return ShaftSeries(joints=tuple(joints), time=self.time, **arrays)

    def with_torque(self, torque: Array) -> "ShaftSeries":
        """Return the same motion with another torque, (N, J) [N*m]; arrays are shared."""
        return replace(self, torque=torque)

    def geared(self, ratio: Scalars, torque: Array) -> "ShaftSeries":
        """Return a shaft that turns `ratio` times as fast, with its torque (N, J) [N*m]."""
        turned = {name: getattr(self, name) * ratio for name in BY_JOINT[:3]}
        return replace(self, torque=torque, **turned)


def directions(time: Array, velocity: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return directions (N, J) by this module's rules, and which samples are at rest (N, J)."""
    starts = np.concatenate(([0], np.flatnonzero(np.diff(time) == 0.0) + 1))  # of the blocks
    lengths = np.diff(np.append(starts, time.size))
    high = np.maximum.reduceat(velocity, starts, axis=0) >= REST_SPEED  # (blocks, J)
    low = np.minimum.reduceat(velocity, starts, axis=0) <= -REST_SPEED
    per_block = high.astype(float) - low.astype(float)
    direction = np.repeat(per_block, lengths, axis=0)
    rest = np.repeat(~(high | low), lengths, axis=0)
    for block, joint in np.argwhere(high & low):
        part = slice(starts[block], starts[block] + lengths[block])
        v = velocity[part, joint]
        # Samples at rest copy the moving sample before, or the first.
        moving = np.flatnonzero(np.abs(v) >= REST_SPEED)
        source = np.searchsorted(moving, np.arange(v.size), side="right") - 1
        direction[part, joint] = np.sign(v[moving[np.maximum(source, 0)]])
    return direction, rest


@dataclass(frozen=True, eq=False)
class DCMotor(Numbers):
    """Conversion only: rotor friction and inertia are elements of their own.

    Note:
        Inductance is left out: with 0.08 mH and 0.3 ohm it matters below a millisecond.
    """

    name: str  #: Names the row of its copper loss.
    #: k, of torque per current and of voltage per speed [N*m/A = V*s/rad].
    torque_constant: Scalars = number("torque constant", "positive", MISSING)
    #: R of the winding at its working temperature [ohm].
    resistance: Scalars = number("resistance", "", MISSING)
    max_speed: float = number("angular velocity", "limit", math.inf)  #: Permissible [rad/s].
    supply_voltage: float = number("voltage", "limit", math.inf)  #: At hand [V].
    continuous_current: float = number("current", "limit", math.inf)  #: Root mean square [A].
    peak_current: float = number("current", "limit", math.inf)  #: At every instant [A].
    mass: float = number("mass")  #: [kg]; no law uses it, and 0 says that no file states it.
    torque_constant_spread: float = 0.0  #: Relative standard deviation of k in its file [1].
    resistance_spread: float = 0.0  #: Of R likewise [1].

    def __post_init__(self) -> None:
        super().__post_init__()
        apart = self.peak_current >= self.continuous_current
        require(apart, self.name, "peak_current must not be below continuous_current")

    def current(self, torque: Array) -> Array:
        """Return the current (...) [A] for an air-gap torque [N*m]."""
        return torque / self.torque_constant

    def voltage(self, current: Array, velocity: Array) -> Array:
        """Return the voltage at the terminals (...) [V]."""
        return self.resistance * current + self.torque_constant * velocity

    def copper_loss(self, current: Array) -> Array:
        """Return R I^2, (...) [W]."""
        return self.resistance * current * current
