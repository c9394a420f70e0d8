"""Elasticity and play of joints whose log holds both positions, read off the two."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from pipeline.identification import results as limits
from pipeline.identification.results import Estimate, Member
from pipeline.identification.whole.beside import CROSSING
from pipeline.identification.whole.told import Told, estimate, exact
from pipeline.identification.workflow.locate import Whereabouts
from pipeline.logs.prepared.measurement import PROVE
from pipeline.logs.prepared.read_off import two_sides
from pipeline.logs.signals.two_sides import TwoSides

#: Why the gap in torque has no say: the torque hardly feels it.
READ_OFF: Final = "read off two positions"
#: Stiffness of what does not bend [N*m/rad].
_RIGID: Final = 1e12


def sides(where: Whereabouts) -> list[Told]:
    """Findings of the logs that may be learnt from; rows that prove are not looked at."""
    out = []
    for joint, (seen, torque) in _seen(where).items():
        if seen.plays:
            width, error = seen.width
            stiffness = _stiffness(seen) if seen.elastic else exact("stiffness", _RIGID, "N*m/rad")
            parameters: tuple[Estimate, ...] = (
                estimate("width", width, 1.96 * error, "rad", low=0.0, high=1.0),
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


def _seen(where: Whereabouts) -> Mapping[str, tuple[TwoSides, float]]:
    """Joint to what the first log that tells says, and its largest torque [N*m]."""
    out: dict[str, tuple[TwoSides, float]] = {}
    for one, part in zip(where.intake.prepared, where.parts.part, strict=True):
        known = (part >= 0) & (part != PROVE)
        if one.channel != "torque" or not known.any():
            continue
        seen = two_sides(replace(one, mask=one.mask & known[:, None]))
        for joint, told in seen.items():
            torque = np.abs(one.effort[known, one.joints.index(joint)])
            out.setdefault(joint, (told, float(np.nanmax(torque))))
    return out
