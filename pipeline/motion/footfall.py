"""Footfall: which legs stand when, from phase and duty factor, by name or as the user's own.

A leg touches down at its phase and stands for its duty factor, both shares of the period. The wave
gaits are those of Song and Waldron ("Machines That Walk", MIT Press 1989): a leg touches down when
the one in front of it on its side lifts off, and the two sides are half a period apart.

Shapes of a foot's path through the air between lift-off and touch-down. The paper gives stroke and
lift (Table II) but not the shape, so it is a named option. Every shape starts and ends with zero
velocity relative to the ground.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Final

import numpy as np

from actuators.arrays import Array
from actuators.errors import LegwattError, closest, one_line
from pipeline.robot.robot_file import LegSpec

LEAST_FEET = 3
#: Name of the user's own phases.
OWN = "own"
#: Shares of a period closer than this are one event.
_SAME = 1e-9


@dataclass(frozen=True)
class Footfall:
    """Phases and duty factors of all legs."""

    name: str  #: Of the gait.
    #: Leg to its touch-down as a share of the period, in [0, 1); legs that stand together are
    #: reported in this order.
    phase: Mapping[str, float]
    #: Leg to the share of the period for which it stands, between 0 and 1.
    duty: Mapping[str, float]
    #: Feet that stand at any time, at least: three, or two where the body may rock.
    least: int = LEAST_FEET

    def since(self, leg: str, share: float, *, stood: bool) -> float:
        """Share of the period since a leg's touch-down, or its lift-off where it did not stand."""
        event = self.phase[leg] if stood else self.phase[leg] + self.duty[leg]
        passed = (share - event) % 1.0
        return 0.0 if passed > 1 - _SAME else passed

    def stands(self, leg: str, share: float) -> bool:
        """Whether a leg stands at a share of the period."""
        return self.since(leg, share, stood=True) < self.duty[leg] - _SAME

    def stances(self) -> list[tuple[float, float, tuple[str, ...]]]:
        """Stretches of the period in which the same legs stand: start, end, legs.

        The first starts at 0; the last ends at 1.

        Raises:
            LegwattError: Fewer legs than `least` stand in one of them.
        """
        events = {0.0, 1.0}
        for leg, phase in self.phase.items():
            for event in (phase, phase + self.duty[leg]):
                share = event % 1.0
                if all(abs(share - known) > _SAME for known in events):
                    events.add(share)
        out: list[tuple[float, float, tuple[str, ...]]] = []
        for start, end in pairwise(sorted(events)):
            middle = (start + end) / 2
            stance = tuple(leg for leg in self.phase if self.stands(leg, middle))
            if len(stance) < self.least:
                if len(self.phase) == self.least == LEAST_FEET:
                    raise LegwattError(
                        f"gait '{self.name}': none of {LEAST_FEET} legs can be lifted, a static "
                        f"gait needs {LEAST_FEET} feet on the ground; `stand` has an answer"
                    )
                raise LegwattError(
                    f"gait '{self.name}': from {100 * start:.4g} % to {100 * end:.4g} % of the "
                    f"period only {len(stance)} feet stand ({', '.join(stance) or 'none'}); a "
                    f"static gait needs {self.least}; raise gait.duty_factor or change gait.phase"
                )
            if out and out[-1][2] == stance:
                out[-1] = (out[-1][0], end, stance)
            else:
                out.append((start, end, stance))
        return out


def _sides(legs: Sequence[LegSpec]) -> tuple[list[str], list[str]]:
    """Legs of the left and of the right side, front to rear."""
    ordered = sorted(legs, key=lambda leg: -leg.neutral_foot[0])  # stable: file order where equal
    left = [leg.name for leg in ordered if leg.side == "left"]
    return left, [leg.name for leg in ordered if leg.side != "left"]


def wave(legs: Sequence[LegSpec], duty: float) -> dict[str, float]:
    """Phases of the wave gait: k duty on the left, 1/2 + k duty on the right, k from the front."""
    left, right = _sides(legs)
    phase = {leg: (k * duty) % 1.0 for k, leg in enumerate(left)}
    return phase | {leg: (0.5 + k * duty) % 1.0 for k, leg in enumerate(right)}


def _tripod(legs: Sequence[LegSpec], duty: float) -> dict[str, float]:
    del duty
    left, right = _sides(legs)
    first, second = [*left[0::2], *right[1::2]], [*right[0::2], *left[1::2]]
    return dict.fromkeys(first, 0.0) | dict.fromkeys(second, 0.5)


def _tetrapod(legs: Sequence[LegSpec], duty: float) -> dict[str, float]:
    """Pairs of legs swing in turn, a left one with the right one before it."""
    del duty
    left, right = _sides(legs)
    n = len(left)
    phase = {leg: (-k / n) % 1.0 for k, leg in enumerate(left)}
    return phase | {leg: (-(k + 1) / n) % 1.0 for k, leg in enumerate(right)}


@dataclass(frozen=True)
class NamedGait:
    """A gait known by name."""

    name: str  #: How robot file and command line call it.
    legs: int | None  #: Number of legs it is defined for; None for any.
    duty: Callable[[int], float]  #: Duty factor where none is stated, from the number of legs.
    #: Phases from the legs and the duty factor.
    phase: Callable[[Sequence[LegSpec], float], dict[str, float]]
    meaning: str  #: In words.


GAITS: dict[str, NamedGait] = {
    gait.name: gait
    for gait in (
        NamedGait("tripod", 6, lambda n: 1 / 2, _tripod, "two sets of three legs swing in turn"),
        NamedGait("tetrapod", 6, lambda n: 2 / 3, _tetrapod, "three pairs of legs swing in turn"),
        NamedGait("ripple", 6, lambda n: 2 / 3, wave, "waves on both sides overlap by half"),
        NamedGait("crawl", 4, lambda n: 5 / 6, wave, "one leg swings, then all four stand"),
        NamedGait("wave", None, lambda n: 1 - 1 / n, wave, "legs swing from the rear forward"),
    )
}


#: Gaits that stand on two feet or fewer for a part of the period, or fly.
DYNAMIC_GAITS: Final = frozenset(
    {
        *("trot", "flying_trot", "walking_trot", "pace", "amble", "bound", "half_bound", "pronk"),
        *("gallop", "canter", "jump", "hop", "run"),
    }
)


def known_gait(name: object) -> str:
    """The name of a gait of `GAITS`.

    Raises:
        LegwattError: It is none; says whether it is a dynamic one, or which one was meant.
    """
    words = one_line(name)
    if not isinstance(name, str):
        raise LegwattError(f"{words}: expected the name of a gait: {', '.join(sorted(GAITS))}")
    if name in GAITS:
        return name
    if re.sub(r"[\s-]+", "_", words.strip().lower()) in DYNAMIC_GAITS:
        raise LegwattError(
            f"{words} is a dynamic gait: at times fewer than {LEAST_FEET} feet stand, and every "
            f"gait here is statically stable; known: {', '.join(sorted(GAITS))}"
        )
    raise LegwattError(f"{words}: {closest(words, list(GAITS))}")


def named(name: str, legs: Sequence[LegSpec], duty: float | None) -> Footfall:
    """A gait by name.

    `name`: one of `GAITS`. `duty`: duty factor of every leg; the gait's own by default.

    Raises:
        LegwattError: No gait of that name, or none for this number of legs.
    """
    gait = GAITS[known_gait(name)]
    if gait.legs is not None and len(legs) != gait.legs:
        fit = [g.name for g in GAITS.values() if g.legs in (None, len(legs))]
        raise LegwattError(
            f"gait.name = '{name}' is for {gait.legs} legs, the robot has {len(legs)}; "
            f"for these: {', '.join(fit)}, or phases of your own (gait.phase)"
        )
    share = gait.duty(len(legs)) if duty is None else duty
    return Footfall(name, gait.phase(legs, share), {leg.name: share for leg in legs})


def in_turn(sets: Sequence[Sequence[str]], duty: float | None, name: str) -> Footfall:
    """Sets of legs that swing one after another, each for its share of the period.

    `sets`: every leg once; at least two sets. The first touches down at the period's start. `duty`:
    duty factor of every leg; by default one set is in the air at any time.
    """
    n = len(sets)
    share = 1 - 1 / n if duty is None else duty
    phase = {leg: k / n for k, legs in enumerate(sets) for leg in legs}
    return Footfall(name, phase, dict.fromkeys(phase, share))


def own(phase: Mapping[str, float], duty: Mapping[str, float]) -> Footfall:
    """The user's own phases (of any size: whole periods are dropped) and duty factors."""
    return Footfall(OWN, {leg: float(np.mod(p, 1.0)) for leg, p in phase.items()}, dict(duty))


#: value, first and second derivative with respect to the phase, each (N,)
Profile = tuple[Array, Array, Array]


@dataclass(frozen=True)
class TransferPath:
    """One shape of the transfer."""

    name: str  #: How the robot file and the command line call it.
    #: Phase in [0, 1], shape (N,), to progress over ground from 0 to 1 with derivatives.
    advance: Callable[[Array], Profile]
    #: Phase to height from 0 over 1 (at phase 0.5) back to 0 with derivatives.
    lift: Callable[[Array], Profile]


def _quartic_lift(s: Array) -> Profile:
    u = s * (1 - s)
    du = 1 - 2 * s
    return 16 * u * u, 32 * u * du, 32 * (du * du - 2 * u)


def _quintic_advance(s: Array) -> Profile:
    u = s * (1 - s)
    return s**3 * (10 - 15 * s + 6 * s * s), 30 * u * u, 60 * u * (1 - 2 * s)


def _sextic_lift(s: Array) -> Profile:
    u = s * (1 - s)
    du = 1 - 2 * s
    return 64 * u**3, 192 * u * u * du, 384 * u * (du * du - u)


def _harmonic(s: Array, w: float) -> Profile:
    return (1 - np.cos(w * s)) / 2, w * np.sin(w * s) / 2, w * w * np.cos(w * s) / 2


def _cycloid_advance(s: Array) -> Profile:
    w = 2 * np.pi
    return s - np.sin(w * s) / w, 1 - np.cos(w * s), w * np.sin(w * s)


TRANSFER_PATHS: dict[str, TransferPath] = {
    path.name: path
    for path in (
        TransferPath(
            "cubic", lambda s: (s * s * (3 - 2 * s), 6 * s * (1 - s), 6 - 12 * s), _quartic_lift
        ),
        TransferPath("harmonic", partial(_harmonic, w=np.pi), partial(_harmonic, w=2 * np.pi)),
        TransferPath("quintic", _quintic_advance, _sextic_lift),
        TransferPath("cycloid", _cycloid_advance, partial(_harmonic, w=2 * np.pi)),
    )
}


def transfer_path(name: str) -> TransferPath:
    """Look a shape up by name.

    Raises:
        LegwattError: If there is no shape of that name.
    """
    try:
        return TRANSFER_PATHS[name]
    except KeyError:
        raise LegwattError(
            f"transfer path '{one_line(name)}' is not known; {closest(name, list(TRANSFER_PATHS))}"
        ) from None
