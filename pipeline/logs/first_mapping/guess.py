"""From names and numbers to one guess per column, with its reason and what else it may be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from actuators.arrays import Array
from pipeline.logs.first_mapping.names import Named, assign
from pipeline.logs.first_mapping.numbers import (
    ANGLES,
    DERIVATIVE,
    NO_DERIVATIVE,
    Follows,
    angle_units,
    follows,
    mean_of,
    rate_of,
)
from pipeline.logs.reading.expected import Expected
from pipeline.logs.reading.log import SUPPLY

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


@dataclass
class _Seen:
    """Columns on their way to guesses, by name."""

    named: dict[str, Named]
    data: Mapping[str, Array]
    time: Array
    rates: dict[str, Array] = field(default_factory=dict)
    why: dict[str, str] = field(default_factory=dict)

    def of(self, *quantities: str) -> list[str]:
        return [c for c, n in self.named.items() if n.quantity in quantities]

    def change(self, column: str, why: str, quantity: str, joint: str) -> None:
        self.named[column] = replace(self.named[column], quantity=quantity, joint=joint)
        self.why[column] = why

    def position_of(self, joint: str) -> str:
        own = [c for c in self.of(*POSITIONS) if self.named[c].joint == joint]
        return own[0] if own else ""


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
    seen = _Seen({n.column: n for n in names if n.column in data}, data, time)
    seen.rates = {c: rate_of(time, data[c]) for c in seen.of(*POSITIONS)}
    moved = {c: _pair(seen, c) for c in [*seen.of("velocity"), *seen.of("")]}
    _positions_of_velocities(seen)
    owners = list(dict.fromkeys(seen.named[c].joint for c in seen.of(*POSITIONS)))
    _called_otherwise(seen, owners)
    if expected is None:
        assigned, by = {o: _own_name(o) for o in owners}, "as the log calls it"
    else:
        assigned, by = assign(owners, expected.joints)
    ratios: dict[str, float] = {}
    out: list[Guess] = []
    units: dict[str, str] = {}
    for column in seen.of(*POSITIONS):
        follower = next((f for f in moved.values() if f and f.position == column), None)
        guess = _position(seen, column, assigned, expected, follower, ratios)
        units[seen.named[column].joint] = guess.unit
        out.append(guess)
    for column, named in seen.named.items():
        if named.quantity not in ("", *SUPPLY, *POSITIONS):
            out.append(_other(seen, column, assigned, expected, units, moved.get(column), ratios))
    return out, ratios, by


def _own_name(owner: str) -> str:
    return owner if owner and not owner[0].isdigit() else f"joint_{owner}".rstrip("_")


def _pair(seen: _Seen, column: str) -> Follows | None:
    """The position whose derivative a column is; its joint is that position's."""
    found = follows(mean_of(seen.time, seen.data[column]), seen.rates)
    if not found:
        return None
    named, best = seen.named[column], found[0]
    own = next((f for f in found if f.position == seen.position_of(named.joint)), None)
    if named.quantity == "velocity" and own and abs(own.correlation) >= NO_DERIVATIVE:
        return own
    if abs(best.correlation) < DERIVATIVE:
        if named.quantity == "velocity" and own:
            seen.why[column] = f"but it is no derivative of {own.position}: look at it"
        return None
    if named.quantity == "" and seen.named[best.position].quantity == "":
        return None
    joint = seen.named[best.position].joint
    why = f"it is the derivative of {best.position} (correlation {best.correlation:.2f})"
    seen.change(column, why, "velocity", joint)
    return best


def _positions_of_velocities(seen: _Seen) -> None:
    """Unnamed columns whose derivative is a velocity that has no position."""
    lonely = {
        c: mean_of(seen.time, seen.data[c])
        for c in seen.of("velocity")
        if not seen.position_of(seen.named[c].joint)
    }
    for column in seen.of(""):
        found = follows(rate_of(seen.time, seen.data[column]), lonely)
        if found and abs(found[0].correlation) >= DERIVATIVE:
            other = found[0].position
            seen.change(column, f"{other} is its derivative", "position", seen.named[other].joint)
            seen.rates[column] = rate_of(seen.time, seen.data[column])


def _called_otherwise(seen: _Seen, owners: Sequence[str]) -> None:
    """Joints that other quantities call by other names than positions do: `enc 1`, `motor 1 A`."""
    for quantity in {n.quantity for n in seen.named.values()} - {"", *SUPPLY, *POSITIONS}:
        columns = seen.of(quantity)
        own = list(dict.fromkeys(seen.named[c].joint for c in columns))
        if owners and not {*own} <= {*owners}:
            assigned, _ = assign(own, owners)
            for column in columns:
                named = seen.named[column]
                seen.named[column] = replace(named, joint=assigned.get(named.joint, named.joint))


def _limits(joint: str, expected: Expected | None) -> tuple[float, float]:
    if expected is None or joint not in expected.joints:
        return -np.inf, np.inf
    k = expected.joints.index(joint)
    return float(expected.lower[k]), float(expected.upper[k])


def _position(
    seen: _Seen,
    column: str,
    assigned: Mapping[str, str],
    expected: Expected | None,
    velocity: Follows | None,
    ratios: dict[str, float],
) -> Guess:
    named, x = seen.named[column], seen.data[column]
    joint = assigned.get(named.joint, "")
    why = seen.why.get(column, "")
    if not joint:
        text = f"no joint of {expected.robot if expected else 'the log'} is called so: put its name"
        return Guess(column, named.quantity, "JOINT", named.unit, text, sure=False)
    if named.unit:
        return Guess(column, named.quantity, joint, named.unit, why or "unit as stated")
    fits = angle_units(x, *_limits(joint, expected))
    span = f"from {np.nanmin(x):.4g} to {np.nanmax(x):.4g}"
    where = "the joint's limits" if np.isfinite(_limits(joint, expected)[0]) else "a joint's turn"
    if named.quantity == "motor_position":
        return Guess(column, "motor_position", joint, "", f"{span}; named of a motor")
    both = (("position", "deg", "in degrees"), ("motor_position", "rad", "at the motor"))
    if velocity:
        own = next((c for c in seen.of("velocity") if seen.named[c].joint == named.joint), column)
        agree = [u for u in fits if velocity.units(u, seen.named[own].unit)]
        ratio = velocity.factor / velocity.of(seen.named[own].unit)
        if not agree and abs(ratio) > _GEARED:
            ratios[joint] = float(f"{ratio:.4g}")
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
        return Guess(column, "position", joint, "", why or f"{span}, within {where}", others=others)
    text = f"{span}: neither radians nor degrees within {where}; counts of an encoder?"
    return Guess(column, "position", joint, "rad", text, sure=False, others=both)


def _other(
    seen: _Seen,
    column: str,
    assigned: Mapping[str, str],
    expected: Expected | None,
    units: Mapping[str, str],
    velocity: Follows | None,
    ratios: Mapping[str, float],
) -> Guess:
    """Everything that is no position."""
    named, x = seen.named[column], seen.data[column]
    joint, quantity = assigned.get(named.joint, ""), named.quantity
    if not joint:
        return Guess(
            column, quantity, "JOINT", named.unit, "of no joint with a position", sure=False
        )
    why = seen.why.get(column, f"named a {quantity.replace('_', ' ')}")
    if "no derivative" in why:
        return Guess(column, quantity, joint, named.unit, why, sure=False)
    most = float(np.nanmax(np.abs(x)))
    if named.unit:
        return Guess(column, quantity, joint, named.unit, f"{why}, unit as stated")
    if quantity == "goal_position":
        return Guess(
            column, quantity, joint, units.get(named.joint, ""), f"{why}, unit of the position"
        )
    if quantity == "velocity" and velocity:
        return _velocity(column, joint, units.get(named.joint, ""), velocity, why, ratios)
    if quantity == "current" and current_unit(x):
        others = (("current", "A", "in amperes"),)
        return Guess(column, quantity, joint, "mA", f"{why}; up to {most:.4g}", others=others)
    if quantity == "torque":
        limit = np.inf
        if expected is not None and joint in expected.joints:
            limit = float(expected.effort_limit[expected.joints.index(joint)])
        others = (("current", "A", "the motor's current"),)
        unit = "mN*m" if limit < np.inf and most > _TORQUES * limit else ""
        return Guess(column, quantity, joint, unit, f"{why}; up to {most:.4g}", others=others)
    return Guess(column, quantity, joint, "", why)


def current_unit(x: Array) -> str:
    """Unit of a current that nothing states: milliamperes where amperes would be too many."""
    return "mA" if float(np.nanmax(np.abs(x))) > _AMPERES else ""


def _velocity(
    column: str, joint: str, position: str, seen: Follows, why: str, ratios: Mapping[str, float]
) -> Guess:
    """A velocity by the factor between it and the derivative of its position."""
    if joint in ratios:  # the position is the motor's
        return Guess(column, "velocity", joint, "", f"{why}, of the joint")
    units = seen.units(position or "rad", "")
    text = f"{why}; {seen.position} changes {seen.factor:.4g} times as fast"
    if units:
        return Guess(column, "velocity", joint, units[0].replace("rad/s", ""), text)
    scale = seen.factor * ANGLES[position or "rad"]
    text = f"{text}: the motor's?"
    return Guess(column, "velocity", joint, "1", text, scale=float(f"{scale:.4g}"))
