"""Estimates of effects together: never less likely, and what the columns and the noise are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.effects.registry import effect_named
from pipeline.identification.regression.design_matrix import Accepted, make_data_set, make_data_sets
from pipeline.identification.regression.problem import Problem
from pipeline.identification.regression.refit import gradient, refit
from pipeline.identification.selection.pool import make_pool
from pipeline.identification.selection.residual import fast_noise
from pipeline.identification.selection.search import Search
from pipeline.identification.selection.settle import as_accepted, estimated
from pipeline.logs.filters import LowPass
from pipeline.logs.prepared.measurement import Measurement
from tests.pipeline.identification import bench_leg as leg

J1, J2 = ("rm_joint_1",), ("rm_joint_2",)
COULOMB, STRIBECK = effect_named("coulomb_friction"), effect_named("stribeck_friction")
TRUE = {"coulomb": 0.3, "excess": 0.6, "velocity": 0.06}


@pytest.fixture(scope="module")
def log() -> Measurement:
    truth = STRIBECK.apply(leg.leg_model(), J2, TRUE)
    truth = COULOMB.apply(truth, J1, {"torque": 0.5})
    return leg.only(leg.measured(truth, leg.leg_motion(duration=8.0)), ("current",))


def problem_of(log: Measurement, *accepted: Accepted) -> Problem:
    return Problem(leg.leg_model(), make_data_sets([log]), log.noise).with_accepted(accepted)


def stribeck(coulomb: float, excess: float, speed: float) -> Accepted:
    return Accepted(STRIBECK, J2, {"coulomb": coulomb, "excess": excess}, {"velocity": speed})


@pytest.mark.parametrize("start", [(0.3, 0.6, 0.06), (0.0, 0.2, 0.15), (5.0, 5.0, 0.02)])
def test_estimating_anew_never_makes_a_log_less_likely(
    log: Measurement, start: tuple[float, float, float]
) -> None:
    before = problem_of(log, stribeck(*start), Accepted(COULOMB, J1, {"torque": 0.1}, {}))
    after = refit(before)
    assert after.cost() <= before.cost()
    at = after.accepted[0]
    assert min(at.x.values()) >= 0.0
    # Wherever it starts it ends where noise alone is left.
    rows = sum(c.count.sum() for c in make_pool(after, []).channels)
    assert after.cost() < 1.2 * rows
    assert at.shape["velocity"] == pytest.approx(TRUE["velocity"], rel=0.2)


def test_the_gradient_is_that_of_the_cost(log: Measurement) -> None:
    """Half the fall of the cost per step of each unknown, by central differences."""
    problem = problem_of(log, stribeck(0.25, 0.5, 0.08))
    downhill = gradient(problem, problem.matrices)
    (coordinates, shape) = problem.spans()[0]
    assert (coordinates.stop - coordinates.start, shape.stop - shape.start) == (2, 1)
    for k, (c, v, s) in enumerate([(1e-4, 0, 0), (0, 1e-4, 0), (0, 0, 1e-5)]):
        ends = [
            problem.with_accepted([stribeck(0.25 + q * c, 0.5 + q * v, 0.08 + q * s)]).cost()
            for q in (1.0, -1.0)
        ]
        slope = -0.5 * (ends[0] - ends[1]) / (2.0 * (c + v + s))
        assert downhill[coordinates.start + k] == pytest.approx(slope, rel=2e-3)


def test_unknowns_count_from_nothing_whatever_the_columns_were_made_about(
    log: Measurement,
) -> None:
    """About estimates the linear problem gives the same estimates back, not steps from them."""
    near = [Accepted(COULOMB, J1, {"torque": 0.5}, {}), stribeck(0.3, 0.6, 0.06)]
    problem = problem_of(log, *near)
    search = Search(make_pool(problem, []))
    _, found = estimated(search, as_accepted(search))
    assert found[0].x["torque"] == pytest.approx(0.5, rel=0.03)
    assert found[1].x["excess"] == pytest.approx(0.6, rel=0.1)


@pytest.mark.parametrize("cutoff", [np.inf, 25.0, 10.0])
def test_noise_is_told_from_a_motion_by_second_differences(cutoff: float) -> None:
    """White noise behind the log's own low-pass, on a slow curve ten times as large."""
    rng = np.random.default_rng(0)
    m = leg.only(leg.leg_motion(duration=60.0), ("current",))
    finite = np.isfinite(cutoff)
    kernel = LowPass(rate=leg.RATE, cutoff=cutoff).kernels[0] if finite else None
    m = replace(m, kernel=kernel, bandwidth=cutoff)
    data_set = make_data_set(m)
    white = rng.standard_normal((len(m), 1))
    noise = white[:, 0] if kernel is None else np.convolve(white[:, 0], kernel, "same")
    deviation = float(noise.std())
    slow = 10.0 * np.sin(0.7 * m.time)
    rest = (noise + slow)[data_set.rows] * data_set.weight
    rest[~m.mask[data_set.rows, 0]] = 0.0
    none = np.zeros(0, dtype=np.intp)
    told = fast_noise([data_set], [[]], [{0: rest[:, None]}], np.zeros(0), (0, 0), none)
    assert told == pytest.approx(deviation, rel=0.15)
