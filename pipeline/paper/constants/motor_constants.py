"""The motor's three constants: all sets that give Tables IV to VI as printed, and draws from them.

Torque constant, resistance and rotor friction have no prior here. The tables leave a sliver of them
that no data sheet resolves, except for the entries that contradict one another.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from actuators.units import to_si
from pipeline.paper.constants.rotor_friction import HELD, Frictions, best_frictions, friction_ranges
from pipeline.paper.constants.table_entries import (
    Entry,
    entries,
    joint_torques,
    limits,
    meets,
    motor_torques,
)
from pipeline.paper.errors import CalibrationError
from pipeline.paper.published import Published

Array = NDArray[np.float64]
TORQUE_CONSTANT = "motor_re40_24v.torque_constant"
RESISTANCE = "motor_re40_24v.resistance"
ROTOR_FRICTION = "rotor_re40.coulomb"
#: References of the three constants, in the order in which they are drawn.
KEYS = (TORQUE_CONSTANT, RESISTANCE, ROTOR_FRICTION)
UNITS = {TORQUE_CONSTANT: "mN*m/A", RESISTANCE: "ohm", ROTOR_FRICTION: "mN*m"}


@dataclass(frozen=True)
class Sliver:
    """All motor constants that give every entry as printed, but for those named.

    Attributes:
        listed: The entries that hold.
        ideal: Motor torques of the ideal actuator [N*m], by joint.
        frictions: Range of the rotor's friction, and which entries stay unmet.
        held: Range of the reversible actuator's motor torque at joint 2 [N*m].
        low: Least u [A/(N*m)] and w [V/(N*m)] that any of them can have.
        high: Greatest.
        middle: Mean of its sets, by reference: on average as far from the edges as they are.
    """

    listed: tuple[Entry, ...]
    ideal: Mapping[str, float]
    frictions: Frictions
    held: tuple[float, float]
    low: tuple[float, float]
    high: tuple[float, float]
    middle: Mapping[str, float] = field(default_factory=dict)

    def draw(self, rng: np.random.Generator) -> tuple[dict[str, float], float]:
        """One set, uniform in friction, torque, u and w; and the torque it holds [N*m].

        Raises:
            CalibrationError: Nothing was found, the sliver is empty.
        """
        sets, held = self.draws(rng, 1)
        return {key: float(sets[0, i]) for i, key in enumerate(KEYS)}, float(held[0])

    def draws(self, rng: np.random.Generator, count: int) -> tuple[Array, Array]:
        """Several sets: constants in the order of `KEYS`, (N, 3), and held torques, (N,).

        Raises:
            CalibrationError: Nothing was found, the sliver is empty.
        """
        found: list[Array] = []
        for _ in range(1000):
            friction = rng.uniform(self.frictions.low, self.frictions.high, 1000)
            held = rng.uniform(*self.held, 1000)
            u = rng.uniform(self.low[0], self.high[0], 1000)
            w = rng.uniform(self.low[1], self.high[1], 1000)
            good = meets(self.listed, self.ideal, friction, held, u, w).all(axis=0)
            found.append(np.stack([1 / u, w / u, friction, held], axis=1)[good])
            if sum(len(part) for part in found) >= count:
                break
        else:
            raise CalibrationError("no motor constants give the entries of Tables IV to VI")
        out = np.concatenate(found)[:count]
        return out[:, :3], out[:, 3]


def sliver(published: Mapping[str, Published]) -> Sliver:
    """Motor constants that leave the fewest entries of Tables IV to VI unmet.

    Raises:
        CalibrationError: No friction, torque constant and resistance meets the others.
    """
    return _sliver(tuple(published.values()))


@cache
def _sliver(rows: tuple[Published, ...]) -> Sliver:
    published = {row.id: row for row in rows}
    frictions = best_frictions(friction_ranges(published), published)
    ideal = joint_torques(published)
    listed = tuple(e for e in entries(published) if e.id not in frictions.unmet)
    row = published[HELD]
    value, half = abs(to_si(row.value, row.unit)), to_si(row.half_width, row.unit)
    held = (value - half, value + half)
    ends = []
    for what in ("current", "voltage"):
        pairs = [
            limits(listed, motor_torques(ideal, f, h), what)
            for f in (frictions.low, frictions.high)
            for h in held
        ]
        # What an entry allows at any friction and torque in their ranges.
        widest = [
            (min(p[i][0] for p in pairs), max(p[i][1] for p in pairs)) for i in range(len(pairs[0]))
        ]
        ends.append((max(p[0] for p in widest), min(p[1] for p in widest)))
    if any(low >= high for low, high in ends):
        raise CalibrationError("no motor constants give the entries of Tables IV to VI")
    (u_low, u_high), (w_low, w_high) = ends
    found = Sliver(listed, ideal, frictions, held, (u_low, w_low), (u_high, w_high))
    sets, _ = found.draws(np.random.default_rng(0), 4000)
    return replace(found, middle={key: float(sets[:, i].mean()) for i, key in enumerate(KEYS)})
