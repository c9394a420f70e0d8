"""Springs beside the actuators.

A spring of stiffness k without torque at q0 acts -k (q - q0) on the joint, so that the actuator
gives tau + k (q - q0).
"""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase
from typing import Final

import numpy as np

from actuators.elements.position_torque import ParallelSpring
from actuators.errors import UnitError, closest, one_line
from actuators.units import quantity
from pipeline.errors import PipelineError

#: Dimensions of a spring's stiffness and angle without torque.
_SPRING: Final = ("rotational stiffness", "angle")


def springs_of(joints: Sequence[str], given: Sequence[str]) -> ParallelSpring | None:
    """The springs beside the actuators of all joints; None without any.

    Args:
        joints: Of the robot, in order.
        given: ``PATTERN=STIFFNESS@ANGLE`` each, with units.

    Raises:
        PipelineError: It is written otherwise, a number or unit is wrong, or its pattern fits no
            joint, or one that has a spring.
    """
    stiffness, rest = np.zeros(len(joints)), np.zeros(len(joints))
    for text in given:
        pattern, _, numbers = text.partition("=")
        which = np.array([fnmatchcase(joint, pattern) for joint in joints])
        if not which.any():
            hint = closest(pattern, joints)
            raise PipelineError(f"--spring {one_line(text)}: no joint '{pattern}': {hint}")
        if numbers.count("@") != 1:
            form = "'PATTERN=STIFFNESS@ANGLE', such as '*_knee=3 N*m/rad@40 deg'; none is searched"
            raise PipelineError(f"--spring {one_line(text)}: expected {form}")
        if (stiffness[which] != 0.0).any():
            raise PipelineError(f"--spring {one_line(text)}: a joint of it has a spring already")
        try:
            k, q = (quantity(x, kind) for x, kind in zip(numbers.split("@"), _SPRING, strict=True))
        except UnitError as error:
            raise PipelineError(f"--spring {one_line(text)}: {error}") from None
        if k <= 0.0:
            raise PipelineError(f"--spring {one_line(text)}: the stiffness has to be above 0")
        stiffness[which], rest[which] = k, q
    return ParallelSpring("spring", stiffness, rest) if stiffness.any() else None
