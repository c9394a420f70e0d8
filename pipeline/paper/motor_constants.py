"""The motor's three constants: all sets that give Tables IV to VI as printed, and draws from them.

At standstill Eq. 1, Ohm's law and P = U I make every entry a product of a motor torque G with
powers of two numbers, u = 1 / k and w = R / k:

    G        I = G u        U = G w        P = G^2 u w        E = 3 s (G2^2 + G3^2) u w

so that each printed entry bounds u, w or their product. Rotor friction lowers the torque of Table
V. The tables leave a set of constants so narrow that no data sheet resolves it, except for the
entries that contradict one another: those that the best rotor friction leaves unmet.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.paper.published import ALTERNATIVES, CYCLE, HELD, Published

TORQUE_CONSTANT = "motor_re40_24v.torque_constant"
ROTOR_FRICTION = "rotor_re40.coulomb"
#: References of the three constants, in the order in which they are drawn, with their units.
UNITS = {
    TORQUE_CONSTANT: "mN*m/A",
    "motor_re40_24v.resistance": "ohm",
    ROTOR_FRICTION: "mN*m",
}
KEYS = tuple(UNITS)
#: Rotor friction that leaves the fewest entries unmet, and which; `study/rotor_friction.csv` has
#: all frictions tried [N*m].
FRICTION = (3.615e-3, 3.625e-3)
UNMET = ("rotor_motor_torque_2", "rotor_leg_energy_3s")
#: Of the motor's data sheet, to hold the calibration against: maxon RE 40 148867, older edition, as
#: quoted in the calibration files of the MEKA M3 robot [A].
NO_LOAD_CURRENT = 0.137
_LOADED = ("2", "3")  # joints of Tables IV to VI
_ENERGY = "leg_energy_3s"
#: Powers of u and w in each kind of entry.
_POWERS = {
    "motor_torque": (0, 0),
    "current": (1, 0),
    "voltage": (0, 1),
    "power": (1, 1),
    _ENERGY: (1, 1),
}
_SLACK = 1e-9  # as `Published.reproduced` has it
_EMPTY = "no motor constants give the entries of Tables IV to VI"


def joint_torques(published: Mapping[str, Published]) -> tuple[float, float]:
    """Magnitudes of Table III over the transmission ratio: what the ideal motor holds [N*m]."""
    ratio = published["transmission_ratio"].value
    two, three = (abs(published[f"standing_torque_{j}"].value) / ratio for j in _LOADED)
    return two, three


def asked_frictions(published: Mapping[str, Published]) -> dict[str, tuple[float, float]]:
    """The rotor friction that each motor torque of Table V asks for, by id.

    Returns:
        Friction, and its half width with the rounding of Table III [N*m].
    """
    ratio = published["transmission_ratio"].value
    out = {}
    for joint, ideal in zip(_LOADED, joint_torques(published), strict=True):
        row = published[f"rotor_motor_torque_{joint}"]
        rounding = published[f"standing_torque_{joint}"].half_width / ratio
        out[row.id] = (ideal - abs(row.si), row.half_width_si + rounding)
    return out


def entries(
    published: Mapping[str, Published], friction: Array | float, held: Array | float
) -> dict[str, tuple[Array, tuple[int, int], tuple[float, float]]]:
    """The electrical entries of Tables IV to VI, by id.

    Args:
        published: The printed values.
        friction: Of the rotor [N*m].
        held: What the reversible actuator's motor holds at joint 2 [N*m].

    Returns:
        What stands before u and w (...), their powers, least and greatest magnitude that rounds to
        the printed one, SI.
    """
    friction, held = (np.asarray(x, dtype=float) for x in np.broadcast_arrays(friction, held))
    ideal = [np.full(friction.shape, torque) for torque in joint_torques(published)]
    rotor = [np.maximum(torque - friction, 0.0) for torque in ideal]
    torques = zip(ALTERNATIVES[:3], (ideal, rotor, [held, np.zeros(held.shape)]), strict=True)
    out = {}
    for table, both in torques:
        own = {f"{table}_{_ENERGY}": CYCLE * (both[0] ** 2 + both[1] ** 2)}
        for joint, torque in zip(_LOADED, both, strict=True):
            own |= {f"{table}_{k}_{joint}": torque for k in ("motor_torque", "current", "voltage")}
            own[f"{table}_power_{joint}"] = torque**2
        for name, factor in own.items():
            powers = next(powers for kind, powers in _POWERS.items() if f"_{kind}" in name)
            # All signs of a table are those of the joint's torque, so magnitudes are compared.
            value = abs(published[name].si)
            half = published[name].half_width_si + _SLACK * max(1.0, value)
            out[name] = (factor, powers, (value - half, value + half))
    return out


@dataclass(frozen=True)
class FeasibleSet:
    """All motor constants that give every entry as printed, but for `UNMET`."""

    published: Mapping[str, Published]  #: The printed values.
    held: tuple[float, float]  #: Range of the reversible motor's torque at joint 2 [N*m].
    u: tuple[float, float]  #: Range of 1 / k that any of them can have [A/(N*m)].
    w: tuple[float, float]  #: Range of R / k [V/(N*m)].
    #: Mean of its sets, by reference: on average as far from the edges as they are.
    middle: Mapping[str, float] = field(default_factory=dict)

    def draws(self, rng: np.random.Generator, count: int) -> Array:
        """Sets uniform in friction, torque, u and w: constants as in `KEYS`, and held torque.

        Returns:
            (count, 4), the torque in [N*m].

        Raises:
            LegwattError: Nothing was found, the set is empty.
        """
        found = np.empty((0, 4))
        for _ in range(1000):
            friction = rng.uniform(*FRICTION, 1000)
            held, u, w = (rng.uniform(*ends, 1000) for ends in (self.held, self.u, self.w))
            good: NDArray[np.bool_] = np.full(u.size, True)
            for name, (factor, (a, b), (low, high)) in entries(
                self.published, friction, held
            ).items():
                value = factor * u**a * w**b
                good &= (name in UNMET) | ((value >= low) & (value <= high))
            sets = np.stack([1 / u, w / u, friction, held], axis=1)
            found = np.concatenate([found, sets[good]])
            if len(found) >= count:
                return found[:count]
        raise LegwattError(_EMPTY)


def feasible_set(published: Mapping[str, Published]) -> FeasibleSet:
    """Motor constants that give Tables IV to VI but for `UNMET`.

    Raises:
        LegwattError: No friction, torque constant and resistance meets the others.
    """
    row = published[HELD]
    held = (abs(row.si) - row.half_width_si, abs(row.si) + row.half_width_si)
    ends: list[tuple[float, float]] = []
    for wanted in ((1, 0), (0, 1)):
        # What an entry allows at any friction and torque in their ranges.
        bounds: dict[str, list[tuple[float, float]]] = {}
        for corner in itertools.product(FRICTION, held):
            for name, (factor, powers, (low, high)) in entries(published, *corner).items():
                if powers == wanted and factor > 0 and name not in UNMET:
                    one = (low / float(factor), high / float(factor))
                    bounds.setdefault(name, []).append(one)
        least = max(min(low for low, _ in own) for own in bounds.values())
        most = min(max(high for _, high in own) for own in bounds.values())
        if least >= most:
            raise LegwattError(_EMPTY)
        ends.append((least, most))
    found = FeasibleSet(published, held, ends[0], ends[1])
    means = found.draws(np.random.default_rng(0), 4000)[:, :3].mean(axis=0)
    return replace(found, middle=dict(zip(KEYS, map(float, means), strict=True)))
