"""Says by what a run may be held against the paper, and how far the fit's study speaks of it.

What data sheets and literature say without the fit, what the rest says of a figure left out, and
how wide the posterior is was computed once; it belongs to the numbers of that fit and judges no
others.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from actuators.loading.build import Catalog
from actuators.units import dimension
from pipeline.dynamics.force_rules import PAPER
from pipeline.paper.published import ALTERNATIVES
from pipeline.robot.robot_file import RobotSpec
from pipeline.simulation.machine import Machine

STUDY = Path(__file__).with_name("study")
Fingerprint = Mapping[str, float | str]
_SAME = 1e-8  # stored numbers have nine digits
#: A robot or an actuator built otherwise than the paper's has no such numbers to compare.
_STRUCTURE = ("legs", "gait.", "standing.feet")
_ALTERNATIVE = "alternatives."
_SHOWN = 3


class Basis(NamedTuple):
    """What a run may be judged by."""

    results: Mapping[str, Any] | None  #: The fit's study; None where it is of other numbers.
    catalog: Catalog  #: The paper's own alternatives among the run's.
    word: str  #: What to say of actuators and numbers that differ; empty where none does.


def basis(given: Machine) -> Basis | str | None:
    """What the run may be judged by, or why not at all, in words; None for any other robot."""
    study = json.loads((STUDY / "fitted.json").read_text(encoding="utf-8"))
    spec, stored = given.robot.spec, study["numbers"]
    if spec.path.name != study["robot"]:
        return None
    catalog, own = given.catalog.only(ALTERNATIVES), given.own.usual or given.own.groups
    differ = differences(stored, fingerprint(spec, catalog))
    if "legs" in differ:
        return None
    reasons = {
        "its joints have actuators of their own, of which the paper says nothing": bool(own),
        "a model file changes the robot, and the paper knows nothing of its effects": (
            given.model_file is not None
        ),
        "the paper counts the links' inertia, this run does not": given.options.quasi_static,
        "the paper's ground forces are the least tangential ones, this run's are others": (
            given.forces != PAPER
        ),
        "in the paper energy that flows back is lost, in this run it is used again": (
            given.options.regeneration != "none"
        ),
    }
    for name in ALTERNATIVES:
        words = f"no actuator alternative is built as the paper's '{name}'"
        reasons[words] = f"{_ALTERNATIVE}{name}" in differ
    built = [name for name in differ if name.startswith(_STRUCTURE)]
    reasons |= {f"{name} differs from the paper's": True for name in built}
    said = [
        f"the paper says nothing of '{name}': left out"
        for name in given.catalog.alternatives
        if name not in ALTERNATIVES
    ]
    for reason, there in reasons.items():
        if there:
            return reason
    if differ:
        more = f" and {len(differ) - _SHOWN} more" if len(differ) > _SHOWN else ""
        said.append(
            f"not the calibration's: {', '.join(differ[:_SHOWN])}{more}; what is compared with the "
            "paper was computed anew, the fit's intervals are left out"
        )
    return Basis(None if differ else study, catalog, "; ".join(said))


def fingerprint(spec: RobotSpec, catalog: Catalog) -> Fingerprint:
    """Everything of a run that its judgement depends on, by name: SI numbers and texts."""
    out: dict[str, float | str] = {f"robot.{name}": x for name, x in spec.parameters.items()}
    out |= {f"gait.{key}": _text(value) for key, value in sorted(spec.gait.items())}
    out["standing.feet"] = repr(spec.standing_feet)
    out["legs"] = repr([(leg.name, leg.joints, leg.foot, leg.side) for leg in spec.legs])
    # No law takes a part's mass.
    parts = [(component, p) for component, p in catalog.rows() if dimension(p.unit) != "mass"]
    out |= {f"{component}.{p.name}": p.value for component, p in parts}
    for name, a in catalog.alternatives.items():
        elements = [(e.name, e.law, e.stage, sorted(e.arguments.items())) for e in a.elements]
        out[f"{_ALTERNATIVE}{name}"] = repr((a.motor, a.ratio, elements))
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
