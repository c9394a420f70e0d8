"""One finding of a whole machine before it is held against the log."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from pipeline.effects.registry import effect_named
from pipeline.identification import results as limits
from pipeline.identification.results import Estimate, Found, Member

NAN: Final = float("nan")


@dataclass(frozen=True)
class Told:
    """One finding before it is held against the log.

    Attributes:
        effect: Name.
        law: Which of its laws.
        reason: Why it is not confirmed.
        members: Where, with estimates.
        rivals: Effects at places that explain the log as well.
    """

    effect: str
    law: str
    reason: str
    members: tuple[Member, ...]
    rivals: tuple[tuple[str, tuple[str, ...]], ...] = ()

    def found(self, order: int, unit: str) -> Found:
        """As something found, its proof still open."""
        levels = {m.level for m in self.members}
        level = limits.CONFIRMED if levels == {limits.CONFIRMED} else limits.APPROXIMATE
        one = self.members[0]
        several = len(self.members) > 1
        return Found(
            order=order,
            effect=self.effect,
            place=tuple(p for m in self.members for p in m.place),
            parameters=() if several else one.parameters,
            rivals=self.rivals,
            valid_before=NAN,
            valid_after=NAN,
            unit=unit,
            noise_floor=NAN,
            excitation=effect_named(self.effect).excitation,
            level=level if levels != {limits.SUSPECTED} else limits.SUSPECTED,
            reason=self.reason if level != limits.CONFIRMED else "",
            share=min(m.share for m in self.members),
            law=self.law,
            members=self.members if several else (),
        )


def estimate(
    name: str, value: float, half: float, unit: str, low: float = -1e6, high: float = 1e6
) -> Estimate:
    """A value with half of its interval, inside bounds."""
    value = float(value)
    return Estimate(name, value, max(value - half, low), min(value + half, high), unit)


def exact(name: str, value: float, unit: str = "rad/s") -> Estimate:
    """A value without an interval."""
    return Estimate(name, float(value), float(value), float(value), unit)
