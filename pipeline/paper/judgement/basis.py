"""Judges the run against the paper, as far as the stored calibration belongs to its numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pipeline.paper.calibration.fingerprint import differences, fingerprint
from pipeline.paper.calibration.prior import Prior, load_prior
from pipeline.paper.calibration.quantities import DIMENSIONS, IDS
from pipeline.paper.calibration.store import RESULTS_FILE, load_results
from pipeline.paper.judgement.judge import Judgement
from pipeline.paper.published import Published, load_published
from pipeline.simulation.settings import Settings

#: A robot or an actuator built otherwise than the paper's has no such numbers to compare.
_STRUCTURE = ("alternatives.", "legs", "gait.tripods", "standing.feet")
_SHOWN = 3


@dataclass(frozen=True)
class Basis:
    """What a run may be judged by.

    Attributes:
        published: The printed values.
        prior: What was known before.
        stored: The stored calibration.
        changed: Numbers of the run that differ from those the calibration was made with; its
            sets, intervals and verdicts then belong to other numbers and are left out.
    """

    published: Mapping[str, Published]
    prior: Prior
    stored: Mapping[str, Any]
    changed: tuple[str, ...]

    @property
    def results(self) -> Mapping[str, Any] | None:
        """The stored calibration where it belongs to the run's numbers, else None."""
        return None if self.changed else self.stored

    @property
    def word(self) -> str:
        """What to say of the numbers that differ; empty where none does."""
        if not self.changed:
            return ""
        shown = ", ".join(self.changed[:_SHOWN])
        more = len(self.changed) - _SHOWN
        return (
            f"{shown}{f' and {more} more' if more > 0 else ''} "
            f"{'differs' if len(self.changed) == 1 else 'differ'} from the numbers of the "
            "calibration: what is compared with the paper was computed anew; what rests on the "
            "calibration's sets (intervals, predictions, readings, sensitivities) is left out"
        )


@dataclass(frozen=True)
class Judged:
    """A judgement and what it rests on."""

    judgement: Judgement
    by: Basis


def basis(given: Settings) -> Basis | str:
    """What the run may be judged by, or why not at all, in words.

    Raises:
        CalibrationError: The stored calibration, the printed values or the prior cannot be read.
    """
    if not RESULTS_FILE.exists():
        return "there is no stored calibration; `make calibrate` makes one"
    results = load_results()
    if given.robot.spec.path.name != results.get("robot"):
        return f"{given.robot.spec.path.name} is not the paper's robot"
    if given.actuators is not None:
        return f"the actuators of {given.actuators} are not the paper's"
    if given.effects is not None:
        return "a model file changes the robot, and the paper knows nothing of its effects"
    if given.quasi_static:
        return "the paper counts the links' inertia, this run does not"
    if given.regeneration.policy != "none":
        return "in the paper energy that flows back is lost, in this run it is used again"
    published, prior = load_published(IDS, DIMENSIONS), load_prior()
    now = fingerprint(given.robot.spec, given.catalog, published, prior)
    changed = differences(results.get("numbers", {}), now)
    built = [name for name in changed if name.startswith(_STRUCTURE)]
    if built:
        return f"{built[0]} differs from the paper's"
    return Basis(published, prior, results, tuple(changed))
