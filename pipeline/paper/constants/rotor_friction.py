"""Rotor friction: what Table V asks for, and which friction leaves the fewest entries unmet."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from actuators.units import to_si
from pipeline.paper.constants.table_entries import (
    LOADED,
    Entry,
    entries,
    joint_torques,
    limits,
    meets,
    motor_torques,
)
from pipeline.paper.published import Published

Array = NDArray[np.float64]
HELD = "reversible_motor_torque_2"
#: Frictions tried around what Table V asks for: this far [N*m], in these steps.
_REACH, _STEP = 1e-4, 2.5e-6
_HAIR = 1e-9  # relative


@dataclass(frozen=True)
class Frictions:
    """Rotor frictions that leave equally few entries unmet.

    Attributes:
        low: Least [N*m].
        high: Greatest [N*m].
        unmet: Ids that no torque constant and resistance meets as well.
    """

    low: float
    high: float
    unmet: tuple[str, ...]


@dataclass(frozen=True)
class Scan:
    """How many entries each rotor friction leaves unmet, at the best k and R for it.

    Attributes:
        friction: Tried, shape (F,) [N*m].
        unmet: Ids unmet at each.
    """

    friction: Array
    unmet: tuple[tuple[str, ...], ...]


def scan(published: Mapping[str, Published]) -> Scan:
    """Try rotor frictions around those that the entries of Table V ask for."""
    ideal = joint_torques(published)
    listed = entries(published)
    asked = asked_frictions(published)
    low, high = min(asked.values()) - _REACH, max(asked.values()) + _REACH
    first, last = int(np.floor(low / _STEP)), int(np.ceil(high / _STEP))
    friction: Array = np.arange(first, last + 1, dtype=np.float64) * _STEP
    row = published[HELD]
    held = abs(to_si(row.value, row.unit))
    unmet = []
    for f in friction:
        corners = _corners(listed, motor_torques(ideal, float(f), held))
        # Corners lie on the bounds: a hair of rounding must not decide.
        good = meets(_widened(listed), ideal, float(f), held, corners[:, 0], corners[:, 1])
        best = good[:, int(np.argmax(good.sum(axis=0)))]
        unmet.append(tuple(e.id for e, ok in zip(listed, best, strict=True) if not ok))
    return Scan(friction, tuple(unmet))


def _widened(listed: tuple[Entry, ...]) -> tuple[Entry, ...]:
    return tuple(replace(e, low=e.low - _HAIR * e.high, high=e.high * (1 + _HAIR)) for e in listed)


def _corners(listed: tuple[Entry, ...], torque: Mapping[tuple[str, str], Array]) -> Array:
    """Points (u, w) where bounds cross, shape (C, 2).

    In logarithms each bound is a straight line, so the greatest number of bounds that hold at once
    holds at one of these points too.
    """
    us, ws, products = (
        np.array([edge for pair in limits(listed, torque, what) for edge in pair if edge > 0])
        for what in ("current", "voltage", "power")
    )
    pairs = [
        np.stack([a.ravel() for a in np.meshgrid(us, ws)], axis=1),
        np.stack([(u := np.repeat(us, products.size)), np.tile(products, us.size) / u], axis=1),
        np.stack([np.tile(products, ws.size) / (w := np.repeat(ws, products.size)), w], axis=1),
    ]
    return np.concatenate(pairs)


def asked_frictions(published: Mapping[str, Published]) -> dict[str, float]:
    """The rotor friction that each motor torque of Table V asks for, by id [N*m]."""
    ideal = joint_torques(published)
    out = {}
    for joint in LOADED:
        row = published[f"rotor_motor_torque_{joint}"]
        out[row.id] = ideal[joint] - abs(to_si(row.value, row.unit))
    return out


def asked_widths(published: Mapping[str, Published]) -> dict[str, float]:
    """Half widths of `asked_frictions`, the rounding of Table III included [N*m]."""
    ratio = published["transmission_ratio"].value
    out = {}
    for joint in LOADED:
        row = published[f"rotor_motor_torque_{joint}"]
        own = to_si(row.half_width, row.unit)
        out[row.id] = own + published[f"standing_torque_{joint}"].half_width / ratio
    return out


def friction_ranges(published: Mapping[str, Published]) -> tuple[Frictions, ...]:
    """Rotor frictions in order, by which entries of Tables IV to VI they leave unmet."""
    scanned = scan(published)
    edges = [
        i
        for i in range(len(scanned.unmet) + 1)
        if i in (0, len(scanned.unmet)) or scanned.unmet[i] != scanned.unmet[i - 1]
    ]
    return tuple(
        Frictions(float(scanned.friction[a]), float(scanned.friction[b - 1]), scanned.unmet[a])
        for a, b in itertools.pairwise(edges)
    )


def best_frictions(ranges: Sequence[Frictions], published: Mapping[str, Published]) -> Frictions:
    """The rotor frictions that leave the fewest entries unmet.

    Among equals those count first that leave none unmet but rows the paper contradicts, then the
    widest range.
    """
    contradicted = {p.id for p in published.values() if p.role == "contradicted"}

    def cost(range_: Frictions) -> tuple[int, int, float]:
        outside = sum(name not in contradicted for name in range_.unmet)
        return len(range_.unmet), outside, range_.low - range_.high

    return min(ranges, key=cost)
