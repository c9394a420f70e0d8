"""Groups of joints that are built alike, and fronts of what they cost."""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Mapping, Sequence
from os.path import commonprefix

import numpy as np

from actuators.arrays import Array, Index
from actuators.errors import LegwattError
from pipeline.robot.robot_file import RobotSpec


def groups_of(spec: RobotSpec, given: Sequence[str] = ()) -> dict[str, tuple[str, ...]]:
    """Joints that are built alike, by the name of their group.

    By default the first joints of all legs, the second ones, and so on, and those outside the legs
    (each joint without legs); else `given`, ``NAME=PATTERN,PATTERN``.

    Raises:
        LegwattError: A group has no name or no joint, or a joint is in no group or in two.
    """
    out: dict[str, tuple[str, ...]] = {}
    for text in given:
        name, _, patterns = text.partition("=")
        each = [p.strip() for p in patterns.split(",") if p.strip()]
        joints = tuple(j for j in spec.joints if any(fnmatch.fnmatchcase(j, p) for p in each))
        if not name or not joints or name in out:
            raise LegwattError(f"group {text}: expected NAME=PATTERN,PATTERN, each name once")
        out[name] = joints
    if not given:
        for k in range(max((len(leg.joints) for leg in spec.legs), default=0)):
            alike = tuple(leg.joints[k] for leg in spec.legs if k < len(leg.joints))
            out[_shared(alike, f"joint {k + 1}", out)] = alike
        legs = {joint for leg in spec.legs for joint in leg.joints}
        others = tuple(joint for joint in spec.joints if joint not in legs)
        out |= {"held": others} if legs and others else {joint: (joint,) for joint in others}
    for joint in spec.joints:
        if (count := sum(joint in joints for joints in out.values())) != 1:
            raise LegwattError(f"group: joint '{joint}' is in {count} groups, not in one")
    return out


def _shared(joints: Sequence[str], otherwise: str, taken: Mapping[str, object]) -> str:
    """What the names of joints end in, or begin with, alike: whole words of an end."""
    end = commonprefix([joint[::-1] for joint in joints])[::-1]  # noqa: RUF071 (letters are meant)
    begin = commonprefix(joints).strip("_- ")  # noqa: RUF071
    name = re.sub("^[^_-]*[_-]", "", end) or begin
    return otherwise if not name or name in taken else name


def front(power: Array, mass: Array) -> Index:
    """Designs (D,) on the Pareto front of power and mass, from the least power on."""
    order = np.lexsort((mass, power))
    lightest = np.minimum.accumulate(mass[order])
    first = np.ones(len(order), dtype=np.bool_)
    first[1:] = mass[order][1:] < lightest[:-1]
    return np.asarray(order[first])


def merged(fronts: Sequence[tuple[Array, Array]]) -> tuple[Array, Array, Index]:
    """The front of all sums of one design of each group: power, mass (P,), and which (P, groups).

    A sum that holds a design beaten in its own group is beaten itself, so that sums of fronts of
    power (F,) [W] and mass (F,) [kg], pair by pair, lose nothing.
    """
    power, mass = np.zeros(1), np.zeros(1)
    taken = np.zeros((1, 0), dtype=np.intp)
    for p, m in fronts:
        both = (power[:, None] + p).ravel(), (mass[:, None] + m).ravel()
        kept = front(*both)
        before, own = np.unravel_index(kept, (len(power), len(p)))
        power, mass = both[0][kept], both[1][kept]
        taken = np.column_stack([taken[before], own])
    return power, mass, taken


def knee(power: Array, mass: Array) -> int:
    """The point of a front that lies furthest below the line between its ends, both scaled."""
    if len(power) < 3:
        return 0
    x, y = ((v - v.min()) / max(float(np.ptp(v)), 1e-300) for v in (mass, power))
    return int((x + y).argmin())
