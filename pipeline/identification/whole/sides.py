"""Elasticity and play of joints whose log holds both positions, read off the two."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipeline.identification import results as limits
from pipeline.identification.results import Estimate, Member
from pipeline.identification.whole.beside import CROSSING
from pipeline.identification.whole.told import Told, estimate, exact
from pipeline.identification.workflow.locate import Whereabouts
from pipeline.logs.prepared.measurement import PROVE
from pipeline.logs.prepared.prepare import Prepared
from pipeline.logs.prepared.read_off import two_sides
from pipeline.logs.signals.two_sides import TwoSides
from pipeline.regression import Result

#: Why the gap in torque has no say: the torque hardly feels it.
READ_OFF: Final = "read off two positions"
#: Standard errors in half of a 95 % interval.
_COVER: Final = 1.96
#: Stiffness of what does not bend [N*m/rad].
_RIGID: Final = 1e12


def sides(where: Whereabouts, result: Result, order: NDArray[np.intp]) -> list[Told]:
    """Findings of the logs that may be learnt from; rows that prove are not looked at.

    Args:
        where: Logs and their parts.
        result: Of the regression: friction does not wind up what lies behind it.
        order: Columns of its joints.
    """
    out = []
    for joint, (seen, torque) in _seen(where, result, order).items():
        if seen.plays:
            width, error = seen.width
            stiffness = _stiffness(seen) if seen.elastic else exact("stiffness", _RIGID, "N*m/rad")
            parameters: tuple[Estimate, ...] = (
                estimate("width", width, _COVER * error, "rad", low=0.0, high=1.0),
                stiffness,
                exact("crossing", CROSSING * torque, "N*m"),
            )
            name = "backlash"
        elif seen.elastic:
            name, parameters = "joint_elasticity", (_stiffness(seen),)
        else:
            continue
        member = Member((joint,), parameters, limits.CONFIRMED, float("nan"))
        out.append(Told(name, READ_OFF, "", (member,)))
    return out


def _stiffness(seen: TwoSides) -> Estimate:
    value, low, high = seen.stiffness
    return Estimate("stiffness", max(value, 1.0), max(low, 1.0), min(high, _RIGID), "N*m/rad")


def _through(one: Prepared, result: Result, order: NDArray[np.intp]) -> Prepared:
    """A log whose torques are those behind the friction, springs and ripple in them."""
    q, v, a = (np.nan_to_num(x[:, order]) for x in (one.q, one.v, one.a))
    friction = result.predict(q, v, a) - result.passed(q, v, a)
    effort = one.effort.copy()
    effort[:, order] -= one.lowpass(friction)
    return replace(one, effort=effort)


def _wider(seen: TwoSides, plain: TwoSides) -> TwoSides:
    """With half of what friction changes as an error, too: its law is none that holds exactly."""
    (c, c_error), (w, w_error) = seen.compliance, seen.width
    c_error = float(np.hypot(c_error, 0.5 * abs(c - plain.compliance[0]) / _COVER))
    if np.isfinite(plain.width[0]):
        w_error = float(np.hypot(w_error, 0.5 * abs(w - plain.width[0]) / _COVER))
    return replace(seen, compliance=(c, c_error), width=(w, w_error))


def _seen(
    where: Whereabouts, result: Result, order: NDArray[np.intp]
) -> Mapping[str, tuple[TwoSides, float]]:
    """Joint to what the first log that tells says, and its largest torque [N*m]."""
    out: dict[str, tuple[TwoSides, float]] = {}
    for one, part in zip(where.intake.prepared, where.parts.part, strict=True):
        known = (part >= 0) & (part != PROVE)
        if one.channel != "torque" or not known.any():
            continue
        if one.other.get("motor_position") is None:
            continue
        learnt = replace(one, mask=one.mask & known[:, None])
        plain = two_sides(learnt)
        for joint, told in two_sides(_through(learnt, result, order)).items():
            torque = np.abs(one.effort[known, one.joints.index(joint)])
            seen = _wider(told, plain.get(joint, told))
            out.setdefault(joint, (seen, float(np.nanmax(torque))))
    return out
