"""Motions and logs made of arrays, with known content."""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.logs.log import EFFORTS, Log, Recording, column_name
from pipeline.logs.reduce import Settings, choose_settings, reduced

Array = NDArray[np.float64]


def motion(n: int = 2000, rate: float = 500.0) -> tuple[Array, Array, Array, Array]:
    """Time, position, velocity and acceleration of a two-joint multi-sine, analytic."""
    t = np.arange(n) / rate
    w = 2 * np.pi * np.array([[0.7, 1.1], [1.9, 2.3]])  # [rad/s], (component, joint)
    amplitude = np.array([[0.9, 0.8], [0.3, 0.25]])
    phase = w[:, None, :] * t[None, :, None] + np.array([0.2, 1.1])
    q = (amplitude[:, None, :] * np.sin(phase)).sum(axis=0)
    v = ((amplitude * w)[:, None, :] * np.cos(phase)).sum(axis=0)
    a = (-(amplitude * w**2)[:, None, :] * np.sin(phase)).sum(axis=0)
    return t, q, v, a


def made_log(
    q: Array,
    effort: Array | None,
    rate: float = 500.0,
    *,
    time: Array | None = None,
    force: Array | None = None,
    feet: tuple[str, ...] = (),
    facts: dict[str, Any] | None = None,
    **channels: Array,
) -> Recording:
    """A log straight from arrays: position, torque and other channels, (N, J); forces (N, F, 3)."""
    n, joints = q.shape
    names = tuple("abcdefghijklmnopqr"[:joints])
    frame = {"time_s": np.arange(n) / rate if time is None else time}
    every = {"position": q} | ({} if effort is None else {"torque": effort}) | channels
    for quantity, values in every.items():
        for joint, column in zip(names, values.T, strict=True):
            key = f"{joint}__{quantity}" if quantity == "torque_off" else None
            frame[key or column_name(joint, quantity)] = column
    for k, foot in enumerate(feet if force is not None else ()):
        for axis in range(3):
            assert force is not None
            frame[f"{foot}__force_{'xyz'[axis]}_N"] = force[:, k, axis]
    channel = next(c for c in EFFORTS if c in every)
    return Recording("made", pd.DataFrame(frame), names, channel, feet=feet, **(facts or {}))


def reduced_log(log: Recording, cutoff: float | None = 20.0, *, thinned: bool = False) -> Log:
    """A log at its grid and a cut-off [Hz], or the one that it asks for."""
    return reduced(log, settings_of(log, cutoff, thinned=thinned))


def settings_of(log: Recording, cutoff: float | None = None, *, thinned: bool = False) -> Settings:
    """As chosen from this log alone."""
    return choose_settings([log], cutoff=cutoff, thinned=thinned)
