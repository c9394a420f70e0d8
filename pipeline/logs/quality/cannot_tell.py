"""What a log cannot tell by its channels and its motion, and what would be needed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from pipeline.logs.quality.finding import Finding
from pipeline.logs.reading.log import Log

#: Fast over slow speeds below which laws of speed look alike.
_SPEEDS: Final = 4.0
#: Spread of a load's magnitude over its mean below which it might as well be constant.
_LOADS: Final = 0.3
#: Share of a joint's motion that has to go the other way.
_BACK: Final = 0.1
#: Windings warm over minutes [s].
_WARMING: Final = 60.0


def cannot_tell(log: Log, velocity: Array, effort: Array, ok: NDArray[np.bool_]) -> list[Finding]:
    """One finding per thing that stays open.

    Args:
        log: As read.
        velocity: Of its joints in the bandwidth, shape (N, J) [rad/s].
        effort: That is compared, shape (N, J).
        ok: Rows that count, shape (N, J).
    """
    out: list[str] = []
    if log.motor_position is None or not np.isfinite(log.motor_position).any():
        side = "motor" if log.position_source == "motor" else "joint"
        other = "joint" if side == "motor" else "motor"
        out.append(
            f"play and wind-up of gears as such: positions are the {side}s' alone; log the "
            f"{other}s' positions, too"
        )
    if log.torque is None or log.current is None:
        out.append(
            "a torque constant but by gravity: log both torque and current, or hold known weights"
        )
    duration = float(log.time[-1] - log.time[0])
    if log.temperature is None and duration < _WARMING:
        out.append(
            f"warming: {duration:.3g} s without a temperature; log minutes, or the housings' "
            "temperature"
        )
    ways: dict[str, list[str]] = {}
    for j, joint in enumerate(log.joints):
        for why in _by_motion(velocity[ok[:, j], j], effort[ok[:, j], j]):
            ways.setdefault(why, []).append(joint)
    out += [f"{why} ({_names(joints, log.joints)})" for why, joints in ways.items()]
    return [Finding(log.name, "", "cannot_tell", 1.0, "1", "ok", text) for text in out]


def _by_motion(v: Array, effort: Array) -> list[str]:
    """What one joint's motion leaves open."""
    good = np.isfinite(effort)
    v, effort = v[good], effort[good]
    fast = float(np.quantile(np.abs(v), 0.95)) if v.size else 0.0
    if fast <= 0.0:
        return []
    moving = np.abs(v) > 0.02 * fast
    out = []
    if min((v[moving] > 0).mean(), (v[moving] < 0).mean()) < _BACK:
        out.append("dry friction from an offset: move both ways")
    if fast < _SPEEDS * float(np.quantile(np.abs(v[moving]), 0.1)):
        out.append("dry from viscous friction: move at speeds further apart")
    load = np.abs(effort[moving])
    if load.size and float(load.std()) < _LOADS * float(load.mean()):
        out.append("friction that grows with the load: vary pose or payload")
    return out


def _names(joints: Sequence[str], every: Sequence[str]) -> str:
    return "every joint" if len(joints) == len(every) > 1 else ", ".join(joints)
