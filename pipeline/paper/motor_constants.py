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
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.parameters import ParameterSet, parameters_from_table, read_toml
from pipeline.errors import CalibrationError
from pipeline.paper.published import ALTERNATIVES, CYCLE, HELD, Published

TORQUE_CONSTANT = "motor_re40_24v.torque_constant"
RESISTANCE = "motor_re40_24v.resistance"
ROTOR_FRICTION = "rotor_re40.coulomb"
#: References of the three constants, in the order in which they are drawn, with their units.
UNITS = {TORQUE_CONSTANT: "mN*m/A", RESISTANCE: "ohm", ROTOR_FRICTION: "mN*m"}
KEYS = tuple(UNITS)
DATA_SHEET_FILE = Path(__file__).parent / "data_sheet.toml"
_DATA_SHEET = {
    "torque_constant": "torque constant",
    "resistance": "resistance",
    "no_load_current": "current",
    "no_load_speed": "angular velocity",
}
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
#: Frictions tried around what Table V asks for: this far [N*m], in these steps.
_REACH, _STEP = 1e-4, 2.5e-6
_ROUNDING = 1e-9  # relative
_EMPTY = "no motor constants give the entries of Tables IV to VI"


@cache
def data_sheet() -> ParameterSet:
    """What the motor's data sheet says, to hold the calibration against it.

    Raises:
        ParameterError: The file cannot be read, or a number is wrong.
    """
    return parameters_from_table(read_toml(DATA_SHEET_FILE), _DATA_SHEET, DATA_SHEET_FILE.name)


def no_load_current(torque_constant: float, coulomb: float, viscous: float) -> float:
    """Current at the data sheet's no-load speed with a rotor of given friction [A].

    Arguments in N*m/A, N*m and N*m*s/rad.
    """
    return (coulomb + viscous * data_sheet()["no_load_speed"]) / torque_constant


def joint_torques(published: Mapping[str, Published]) -> tuple[float, float]:
    """Magnitudes of Table III over the transmission ratio: what the ideal motor holds [N*m]."""
    ratio = published["transmission_ratio"].value
    two, three = (abs(published[f"standing_torque_{j}"].value) / ratio for j in _LOADED)
    return two, three


def entries(
    published: Mapping[str, Published], friction: Array | float, held: Array | float
) -> dict[str, Array]:
    """The electrical entries of Tables IV to VI, by id: what stands before u and w (...).

    Args:
        published: The printed values.
        friction: Of the rotor [N*m].
        held: What the reversible actuator's motor holds at joint 2 [N*m].
    """
    friction, held = (np.asarray(x, dtype=float) for x in np.broadcast_arrays(friction, held))
    ideal = [np.full(friction.shape, torque) for torque in joint_torques(published)]
    rotor = [np.maximum(torque - friction, 0.0) for torque in ideal]
    torques = zip(ALTERNATIVES[:3], (ideal, rotor, [held, np.zeros(held.shape)]), strict=True)
    out: dict[str, Array] = {}
    for table, both in torques:
        for kind in _POWERS:
            if kind == _ENERGY:
                out[f"{table}_{kind}"] = CYCLE * (both[0] ** 2 + both[1] ** 2)
                continue
            for joint, torque in zip(_LOADED, both, strict=True):
                out[f"{table}_{kind}_{joint}"] = torque**2 if kind == "power" else torque
    return out


def _powers(name: str) -> tuple[int, int]:
    """Of u and w in an entry."""
    return next(powers for kind, powers in _POWERS.items() if f"_{kind}" in name)


def _ends(row: Published) -> tuple[float, float]:
    """Least and greatest magnitude that rounds to the printed one, SI."""
    # All signs of a table are those of the joint's torque, so magnitudes are compared.
    value = abs(row.si)
    half = row.half_width_si + _SLACK * max(1.0, value)
    return value - half, value + half


def meets(
    published: Mapping[str, Published],
    friction: Array | float,
    held: Array | float,
    u: Array,
    w: Array,
    rounding: float = 0.0,
) -> dict[str, NDArray[np.bool_]]:
    """Whether each entry comes out as printed, by id, (W,), with u and w (W,); see `entries`.

    A value may miss a bound by `rounding`, relative to the upper one.
    """
    out = {}
    for name, factor in entries(published, friction, held).items():
        (a, b), (low, high) = _powers(name), _ends(published[name])
        value = np.broadcast_to(factor * u**a * w**b, u.shape)
        out[name] = (value >= low - rounding * high) & (value <= high * (1 + rounding))
    return out


def limits(
    published: Mapping[str, Published], friction: float, held: float, powers: tuple[int, int]
) -> dict[str, tuple[float, float]]:
    """Bounds that the entries with these powers put on u, w or u w, by id."""
    out = {}
    for name, factor in entries(published, friction, held).items():
        if _powers(name) == powers and factor > 0:
            low, high = _ends(published[name])
            out[name] = (low / float(factor), high / float(factor))
    return out


@dataclass(frozen=True)
class Frictions:
    """Rotor frictions that leave the same entries unmet."""

    low: float  #: Least [N*m].
    high: float  #: Greatest [N*m].
    unmet: tuple[str, ...]  #: Ids that no torque constant and resistance meets as well.


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


def friction_ranges(published: Mapping[str, Published]) -> tuple[Frictions, ...]:
    """Rotor frictions in order, by which entries of Tables IV to VI they leave unmet.

    Tried are frictions around those that Table V asks for, each with the torque constant and
    resistance that are best for it.
    """
    held = abs(published[HELD].si)
    asked = [friction for friction, _ in asked_frictions(published).values()]
    first = int(np.floor((min(asked) - _REACH) / _STEP))
    last = int(np.ceil((max(asked) + _REACH) / _STEP))
    tried = [float(f) for f in np.arange(first, last + 1, dtype=np.float64) * _STEP]
    out = []
    for unmet, group in itertools.groupby(tried, lambda f: _least_unmet(published, f, held)):
        frictions = list(group)
        out.append(Frictions(frictions[0], frictions[-1], unmet))
    return tuple(out)


def _least_unmet(
    published: Mapping[str, Published], friction: float, held: float
) -> tuple[str, ...]:
    """Ids of the entries unmet at the u and w that meet the most.

    In logarithms each bound is a straight line, so the greatest number of bounds that hold at once
    holds at a point where two of them cross.
    """
    bounds = (limits(published, friction, held, p).values() for p in ((1, 0), (0, 1), (1, 1)))
    us, ws, products = (
        np.array([end for pair in own for end in pair if end > 0]) for own in bounds
    )
    pairs = [
        [a.ravel() for a in np.meshgrid(us, ws)],
        [(u := np.repeat(us, products.size)), np.tile(products, us.size) / u],
        [np.tile(products, ws.size) / (w := np.repeat(ws, products.size)), w],
    ]
    u, w = np.concatenate(pairs, axis=1)
    # These points lie on the bounds: rounding must not decide.
    good = meets(published, friction, held, u, w, _ROUNDING)
    best = int(np.argmax(np.sum([*good.values()], axis=0)))
    return tuple(name for name, met in good.items() if not met[best])


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
    """All motor constants that give every entry as printed, but for those named."""

    published: Mapping[str, Published]  #: The printed values.
    frictions: Frictions  #: Range of the rotor's friction, and which entries stay unmet.
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
            CalibrationError: Nothing was found, the set is empty.
        """
        found = np.empty((0, 4))
        for _ in range(1000):
            friction = rng.uniform(self.frictions.low, self.frictions.high, 1000)
            held, u, w = (rng.uniform(*ends, 1000) for ends in (self.held, self.u, self.w))
            met = meets(self.published, friction, held, u, w)
            good = np.all([met[name] for name in met.keys() - {*self.frictions.unmet}], axis=0)
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
    row = published[HELD]
    held = (abs(row.si) - row.half_width_si, abs(row.si) + row.half_width_si)
    corners = list(itertools.product((frictions.low, frictions.high), held))
    ends: list[tuple[float, float]] = []
    for powers in ((1, 0), (0, 1)):
        # What an entry allows at any friction and torque in their ranges.
        allowed = [limits(published, *corner, powers) for corner in corners]
        names = allowed[0].keys() - {*frictions.unmet}
        low = max(min(own[name][0] for own in allowed) for name in names)
        high = min(max(own[name][1] for own in allowed) for name in names)
        if low >= high:
            raise CalibrationError(_EMPTY)
        ends.append((low, high))
    found = FeasibleSet(published, frictions, held, ends[0], ends[1])
    means = found.draws(np.random.default_rng(0), 4000)[:, :3].mean(axis=0)
    return replace(found, middle=dict(zip(KEYS, map(float, means), strict=True)))
