"""The electrical entries of Tables IV to VI as bounds on the motor's constants.

At standstill Eq. 1, Ohm's law and P = U I make every entry a product of a motor torque G with
powers of two numbers, u = 1 / k and w = R / k:

    G        I = G u        U = G w        P = G^2 u w        E = 3 s (G2^2 + G3^2) u w

so that each printed entry bounds u, w or their product. Rotor friction lowers the torque of Table
V.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from pipeline.paper.published import ALTERNATIVES, CYCLE, Published

LOADED = ("2", "3")  # joints of Tables IV to VI
_SLACK = 1e-9  # as `Published.reproduced` has it
#: Powers of u and w in each kind of entry.
POWERS = {
    "motor_torque": (0, 0),
    "current": (1, 0),
    "voltage": (0, 1),
    "power": (1, 1),
    "energy": (1, 1),
}


@dataclass(frozen=True)
class Entry:
    """One entry of Tables IV to VI as a bound on the motor's constants.

    Attributes:
        id: Of the printed value.
        alternative: Which table.
        kind: One of `POWERS`.
        joint: ``2`` or ``3``; empty for the leg's energy.
        ideal: Motor torque of the ideal actuator at joints 2 and 3 [N*m].
        low: Least magnitude that rounds to the printed one, SI.
        high: Greatest.
    """

    id: str
    alternative: str
    kind: str
    joint: str
    ideal: tuple[float, float]
    low: float
    high: float

    @property
    def powers(self) -> tuple[int, int]:
        """Of u and w."""
        return POWERS[self.kind]

    def factor(self, friction: Array | float, held: Array | float) -> Array:
        """What stands before u and w.

        Args:
            friction: Of the rotor [N*m].
            held: What the reversible actuator's motor holds at joint 2 [N*m].
        """
        friction, held = np.asarray(friction, dtype=float), np.asarray(held, dtype=float)
        torques = {
            "ideal": [np.full(friction.shape, ideal) for ideal in self.ideal],
            "rotor": [np.maximum(ideal - friction, 0.0) for ideal in self.ideal],
            "reversible": [held, np.zeros(held.shape)],
        }[self.alternative]
        if self.kind == "energy":
            return CYCLE * (torques[0] ** 2 + torques[1] ** 2)
        own: Array = torques[LOADED.index(self.joint)]
        return own**2 if self.kind == "power" else own


def entries(published: Mapping[str, Published]) -> tuple[Entry, ...]:
    """Every electrical entry of Tables IV to VI and the energies made of them."""
    ideal = joint_torques(published)
    out = []
    for alternative in ALTERNATIVES[:3]:
        for kind in POWERS:
            for joint in ("",) if kind == "energy" else LOADED:
                name = "leg_energy_3s" if kind == "energy" else f"{kind}_{joint}"
                row = published[f"{alternative}_{name}"]
                # All signs of a table are those of the joint's torque, so magnitudes are compared.
                value, half = abs(row.si), row.half_width_si
                slack = _SLACK * max(1.0, value)
                low, high = value - half - slack, value + half + slack
                out.append(Entry(row.id, alternative, kind, joint, ideal, low, high))
    return tuple(out)


def joint_torques(published: Mapping[str, Published]) -> tuple[float, float]:
    """Magnitudes of Table III over the transmission ratio: what the ideal motor holds [N*m]."""
    ratio = published["transmission_ratio"].value
    two, three = (abs(published[f"standing_torque_{j}"].value) / ratio for j in LOADED)
    return two, three


def meets(
    listed: Sequence[Entry],
    friction: Array | float,
    held: Array | float,
    u: Array,
    w: Array,
    rounding: float = 0.0,
) -> NDArray[np.bool_]:
    """Whether each entry comes out as printed, shape (E, ...).

    Args:
        listed: The entries.
        friction: Of the rotor [N*m].
        held: By the reversible actuator's motor at joint 2 [N*m].
        u: 1 / k [A/(N*m)].
        w: R / k [V/(N*m)].
        rounding: By which a value may miss a bound, relative to the upper one.
    """
    rows = []
    for e in listed:
        a, b = e.powers
        value = e.factor(friction, held) * u**a * w**b
        rows.append((value >= e.low - rounding * e.high) & (value <= e.high * (1 + rounding)))
    return np.stack(np.broadcast_arrays(*rows))


def limits(
    listed: Sequence[Entry], friction: float, held: float, powers: tuple[int, int]
) -> dict[str, tuple[float, float]]:
    """Bounds that the entries put on u, w or u w, by id."""
    out = {}
    for e in listed:
        factor = float(e.factor(friction, held))
        if e.powers == powers and factor > 0:
            out[e.id] = (e.low / factor, e.high / factor)
    return out
