"""Designs: every compatible motor x gear x brake as arrays of the numbers that their laws take.

A motor without a gear of its own goes on every gear; one that is sold with its gear goes alone. One
rule per kind turns sheets into numbers, `actuators.loading.converted`. A gear whose efficiency is
half and less is a `hypoid` with flat wheel: its law has 1 + c driving and 1 - c driven, as that of
friction has, and stands still without current from c = 1 on.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from actuators.chain import Chain
from actuators.elements.element import Element
from actuators.elements.friction import Friction
from actuators.elements.holding_brake import HoldingBrake
from actuators.elements.hypoid import Hypoid
from actuators.elements.inertia import Inertia
from actuators.elements.motor import DCMotor
from actuators.elements.ratio import Ratio
from actuators.errors import DataSheetError
from actuators.loading.build import WINDING
from actuators.loading.converted import converted
from actuators.loading.data_sheet import ENTRIES, Number, read_sheet
from actuators.loading.parts import Part
from pipeline.choice.errors import ChoiceError

Array = NDArray[np.float64]
GEARS: Final = ("strain_wave", "planetary", "self_locking")
#: What a brake weighs per torque to the power 2/3; no maker's table at hand prints it.
BRAKE_MASS: Final = (0.15, 0.45)
#: The same of gears, where none of a folder's prints its own; as of those that come here.
GEAR_MASS: Final = (0.05, 0.15)
#: Motor by which a gear's sheet is converted: none of the gear's numbers depends on it.
_ANY: Final = {
    **dict.fromkeys(("current_of", "resistance_of", "torque_constant", "resistance"), 1.0),
    **dict.fromkeys(("supply_voltage", "continuous_current", "peak_current", "rotor_inertia"), 1.0),
    **dict.fromkeys(("back_drive_torque", "shaft"), 0.0),
}
Drawn = Mapping[tuple[str, str], float]


@dataclass(frozen=True, eq=False)
class Designs:
    """D designs; arrays (D,), SI, at the motor's shaft where nothing else is said.

    Attributes:
        parts: Names of motor, gear and brake of each; empty for none.
        ratio: n [1].
        load: c, friction per transmitted torque [1].
        coulomb: Dry friction [N*m].
        viscous: [N*m*s/rad].
        inertia: [kg*m^2].
        torque_constant: k [N*m/A].
        resistance: R [ohm].
        voltage: Of the supply [V].
        continuous_current: [A].
        peak_current: [A].
        max_speed: Of the motor [rad/s].
        gear_speed: Of the gear's input, at most [rad/s].
        gear_continuous: At its output, root mean square [N*m].
        gear_peak: At its output [N*m].
        brake_torque: With which the brake holds; 0 for none [N*m].
        brake_power: That keeps it open [W].
        mass: Of motor, gear and brake [kg].
    """

    parts: tuple[tuple[str, str, str], ...]
    ratio: Array
    load: Array
    coulomb: Array
    viscous: Array
    inertia: Array
    torque_constant: Array
    resistance: Array
    voltage: Array
    continuous_current: Array
    peak_current: Array
    max_speed: Array
    gear_speed: Array
    gear_continuous: Array
    gear_peak: Array
    brake_torque: Array
    brake_power: Array
    mass: Array

    def __len__(self) -> int:
        return len(self.parts)

    def taken(self, which: NDArray[np.intp]) -> Designs:
        """Those of these numbers."""
        arrays = {f.name: getattr(self, f.name)[which] for f in fields(self)[1:]}
        return Designs(tuple(self.parts[i] for i in which), **arrays)

    @classmethod
    def together(cls, some: Sequence[Designs]) -> Designs:
        """Several in a row."""
        parts = tuple(row for one in some for row in one.parts)
        names = [f.name for f in fields(cls)[1:]]
        return cls(parts, **{n: np.concatenate([getattr(d, n) for d in some]) for n in names})

    @property
    def theta(self) -> Array:
        """Coefficients of the five series in the motor's torque, (D, 5); see `search`."""
        n = self.ratio
        columns = (1 / n, self.load / n, self.coulomb, self.viscous * n, self.inertia * n)
        return np.stack(columns, axis=1)

    def locks(self, engaged: bool) -> NDArray[np.bool_]:
        """Whether gear or brake hold what pushes from outside, (D,); then a driver may be off.

        Args:
            engaged: Whether brakes are closed.
        """
        return np.asarray((self.load >= 1.0) | ((self.brake_torque > 0.0) & engaged))

    def chain(self, i: int, *, engaged: bool = True) -> Chain:
        """One design as a chain.

        Args:
            i: Its number.
            engaged: Whether its brake holds at standstill; open it draws its power there, too.
        """
        ratio, load = float(self.ratio[i]), float(self.load[i])
        gear: tuple[Element, ...] = (Ratio(name="transmission", ratio=ratio),)
        if load >= 1.0:
            gear = (
                Hypoid(name="transmission", ratio=ratio, pinion_angle=np.pi / 4, friction=load),
            )
            load = 0.0
        elements: tuple[Element, ...] = (
            *gear,
            Friction(
                name="friction",
                coulomb=self.coulomb[i],
                load=load,
                viscous=self.viscous[i],
            ),
        )
        if self.brake_power[i]:
            power = float(self.brake_power[i])
            held = (float(self.brake_torque[i]), power, 0.0) if engaged else (0.0, power, power)
            elements += (HoldingBrake("brake", *held),)
        elements += (Inertia(name="rotor", inertia=self.inertia[i]),)
        motor = DCMotor(
            WINDING,
            self.torque_constant[i],
            self.resistance[i],
            self.max_speed[i],
            self.voltage[i],
            self.continuous_current[i],
            self.peak_current[i],
        )
        name = " + ".join(part for part in self.parts[i] if part)
        return Chain(name, elements, motor, MappingProxyType({"m": "rotor"}))


@dataclass(frozen=True)
class Shelf:
    """Parts that designs are made of, and what is known of each.

    Attributes:
        parts: By name.
        numbers: Part to its entries; what it does not print is a range of its class.
    """

    parts: Mapping[str, Part]
    numbers: Mapping[str, Mapping[str, Number]]

    @classmethod
    def of(cls, parts: Mapping[str, Part]) -> Shelf:
        """The motors, gears and brakes among parts; a mass that no sheet prints is filled in."""
        sized = [
            part.printed["mass"].value / part.printed["gear_continuous_torque"].value ** (2 / 3)
            for part in parts.values()
            if part.kind in GEARS and {"mass", "gear_continuous_torque"} <= part.printed.keys()
        ]
        low, high = np.quantile(sized, [0.1, 0.9]).tolist() if sized else GEAR_MASS
        numbers = {}
        for name, part in parts.items():
            own = _sheet(part) if part.kind == "motor" else dict(part.printed)
            if part.kind in GEARS and "mass" not in own:
                torque = own.get("gear_continuous_torque", own.get("gear_rated_torque"))
                size = torque.value ** (2 / 3) if torque else 1.0
                own["mass"] = _range(low * size, high * size, "kg")
            elif part.kind == "brake" and "mass" not in own:
                size = own["holding_torque"].value ** (2 / 3)
                own["mass"] = _range(BRAKE_MASS[0] * size, BRAKE_MASS[1] * size, "kg")
            numbers[name] = own
        return cls(parts, numbers)

    def unknown(self, design: Sequence[str]) -> Iterator[tuple[str, str, Number]]:
        """Part, entry and range of what no sheet of a design prints."""
        for part in design:
            for entry, number in self.numbers.get(part, {}).items():
                if number.low < number.high:
                    yield part, entry, number

    def not_printed(self, design: Sequence[str]) -> str:
        """The same in words."""
        return ", ".join(f"{part}.{entry}" for part, entry, _ in self.unknown(design))

    def designs(
        self, combinations: Sequence[tuple[str, str, str]], drawn: Drawn | None = None
    ) -> Designs:
        """Their numbers.

        Args:
            combinations: Motor, gear and brake of each; empty for none.
            drawn: Entries that differ from the middle of their range, by part and entry.
        """
        names = {name for row in combinations for name in row if name}
        known = {name: self._converted(name, drawn or {}) for name in names}
        none = dict.fromkeys((f.name for f in fields(Designs)[1:]), 0.0)
        none |= {"gear_speed": np.inf, "gear_continuous": np.inf, "gear_peak": np.inf}
        none |= {"ratio": 1.0}
        columns = [[known.get(row[k], none) for row in combinations] for k in range(3)]
        motor, gear, brake = (
            {key: np.array([x[key] for x in rows], dtype=np.float64) for key in none}
            for rows in columns
        )
        own = motor["ratio"] * gear["ratio"]
        return Designs(
            tuple(combinations),
            ratio=own,
            load=motor["load"] + gear["load"],
            coulomb=motor["coulomb"] + gear["coulomb"],
            viscous=motor["viscous"] + gear["viscous"],
            inertia=motor["inertia"] + gear["inertia"] + brake["inertia"],
            gear_speed=gear["gear_speed"],
            gear_continuous=np.minimum(gear["gear_continuous"], motor["gear_continuous"]),
            gear_peak=np.minimum(gear["gear_peak"], motor["gear_peak"]),
            brake_torque=brake["brake_torque"],
            brake_power=brake["brake_power"],
            mass=motor["mass"] + gear["mass"] + brake["mass"],
            **{
                key: motor[key]
                for key in (
                    *("torque_constant", "resistance", "voltage", "continuous_current"),
                    *("peak_current", "max_speed"),
                )
            },
        )

    def _converted(self, name: str, drawn: Drawn) -> dict[str, float]:
        """One part's numbers by the names of `Designs`."""
        kind = self.parts[name].kind
        x = {e: drawn.get((name, e), number.value) for e, number in self.numbers[name].items()}
        out = dict.fromkeys((f.name for f in fields(Designs)[1:]), 0.0) | {"ratio": 1.0}
        out |= dict.fromkeys(("gear_speed", "gear_continuous", "gear_peak"), np.inf)
        out["mass"] = x.get("mass", 0.0)
        if kind == "brake":
            out |= {"brake_torque": x["holding_torque"], "brake_power": x["release_power"]}
            return out | {"inertia": x.get("inertia", 0.0)}
        sheet = x if kind == "motor" else _ANY | x
        found = {key: value for key, (value, _) in converted(sheet).items()}
        for law in ("load", "coulomb", "viscous", "inertia"):
            out[law] = found.get(f"gear.{law}", 0.0)
        out["ratio"] = found["gear.ratio"]
        if kind != "motor":
            out["gear_speed"] = x.get("gear_max_speed", np.inf)
            out["gear_continuous"] = x.get("gear_continuous_torque", np.inf)
            out["gear_peak"] = x.get("gear_peak_torque", out["gear_continuous"])
            return out
        for law in ("coulomb", "viscous", "inertia"):
            out[law] += found.get(f"rotor.{law}", 0.0)
        for key in ("torque_constant", "resistance", "continuous_current", "max_speed"):
            out[key] = found[f"motor.{key}"]
        out["peak_current"] = max(found["motor.peak_current"], out["continuous_current"])
        return out | {"voltage": found["motor.supply_voltage"]}


def combinations(
    shelf: Shelf, *, brakes: bool = True, voltage: float | None = None
) -> list[tuple[str, str, str]]:
    """Every compatible motor, gear and brake.

    Args:
        shelf: The parts.
        brakes: Whether designs with a brake are among them; a gear that locks needs none.
        voltage: Of the robot's supply: motors for less are left out [V]; None for any.

    Raises:
        ChoiceError: No motor is left.
    """
    by: dict[str, list[str]] = {}
    for name, part in shelf.parts.items():
        kind = "gear" if part.kind in GEARS else part.kind
        if kind == "gear" and shelf.numbers[name]["gear_ratio"].value == 1.0:
            continue  # a screw: what lever it has at a joint, no sheet says
        by.setdefault(kind, []).append(name)
    motors = [
        name
        for name in by.get("motor", [])
        if voltage is None or shelf.numbers[name]["supply_voltage"].value >= 0.999 * voltage
    ]
    if not motors:
        raise ChoiceError("no motor is left: widen --only, --without, --kind or --voltage")
    none = [""]
    held = [*none, *(by.get("brake", []) if brakes else [])]
    out = []
    for motor in motors:
        geared = shelf.numbers[motor]["gear_ratio"].value != 1.0
        for gear in none if geared else [*none, *by.get("gear", [])]:
            locks = gear and shelf.parts[gear].kind == "self_locking"
            out += [(motor, gear, brake) for brake in (none if locks else held)]
    return out


def _range(low: float, high: float, unit: str) -> Number:
    return Number(0.5 * (low + high), low, high, unit, f"{low:.3g} to {high:.3g} {unit}")


def _sheet(part: Part) -> dict[str, Number]:
    """A motor's entries with what follows without being said."""
    words = {name: text for name, text in part.words.items() if name in ENTRIES}
    try:
        return dict(read_sheet({"gear_ratio": "1"} | words))
    except DataSheetError as error:
        raise ChoiceError(f"motor/{part.name}.toml: {error}") from None
