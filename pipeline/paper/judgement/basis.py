"""Judges the run against the paper, as far as the stored calibration belongs to its numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from actuators.loading.build import Catalog
from pipeline.dynamics.force_rules import PAPER
from pipeline.paper.calibration.prior import Prior, load_prior
from pipeline.paper.calibration.store import RESULTS_FILE, differences, fingerprint, load_results
from pipeline.paper.published import Published, load_published
from pipeline.simulation.settings import Settings

#: A robot or an actuator built otherwise than the paper's has no such numbers to compare.
_STRUCTURE = ("legs", "gait.", "standing.feet")
#: A shape of the same gait, which the paper does not give.
_SHAPE = "gait.transfer_path"
_ALTERNATIVE = "alternatives."
_SHOWN = 3


@dataclass(frozen=True)
class Basis:
    """What a run may be judged by."""

    published: Mapping[str, Published]  #: The printed values.
    prior: Prior  #: What was known before.
    stored: Mapping[str, Any]  #: The stored calibration.
    #: Numbers of the run that differ from those the calibration was made with; its sets, intervals
    #: and verdicts then belong to other numbers and are left out.
    changed: tuple[str, ...]
    catalog: Catalog  #: The paper's own alternatives among the run's.
    #: Alternatives of the paper that the run does not have, or has built otherwise.
    missing: tuple[str, ...] = ()
    others: tuple[str, ...] = ()  #: Alternatives of the run of which the paper says nothing.

    @property
    def results(self) -> Mapping[str, Any] | None:
        """The stored calibration where it belongs to the run's numbers, else None."""
        return None if self.changed or self.missing else self.stored

    @property
    def word(self) -> str:
        """What to say of the actuators and numbers that differ; empty where none does."""
        parts = []
        if self.missing:
            parts.append(
                f"the paper's {_quoted(self.missing)} {'is' if len(self.missing) == 1 else 'are'} "
                "not among the alternatives as the paper builds them: what it prints of them or "
                "compares with them is left out, and so is what rests on the calibration's sets"
            )
        if self.others:
            parts.append(
                f"the paper says nothing of {_quoted(self.others)}: left out of what is held "
                "against it"
            )
        if self.changed:
            more = len(self.changed) - _SHOWN
            parts.append(
                f"{', '.join(self.changed[:_SHOWN])}{f' and {more} more' if more > 0 else ''} "
                f"{'differs' if len(self.changed) == 1 else 'differ'} from the numbers of the "
                "calibration: what is compared with the paper was computed anew; what rests on the "
                "calibration's sets (intervals, predictions, readings, sensitivities) is left out"
            )
        return "; ".join(parts)


def basis(given: Settings) -> Basis | str | None:
    """What the run may be judged by, or why not at all, in words; None for any other robot.

    Raises:
        CalibrationError: The stored calibration, the printed values or the prior cannot be read.
    """
    if not RESULTS_FILE.exists():
        return "there is no stored calibration; `make calibrate` makes one"
    results = load_results()
    if given.robot.spec.path.name != results.get("robot"):
        return None
    if given.own:
        return "its joints have actuators of their own, of which the paper says nothing"
    if given.effects is not None:
        return "a model file changes the robot, and the paper knows nothing of its effects"
    if given.quasi_static:
        return "the paper counts the links' inertia, this run does not"
    if given.forces != PAPER:
        return "the paper's ground forces are the least tangential ones, this run's are others"
    if given.regeneration.policy != "none":
        return "in the paper energy that flows back is lost, in this run it is used again"
    published, prior = load_published(), load_prior()
    stored = results.get("numbers", {})
    now = fingerprint(given.robot.spec, given.catalog, published, prior)
    differ = set(differences(stored, now))
    every = dict.fromkeys((*_alternatives_of(stored), *given.catalog.alternatives))
    own = [name for name in every if f"{_ALTERNATIVE}{name}" not in differ]
    if not own:
        return "no actuator alternative is built as one of the paper's"
    catalog = given.catalog.only(own)
    now = fingerprint(given.robot.spec, catalog, published, prior)
    # A number of which nothing is left is not one that differs.
    changed = [name for name in differences(stored, now) if name in now]
    built = [name for name in changed if name.startswith(_STRUCTURE) and name != _SHAPE]
    if "legs" in built:
        return None
    if built:
        return f"{built[0]} differs from the paper's"
    missing = tuple(name for name in _alternatives_of(stored) if name not in own)
    others = tuple(name for name in given.catalog.alternatives if name not in own)
    return Basis(published, prior, results, tuple(changed), catalog, missing, others)


def _alternatives_of(numbers: Mapping[str, Any]) -> list[str]:
    """The alternatives of a fingerprint."""
    return [n.removeprefix(_ALTERNATIVE) for n in numbers if n.startswith(_ALTERNATIVE)]


def _quoted(names: Sequence[str]) -> str:
    return ", ".join(f"'{name}'" for name in names)
