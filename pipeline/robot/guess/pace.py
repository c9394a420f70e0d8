"""A slow walk that the legs can do: stroke and lift within reach and limits, period and speed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from actuators.arrays import Array
from pipeline.robot.guess.stance import Stance
from pipeline.robot.inverse.least_motion import freedoms
from pipeline.robot.inverse_kinematics import ACCEPTED, reach
from pipeline.robot.kinematics import foot_positions
from pipeline.robot.leg_chains import LegChains

_FIRST = 0.3  # stroke over the height of the hips, if the legs allow
_SHRINK = 0.85
_TRIES = 20
_CUT, _SHORTER = 0.7, 4  # of a stroke that the gait does not allow, and how often
_LIFT = 0.4  # over the stroke
_SIDE = 0.25  # room to the sides, over the stroke: the body sways
#: Over the stroke: how far the foot of a leg that lacks a direction may leave its path.
_ASTRAY = 0.25
_PERIOD = 2.0  # [s] of a robot whose hips are at _HEIGHT
_HEIGHT = 0.3  # [m]


@dataclass(frozen=True)
class Pace:
    """Numbers of a walk."""

    stroke: float  #: Of the feet [m].
    lift: float  #: Of the feet [m].
    period: float  #: [s].


def find_pace(chains: LegChains, stance: Stance, limits: tuple[Array, Array]) -> Pace | None:
    """The longest stroke of a row of shorter and shorter ones that every leg can do.

    `limits`: lower and upper of the legs' joints, each (L, K) [rad, m]. Returns None where the legs
    cannot take even the shortest.
    """
    height = float((chains.offset[0, :, 2] - stance.feet[:, 2]).mean())
    about = replace(chains, nominal=stance.posture)
    follows = np.array([not own.lacks for own in freedoms(about)])
    room = np.where(follows[:, None], 1.0, [1.0, 0.0, 1.0])  # which corners a leg is to reach

    def possible(stroke: float, lift: float) -> bool:
        """Feet reach all corners of a step, with room to the sides, within the limits."""
        x, y, z = stroke / 2, _SIDE * stroke, lift
        corners = [(a * x, b * y, c * z) for a in (-1, 0, 1) for b in (-1, 0, 1) for c in (0, 1)]
        target = stance.feet + np.array(corners)[:, None, :] * room
        q, miss = reach(about, target, stance.posture)
        inside = (q >= limits[0]) & (q <= limits[1]) | ~about.real
        off = np.linalg.norm(foot_positions(about, q) - target, axis=-1)
        return bool(miss.max() <= ACCEPTED and off.max() <= _ASTRAY * stroke and inside.all())

    # A leg that lacks a direction leaves its path when it lifts its foot: less lift, less of that.
    shares = (_LIFT,) if follows.all() else (_LIFT, _LIFT / 2, _LIFT / 4)
    strokes = [_rounded(_FIRST * height * _SHRINK**k) for k in range(_TRIES)]
    if not possible(strokes[-1], _rounded(shares[-1] * strokes[-1])):
        return None
    for stroke in strokes:
        for share in shares:
            if possible(stroke, lift := _rounded(share * stroke)):
                # Robots of one shape walk alike where the period goes with the root of height.
                return Pace(stroke, lift, _rounded(_PERIOD * (height / _HEIGHT) ** 0.5))
    return None


def shorter(pace: Pace | None) -> Iterator[Pace]:
    """Shorter and shorter strokes and lifts, for a gait that asks more than feet alone do."""
    for k in range(1, _SHORTER + 1 if pace else 0):
        assert pace is not None
        stroke = _rounded(pace.stroke * _CUT**k)
        yield Pace(stroke, _rounded(pace.lift * _CUT**k), pace.period)


def _rounded(value: float) -> float:
    """Two significant digits."""
    return float(f"{value:.2g}")
