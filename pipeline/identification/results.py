"""Thresholds and results of naming, in one place.

How often they let a wrong name pass stands in `pipeline/blind/README.md`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

#: How far a finding is to be trusted: name, law and size stand; it closes a large part though its
#: law is not exactly the machine's or its size scatters; it is listed and not written.
CONFIRMED: Final = "confirmed"
APPROXIMATE: Final = "approximate"
SUSPECTED: Final = "suspected"

ACCEPTED: Final = "accepted"
REJECTED: Final = "rejected"
NOT_IDENTIFIABLE: Final = "not identifiable on this motion"
INDISTINGUISHABLE: Final = "indistinguishable from "

#: Uncertainties of the URDF that compete [1]; at the first its bodies are kept.
UNCERTAINTIES: Final = (0.003, 0.01, 0.03, 0.1, 0.3)
NOTHING: Final = "beside the other effects found its size may be nothing at all"
#: A rival is excluded where the log is less likely with it by more than this (logarithm) ...
EXCLUDED: Final = 5.0
#: ... and predicts blocks it has not seen worse by this many standard errors.
SURE: Final = 2.0
#: Rivals of a name that are looked at.
RIVALS: Final = 6
SHAPELESS: Final = "it is a curve, fitted where no law of the catalogue fits"
BESIDE: Final = "in addition to it a curve is fitted over the same variable, whose law is not known"
#: What a model leaves over the noise floor, in any channel, that counts as unexplained.
UNEXPLAINED: Final = 1.6
MORE_LEFT: Final = "more than sensors' noise is left there; what causes that may stand behind it"
IDLE: Final = "it closes none of the gap on validation data, or its size may be nothing at all"
IDLE_NAME: Final = "it closes none of the gap on validation data"


@dataclass(frozen=True)
class Estimate:
    """One parameter of an accepted effect.

    Attributes:
        name: Of the parameter.
        value: Best estimate.
        low: Of the 95 % interval.
        high: Of the 95 % interval.
        unit: Unit.
    """

    name: str
    value: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class Member:
    """One of several like findings that are reported as one.

    Attributes:
        place: Where.
        parameters: Estimates.
        level: Of this one.
    """

    place: tuple[str, ...]
    parameters: tuple[Estimate, ...]
    level: str

    @property
    def values(self) -> dict[str, float]:
        """Parameters by name."""
        return {p.name: p.value for p in self.parameters}


@dataclass(frozen=True)
class Candidate:
    """One effect at one place and what became of it.

    Attributes:
        effect: Name.
        place: Joints, link, ground or effort channels.
        before: Validation error of the joints it touches without it, by estimates from training
            rows, in `unit`.
        after: The same with it; NaN where it was not tried in earnest.
        unit: Of the compared channel.
        identifiable: Whether this motion could show it.
        verdict: `ACCEPTED`, `REJECTED`, `NOT_IDENTIFIABLE` or `INDISTINGUISHABLE` + names.
        reason: In words.
        gain: Fall of the penalised misfit on training and validation rows, in noise variances.
    """

    effect: str
    place: tuple[str, ...]
    before: float
    after: float
    unit: str
    identifiable: bool
    verdict: str
    reason: str
    gain: float = 0.0


@dataclass(frozen=True)
class Found:
    """An accepted effect.

    Attributes:
        order: From 1.
        effect: Name.
        place: Where.
        parameters: Estimates.
        rivals: Effects at places that explain the log as well.
        valid_before: Validation error without it (with those before it) by estimates from training
            rows, RMS of the joints it touches, in `unit`; NaN where none of them has a row there.
        valid_after: The same with it.
        unit: Of the compared channel.
        noise_floor: Of the same joints, in `unit`.
        excitation: The motion that would distinguish it from its rivals.
        level: `CONFIRMED`, `APPROXIMATE` or `SUSPECTED`.
        reason: Why it is not confirmed, or empty.
        law: Which of its laws, where the effect has several.
        members: Where several like findings are reported as one, each of them.
        gap_before: Error on test rows without it, where it shows most; NaN until the written model
            was held against those rows, and where there is no row.
        gap_after: The same with it.
        written: Whether the model file holds it.
    """

    order: int
    effect: str
    place: tuple[str, ...]
    parameters: tuple[Estimate, ...]
    rivals: tuple[tuple[str, tuple[str, ...]], ...]
    valid_before: float
    valid_after: float
    unit: str
    noise_floor: float
    excitation: str
    level: str = CONFIRMED
    reason: str = ""
    law: str = ""
    members: tuple[Member, ...] = ()
    gap_before: float = float("nan")
    gap_after: float = float("nan")
    written: bool = False

    @property
    def values(self) -> dict[str, float]:
        """Parameters by name."""
        return {p.name: p.value for p in self.parameters}

    @property
    def each(self) -> tuple[Member, ...]:
        """Its members; itself where it has none."""
        return self.members or (Member(self.place, self.parameters, self.level),)

    @property
    def key(self) -> tuple[str, tuple[str, ...]]:
        """Effect and place."""
        return self.effect, self.place

    @property
    def kept(self) -> bool:
        """Whether it belongs into a model file."""
        return self.level != SUSPECTED


@dataclass(frozen=True)
class Remainder:
    """What a model leaves at one joint on test rows.

    Attributes:
        joint: Name.
        channel: Channel.
        error: RMS, in `unit`.
        noise_floor: In `unit`.
        unit: Unit.
        significant: Whether it is more than `UNEXPLAINED` times the noise floor.
        description: What it depends on, in words; empty where it is noise.
        rows: Held-out rows that were compared; without any the error is that of fitted rows.
    """

    joint: str
    channel: str
    error: float
    noise_floor: float
    unit: str
    significant: bool
    description: str
    rows: int = 1


@dataclass(frozen=True)
class Naming:
    """The result of naming.

    Attributes:
        found: Accepted effects in the order of acceptance.
        candidates: Every candidate once.
        tolerances: Nuisances with estimate and prior sigma: (kind, place) to (value, sigma).
        tried: Number of candidates tried.
        channel: The compared channel.
        unit: Its unit.
        notes: Remarks for the report, in words.
    """

    found: tuple[Found, ...]
    candidates: tuple[Candidate, ...]
    tolerances: Mapping[tuple[str, str], tuple[float, float]]
    tried: int
    channel: str
    unit: str
    notes: tuple[str, ...] = field(default=())


def named(found: Found) -> str:
    """A finding in words: its name, its law and where."""
    law = f" ({found.law})" if found.law else ""
    places = [" with ".join(one.place) for one in found.each]
    where = places[0] if len(places) == 1 else f"{', '.join(places[:-1])} and {places[-1]}"
    return f"{found.effect}{law} at {where or 'the whole machine'}"
