"""Energy through each stage, forward and reverse, integrated block by block.

Power is linear between samples and split at its zero crossings, which is exact for piecewise
linear power. Breaks carry both limits and have no width, so no integral runs across a jump.
"""

from dataclasses import dataclass

import numpy as np

from actuators.arrays import Array
from actuators.chain import ChainResult
from actuators.errors import EnergyError


@dataclass(frozen=True, eq=False)
class StageEnergy:
    """Energy over the series through one stage."""

    stage: str  #: Name of the stage, as in Fig. 14, 16, 18 and 20 of the paper.
    joints: tuple[str, ...]  #: Names of the J joints.
    forward: Array  #: E(+), from the supply towards the joint (J,) [J], not negative.
    reverse: Array  #: E(-), from the joint towards the supply (J,) [J], not negative.

    @property
    def net(self) -> Array:
        """E(+) - E(-), (J,) [J]."""
        return self.forward - self.reverse


def duration(time: Array) -> float:
    """Return the time that a series (N,) or (N, J) [s] spans, the shortest of its columns [s].

    Raises:
        EnergyError: It spans none.
    """
    span = float(np.min(time[-1] - time[0]))
    if span <= 0.0:
        raise EnergyError(
            f"series of {len(time)} samples spans no time: give at least two instants"
        )
    return span


def integral(time: Array, power: Array) -> Array:
    """Return the integral of a piecewise linear quantity over time, (J,).

    Args:
        time: (N,), or (N, J) where every column has its own [s]; repeated stamps are breaks.
        power: (N, J), or (N,).
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
    """Return the integrals of the positive and of the negative part, both not negative, (J,).

    Arguments as for `integral`.
    """
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


def stage_energy(result: ChainResult, stage: str) -> StageEnergy:
    """Return the energy through one stage."""
    forward, reverse = split_integral(result.joint.time, result.stage_power(stage))
    return StageEnergy(stage, result.joint.joints, forward, reverse)


def stage_energies(result: ChainResult) -> tuple[StageEnergy, ...]:
    """Return the energy through every stage from `out` to `el`."""
    return tuple(stage_energy(result, stage) for stage in result.stages)


def loss_energies(result: ChainResult) -> dict[str, Array]:
    """Return the energy each element dissipates, by name, (J,) [J]."""
    return {name: integral(result.joint.time, power) for name, power in result.losses.items()}
