"""Which numbers a calibration was made with, so that its judgement is not lent to others."""

from __future__ import annotations

import math
from collections.abc import Mapping

from actuators.loading.build import Catalog
from actuators.units import dimension
from pipeline.paper.calibration.prior import Prior
from pipeline.paper.published import Published
from pipeline.robot.robot_file import RobotSpec

Fingerprint = Mapping[str, float | str]
#: Stored numbers have nine digits.
_SAME = 1e-8


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
    return [name for name in {**now, **stored} if not _same(stored.get(name), now.get(name))]


def _same(a: float | str | None, b: float | str | None) -> bool:
    if isinstance(a, str) or isinstance(b, str) or a is None or b is None:
        return a == b
    return math.isclose(a, b, rel_tol=_SAME, abs_tol=1e-12)
