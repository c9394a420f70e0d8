"""Parts that designs are made of, and what stands where a sheet says nothing.

Nothing wins by saying less: a loss, inertia, mass or speed limit that a sheet does not print is the
range of its class, that of 10 to 90 % of the parts that print it, at equal size: torque T, by
geometric similarity mass T^(2/3), inertia T^(5/3), speed at equal speed of surfaces T^(-1/3).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, fields
from functools import cache
from types import MappingProxyType
from typing import Any, Final, NamedTuple

import numpy as np

from actuators.arrays import Array, Index, Mask
from actuators.energy import driver_of
from actuators.errors import LegwattError, known
from actuators.loading.data_sheet import (
    CHOICES,
    GEARS,
    ONE,
    Number,
    completed,
    converted,
    gear_friction,
)
from actuators.loading.parts import DRIVER, Part, load_parts

#: Torque without load over loss by load, both at rated torque, of gears that do not print it.
IDLE_SHARE: Final = (0.02, 0.5)
#: Of a motor that does not say that it has brushes.
ELECTRONIC: Final = CHOICES["commutation"]["electronic"]
#: What a class has to tell: entry, its unit, and the power of torque by which it grows with size.
_GROWING: Final = {
    "gear": {
        "gear_inertia": ("kg*m^2", 5 / 3),
        "gear_max_speed": ("rad/s", -1 / 3),
        "mass": ("kg", 2 / 3),
    },
    "brake": {
        "inertia": ("kg*m^2", 5 / 3),
        "release_power": ("W", 2 / 3),
        "mass": ("kg", 2 / 3),
    },
}
#: Without which no part of a kind is comparable.
_NEEDED: Final = {"motor": "mass", "brake": "holding_torque", "gear": "gear_continuous_torque"}
#: Of `Designs`, of which the least holds.
_LIMITS: Final = (
    *("gear_speed", "gear_mean_speed", "gear_continuous", "gear_peak", "gear_momentary"),
)
#: What two parts of one name differ in, as factors on a sheet's number: entry, least and most.
_SCATTER: Final = {
    # Constants are sold to 5 %; magnets of NdFeB lose 0.11 %/K, so 5 % at 45 K warmer.
    "motor": {"torque_constant_factor": (0.90, 1.05), "resistance_factor": (0.93, 1.07)},
    # No-load torque at 40 and at 10 degC over that at 20 degC, of a CSD-20-100 at 2000 rpm:
    # efficiency at rated torque 0.74, 0.55 and 0.64, less its loss by load.
    "gear": {"grease_factor": (0.55, 1.55)},
}
#: Kinds of gears that are mounted on a shaft by the builder, not by the motor's maker: the hub of a
#: wave generator is bored to the shaft, a belt has pulleys. No table of pairs lists them.
OWN_MOUNTING: Final = ("strain_wave", "belt")
#: Of `Designs`, of which the product holds.
_FACTORS: Final = ("ratio", "standstill")
Design = tuple[str, str, str]
Drawn = Mapping[tuple[str, str], float]
Sheet = Mapping[str, Number]


@dataclass(frozen=True, eq=False)
class Designs:
    """Motor x gear x brake, arrays (D,) in SI, at the motor's shaft where nothing else is said.

    A gear whose efficiency is half and less is a `hypoid` with flat wheel: 1 + c driving and 1 - c
    driven, as friction has, and still without current from c = 1 on.
    """

    #: Names of motor, gear and brake of each; empty for none.
    parts: tuple[tuple[str, str, str], ...]
    ratio: Array  #: n [1].
    load: Array  #: c, friction per transmitted torque [1].
    coulomb: Array  #: Dry friction [N*m].
    viscous: Array  #: [N*m*s/rad].
    inertia: Array  #: [kg*m^2].
    torque_constant: Array  #: k [N*m/A].
    resistance: Array  #: R [ohm].
    voltage: Array  #: That the driver can give to the motor without current [V].
    continuous_current: Array  #: Of motor and driver [A].
    peak_current: Array  #: Likewise [A].
    max_speed: Array  #: Of the motor [rad/s].
    gear_speed: Array  #: Of the gear's input, at most [rad/s].
    gear_mean_speed: Array  #: The same, its mean [rad/s].
    gear_continuous: Array  #: At its output, root mean square [N*m].
    gear_peak: Array  #: At its output, again and again [N*m].
    gear_momentary: Array  #: At its output, now and then [N*m].
    brake_torque: Array  #: With which the brake holds; 0 for none [N*m].
    brake_power: Array  #: That keeps it open [W].
    mass: Array  #: Of motor, gear, brake and driver [kg].
    price: Array  #: Of motor, gear and brake, NaN where one is not at hand [EUR].
    standstill: Array  #: Factor on the current that may flow at standstill, 1 with brushes [1].
    bus: Array  #: Voltage of the supply [V].
    bus_use: Array  #: Share of the driver's range of it that is used [1].
    driver_resistance: Array  #: In the motor's ampere [ohm].
    switching: Array  #: Of the driver, over bus voltage times current [1].
    idle: Array  #: Of the driver while it is on [W].

    def __len__(self) -> int:
        return len(self.parts)

    def taken(self, which: Index) -> Designs:
        """Those of these numbers."""
        arrays = {name: own[which] for name, own in vars(self).items() if name != "parts"}
        return Designs(tuple(self.parts[i] for i in which), **arrays)

    @classmethod
    def together(cls, some: Sequence[Designs]) -> Designs:
        """Several in a row."""
        parts = tuple(row for one in some for row in one.parts)
        names = [f.name for f in fields(cls)[1:]]
        return cls(parts, **{n: np.concatenate([getattr(d, n) for d in some]) for n in names})

    @property
    def switched(self) -> Array:
        """Switching loss over the magnitude of the motor's torque, (D,) [W/(N*m)]."""
        return np.asarray(self.switching * self.bus / self.torque_constant)

    def locks(self, engaged: bool) -> Mask:
        """Whether gear, or brake if engaged, hold what pushes from outside, (D,)."""
        return np.asarray((self.load >= 1.0) | ((self.brake_torque > 0.0) & engaged))


class Margins(NamedTuple):
    """By how much a limit exceeds what the day asks [1]."""

    torque: float = 1.0  #: Torque of gear and brake, and the motor's continuous current.
    speed: float = 1.0  #: Speed of motor and gear, and the voltage that it takes.


NO_MARGINS: Final = Margins()
#: Of `Designs`, the margin by which each is divided.
_MARGIN_OF: Final = {
    **dict.fromkeys(("gear_continuous", "gear_peak", "brake_torque"), "torque"),
    **{"continuous_current": "torque", "voltage": "speed"},
    **dict.fromkeys(("gear_speed", "gear_mean_speed", "max_speed"), "speed"),
}


class PartCatalog:
    """The motors, gears and brakes among parts, and what is known of each.

    `driver`: of every motor; the project's own `DRIVER` by default. `voltage`: of the supply [V].
    `idle`: in place of the driver's own idle power [W].

    Raises:
        LegwattError: A size or a mass is not stated without which no class is comparable.
    """

    def __init__(
        self,
        parts: Mapping[str, Part],
        driver: Part | None = None,
        *,
        voltage: float,
        idle: Number | None = None,
        margins: Margins = NO_MARGINS,
    ) -> None:
        driver = driver or shipped()[DRIVER]
        every = {**shipped(), **parts}
        drivers = (p.printed for p in every.values() if p.kind == "driver")
        mass = [printed["mass"].value for printed in drivers if "mass" in printed]
        own = {"mass": _range(min(mass), max(mass), 1.0, "kg"), **driver.printed}
        self.parts = {**parts, driver.name: driver}
        #: Part to its entries; what it does not print is a range of its class.
        self.numbers: dict[str, Sheet] = {n: _filled(part, every) for n, part in parts.items()}
        self.numbers[driver.name] = {**own, **({"idle_power": idle} if idle else {})}
        self.driver, self.voltage, self.margins = driver.name, voltage, margins

    def unknown(self, design: Sequence[str]) -> Iterator[tuple[str, str, Number]]:
        """Part, entry and range of what no sheet of a design prints."""
        for part in (*design, self.driver):
            for entry, number in self.numbers.get(part, {}).items():
                if number.low < number.high:
                    yield part, entry, number

    def designs(
        self,
        combinations: Sequence[Design],
        drawn: Drawn | None = None,
        margins: Margins | None = None,
    ) -> Designs:
        """Numbers of motor, gear and brake (empty for none), by part and entry as `drawn`."""
        names = ["", *dict.fromkeys(name for row in combinations for name in row if name)]
        number = {name: k for k, name in enumerate(names)}
        each_part = [self._converted(n, drawn or {}) if n else _nothing() for n in names]
        which = np.array([[number[name] for name in row] for row in combinations]).reshape(-1, 3)
        margin = (margins or self.margins)._asdict()
        arrays = {}
        for key in each_part[0]:
            each = np.array([one[key] for one in each_part])[which]
            together = np.prod if key in _FACTORS else np.min if key in _LIMITS else np.sum
            share = margin.get(_MARGIN_OF.get(key, ""), 1.0)
            arrays[key] = np.asarray(together(each, axis=1)) / share
        return Designs(tuple(combinations), **arrays)

    def _converted(self, name: str, drawn: Drawn) -> dict[str, float]:
        """One part's numbers by the names of `Designs`, without margins."""
        kind, x = self.parts[name].kind, self.values(name, drawn)
        out = _nothing() | {"mass": x.get("mass", 0.0), "price": x.get("price", np.nan)}
        if kind == "brake":
            # Once it is open, many brakes stay so with less than it takes to open them.
            power = x.get("open_power", x["release_power"])
            held = {"brake_torque": x["holding_torque"], "brake_power": power}
            return out | held | {"inertia": x.get("inertia", 0.0)}
        found = converted(x) if kind == "motor" else gear_friction(x)
        grease = x.get("grease_factor", 1.0)
        out |= {law: grease * found.get(f"gear.{law}", 0.0) for law in ("coulomb", "viscous")}
        out |= {"load": found.get("gear.load", 0.0)}
        out |= {"ratio": x["gear_ratio"], "inertia": x.get("gear_inertia", 0.0)}
        if kind == "motor" and x["gear_ratio"] != 1.0:  # built in; else it wins by saying less
            torque = found["motor.torque_constant"] * x["gear_ratio"]
            ratings = ("continuous", "peak")
            x = {f"gear_{r}_torque": torque * found[f"motor.{r}_current"] for r in ratings} | x
        lasting = x.get("gear_continuous_torque", np.inf)
        peak = x.get("gear_peak_torque", lasting)
        out |= {
            "gear_speed": x.get("gear_max_speed", np.inf),
            "gear_mean_speed": x.get("gear_mean_speed", np.inf),
            "gear_continuous": lasting,
            "gear_peak": peak,
            "gear_momentary": x.get("gear_momentary_torque", peak),
        }
        if kind != "motor":
            return out
        for law in ("coulomb", "viscous", "inertia"):
            out[law] += found.get(f"rotor.{law}", 0.0)
        for key in ("torque_constant", "resistance"):
            out[key] = found[f"motor.{key}"] * x.get(f"{key}_factor", 1.0)
        sheet, bus = self.values(self.driver, drawn), self.voltage
        driver: Any = driver_of(self.driver, sheet, current_of=x["current_of"])
        lasting = found["motor.continuous_current"]
        most = min(driver.most_voltage, x.get("most_voltage", np.inf))  # of a drive inside it, too
        return out | {
            "mass": out["mass"] + sheet["mass"],
            "standstill": x.get("commutation", ELECTRONIC),
            "max_speed": found["motor.max_speed"],
            "continuous_current": min(lasting, driver.continuous_current),
            "peak_current": min(max(found["motor.peak_current"], lasting), driver.peak_current),
            "voltage": min(found["motor.supply_voltage"], driver.voltage_share * bus),
            "driver_resistance": driver.resistance,
            "switching": driver.switching,
            "idle": driver.idle,
            "bus": bus,
            "bus_use": max(bus / most, driver.least_voltage / bus),
        }

    def values(self, name: str, drawn: Drawn = MappingProxyType({})) -> dict[str, float]:
        """One part's entries, SI."""
        return {e: drawn.get((name, e), x.value) for e, x in self.numbers[name].items()}


def fit_of(shelf: PartCatalog, motor: str, gear: str, pairs: Set[tuple[str, str]]) -> str:
    """Why a motor and a gear can be bolted together, in words; empty where nobody says so."""
    if not gear:
        return "no gear" if shelf.numbers[motor]["gear_ratio"].value == 1.0 else "gear inside"
    if (motor, gear) in pairs:
        return "listed by the maker"
    shaft = shelf.numbers[motor].get("shaft_diameter")
    bore = shelf.numbers[gear].get("shaft_bore")
    if shelf.parts[gear].kind not in OWN_MOUNTING or (shaft and bore and shaft.low > bore.high):
        return ""
    return "own mounting" if shaft and bore else "own mounting, shaft not checked"


def combinations(shelf: PartCatalog, pairs: Set[tuple[str, str]] | None = None) -> list[Design]:
    """Every motor and gear that fit each other, without a brake; without `pairs` all do.

    A motor for less than the supply's voltage runs on it with the drive limiting the voltage.

    Raises:
        LegwattError: No motor is left.
    """
    parts, sheets = shelf.parts.items(), shelf.numbers
    # Without a ratio: a screw, whose lever at a joint no sheet says, or a belt without pulleys.
    turning = {n for n, sheet in sheets.items() if sheet.get("gear_ratio", ONE).value != 1.0}
    gears = [name for name, part in parts if part.kind in GEARS and name in turning]
    motors = {n: [] if n in turning else gears for n, part in parts if part.kind == "motor"}
    if not motors:
        raise LegwattError("no motor is left: widen only, without or kind")
    every = ((motor, gear) for motor, some in motors.items() for gear in ("", *some))
    return [(*pair, "") for pair in every if pairs is None or fit_of(shelf, *pair, pairs)]


def named(parts: Mapping[str, Part], kind: str, name: str) -> Part:
    """A part of one kind, of these or the project's own; a LegwattError where there is none."""
    every = {n: part for n, part in ({**shipped(), **parts}).items() if part.kind == kind}
    return every[known(f"no {kind}", name, every)]


def design_words(design: Design) -> str:
    """Motor, gear and brake."""
    return " + ".join(part for part in design if part)


def _nothing() -> dict[str, float]:
    """Numbers of no part at all."""
    zeros = dict.fromkeys((f.name for f in fields(Designs)[1:]), 0.0)
    return zeros | dict.fromkeys(_FACTORS, 1.0) | dict.fromkeys(_LIMITS, np.inf)


def _filled(part: Part, every: Mapping[str, Part]) -> Sheet:
    """A part's entries, and ranges of its class for what it does not print."""
    own = dict(part.printed)
    if part.kind == "motor":
        try:
            own = completed({"gear_ratio": ONE, **own})
        except LegwattError as error:
            raise LegwattError(f"{part.where}: {error}") from None
    kind, kinds = ("gear", GEARS) if part.kind in GEARS else (part.kind, (part.kind,))
    no_gear = kind == "gear" and own.get("gear_ratio", ONE).value == 1.0  # as in `combinations`
    if kind not in _NEEDED or no_gear:
        return own
    rated, lasting = "gear_rated_torque", "gear_continuous_torque"
    for one, other in ((rated, lasting), (lasting, rated)) if kind == "gear" else ():
        if one in own:
            own.setdefault(other, own[one])
    if _NEEDED[kind] not in own:
        raise LegwattError(f"{part.where}: no {_NEEDED[kind]}; it has to be stated")
    size = own[rated if kind == "gear" else _NEEDED[kind]].value  # [N*m] of gears and brakes
    for entry, ends in _SCATTER.get(kind, {}).items():
        own[entry] = Number(1.0, *ends, "1", "{:g} to {:g}".format(*ends))
    for entry, (unit, power) in _GROWING.get(kind, {}).items():
        if entry not in own:
            own[entry] = _range(*_class(every, kinds, entry, power), size**power, unit)
    if kind != "gear":
        return own
    if not {"gear_efficiency", "gear_load"} & own.keys():
        entry = "gear_load" if part.kind == "strain_wave" else "gear_efficiency"
        own[entry] = _range(*_class(every, (part.kind,), entry), 1.0, "1")
    if "gear_starting_torque" not in own:
        load = gear_friction({name: number.value for name, number in own.items()})["gear.load"]
        lost = load * size / own["gear_ratio"].value  # [N*m]
        own["gear_starting_torque"] = _range(*IDLE_SHARE, lost, "N*m")
    return own


def _class(
    every: Mapping[str, Part], kinds: Sequence[str], entry: str, power: float = 0.0
) -> tuple[float, float]:
    """Range of an entry over torque to a power among the parts of some kinds that print it."""
    each = [
        part.printed[entry].value / (torque if power else 1.0) ** power
        for part in every.values()
        if part.kind in kinds and entry in part.printed
        if (torque := _torque(part.printed)) or not power
    ]
    low, high = np.quantile(each, [0.1, 0.9]).tolist()
    return low, high


def _torque(x: Sheet) -> float:
    """By which parts of a kind are of equal size; 0 where it is not printed [N*m]."""
    return next((x[n].value for n in ("gear_continuous_torque", "holding_torque") if n in x), 0.0)


#: The project's own parts: the classes do not depend on which are searched.
shipped = cache(load_parts)


def _range(low: float, high: float, size: float, unit: str) -> Number:
    low, high = low * size, high * size
    return Number(0.5 * (low + high), low, high, unit, f"{low:.3g} to {high:.3g} {unit}")
