"""Judges the run against the paper, as far as the fit's study belongs to its numbers.

What data sheets and literature say without the fit, what the rest says of a figure left out, and
how wide the posterior is was computed once; it belongs to the numbers of that fit and judges no
others.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from actuators.loading.build import Catalog
from actuators.units import dimension
from pipeline.dynamics.force_rules import PAPER
from pipeline.paper.prior import Prior, load_prior
from pipeline.paper.published import Published, load_published
from pipeline.robot.robot_file import RobotSpec
from pipeline.simulation.machine import Machine

STUDY = Path(__file__).parents[1] / "study"
Fingerprint = Mapping[str, float | str]
_SAME = 1e-8  # stored numbers have nine digits
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
    stored: Mapping[str, Any]  #: The fit's study.
    #: Numbers of the run that differ from those of the fit; its intervals and shares then belong to
    #: other numbers and are left out.
    changed: tuple[str, ...]
    catalog: Catalog  #: The paper's own alternatives among the run's.
    #: Alternatives of the paper that the run does not have, or has built otherwise.
    missing: tuple[str, ...] = ()
    others: tuple[str, ...] = ()  #: Alternatives of the run of which the paper says nothing.

    @property
    def results(self) -> Mapping[str, Any] | None:
        """The fit's study where it belongs to the run's numbers, else None."""
        return None if self.changed or self.missing else self.stored

    @property
    def word(self) -> str:
        """What to say of the actuators and numbers that differ; empty where none does."""
        parts = []
        if self.missing:
            parts.append(
                f"the paper's {_quoted(self.missing)} {'is' if len(self.missing) == 1 else 'are'} "
                "not among the alternatives as the paper builds them: what it prints of them or "
                "compares with them is left out, and so is what rests on the fit's study"
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
                "calibration: what is compared with the paper was computed anew; the intervals of "
                "the fit's study are left out"
            )
        return "; ".join(parts)


def basis(given: Machine) -> Basis | str | None:
    """What the run may be judged by, or why not at all, in words; None for any other robot.

    Raises:
        LegwattError: The printed values or the prior cannot be read.
    """
    results = json.loads((STUDY / "fitted.json").read_text(encoding="utf-8"))
    if given.robot.spec.path.name != results["robot"]:
        return None
    if given.own:
        return "its joints have actuators of their own, of which the paper says nothing"
    if given.effects is not None:
        return "a model file changes the robot, and the paper knows nothing of its effects"
    if given.options.quasi_static:
        return "the paper counts the links' inertia, this run does not"
    if given.forces != PAPER:
        return "the paper's ground forces are the least tangential ones, this run's are others"
    if given.options.returned.policy != "none":
        return "in the paper energy that flows back is lost, in this run it is used again"
    published, prior = load_published(), load_prior()
    stored = results["numbers"]
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
    return Basis(published, results, tuple(changed), catalog, missing, others)


def _alternatives_of(numbers: Mapping[str, Any]) -> list[str]:
    """The alternatives of a fingerprint."""
    return [n.removeprefix(_ALTERNATIVE) for n in numbers if n.startswith(_ALTERNATIVE)]


def _quoted(names: Sequence[str]) -> str:
    return ", ".join(f"'{name}'" for name in names)


def fingerprint(
    spec: RobotSpec, catalog: Catalog, published: Mapping[str, Published], prior: Prior
) -> Fingerprint:
    """Everything a judgement depends on, by name: SI numbers and texts."""
    out: dict[str, float | str] = {f"robot.{name}": x for name, x in spec.parameters.items()}
    out |= {f"gait.{key}": _text(value) for key, value in sorted(spec.gait.items())}
    out["standing.feet"] = repr(spec.standing_feet)
    out["legs"] = repr([(leg.name, leg.joints, leg.foot, leg.side) for leg in spec.legs])
    # No law takes a part's mass.
    parts = [(component, p) for component, p in catalog.rows() if dimension(p.unit) != "mass"]
    out |= {f"{component}.{p.name}": p.value for component, p in parts}
    for name, a in catalog.alternatives.items():
        elements = [(e.name, e.law, e.stage, sorted(e.arguments.items())) for e in a.elements]
        out[f"alternatives.{name}"] = repr((a.motor, a.ratio, elements))
    for p in published.values():
        out[f"published.{p.id}"] = repr((p.unit, p.value, p.half_width, p.role))
    for f in prior.free:
        out[f"prior.{f.key}"] = repr((f.centre, f.deviation, f.bounds, f.logarithmic))
    return out


def _text(value: object) -> str:
    if isinstance(value, list):
        return repr(tuple(tuple(v) if isinstance(v, list) else v for v in value))
    return value if isinstance(value, str) else repr(value)


def differences(stored: Fingerprint, now: Fingerprint) -> list[str]:
    """Names under which two fingerprints differ, in order; empty where they are the same."""

    def same(a: float | str | None, b: float | str | None) -> bool:
        if isinstance(a, str) or isinstance(b, str) or a is None or b is None:
            return a == b
        return math.isclose(a, b, rel_tol=_SAME, abs_tol=1e-12)

    return [name for name in {**now, **stored} if not same(stored.get(name), now.get(name))]
