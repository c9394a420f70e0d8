"""The electrical entries of Tables IV to VI as bounds on the motor's constants.

At standstill Eq. 1, Ohm's law and P = U I make every entry a product of a motor torque with two
numbers, u = 1 / k and w = R / k:

    I = G u        U = G w        P = G^2 u w        E = 3 s (G2^2 + G3^2) u w

so that each printed entry bounds u, w or their product. Rotor friction lowers the torque of Table
V.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuators.units import to_si
from pipeline.paper.published import Published

Array = NDArray[np.float64]
SECONDS = 3.0  # section IV.B adds up over the duration of a walking cycle
LOADED = ("2", "3")  # joints of Tables IV to VI
_SLACK = 1e-9  # as `Published.reproduced` has it


@dataclass(frozen=True)
class Entry:
    """One entry of Tables IV to VI as a bound on the motor's constants.

    Attributes:
        id: Of the printed value.
        alternative: Which table.
        what: ``motor_torque``, ``current``, ``voltage``, ``power`` or ``energy``.
        joint: ``2`` or ``3``; both for the leg's energy.
        low: Least magnitude that rounds to the printed one, SI.
        high: Greatest.
    """

    id: str
    alternative: str
    what: str
    joint: str
    low: float
    high: float


def entries(published: Mapping[str, Published]) -> tuple[Entry, ...]:
    """Every electrical entry of Tables IV to VI and the energies made of them."""
    out = []
    for alternative in ("ideal", "rotor", "reversible"):
        for what in ("motor_torque", "current", "voltage", "power"):
            for joint in LOADED:
                row = published[f"{alternative}_{what}_{joint}"]
                out.append(_entry(row, alternative, what, joint))
        out.append(_entry(published[f"{alternative}_leg_energy_3s"], alternative, "energy", ""))
    return tuple(out)


def _entry(row: Published, alternative: str, what: str, joint: str) -> Entry:
    # All signs of a table are those of the joint's torque, so magnitudes are compared.
    value, half = abs(to_si(row.value, row.unit)), to_si(row.half_width, row.unit)
    slack = _SLACK * max(1.0, abs(row.value)) * (half / row.half_width if row.half_width else 1.0)
    return Entry(row.id, alternative, what, joint, value - half - slack, value + half + slack)


def joint_torques(published: Mapping[str, Published]) -> dict[str, float]:
    """Magnitudes of Table III over the transmission ratio: what the ideal motor holds [N*m]."""
    ratio = published["transmission_ratio"].value
    return {j: abs(published[f"standing_torque_{j}"].value) / ratio for j in LOADED}


def motor_torques(
    ideal: Mapping[str, float], friction: Array | float, held: Array | float
) -> dict[tuple[str, str], Array]:
    """Magnitude of every alternative's motor torque, by alternative and joint [N*m].

    Args:
        ideal: From `joint_torques`.
        friction: Of the rotor [N*m].
        held: What the reversible actuator's motor still holds at joint 2 [N*m].
    """
    friction = np.asarray(friction, dtype=float)
    held = np.asarray(held, dtype=float)
    out = {}
    for joint in LOADED:
        out["ideal", joint] = np.full(friction.shape, ideal[joint])
        out["rotor", joint] = np.maximum(ideal[joint] - friction, 0.0)
        out["reversible", joint] = held if joint == "2" else np.zeros(held.shape)
    return out


def meets(
    listed: tuple[Entry, ...],
    ideal: Mapping[str, float],
    friction: Array | float,
    held: Array | float,
    u: Array | float,
    w: Array | float,
) -> NDArray[np.bool_]:
    """Whether each entry comes out as printed, shape (E, ...).

    Args:
        listed: The entries.
        ideal: From `joint_torques`.
        friction: Of the rotor [N*m].
        held: By the reversible actuator's motor at joint 2 [N*m].
        u: 1 / k [A/(N*m)].
        w: R / k [V/(N*m)].
    """
    torque = motor_torques(ideal, friction, held)
    u, w = np.asarray(u, dtype=float), np.asarray(w, dtype=float)
    rows = []
    for e in listed:
        if e.what == "energy":
            square = sum(torque[e.alternative, j] ** 2 for j in LOADED)
            value = SECONDS * square * u * w
        else:
            own = torque[e.alternative, e.joint]
            value = {
                "motor_torque": own * np.ones_like(u),
                "current": own * u,
                "voltage": own * w,
                "power": own**2 * u * w,
            }[e.what]
        rows.append((value >= e.low) & (value <= e.high))
    return np.stack(np.broadcast_arrays(*rows))


def limits(
    listed: tuple[Entry, ...], torque: Mapping[tuple[str, str], Array], what: str
) -> list[tuple[float, float]]:
    """Bounds that the entries of one kind put on u, w or u w, one pair per entry."""
    out = []
    for e in listed:
        if what == "power" and e.what == "energy":
            factor = SECONDS * sum(float(torque[e.alternative, j]) ** 2 for j in LOADED)
        elif e.what == what:
            own = float(torque[e.alternative, e.joint])
            factor = own**2 if what == "power" else own
        else:
            continue
        if factor > 0:
            out.append((e.low / factor, e.high / factor))
    return out
