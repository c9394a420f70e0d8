"""What naming answers: its records, its words and the numbers it compares with.

How often they let a wrong name pass stands in `tests/blind/README.md`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from pipeline.effects.base import Place
from pipeline.effects.model_file import Edit
from pipeline.identification.settings import UNEXPLAINED as UNEXPLAINED

#: How far a finding is to be trusted: name, law and size stand; it closes a large part though its
#: law is not exactly the machine's or its size scatters; it is listed and not written.
CONFIRMED: Final = "confirmed"
APPROXIMATE: Final = "approximate"
SUSPECTED: Final = "suspected"

ACCEPTED: Final = "accepted"
REJECTED: Final = "rejected"
NOT_IDENTIFIABLE: Final = "not identifiable on this motion"
INDISTINGUISHABLE: Final = "indistinguishable from "

NOTHING: Final = "the other effects found explain the log about as well without it"
OTHERS: Final = "the other effects, estimated anew, would predict the log as well without it"
BESIDE: Final = "it may be a part of what has no name"
UNNAMED: Final = "what has no name explains the log better in its place"
WITHIN: Final = "encoder zeros and offsets within their tolerances would explain the log as well"
MORE_LEFT: Final = "more than sensors' noise is left there; what causes that may stand behind it"
IDLE_NAME: Final = "it closes none of the gap on validation data"
NAN: Final = float("nan")


@dataclass(frozen=True)
class Candidate:
    """One effect at one place and what became of it; its fields are columns of `candidates`."""

    effect: str  #: Name.
    place: Place  #: Joints, link, ground or effort channels.
    identifiable: bool  #: Whether this motion could show it.
    verdict: str  #: `ACCEPTED`, `REJECTED`, `NOT_IDENTIFIABLE` or `INDISTINGUISHABLE` + names.
    reason: str  #: In words.


@dataclass(frozen=True)
class Found:
    """An accepted effect, as the edits that it is in a model file."""

    order: int  #: From 1.
    edits: tuple[Edit, ...]  #: One; of bodies one for every link.
    #: Effects at places that explain the log as well.
    rivals: tuple[tuple[str, Place], ...] = ()
    level: str = CONFIRMED  #: `CONFIRMED`, `APPROXIMATE` or `SUSPECTED`.
    reason: str = ""  #: Why it is not confirmed, or empty.
    law: str = ""  #: Which of its laws, where the effect has several.
    noise_floor: float = NAN  #: Of the same joints.
    #: Error on test rows without it, where it shows most; NaN until the written model was held
    #: against those rows, and where there is no row.
    gap_before: float = NAN
    gap_after: float = NAN  #: The same with it.
    written: bool = False  #: Whether the model file holds it.

    @property
    def effect(self) -> str:
        """Its name."""
        return self.edits[0].effect

    @property
    def place(self) -> Place:
        """Where."""
        return tuple(name for edit in self.edits for name in edit.place)

    @property
    def values(self) -> dict[str, float]:
        """Parameters by name, of the first of its edits."""
        return self.edits[0].values

    @property
    def key(self) -> tuple[str, Place]:
        """Effect and place."""
        return self.effect, self.place

    @property
    def kept(self) -> bool:
        """Whether it belongs into a model file."""
        return self.level != SUSPECTED


@dataclass(frozen=True)
class Residual:
    """What a model leaves at one joint, on test rows or where it was learnt."""

    joint: str  #: Name.
    channel: str  #: Channel.
    error: float  #: RMS, in `unit`.
    noise_floor: float  #: In `unit`.
    unit: str  #: Unit.
    significant: bool  #: Whether it is more than `UNEXPLAINED` times the noise floor.
    description: str  #: What it depends on, in words; empty where it is noise.
    #: Held-out rows that were compared.
    rows: int = 1

    @property
    def ratio(self) -> float:
        """Error over noise floor; 0 without a noise floor."""
        return self.error / self.noise_floor if self.noise_floor > 0 else 0.0


def named(found: Found) -> str:
    """A finding in words: its name, its law and where."""
    law = f" ({found.law})" if found.law else ""
    places = [" with ".join(edit.place) for edit in found.edits]
    where = places[0] if len(places) == 1 else f"{', '.join(places[:-1])} and {places[-1]}"
    return f"{found.effect}{law} at {where or 'the whole machine'}"
