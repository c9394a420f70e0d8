"""Which legs stand when, and how a foot goes through the air: gaits and paths by name.

A leg touches down at its phase and stands for the duty factor, both shares of the period. The wave
gaits are those of Song and Waldron ("Machines That Walk", MIT Press 1989): a leg touches down when
the one in front of it on its side lifts off, and the two sides are half a period apart.

The paper gives stroke and lift (Table II) but not the shape of a foot's path through the air, so it
is a named option. Every path starts and ends with zero velocity relative to the ground.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.polynomial import Polynomial

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.robot.robot_file import LegSpec

LEAST_FEET: Final = 3
#: Shares of a period closer than this are one event.
_SAME: Final = 1e-9


@dataclass(frozen=True)
class Footfall:
    """Phases of all legs, and their duty factor."""

    name: str  #: Of the gait.
    #: Leg to its touch-down as a share of the period, in [0, 1).
    phase: Mapping[str, float]
    duty: float  #: Share of the period for which a leg stands, between 0 and 1.
    #: Feet that stand at any time, at least: three, or two where the body may rock.
    least: int = LEAST_FEET

    def since(self, leg: str, share: float, *, stood: bool) -> float:
        """Share of the period since a leg's touch-down, or its lift-off where it did not stand."""
        event = self.phase[leg] if stood else self.phase[leg] + self.duty
        passed = (share - event) % 1.0
        return 0.0 if passed > 1 - _SAME else passed

    def stands(self, leg: str, share: float) -> bool:
        """Whether a leg stands at a share of the period."""
        return self.since(leg, share, stood=True) < self.duty - _SAME

    def stances(self) -> list[tuple[float, float, tuple[str, ...]]]:
        """Stretches of the period, from 0 to 1, in which the same legs stand: start, end, legs.

        Raises:
            LegwattError: Fewer legs than `least` stand in one of them.
        """
        events = [0.0, 1.0]
        for phase in self.phase.values():
            for share in (phase % 1.0, (phase + self.duty) % 1.0):
                if all(abs(share - known) > _SAME for known in events):
                    events.append(share)
        out: list[tuple[float, float, tuple[str, ...]]] = []
        for start, end in pairwise(sorted(events)):
            stance = tuple(leg for leg in self.phase if self.stands(leg, (start + end) / 2))
            if len(stance) < self.least:
                raise LegwattError(
                    f"gait '{self.name}': from {100 * start:.4g} % to {100 * end:.4g} % of the "
                    f"period only {len(stance)} feet stand ({', '.join(stance) or 'none'}), "
                    f"{self.least} are needed; raise gait.duty_factor or change gait.phase"
                )
            if out and out[-1][2] == stance:
                start = out.pop()[0]
            out.append((start, end, stance))
        return out


def _sides(legs: Sequence[LegSpec]) -> tuple[list[str], list[str]]:
    """Legs of the left and of the right side, front to rear."""
    ordered = sorted(legs, key=lambda leg: -leg.neutral_foot[0])  # stable: file order where equal
    left = [leg.name for leg in ordered if leg.side == "left"]
    return left, [leg.name for leg in ordered if leg.side != "left"]


def wave(legs: Sequence[LegSpec], duty: float) -> dict[str, float]:
    """Phases of the wave gait: k duty on the left, 1/2 + k duty on the right, k from the front."""
    return {
        leg: (first + k * duty) % 1.0
        for first, side in zip((0.0, 0.5), _sides(legs), strict=True)
        for k, leg in enumerate(side)
    }


def _tripod(legs: Sequence[LegSpec], duty: float) -> dict[str, float]:
    left, right = _sides(legs)
    first, second = [*left[0::2], *right[1::2]], [*right[0::2], *left[1::2]]
    return dict.fromkeys(first, 0.0) | dict.fromkeys(second, 0.5)


def _tetrapod(legs: Sequence[LegSpec], duty: float) -> dict[str, float]:
    """Pairs of legs swing in turn, a left one with the right one before it."""
    return {
        leg: (-(k + ahead) / len(side)) % 1.0
        for ahead, side in enumerate(_sides(legs))
        for k, leg in enumerate(side)
    }


#: From legs and duty factor.
Phases = Callable[[Sequence[LegSpec], float], dict[str, float]]
#: Number of legs (None for any), usual duty factor of so many, phases.
GAITS: dict[str, tuple[int | None, Callable[[int], float], Phases]] = {
    "tripod": (6, lambda n: 1 / 2, _tripod),  # two sets of three legs swing in turn
    "tetrapod": (6, lambda n: 2 / 3, _tetrapod),  # three pairs of legs swing in turn
    "ripple": (6, lambda n: 2 / 3, wave),  # waves on both sides overlap by half
    "crawl": (4, lambda n: 5 / 6, wave),  # one leg swings, then all four stand
    "wave": (None, lambda n: 1 - 1 / n, wave),  # legs swing from the rear forward
}


#: Of the share of the transfer that has passed, shape (N,): the value with its first and second
#: derivative, shape (3, N).
Profile = Callable[[Array], Array]


def _polynomial(*coefficients: float) -> Profile:
    """A polynomial, the constant first."""
    value = Polynomial(coefficients)
    parts = (value, value.deriv(), value.deriv(2))
    return lambda s: np.stack([part(s) for part in parts])


def _cosine(rate: float) -> Profile:
    """(1 - cos(rate s)) / 2."""
    w = rate
    return lambda s: np.stack([1 - np.cos(w * s), w * np.sin(w * s), w * w * np.cos(w * s)]) / 2


def _cycloid(s: Array) -> Array:
    w = 2 * np.pi
    return np.stack([s - np.sin(w * s) / w, 1 - np.cos(w * s), w * np.sin(w * s)])


_UP_AND_DOWN: Final = _cosine(2 * np.pi)
_SEXTIC: Final = _polynomial(0, 0, 0, 64, -192, 192, -64)  # 64 s^3 (1 - s)^3
#: Progress over the ground, from 0 to 1, and height, from 0 over 1 in the middle back to 0.
TRANSFER_PATHS: dict[str, tuple[Profile, Profile]] = {
    "cubic": (_polynomial(0, 0, 3, -2), _polynomial(0, 0, 16, -32, 16)),
    "harmonic": (_cosine(np.pi), _UP_AND_DOWN),
    "quintic": (_polynomial(0, 0, 0, 10, -15, 6), _SEXTIC),
    "cycloid": (_cycloid, _UP_AND_DOWN),
}
