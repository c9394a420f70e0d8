"""What has no name is taken by the general member, which is absent in a clean log."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pipeline.identification.general import _played, columns_of
from tests.pipeline.identification import bench_leg as leg


def test_a_play_follows_at_its_radius() -> None:
    m = leg.leg_motion(duration=4.0)
    q = 0.5 * np.sin(2.0 * np.pi * 0.5 * m.time)
    pushed = _played(m, q, 0.1)
    assert np.abs(pushed).max() <= 1.0 + 1e-12
    # Behind a reversal it takes two radii until the other side pushes.
    moving = np.abs(np.gradient(q, m.time)) > 0.5
    sure = np.abs(pushed[moving]) > 0.999
    assert sure.mean() > 0.5
    assert (np.sign(pushed[moving][sure]) == np.sign(np.gradient(q, m.time)[moving][sure])).all()


def test_columns_have_no_mean_and_a_joint_at_rest_has_none() -> None:
    m = leg.leg_motion(duration=4.0)
    for x in columns_of(m, 0, [m]).values():
        np.testing.assert_allclose(x.mean(axis=0), 0.0, atol=1e-9)
    still = replace(m, q=np.zeros_like(m.q))
    assert columns_of(still, 0, [still]) == {}
