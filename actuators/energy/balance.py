"""The energy balance of a chain at every sample, from the elements' own loss laws."""

import numpy as np

from actuators.arrays import Array
from actuators.chain import ChainResult
from actuators.energy.regeneration import Supply


def balance_residual(result: ChainResult, supply: Supply | None = None) -> Array:
    """Return the relative error of the power balance, (N, J), or (N, 1) for a shared bus.

        supplied - dumped - joint - sum of losses - sum of stored = 0

    It is divided by the sum of the terms' magnitudes, and zero where all terms are. Losses come
    from the elements' laws, not from differences of powers, so the balance can fail.

    Args:
        result: What a chain needs for a motion.
        supply: The supply's account; without it the electrical power itself is the supply.
    """
    shared = supply is not None and supply.electrical.shape != result.electrical_power.shape
    if supply is None:
        residual = result.electrical_power.copy()
        scale = np.abs(residual)
    else:
        residual = supply.supplied - supply.dumped
        scale = np.abs(supply.supplied) + supply.dumped
    for power in (result.joint.power, *result.losses.values(), *result.stored.values()):
        term = power.sum(axis=1, keepdims=True) if shared else power
        residual -= term
        scale += np.abs(power).sum(axis=1, keepdims=True) if shared else np.abs(power)
    return np.divide(residual, scale, out=np.zeros_like(residual), where=scale > 0.0)
