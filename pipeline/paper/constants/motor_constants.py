"""The motor's three constants: all sets that give Tables IV to VI as printed, and draws from them.

Torque constant, resistance and rotor friction have no prior here. The tables leave a set of them
so narrow that no data sheet resolves it, except for the entries that contradict one another: those
that the best rotor friction leaves unmet.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np

from actuators.arrays import Array
from pipeline.paper.constants.table_entries import (
    LOADED,
    Entry,
    entries,
    joint_torques,
    limits,
    meets,
)
from pipeline.paper.errors import CalibrationError
from pipeline.paper.published import HELD, Published

TORQUE_CONSTANT = "motor_re40_24v.torque_constant"
RESISTANCE = "motor_re40_24v.resistance"
ROTOR_FRICTION = "rotor_re40.coulomb"
#: References of the three constants, in the order in which they are drawn.
KEYS = (TORQUE_CONSTANT, RESISTANCE, ROTOR_FRICTION)
UNITS = {TORQUE_CONSTANT: "mN*m/A", RESISTANCE: "ohm", ROTOR_FRICTION: "mN*m"}
#: Frictions tried around what Table V asks for: this far [N*m], in these steps.
_REACH, _STEP = 1e-4, 2.5e-6
_ROUNDING = 1e-9  # relative
_EMPTY = "no motor constants give the entries of Tables IV to VI"


@dataclass(frozen=True)
class Frictions:
    """Rotor frictions that leave the same entries unmet.

    Attributes:
        low: Least [N*m].
        high: Greatest [N*m].
        unmet: Ids that no torque constant and resistance meets as well.
    """

    low: float
    high: float
    unmet: tuple[str, ...]


def asked_frictions(published: Mapping[str, Published]) -> dict[str, tuple[float, float]]:
    """The rotor friction that each motor torque of Table V asks for, by id.

    Returns:
        Friction, and its half width with the rounding of Table III [N*m].
    """
    ratio = published["transmission_ratio"].value
    out = {}
    for joint, ideal in zip(LOADED, joint_torques(published), strict=True):
        row = published[f"rotor_motor_torque_{joint}"]
        rounding = published[f"standing_torque_{joint}"].half_width / ratio
        out[row.id] = (ideal - abs(row.si), row.half_width_si + rounding)
    return out


def friction_ranges(published: Mapping[str, Published]) -> tuple[Frictions, ...]:
    """Rotor frictions in order, by which entries of Tables IV to VI they leave unmet.

    Tried are frictions around those that Table V asks for, each with the torque constant and
    resistance that are best for it.
    """
    listed, held = entries(published), abs(published[HELD].si)
    asked = [friction for friction, _ in asked_frictions(published).values()]
    first = int(np.floor((min(asked) - _REACH) / _STEP))
    last = int(np.ceil((max(asked) + _REACH) / _STEP))
    tried = np.arange(first, last + 1, dtype=np.float64) * _STEP
    out = []
    for unmet, group in itertools.groupby(tried, lambda f: _least_unmet(listed, float(f), held)):
        frictions = list(group)
        out.append(Frictions(float(frictions[0]), float(frictions[-1]), unmet))
    return tuple(out)


def _least_unmet(listed: Sequence[Entry], friction: float, held: float) -> tuple[str, ...]:
    """Ids of the entries unmet at the u and w that meet the most.

    In logarithms each bound is a straight line, so the greatest number of bounds that hold at once
    holds at a point where two of them cross.
    """
    us, ws, products = (
        np.array([end for pair in limits(listed, friction, held, p).values() for end in pair])
        for p in ((1, 0), (0, 1), (1, 1))
    )
    us, ws, products = us[us > 0], ws[ws > 0], products[products > 0]
    pairs = [
        [a.ravel() for a in np.meshgrid(us, ws)],
        [(u := np.repeat(us, products.size)), np.tile(products, us.size) / u],
        [np.tile(products, ws.size) / (w := np.repeat(ws, products.size)), w],
    ]
    u, w = np.concatenate(pairs, axis=1)
    # These points lie on the bounds: rounding must not decide.
    good = meets(listed, friction, held, u, w, _ROUNDING)
    best = good[:, int(np.argmax(good.sum(axis=0)))]
    return tuple(e.id for e, ok in zip(listed, best, strict=True) if not ok)


def best_frictions(ranges: Sequence[Frictions], published: Mapping[str, Published]) -> Frictions:
    """The rotor frictions that leave the fewest entries unmet.

    Among equals those count first that leave none unmet but rows the paper contradicts, then the
    widest range.
    """

    def cost(range_: Frictions) -> tuple[int, int, float]:
        outside = sum(published[name].role != "contradicted" for name in range_.unmet)
        return len(range_.unmet), outside, range_.low - range_.high

    return min(ranges, key=cost)


@dataclass(frozen=True)
class FeasibleSet:
    """All motor constants that give every entry as printed, but for those named.

    Attributes:
        listed: The entries that hold.
        frictions: Range of the rotor's friction, and which entries stay unmet.
        held: Range of the reversible actuator's motor torque at joint 2 [N*m].
        u: Range of 1 / k that any of them can have [A/(N*m)].
        w: Range of R / k [V/(N*m)].
        middle: Mean of its sets, by reference: on average as far from the edges as they are.
    """

    listed: tuple[Entry, ...]
    frictions: Frictions
    held: tuple[float, float]
    u: tuple[float, float]
    w: tuple[float, float]
    middle: Mapping[str, float] = field(default_factory=dict)

    def draws(self, rng: np.random.Generator, count: int) -> Array:
        """Sets uniform in friction, torque, u and w: constants as in `KEYS`, and held torque.

        Returns:
            (count, 4), the torque in [N*m].

        Raises:
            CalibrationError: Nothing was found, the set is empty.
        """
        found = np.empty((0, 4))
        for _ in range(1000):
            friction = rng.uniform(self.frictions.low, self.frictions.high, 1000)
            held, u, w = (rng.uniform(*ends, 1000) for ends in (self.held, self.u, self.w))
            good = meets(self.listed, friction, held, u, w).all(axis=0)
            sets = np.stack([1 / u, w / u, friction, held], axis=1)
            found = np.concatenate([found, sets[good]])
            if len(found) >= count:
                return found[:count]
        raise CalibrationError(_EMPTY)


def feasible_set(published: Mapping[str, Published]) -> FeasibleSet:
    """Motor constants that leave the fewest entries of Tables IV to VI unmet.

    Raises:
        CalibrationError: No friction, torque constant and resistance meets the others.
    """
    return _feasible_set(tuple(published.values()))


@cache
def _feasible_set(rows: tuple[Published, ...]) -> FeasibleSet:
    published = {row.id: row for row in rows}
    frictions = best_frictions(friction_ranges(published), published)
    listed = tuple(e for e in entries(published) if e.id not in frictions.unmet)
    row = published[HELD]
    held = (abs(row.si) - row.half_width_si, abs(row.si) + row.half_width_si)
    ends: list[tuple[float, float]] = []
    for powers in ((1, 0), (0, 1)):
        corners = [
            limits(listed, friction, torque, powers)
            for friction in (frictions.low, frictions.high)
            for torque in held
        ]
        # What an entry allows at any friction and torque in their ranges.
        low = max(min(corner[e][0] for corner in corners) for e in corners[0])
        high = min(max(corner[e][1] for corner in corners) for e in corners[0])
        if low >= high:
            raise CalibrationError(_EMPTY)
        ends.append((low, high))
    found = FeasibleSet(listed, frictions, held, ends[0], ends[1])
    means = found.draws(np.random.default_rng(0), 4000)[:, :3].mean(axis=0)
    return replace(found, middle=dict(zip(KEYS, map(float, means), strict=True)))
