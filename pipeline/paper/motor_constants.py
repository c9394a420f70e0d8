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
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.parameters import ParameterSet, parameters_from_table, read_toml
from pipeline.paper.errors import CalibrationError
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
#: Of each kind of entry: the torque's power, and those of u and w.
_POWERS = {
    "motor_torque": (1, 0, 0),
    "current": (1, 1, 0),
    "voltage": (1, 0, 1),
    "power": (2, 1, 1),
    _ENERGY: (2, 1, 1),
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


@dataclass(frozen=True)
class Entries:
    """E electrical entries of Tables IV to VI as bounds on the motor's constants."""

    ids: tuple[str, ...]  #: Of the printed values.
    powers: NDArray[np.intp]  #: Of the torque, u and w, (E, 3).
    #: How often each of six torques counts: joints 2 and 3 of the three tables, (E, 6).
    weights: Array
    low: Array  #: Least magnitudes that round to the printed ones, SI, (E,).
    high: Array  #: Greatest.
    ideal: tuple[float, float]  #: Motor torque of the ideal actuator at joints 2 and 3 [N*m].

    def factors(self, friction: Array | float, held: Array | float) -> Array:
        """What stands before u and w, (E, ...), with a rotor's friction [N*m].

        `held` is what the reversible actuator's motor holds at joint 2 [N*m].
        """
        friction, held = np.broadcast_arrays(friction, held)
        ideal = [np.full(friction.shape, torque) for torque in self.ideal]
        rotor = [np.maximum(torque - friction, 0.0) for torque in self.ideal]
        torques = np.array([*ideal, *rotor, held, np.zeros(held.shape)])  # (6, ...)
        squared = (self.powers[:, 0] == 2).reshape(-1, *[1] * friction.ndim)
        once, twice = (np.tensordot(self.weights, t, 1) for t in (torques, torques**2))
        return np.where(squared, twice, once)

    def meets(
        self, friction: Array | float, held: Array | float, u: Array, w: Array, rounding: float = 0
    ) -> NDArray[np.bool_]:
        """Whether each entry comes out as printed, (E, W), with u and w (W,); see `factors`.

        A value may miss a bound by `rounding`, relative to the upper one.
        """
        friction, held = np.broadcast_to(friction, u.shape), np.broadcast_to(held, u.shape)
        of_u, of_w = (self.powers[:, k, None] for k in (1, 2))
        value = self.factors(friction, held) * u**of_u * w**of_w
        low, high = self.low[:, None], self.high[:, None]
        missed = (value < low - rounding * high) | (value > high * (1 + rounding))
        return ~missed

    def limits(self, friction: float, held: float, powers: tuple[int, int]) -> Array:
        """Bounds that the entries with these powers put on u, w or u w, (..., 2)."""
        factor = self.factors(friction, held)
        own = (self.powers[:, 1:] == powers).all(axis=1) & (factor > 0)
        return np.stack([self.low[own], self.high[own]], axis=1) / factor[own, None]


def entries(published: Mapping[str, Published], without: Collection[str] = ()) -> Entries:
    """Every electrical entry of Tables IV to VI and the energies made of them, but for some."""
    rows = []
    for k, table in enumerate(ALTERNATIVES[:3]):
        for kind, powers in _POWERS.items():
            # Of joints 2 and 3: the leg's energy has both, everything else one of them.
            both = {"": (CYCLE, CYCLE)} if kind == _ENERGY else {"_2": (1, 0), "_3": (0, 1)}
            for joint, weights in both.items():
                of_tables = np.zeros((3, 2))
                of_tables[k] = weights
                rows.append((f"{table}_{kind}{joint}", powers, of_tables.ravel()))
    ids, powers_of, counts = zip(*(row for row in rows if row[0] not in without), strict=True)
    # All signs of a table are those of the joint's torque, so magnitudes are compared.
    value = np.array([abs(published[name].si) for name in ids])
    half = np.array([published[name].half_width_si for name in ids])
    half += _SLACK * np.maximum(1.0, value)
    ideal = joint_torques(published)
    return Entries(ids, np.array(powers_of), np.array(counts), value - half, value + half, ideal)


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
    listed, held = entries(published), abs(published[HELD].si)
    asked = [friction for friction, _ in asked_frictions(published).values()]
    first = int(np.floor((min(asked) - _REACH) / _STEP))
    last = int(np.ceil((max(asked) + _REACH) / _STEP))
    tried = [float(f) for f in np.arange(first, last + 1, dtype=np.float64) * _STEP]
    out = []
    for unmet, group in itertools.groupby(tried, lambda f: _least_unmet(listed, f, held)):
        frictions = list(group)
        out.append(Frictions(frictions[0], frictions[-1], unmet))
    return tuple(out)


def _least_unmet(listed: Entries, friction: float, held: float) -> tuple[str, ...]:
    """Ids of the entries unmet at the u and w that meet the most.

    In logarithms each bound is a straight line, so the greatest number of bounds that hold at once
    holds at a point where two of them cross.
    """
    ends = [listed.limits(friction, held, p).ravel() for p in ((1, 0), (0, 1), (1, 1))]
    us, ws, products = (end[end > 0] for end in ends)
    pairs = [
        [a.ravel() for a in np.meshgrid(us, ws)],
        [(u := np.repeat(us, products.size)), np.tile(products, us.size) / u],
        [np.tile(products, ws.size) / (w := np.repeat(ws, products.size)), w],
    ]
    u, w = np.concatenate(pairs, axis=1)
    # These points lie on the bounds: rounding must not decide.
    good = listed.meets(friction, held, u, w, _ROUNDING)
    best = good[:, int(np.argmax(good.sum(axis=0)))]
    return tuple(name for name, met in zip(listed.ids, best, strict=True) if not met)


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

    listed: Entries  #: The entries that hold.
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
            good = self.listed.meets(friction, held, u, w).all(axis=0)
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
    listed = entries(published, frictions.unmet)
    row = published[HELD]
    held = (abs(row.si) - row.half_width_si, abs(row.si) + row.half_width_si)
    corners = list(itertools.product((frictions.low, frictions.high), held))
    ends: list[tuple[float, float]] = []
    for powers in ((1, 0), (0, 1)):
        # What an entry allows at any friction and torque in their ranges.
        allowed = np.array([listed.limits(*corner, powers) for corner in corners])
        low, high = allowed[..., 0].min(axis=0).max(), allowed[..., 1].max(axis=0).min()
        if low >= high:
            raise CalibrationError(_EMPTY)
        ends.append((float(low), float(high)))
    found = FeasibleSet(listed, frictions, held, ends[0], ends[1])
    means = found.draws(np.random.default_rng(0), 4000)[:, :3].mean(axis=0)
    return replace(found, middle=dict(zip(KEYS, map(float, means), strict=True)))
