"""Gains of a ROS 2 joint trajectory controller that drives by effort."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from pipeline.simulation.export.joints import JointNumbers

#: What the controller's parameters do not hold.
LEFT: Final = (
    "dry friction: the controller has no term for it; its integral gain stands in, slowly",
    "inertia and bodies: the controller knows no model",
    "springs beside the drive",
)


def ros2_control(
    numbers: Sequence[JointNumbers],
    remarks: Sequence[str],
    gains: Mapping[str, tuple[float, float]] | None = None,
) -> str:
    """Write the parameters of a `joint_trajectory_controller` with an effort interface.

    It commands, by its documentation, ``ff_velocity_scale v_goal + p e + d de/dt``: viscous
    friction is what the first term makes up for. `gains`: joint to stiffness [N*m/rad] and damping
    [N*m*s/rad] of its servo; zeros to be filled in without.
    """
    lines = [*(f"# {r}" for r in remarks), "joint_trajectory_controller:", "  ros__parameters:"]
    lines.append("    joints:")
    lines += [f"      - {n.joint}" for n in numbers]
    lines += ["    command_interfaces:", "      - effort", "    state_interfaces:"]
    lines += ["      - position", "      - velocity", "    gains:"]
    for n in numbers:
        kp, kd = (gains or {}).get(n.joint, (0.0, 0.0))
        lines += [f"      {n.joint}:", f"        p: {float(kp)!r}", "        i: 0.0"]
        lines += [f"        d: {float(kd)!r}", f"        ff_velocity_scale: {_double(n.damping)}"]
        if np.isfinite(n.effort):
            lines += [f"        u_clamp_max: {_double(n.effort)}"]
            lines += [f"        u_clamp_min: {_double(-n.effort)}"]
    return "\n".join(lines) + "\n"


def _double(x: float) -> str:
    """A number with its point: ROS 2 refuses a whole one where it expects a double."""
    return repr(float(f"{x:.9g}") + 0.0)
