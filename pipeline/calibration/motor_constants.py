"""The motor's three constants, from Tables IV to VI: all sets that give every entry as printed.

At standstill Eq. 1, Ohm's law and P = U I make every electrical entry of the tables a product of a
motor torque with two numbers, u = 1 / k and w = R / k:

    I = G u        U = G w        P = G^2 u w        E = 3 s (G2^2 + G3^2) u w

so that each printed entry bounds u, w or their product. Rotor friction lowers the torque of Table
V. Where no friction meets every entry, `best_frictions` says which leaves the fewest unmet.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from actuators.units import to_si
from pipeline.calibration.errors import CalibrationError
from pipeline.calibration.published import Published

Array = NDArray[np.float64]
TORQUE_CONSTANT = "motor_re40_24v.torque_constant"
RESISTANCE = "motor_re40_24v.resistance"
ROTOR_FRICTION = "rotor_re40.coulomb"
#: References of the three constants, in the order in which they are drawn.
KEYS = (TORQUE_CONSTANT, RESISTANCE, ROTOR_FRICTION)
UNITS = {TORQUE_CONSTANT: "mN*m/A", RESISTANCE: "ohm", ROTOR_FRICTION: "mN*m"}
#: Frictions tried around what Table V asks for: this far [N*m], in these steps.
_REACH, _STEP = 1e-4, 5e-7
_SECONDS = 3.0
_HELD = "reversible_motor_torque_2"
_LOADED = ("2", "3")  # joints of Tables IV to VI
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


def entries(published: Mapping[str, Published]) -> tuple[Entry, ...]:
    """Every electrical entry of Tables IV to VI and the energies made of them."""
    out = []
    for alternative in ("ideal", "rotor", "reversible"):
        for what in ("motor_torque", "current", "voltage", "power"):
            for joint in _LOADED:
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
    return {j: abs(published[f"standing_torque_{j}"].value) / ratio for j in _LOADED}


def _motor_torques(
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
    for joint in _LOADED:
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
    torque = _motor_torques(ideal, friction, held)
    u, w = np.asarray(u, dtype=float), np.asarray(w, dtype=float)
    rows = []
    for e in listed:
        if e.what == "energy":
            square = sum(torque[e.alternative, j] ** 2 for j in _LOADED)
            value = _SECONDS * square * u * w
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


def _limits(
    listed: tuple[Entry, ...], torque: Mapping[tuple[str, str], Array], what: str
) -> list[tuple[float, float]]:
    """Bounds that the entries of one kind put on u, w or u w, one pair per entry."""
    out = []
    for e in listed:
        if what == "power" and e.what == "energy":
            factor = _SECONDS * sum(float(torque[e.alternative, j]) ** 2 for j in _LOADED)
        elif e.what == what:
            own = float(torque[e.alternative, e.joint])
            factor = own**2 if what == "power" else own
        else:
            continue
        if factor > 0:
            out.append((e.low / factor, e.high / factor))
    return out


def _corners(listed: tuple[Entry, ...], torque: Mapping[tuple[str, str], Array]) -> Array:
    """Points (u, w) where bounds cross, shape (C, 2).

    In logarithms each bound is a straight line, so the greatest number of bounds that hold at once
    holds at one of these points too.
    """
    us, ws, products = (
        np.array([edge for pair in _limits(listed, torque, what) for edge in pair if edge > 0])
        for what in ("current", "voltage", "power")
    )
    pairs = [
        np.stack([a.ravel() for a in np.meshgrid(us, ws)], axis=1),
        np.stack([(u := np.repeat(us, products.size)), np.tile(products, us.size) / u], axis=1),
        np.stack([np.tile(products, ws.size) / (w := np.repeat(ws, products.size)), w], axis=1),
    ]
    return np.concatenate(pairs)


def scan(published: Mapping[str, Published]) -> Scan:
    """Try rotor frictions around those that the entries of Table V ask for."""
    ideal = joint_torques(published)
    listed = entries(published)
    asked = asked_frictions(published)
    low, high = min(asked.values()) - _REACH, max(asked.values()) + _REACH
    first, last = int(np.floor(low / _STEP)), int(np.ceil(high / _STEP))
    friction = np.arange(first, last + 1) * _STEP
    row = published[_HELD]
    held = abs(to_si(row.value, row.unit))
    unmet = []
    for f in friction:
        corners = _corners(listed, _motor_torques(ideal, float(f), held))
        # Corners lie on the bounds: a hair of rounding must not decide.
        good = meets(_widened(listed), ideal, float(f), held, corners[:, 0], corners[:, 1])
        best = good[:, int(np.argmax(good.sum(axis=0)))]
        unmet.append(tuple(e.id for e, ok in zip(listed, best, strict=True) if not ok))
    return Scan(friction, tuple(unmet))


def _widened(listed: tuple[Entry, ...]) -> tuple[Entry, ...]:
    return tuple(
        Entry(e.id, e.alternative, e.what, e.joint, e.low - 1e-9 * e.high, e.high * (1 + 1e-9))
        for e in listed
    )


def asked_frictions(published: Mapping[str, Published]) -> dict[str, float]:
    """The rotor friction that each motor torque of Table V asks for, by id [N*m]."""
    ideal = joint_torques(published)
    out = {}
    for joint in _LOADED:
        row = published[f"rotor_motor_torque_{joint}"]
        out[row.id] = ideal[joint] - abs(to_si(row.value, row.unit))
    return out


def asked_widths(published: Mapping[str, Published]) -> dict[str, float]:
    """Half widths of `asked_frictions`, the rounding of Table III included [N*m]."""
    ratio = published["transmission_ratio"].value
    out = {}
    for joint in _LOADED:
        row = published[f"rotor_motor_torque_{joint}"]
        own = to_si(row.half_width, row.unit)
        out[row.id] = own + published[f"standing_torque_{joint}"].half_width / ratio
    return out


def best_frictions(scanned: Scan, published: Mapping[str, Published]) -> Frictions:
    """The rotor frictions that leave the fewest entries unmet.

    Among equals those count first that leave none unmet but rows the paper contradicts, then the
    widest range.
    """
    contradicted = {p.id for p in published.values() if p.role == "contradicted"}
    ranges: list[tuple[tuple[int, int, int], int, int]] = []
    start = 0
    for i in range(1, len(scanned.unmet) + 1):
        if i < len(scanned.unmet) and scanned.unmet[i] == scanned.unmet[start]:
            continue
        unmet = scanned.unmet[start]
        outside = sum(name not in contradicted for name in unmet)
        ranges.append(((len(unmet), outside, start - i), start, i - 1))
        start = i
    _, first, last = min(ranges)
    return Frictions(
        float(scanned.friction[first]), float(scanned.friction[last]), scanned.unmet[first]
    )


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
    frictions = best_frictions(scan(published), published)
    ideal = joint_torques(published)
    listed = tuple(e for e in entries(published) if e.id not in frictions.unmet)
    row = published[_HELD]
    value, half = abs(to_si(row.value, row.unit)), to_si(row.half_width, row.unit)
    held = (value - half, value + half)
    ends = []
    for what in ("current", "voltage"):
        pairs = [
            _limits(listed, _motor_torques(ideal, f, h), what)
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
