"""Where the paper contradicts itself: no rotor friction meets every entry of Table V."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from actuators.units import from_si
from pipeline.paper.constants.rotor_friction import (
    Frictions,
    asked_frictions,
    asked_widths,
    best_frictions,
)
from pipeline.paper.published import Published

JOINTS = (2, 3)


@dataclass(frozen=True)
class Contradiction:
    """What Table V asks of the rotor's friction, and what stays unmet at best.

    Attributes:
        asked: Friction by which each motor torque is met, joints 2 and 3 [mN*m].
        widths: Half widths of them, the rounding of Table III included [mN*m].
        best: The frictions that leave the fewest entries of Tables IV to VI unmet.
    """

    asked: tuple[float, float]
    widths: tuple[float, float]
    best: Frictions

    @property
    def apart(self) -> bool:
        """Whether the two torques exclude each other at printed precision."""
        return abs(self.asked[0] - self.asked[1]) > sum(self.widths)


def contradiction(published: Mapping[str, Published], ranges: Sequence[Frictions]) -> Contradiction:
    """The contradiction of the printed values.

    Args:
        published: All of them.
        ranges: From `rotor_friction.friction_ranges` or `stored_ranges`.
    """
    asked, widths = asked_frictions(published), asked_widths(published)
    names = [f"rotor_motor_torque_{joint}" for joint in JOINTS]
    return Contradiction(
        (from_si(asked[names[0]], "mN*m"), from_si(asked[names[1]], "mN*m")),
        (from_si(widths[names[0]], "mN*m"), from_si(widths[names[1]], "mN*m")),
        best_frictions(ranges, published),
    )


def stored_ranges(results: Mapping[str, Any]) -> list[Frictions]:
    """The same, as a calibration stored them."""
    return [
        Frictions(row["low"], row["high"], tuple(row["unmet"])) for row in results["rotor_friction"]
    ]
