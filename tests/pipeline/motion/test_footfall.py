"""Gaits by name against what the literature says of them, above all their stability margin."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.motion.feet import foot_course
from pipeline.motion.footfall import Footfall, named
from pipeline.motion.gait import Gait
from pipeline.motion.gait_table import GaitTable
from pipeline.motion.support import edge_distances
from pipeline.robot.robot_tables import LegSpec

PITCH, WIDTH, STROKE = 0.3, 0.5, 0.2  # [m]


def pairs(count: int) -> tuple[LegSpec, ...]:
    """Legs in pairs, one pitch apart from front to rear."""
    legs = []
    for side, y in (("left", WIDTH / 2), ("right", -WIDTH / 2)):
        for k in range(count):
            x = PITCH * ((count - 1) / 2 - k)
            name, foot = f"{side[0]}{k}", (x, y, -0.3)
            legs.append(LegSpec(name=name, joints=("j",), foot="f", side=side, neutral_foot=foot))
    return tuple(legs)


def walked(legs: tuple[LegSpec, ...], footfall: Footfall) -> Gait:
    stride = STROKE / footfall.duty
    return Gait(
        legs=tuple(leg.name for leg in legs),
        footfall=footfall,
        period=2.0,
        twist=np.array([stride / 2.0, 0.0, 0.0]),
        lift=0.05,
        neutral=np.array([leg.neutral_foot for leg in legs]),
        table=GaitTable(),
        source="test",
    )


def least_margin(gait: Gait) -> float:
    """Way ahead or behind to the support's edge, over the period, from the body's middle [m]."""
    least = np.inf
    for begin, end, stance in gait.footfall.stances():
        feet = []
        for name in stance:
            since = gait.footfall.since(name, begin, stood=True)
            local = (since + np.linspace(0, end - begin, 11)) / gait.footfall.duty
            feet.append(foot_course(gait, gait.legs.index(name), local, stands=True)[0])
        distance, inward = edge_distances(np.stack(feet, axis=1), np.zeros((11, 2)))
        ahead = np.abs(inward[..., 0])
        met = np.isfinite(distance) & (ahead > 1e-12)  # no way ahead meets an edge at the side
        way = distance[met] / ahead[met]
        least = min(least, float(way.min()))
    return least


@pytest.mark.parametrize(
    ("count", "duty"), [(2, 0.76), (2, 0.97), (3, 0.5), (3, 0.95), (4, 0.6), (5, 0.7)]
)
def test_wave_gaits_have_the_longitudinal_margin_of_song_and_waldron(
    count: int, duty: float
) -> None:
    """S = (n/2 - 1) P + (duty - 3/4) stride, for n legs on a side P apart."""
    legs = pairs(count)
    expected = (count / 2 - 1) * PITCH + (duty - 0.75) * STROKE / duty
    assert least_margin(walked(legs, named("wave", legs, duty))) == pytest.approx(expected)
