"""From names and numbers to one guess per column, with its reason and what else it may be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from actuators.arrays import Array
from pipeline.logs.first_mapping.names import (
    ANGLES,
    DERIVATIVE,
    NO_DERIVATIVE,
    Follows,
    Named,
    angle_units,
    assign,
    follows,
    mean_of,
    rate_of,
)
from pipeline.logs.log_format import Expected

SUPPLY: Final = ("supply", "supply_current", "supply_power")
POSITIONS: Final = ("position", "motor_position")
#: Factor between a position and its velocity beyond which the position is a motor's.
_GEARED: Final = 1.5
#: Beyond this a current is hardly one of amperes.
_AMPERES: Final = 200.0
#: Beyond this share of the joint's limit a torque is hardly one of N*m.
_TORQUES: Final = 30.0


@dataclass(frozen=True)
class Guess:
    """What a column may be."""

    column: str  #: Its name in the file.
    quantity: str  #: Of the log format; empty where it is not known.
    joint: str  #: The robot's name of it, or the log's own without a robot.
    unit: str  #: Of the file; empty for the log format's own.
    why: str  #: By what this was guessed.
    scale: float = 1.0  #: Factor.
    sure: bool = True  #: Whether the line counts; else it is written as a remark.
    #: What it may be instead: quantity, unit, and when.
    others: tuple[tuple[str, str, str], ...] = ()


def guesses(
    names: Sequence[Named], data: Mapping[str, Array], time: Array, expected: Expected | None
) -> tuple[list[Guess], dict[str, float], str]:
    """One guess per column.

    Args:
        names: What the columns' names say.
        data: Their numbers, each shape (N,).
        time: Shape (N,) [s].
        expected: The robot's names and limits, where one is given.

    Returns:
        Guesses, gear ratios that the motion shows by joint, and how joints were recognised.
    """
    seen = _Columns({n.column: n for n in names if n.column in data}, data, time, expected)
    return seen.guesses()


def _own_name(owner: str) -> str:
    return owner if owner and not owner[0].isdigit() else f"joint_{owner}".rstrip("_")


def current_unit(x: Array) -> str:
    """Unit of a current that nothing states: milliamperes where amperes would be too many."""
    return "mA" if float(np.nanmax(np.abs(x))) > _AMPERES else ""


class _Columns:
    """Columns on their way to guesses, by name."""

    def __init__(
        self,
        named: dict[str, Named],
        data: Mapping[str, Array],
        time: Array,
        expected: Expected | None,
    ) -> None:
        self.named, self.data, self.time, self.expected = named, data, time, expected
        self.rates = {c: rate_of(time, data[c]) for c in self.of(*POSITIONS)}
        self.why: dict[str, str] = {}
        self.ratios: dict[str, float] = {}
        self.units: dict[str, str] = {}  # of positions, by what the log calls the joint
        self.assigned: dict[str, str] = {}  # the log's name of a joint to the robot's

    def of(self, *quantities: str) -> list[str]:
        return [c for c, n in self.named.items() if n.quantity in quantities]

    def change(self, column: str, why: str, quantity: str, joint: str) -> None:
        self.named[column] = self.named[column]._replace(quantity=quantity, joint=joint)
        self.why[column] = why

    def position_of(self, joint: str) -> str:
        own = [c for c in self.of(*POSITIONS) if self.named[c].joint == joint]
        return own[0] if own else ""

    def guesses(self) -> tuple[list[Guess], dict[str, float], str]:
        moved = {c: self._pair(c) for c in [*self.of("velocity"), *self.of("")]}
        # Unnamed columns whose derivative is a velocity that has no position.
        lonely = {
            c: mean_of(self.time, self.data[c])
            for c in self.of("velocity")
            if not self.position_of(self.named[c].joint)
        }
        for column in self.of(""):
            found = follows(rate_of(self.time, self.data[column]), lonely)
            if found and abs(found[0].correlation) >= DERIVATIVE:
                other = found[0].position
                self.change(
                    column, f"{other} is its derivative", "position", self.named[other].joint
                )
                self.rates[column] = rate_of(self.time, self.data[column])
        owners = list(dict.fromkeys(self.named[c].joint for c in self.of(*POSITIONS)))
        # Joints that other quantities call otherwise than positions do: `enc 1`, `motor 1 A`.
        for quantity in {n.quantity for n in self.named.values()} - {"", *SUPPLY, *POSITIONS}:
            columns = self.of(quantity)
            own = list(dict.fromkeys(self.named[c].joint for c in columns))
            if owners and not {*own} <= {*owners}:
                called, _ = assign(own, owners)
                for column in columns:
                    named = self.named[column]
                    joint = called.get(named.joint, named.joint)
                    self.named[column] = named._replace(joint=joint)
        if self.expected is None:
            self.assigned, by = {o: _own_name(o) for o in owners}, "as the log calls it"
        else:
            self.assigned, by = assign(owners, self.expected.joints)
        out: list[Guess] = []
        for column in self.of(*POSITIONS):
            follower = next((f for f in moved.values() if f and f.position == column), None)
            out.append(self._position(column, follower))
            self.units[self.named[column].joint] = out[-1].unit
        for column, named in self.named.items():
            if named.quantity not in ("", *SUPPLY, *POSITIONS):
                out.append(self._other(column, moved.get(column)))
        return out, self.ratios, by

    def _pair(self, column: str) -> Follows | None:
        """The position whose derivative a column is; its joint is that position's."""
        found = follows(mean_of(self.time, self.data[column]), self.rates)
        if not found:
            return None
        named, best = self.named[column], found[0]
        own = next((f for f in found if f.position == self.position_of(named.joint)), None)
        if named.quantity == "velocity" and own and abs(own.correlation) >= NO_DERIVATIVE:
            return own
        if abs(best.correlation) < DERIVATIVE:
            if named.quantity == "velocity" and own:
                self.why[column] = f"but it is no derivative of {own.position}: look at it"
            return None
        if named.quantity == "" and self.named[best.position].quantity == "":
            return None
        joint = self.named[best.position].joint
        why = f"it is the derivative of {best.position} (correlation {best.correlation:.2f})"
        self.change(column, why, "velocity", joint)
        return best

    def _limits(self, joint: str) -> tuple[float, float]:
        if self.expected is None or joint not in self.expected.joints:
            return -np.inf, np.inf
        k = self.expected.joints.index(joint)
        return float(self.expected.lower[k]), float(self.expected.upper[k])

    def _position(self, column: str, velocity: Follows | None) -> Guess:
        named, x = self.named[column], self.data[column]
        joint = self.assigned.get(named.joint, "")
        why = self.why.get(column, "")
        if not joint:
            whose = self.expected.robot if self.expected else "the log"
            text = f"no joint of {whose} is called so: put its name"
            return Guess(column, named.quantity, "JOINT", named.unit, text, sure=False)
        if named.unit:
            return Guess(column, named.quantity, joint, named.unit, why or "unit as stated")
        fits = angle_units(x, *self._limits(joint))
        span = f"from {np.nanmin(x):.4g} to {np.nanmax(x):.4g}"
        where = "the joint's limits" if np.isfinite(self._limits(joint)[0]) else "a joint's turn"
        if named.quantity == "motor_position":
            return Guess(column, "motor_position", joint, "", f"{span}; named of a motor")
        both = (("position", "deg", "in degrees"), ("motor_position", "rad", "at the motor"))
        if velocity:
            own = next(
                (c for c in self.of("velocity") if self.named[c].joint == named.joint), column
            )
            agree = [u for u in fits if velocity.units(u, self.named[own].unit)]
            ratio = velocity.factor / velocity.of(self.named[own].unit)
            if not agree and abs(ratio) > _GEARED:
                self.ratios[joint] = float(f"{ratio:.4g}")
                text = f"{span}; moves {ratio:.4g} times as far as its velocity says"
                return Guess(column, "motor_position", joint, "", text, others=both[:1])
            if agree and agree != fits:
                text = f"{span}; changes {velocity.factor:.4g} times as fast as its velocity says"
                return Guess(column, "position", joint, agree[0].replace("rad", ""), text)
        if fits == ["deg"]:
            text = f"{span}, beyond {where} in radians"
            return Guess(column, "position", joint, "deg", text, others=both[1:])
        if fits:
            others = both[:1] if "deg" in fits and np.ptp(x[np.isfinite(x)]) > np.pi else ()
            return Guess(
                column, "position", joint, "", why or f"{span}, within {where}", others=others
            )
        text = f"{span}: neither radians nor degrees within {where}; counts of an encoder?"
        return Guess(column, "position", joint, "rad", text, sure=False, others=both)

    def _other(self, column: str, velocity: Follows | None) -> Guess:
        """Everything that is no position."""
        named, x = self.named[column], self.data[column]
        joint, quantity = self.assigned.get(named.joint, ""), named.quantity
        if not joint:
            return Guess(
                column, quantity, "JOINT", named.unit, "of no joint with a position", sure=False
            )
        why = self.why.get(column, f"named a {quantity.replace('_', ' ')}")
        if "no derivative" in why:
            return Guess(column, quantity, joint, named.unit, why, sure=False)
        most = float(np.nanmax(np.abs(x)))
        if named.unit:
            return Guess(column, quantity, joint, named.unit, f"{why}, unit as stated")
        if quantity == "goal_position":
            why, unit = f"{why}, unit of the position", self.units.get(named.joint, "")
            return Guess(column, quantity, joint, unit, why)
        if quantity == "velocity" and velocity:
            position = self.units.get(named.joint, "")
            # By the factor between it and the derivative of its position.
            if joint in self.ratios:  # the position is the motor's
                return Guess(column, "velocity", joint, "", f"{why}, of the joint")
            units = velocity.units(position or "rad", "")
            text = f"{why}; {velocity.position} changes {velocity.factor:.4g} times as fast"
            if units:
                return Guess(column, "velocity", joint, units[0].replace("rad/s", ""), text)
            scale = velocity.factor * ANGLES[position or "rad"]
            text = f"{text}: the motor's?"
            return Guess(column, "velocity", joint, "1", text, scale=float(f"{scale:.4g}"))
        if quantity == "current" and current_unit(x):
            others = (("current", "A", "in amperes"),)
            return Guess(column, quantity, joint, "mA", f"{why}; up to {most:.4g}", others=others)
        if quantity == "torque":
            limit = np.inf
            if self.expected is not None and joint in self.expected.joints:
                limit = float(self.expected.effort_limit[self.expected.joints.index(joint)])
            others = (("current", "A", "the motor's current"),)
            unit = "mN*m" if limit < np.inf and most > _TORQUES * limit else ""
            return Guess(column, quantity, joint, unit, f"{why}; up to {most:.4g}", others=others)
        return Guess(column, quantity, joint, "", why)
