"""Springs beside the actuators: as stated, or those of least power.

A spring of stiffness k without torque at q0 acts -k (q - q0) on the joint, so that the actuator
gives tau + k (q - q0). What makes the mean square of that least for a given q0 is

    k = -sum W tau (q - q0) / sum W (q - q0)^2,

the best for copper alone. From shares of it, at angles all around, starts the search of k and q0
for the least power of the best designs, friction, holding and idle power included; then all designs
are searched with the spring, and so on until that lowers the power no further.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from typing import Final

import numpy as np
from scipy.optimize import minimize

from actuators.arrays import Array
from actuators.elements.position_torque import ParallelSpring
from actuators.errors import UnitError, closest, one_line
from actuators.units import quantity
from pipeline.choice.errors import ChoiceError
from pipeline.choice.group import search
from pipeline.choice.loads import Load, with_spring
from pipeline.choice.parts.designs import Designs
from pipeline.choice.search import Demanded
from pipeline.choice.track import Account

Groups = Mapping[str, Sequence[str]]
#: Dimensions of a spring's stiffness and angle without torque.
_SPRING: Final = ("rotational stiffness", "angle")
_SHARES: Final = (0.03, 0.1, 0.3, 1.0)  # of that stiffness
_TURNS: Final = 4  # searches of all designs for one spring, at most
_STARTS: Final = 12  # angles all around, none at the mean position
_BETTER: Final = 1e-4  # share of power that a spring has to save


def springs_of(joints: Sequence[str], given: Sequence[str]) -> ParallelSpring | None:
    """The springs beside the actuators of all joints; None without any.

    Args:
        joints: Of the robot, in order.
        given: ``PATTERN=STIFFNESS@ANGLE`` each, with units; a PATTERN alone is left out.

    Raises:
        ChoiceError: It is written otherwise, a number or unit is wrong, or its pattern fits no
            joint, or one that has a spring.
    """
    stiffness, rest = np.zeros(len(joints)), np.zeros(len(joints))
    for text in given:
        pattern, stated, numbers = text.partition("=")
        which = np.array([fnmatchcase(joint, pattern) for joint in joints])
        if not which.any():
            hint = closest(pattern, joints)
            raise ChoiceError(f"--spring {one_line(text)}: no joint '{pattern}': {hint}")
        if not stated:
            continue
        if numbers.count("@") != 1:
            form = "PATTERN, or 'PATTERN=STIFFNESS@ANGLE' such as '*_knee=3 N*m/rad@40 deg'"
            raise ChoiceError(f"--spring {one_line(text)}: expected {form}")
        if (stiffness[which] != 0.0).any():
            raise ChoiceError(f"--spring {one_line(text)}: a joint of it has a spring already")
        try:
            k, q = (quantity(x, kind) for x, kind in zip(numbers.split("@"), _SPRING, strict=True))
        except UnitError as error:
            raise ChoiceError(f"--spring {one_line(text)}: {error}") from None
        if k <= 0.0:
            raise ChoiceError(f"--spring {one_line(text)}: the stiffness has to be above 0")
        stiffness[which], rest[which] = k, q
    return ParallelSpring("spring", stiffness, rest) if stiffness.any() else None


def found_springs(
    given: Sequence[str],
    groups: Groups,
    loads: Sequence[Load],
    designs: Designs,
    account: Account,
) -> tuple[str, ...]:
    """Springs as they are stated, and for a PATTERN alone the one of least power, if it saves any.

    The mission is with the springs that are stated.

    Raises:
        ChoiceError: No design of a group is within limits without the spring.
    """
    out: list[str] = []
    joints = loads[0].series.joints
    for text in given:
        if "=" in text:
            out.append(text)
        elif found := _found(text, groups, loads, designs, account):
            out.append(f"{text}={found[0]:.4g} N*m/rad@{np.rad2deg(found[1]):.4g} deg")
            spring = springs_of(joints, out[-1:])
            loads = [with_spring(load, spring) for load in loads]
    return tuple(out)


def _found(
    pattern: str, groups: Groups, loads: Sequence[Load], designs: Designs, account: Account
) -> tuple[float, float] | None:
    """Stiffness [N*m/rad] and angle [rad] of least power; None if none saves any."""
    joints = loads[0].series.joints
    which = np.array([fnmatchcase(joint, pattern) for joint in joints])
    own = {g: js for g, js in groups.items() if any(which[joints.index(j)] for j in js)}

    def beside(k: float, rest: float) -> list[Demanded]:
        spring = ParallelSpring("spring", k * which, rest * which)
        with_it = [with_spring(load, spring) for load in loads]
        return [Demanded.of(g, js, with_it) for g, js in own.items()]

    starts = _starts([j for j, fits in zip(joints, which, strict=True) if fits], loads)
    found = [search(demanded, designs, account) for demanded in beside(0.0, 0.0)]
    least, best = sum(float(f.score.min()) for f in found), None
    for _ in range(_TURNS if starts else 0):
        pool = [f.designs.taken(f.looked[f.finalists]) for f in found]

        def power(x: Array, pool: Sequence[Designs]) -> float:
            each = zip(beside(*x), pool, strict=True)
            return sum(float(one.power(some, account).min()) for one, some in each)

        first = np.array(best or min(starts, key=lambda x: power(np.array(x), pool)))
        bounds = [(1e-3 * first[0], 1e3 * first[0]), (starts[0][1], starts[-1][1])]
        result = minimize(
            *(power, first, (pool,)),
            method="Nelder-Mead",
            bounds=bounds,
            options={"xatol": 1e-3, "fatol": 0.1 * _BETTER * least, "maxiter": 100},
        )
        k, rest = (float(x) for x in result.x)
        found = [search(demanded, designs, account) for demanded in beside(k, rest)]
        now = sum(float(f.score.min()) for f in found)
        if now >= least * (1.0 - _BETTER):
            break
        least, best = now, (k, rest)
    return best


def _starts(joints: Sequence[str], loads: Sequence[Load]) -> list[tuple[float, float]]:
    """Shares of the stiffness of least mean square torque, either way, and angles.

    The angles lie up to half a turn from the joints' mean position; farther off a spring is a
    constant torque.
    """
    tracks = Demanded.of("", joints, loads).tracks
    q = np.concatenate([t.series.position.ravel() for t in tracks])
    tau = np.concatenate([t.series.torque.ravel() for t in tracks])
    w = np.concatenate([np.repeat(t.share * t.weight, len(joints)) for t in tracks])
    out = []
    for rest in (w @ q) / w.sum() + np.linspace(-np.pi, np.pi, _STARTS):
        off = q - rest
        k = abs(float((w * tau) @ off) / float((w * off) @ off))
        out += [(share * k, float(rest)) for share in _SHARES if k]
    return out
