"""Joints that mimic others: a log's comparison goes on where none of them moves."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

import numpy as np

from pipeline.logs.errors import LogContentError
from pipeline.logs.reading.expected import Expected
from pipeline.logs.reading.log import Log
from pipeline.robot.urdf_source import MOVING, parse_elements

#: A joint that moves by less is still and its encoder noisy: share of its range,
STILL: Final = 0.01
#: ... or angle where it has no range [rad].
STILL_ENDLESS: Final = 0.01


def mimics_in(text: str, where: str) -> dict[str, str]:
    """Moving joints of a URDF that mimic another, to the other's name."""
    out = {}
    for joint in parse_elements(text, where).findall("joint"):
        mimic = joint.find("mimic")
        if mimic is not None and joint.get("type") in MOVING:
            out[joint.get("name", "")] = mimic.get("joint", "")
    return out


def refuse_moved(mimics: Mapping[str, str], logs: Iterable[Log], expected: Expected) -> None:
    """Stop where a log moves a joint that mimics another, or the one that it mimics.

    Raises:
        LogContentError: Names log and joints.
    """
    for log in logs:
        for joint, other in mimics.items():
            moved = [name for name in (joint, other) if _moves(log, name, expected)]
            if moved:
                raise LogContentError(
                    f"{log.name}: '{moved[0]}' moves, and '{joint}' mimics '{other}': a drive that "
                    "moves several joints is not computed; make it fixed in the URDF, or remove "
                    "<mimic> if it has a drive of its own"
                )


def _moves(log: Log, joint: str, expected: Expected) -> bool:
    if joint not in log.joints:
        return False
    k = log.joints.index(joint)
    q = log.position[:, k]
    q = q[np.isfinite(q)]
    span = float(expected.upper[k] - expected.lower[k])
    least = STILL * span if np.isfinite(span) else STILL_ENDLESS
    return q.size > 0 and float(np.ptp(q)) > least
