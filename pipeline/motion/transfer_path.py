"""Shapes of a foot's path through the air between lift-off and touch-down.

The paper gives stroke and lift (Table II) but not the shape, so it is a named option. Every shape
starts and ends with zero velocity relative to the ground.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from actuators.arrays import Array
from actuators.errors import closest, one_line
from pipeline.errors import GaitError

#: value, first and second derivative with respect to the phase, each (N,)
Profile = tuple[Array, Array, Array]


@dataclass(frozen=True)
class TransferPath:
    """One shape of the transfer."""

    name: str  #: How the robot file and the command line call it.
    #: Phase in [0, 1], shape (N,), to progress over ground from 0 to 1 with derivatives.
    advance: Callable[[Array], Profile]
    #: Phase to height from 0 over 1 (at phase 0.5) back to 0 with derivatives.
    lift: Callable[[Array], Profile]


def _cubic_advance(s: Array) -> Profile:
    return s * s * (3 - 2 * s), 6 * s * (1 - s), 6 - 12 * s


def _quartic_lift(s: Array) -> Profile:
    u = s * (1 - s)
    du = 1 - 2 * s
    return 16 * u * u, 32 * u * du, 32 * (du * du - 2 * u)


def _quintic_advance(s: Array) -> Profile:
    u = s * (1 - s)
    return s**3 * (10 - 15 * s + 6 * s * s), 30 * u * u, 60 * u * (1 - 2 * s)


def _sextic_lift(s: Array) -> Profile:
    u = s * (1 - s)
    du = 1 - 2 * s
    return 64 * u**3, 192 * u * u * du, 384 * u * (du * du - u)


def _harmonic_advance(s: Array) -> Profile:
    w = np.pi
    return (1 - np.cos(w * s)) / 2, w * np.sin(w * s) / 2, w * w * np.cos(w * s) / 2


def _harmonic_lift(s: Array) -> Profile:
    w = 2 * np.pi
    return (1 - np.cos(w * s)) / 2, w * np.sin(w * s) / 2, w * w * np.cos(w * s) / 2


def _cycloid_advance(s: Array) -> Profile:
    w = 2 * np.pi
    return s - np.sin(w * s) / w, 1 - np.cos(w * s), w * np.sin(w * s)


TRANSFER_PATHS: dict[str, TransferPath] = {
    path.name: path
    for path in (
        TransferPath("cubic", _cubic_advance, _quartic_lift),
        TransferPath("harmonic", _harmonic_advance, _harmonic_lift),
        TransferPath("quintic", _quintic_advance, _sextic_lift),
        TransferPath("cycloid", _cycloid_advance, _harmonic_lift),
    )
}


def transfer_path(name: str) -> TransferPath:
    """Look a shape up by name.

    Raises:
        GaitError: If there is no shape of that name.
    """
    try:
        return TRANSFER_PATHS[name]
    except KeyError:
        raise GaitError(
            f"transfer path '{one_line(name)}' is not known; {closest(name, list(TRANSFER_PATHS))}"
        ) from None
