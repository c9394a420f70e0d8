"""Smooth random motions and series that the tests of this package share."""

import numpy as np
from hypothesis import strategies as st

from actuators.arrays import Array
from actuators.chain import ChainResult
from actuators.loading.build import load_catalog
from actuators.shaft import ShaftSeries, split_at_reversals

ALTERNATIVES = ("ideal", "rotor", "reversible", "irreversible")
CHAINS = load_catalog().chains()
seeds = st.integers(0, 2**32 - 1)


def series(time, position, velocity, acceleration, torque, joints=None):
    def column(x):
        return np.asarray(x, dtype=float).reshape(len(time), -1)

    n = column(position).shape[1]
    names = joints or tuple(f"j{i}" for i in range(n))
    return ShaftSeries.at_joint(
        names, time, *(column(x) for x in (position, velocity, acceleration, torque))
    )


def harmonic(samples, joints=3, seed=0, period=3.0, torque=30.0):
    """A periodic motion of three harmonics per joint with analytic derivatives."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, period, samples)[:, None]
    q, v, a, load = (np.zeros((samples, joints)) for _ in range(4))
    for k in (1, 2, 3):
        w = 2.0 * np.pi * k / period
        amplitude = rng.normal(size=joints) * 0.3 / k
        phase = rng.uniform(0.0, 2.0 * np.pi, joints)
        q += amplitude * np.sin(w * t + phase)
        v += amplitude * w * np.cos(w * t + phase)
        a -= amplitude * w**2 * np.sin(w * t + phase)
        load += rng.normal(size=joints) * torque / k * np.cos(w * t + rng.uniform(0, 6.28, joints))
    return series(t[:, 0], q, v, a, load)


def constant(velocity, torque, acceleration=0.0):
    """Two samples at one speed, one column per value."""
    v = np.atleast_1d(np.asarray(velocity, dtype=float)) * np.ones((2, 1))
    one = np.ones_like(v)
    return series([0.0, 1.0], 0.0 * v, v, acceleration * one, np.asarray(torque) * one)


split = split_at_reversals


def balance_residual(result: ChainResult) -> Array:
    """Return the relative error of the power balance, (N, J).

        electrical - joint - sum of losses - sum of stored = 0

    It is divided by the sum of the terms' magnitudes, and zero where all terms are. Losses come
    from the elements' laws, not from differences of powers, so the balance can fail.
    """
    residual = result.electrical_power.copy()
    scale = np.abs(residual)
    for power in (result.joint.power, *result.losses.values(), *result.stored.values()):
        residual -= power
        scale += np.abs(power)
    return np.divide(residual, scale, out=np.zeros_like(residual), where=scale > 0.0)
