"""Energy through each stage, forward and reverse, integrated block by block.

Power is linear between samples and split at its zero crossings, which is exact for piecewise
linear power. Breaks carry both limits and have no width, so no integral runs across a jump.

Electrical power that flows back is dissipated, partly used, or shared on a bus (`supply_of`). What
a motion asks is held against the motor's sheet: speed, voltage |R I + k velocity| <= U, peak
current, and the root mean square of the current.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from actuators.arrays import Array
from actuators.chain import ChainResult, HoldingResult
from actuators.errors import LegwattError, one_line
from actuators.shaft import DCMotor

BUS: Final = "bus"  # the row under which a shared bus is accounted


def duration(time: Array) -> float:
    """Return the time that a series (N,) or (N, J) spans, its shortest column [s]; not none."""
    span = float(np.min(time[-1] - time[0]))
    if span <= 0.0:
        raise LegwattError(
            f"series of {len(time)} samples spans no time: give at least two instants"
        )
    return span


def integral(time: Array, power: Array) -> Array:
    """Return the integral of a piecewise linear quantity (N, J) or (N,) over time, (J,).

    Time is (N,), or (N, J) where every column has its own [s]; repeated stamps are breaks.
    """
    half = 0.5 * np.diff(time, axis=0)
    weights = np.zeros(time.shape)  # trapezoids as one product
    weights[:-1] += half
    weights[1:] += half
    return weighted(weights, power)


def weighted(weights: Array, values: Array) -> Array:
    """Return the weighted sum over the samples, (J,), of weights (N,) or (N, J)."""
    each = weights @ values if weights.ndim == 1 else np.einsum("nj,nj->j", weights, values)
    return np.asarray(each)


def split_integral(time: Array, power: Array) -> tuple[Array, Array]:
    """Return the integrals of the positive and of the negative part, both not negative, (J,)."""
    net = integral(time, power)
    magnitude = integral(time, np.abs(power))
    # Where power crosses zero inside an interval the trapezoid of |power| is too large by
    # h |a| |b| / (|a| + |b|): the tip of the two triangles.
    row, column = np.nonzero(np.signbit(power[:-1]) != np.signbit(power[1:]))
    a, b = np.abs(power[row, column]), np.abs(power[row + 1, column])
    real = (a > 0.0) & (b > 0.0)
    row, column, a, b = row[real], column[real], a[real], b[real]
    step = np.diff(time, axis=0)[(row, column) if time.ndim == 2 else row]
    np.subtract.at(magnitude, column, step * a * (b / (a + b)))
    return np.maximum(0.5 * (magnitude + net), 0.0), np.maximum(0.5 * (magnitude - net), 0.0)


def stage_energies(result: ChainResult) -> dict[str, tuple[Array, Array]]:
    """Return E(+) and E(-), from the supply towards the joint and back, (J,) each [J], by stage.

    Stages are those of Fig. 14, 16, 18 and 20 of the paper, from `out` to `el`.
    """
    time = result.joint.time
    return {stage: split_integral(time, power) for stage, power in result.powers.items()}


def loss_energies(result: ChainResult) -> dict[str, Array]:
    """Return the energy each element dissipates, by name, (J,) [J]."""
    return {name: integral(result.joint.time, power) for name, power in result.losses.items()}


@dataclass(frozen=True, eq=False)
class Supply:
    """Energy drawn from the supply and dissipated in the braking resistor."""

    accounts: tuple[str, ...]  #: What each column stands for: the joints, or the one bus.
    time: Array  #: (N,) [s].
    electrical: Array  #: Power into the motors, per account (N, K) [W].
    recovered: float  #: Share of the returned power that goes back into the supply.

    @property
    def supplied_energy(self) -> Array:
        """Energy out of the supply, (K,) [J]."""
        forward, reverse = split_integral(self.time, self.electrical)
        return forward - self.recovered * reverse

    @property
    def dissipated_energy(self) -> Array:
        """Energy dissipated, (K,) [J]."""
        return (1.0 - self.recovered) * split_integral(self.time, self.electrical)[1]


def recovery(regeneration: str | float) -> tuple[str, float]:
    """Return what becomes of returned energy: `none`, `bus` or `fraction`, and that share of it."""
    if regeneration in ("none", BUS):
        return str(regeneration), 0.0
    with suppress(ValueError):
        if 0.0 <= float(regeneration) <= 1.0:
            return "fraction", float(regeneration)
    raise LegwattError(
        f"regeneration {one_line(regeneration)}: expected none, bus or a fraction between 0 and 1"
    )


def supply(result: ChainResult, regeneration: str | float = "none") -> Supply:
    """Return the supply's account of a chain's motors; see `supply_of`."""
    joint = result.joint
    return supply_of(result.electrical_power, joint.time, joint.joints, regeneration)


def supply_of(
    power: Array, time: Array, joints: tuple[str, ...], regeneration: str | float = "none"
) -> Supply:
    """Return the supply's account of power into each motor, driver losses included, (N, J) [W].

    `regeneration`: ``none``, each joint's returned power is dissipated (the paper); a fraction,
    that share of it goes back into the supply; ``bus``, one joint's return feeds another's demand,
    and what is left over is dissipated.

    Raises:
        LegwattError: No such regeneration.
    """
    policy, fraction = recovery(regeneration)
    if policy == BUS:
        return Supply((BUS,), time, power.sum(axis=1, keepdims=True), fraction)
    return Supply(joints, time, power, fraction)


class LimitRow(NamedTuple):
    """One quantity of one joint's motor against its limit, over the whole series."""

    joint: str  #: Name.
    quantity: str  #: speed, voltage, current or rms_current.
    unit: str  #: rad/s, V or A.
    limit: float  #: Permitted magnitude.
    peak: float  #: Greatest magnitude; for rms_current the root mean square.
    breach: bool  #: Whether the peak exceeds the limit.


#: Unit of each quantity, and the motor's number that limits it.
_LIMITS: Final = {
    "speed": ("rad/s", "max_speed"),
    "voltage": ("V", "supply_voltage"),
    "current": ("A", "peak_current"),
    "rms_current": ("A", "continuous_current"),
}


def limit_rows(result: ChainResult) -> Iterator[LimitRow]:
    """Return a row for every joint and limit of its motor, breached or not.

    Raises:
        LegwattError: The series spans no time.
    """
    every = {"speed": result.motor.velocity, "voltage": result.voltage, "current": result.current}
    peaks = {name: np.abs(values).max(axis=0) for name, values in every.items()}
    peaks["rms_current"] = rms_over_time(result.joint.time, result.current)
    return _rows(result.joint.joints, result.motors, peaks)


def standing_rows(
    holding: HoldingResult, joints: Sequence[str], motors: Sequence[DCMotor]
) -> Iterator[LimitRow]:
    """Return a row for every joint and limit that holding still (J,) can breach."""
    current, voltage = np.abs(holding.current), np.abs(holding.voltage)
    return _rows(joints, motors, {"voltage": voltage, "current": current, "rms_current": current})


def _rows(
    joints: Sequence[str], motors: Sequence[DCMotor], peaks: Mapping[str, Array]
) -> Iterator[LimitRow]:
    """A row for each joint and quantity, whose greatest magnitudes are (J,)."""
    for j, (joint, motor) in enumerate(zip(joints, motors, strict=True)):
        for quantity, values in peaks.items():
            unit, name = _LIMITS[quantity]
            limit, peak = getattr(motor, name), float(values[j])
            yield LimitRow(joint, quantity, unit, limit, peak, bool(peak > limit))


def rms_over_time(time: Array, values: Array) -> Array:
    """Return the root mean square of a piecewise linear quantity (N, J), (J,).

    Time is (N,), or (N, J) where every column has its own [s]; repeated stamps are breaks.

    Raises:
        LegwattError: The series spans no time.
    """
    duration(time)
    a, b = values[:-1], values[1:]
    square = weighted(np.diff(time, axis=0), a * a + a * b + b * b) / 3.0  # exact if linear
    return np.sqrt(np.asarray(square / (time[-1] - time[0])))
