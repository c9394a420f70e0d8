"""Sentences of the method: screening, classes of rivals, intervals, and doubt about a size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from pipeline.effects.registry import catalogue, effect_named
from pipeline.identification import results as limits
from pipeline.identification.regression.design_matrix import make_benches
from pipeline.identification.regression.intervals import _certain
from pipeline.identification.regression.problem import Problem
from pipeline.identification.regression.refit import refit
from pipeline.identification.selection.candidate import Trial, try_candidate
from pipeline.identification.selection.identify import _doubt, identify
from pipeline.identification.selection.screen import Screen, score_all
from pipeline.identification.selection.select import _rivals, _threshold
from pipeline.logs.prepared.measurement import Measurement
from tests.pipeline.identification import bench_leg as leg

J2 = ("rm_joint_2",)
FRICTION = ("coulomb_friction", J2, {"torque": 0.4})
HEAVY = ("link_mass", ("rm_tibia_link",), {"mass": 0.4})
LATE = ("time_delay", ("effort channels",), {"delay": 0.004})


@pytest.fixture(scope="module")
def motion() -> Measurement:
    return leg.leg_motion()


def log_with(motion: Measurement, *hidden: tuple[str, tuple[str, ...], dict[str, float]]):  # type: ignore[no-untyped-def]
    truth = leg.leg_model()
    for name, place, values in hidden:
        truth = effect_named(name).apply(truth, place, values)
    return leg.measured(truth, motion)


def problem_of(log: Measurement) -> Problem:
    return refit(Problem(leg.leg_model(), make_benches([log]), log.noise))


@pytest.fixture(scope="module")
def friction(motion: Measurement) -> Problem:
    return problem_of(log_with(motion, FRICTION))


@pytest.mark.parametrize("hidden", [FRICTION, HEAVY, LATE], ids=lambda h: str(h[0]))
def test_screening_tells_what_a_full_solve_would_gain(motion: Measurement, hidden) -> None:  # type: ignore[no-untyped-def]
    """Also where tolerances stand back for a candidate: what they had explained is not its own."""
    problem = problem_of(log_with(motion, hidden))
    scores = score_all(Screen(problem), catalogue(problem.current()))
    stands_back = 0
    for score in scores:
        if score.gain == 0.0:  # implausible, or of the wrong sign
            continue
        solved = try_candidate(problem, score).gain
        assert score.gain == pytest.approx(solved, rel=1e-4, abs=1e-4), (score.effect, score.place)
        stands_back += bool(problem.absorbed(score.effect, score.place))
    assert stands_back >= 5


def test_noise_does_not_put_the_truth_outside_its_class(friction: Problem) -> None:
    """Of two effects that differ by d standard deviations on a log, noise prefers the wrong one by
    more than T with chance Q((T + d^2) / 2 d), at most Q(sqrt(T)): below 1e-5 for any d. And what
    is worth a name at all is no class with nothing.
    """
    faint = replace(_friction_trial(friction), gain=100.0, significance=100.0, scale=1.0)
    threshold = _threshold(faint)
    d = np.linspace(0.1, 30.0, 3000)
    assert norm.sf((threshold + d**2) / (2.0 * d)).max() < 1e-5
    assert threshold < limits.LEAST_GAIN


@pytest.mark.parametrize(("behind", "rival"), [(0.0, True), (20.0, True), (30.0, False)])
def test_what_explains_the_log_as_well_is_a_rival(
    friction: Problem, behind: float, rival: bool
) -> None:
    """Less than five standard deviations behind it is one class with the winner."""
    winner = _friction_trial(friction)
    score = Screen(friction).score(effect_named("load_dependent_friction"), J2, {})
    assert score is not None
    other = replace(try_candidate(friction, score), gain=winner.gain - behind)
    keys = _rivals(friction, winner, [winner, other])
    assert keys == ((other.key,) if rival else ())


def _friction_trial(problem: Problem) -> Trial:
    score = Screen(problem).score(effect_named("coulomb_friction"), J2, {})
    assert score is not None
    return try_candidate(problem, score)


def test_no_interval_is_narrower_than_laws_are_true(
    motion: Measurement, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However quiet the log: a law of friction holds to a per cent or so, and so does its value."""
    quiet = 1e-3
    monkeypatch.setattr(leg, "CURRENT", quiet * leg.CURRENT)
    monkeypatch.setattr(leg, "VOLTAGE", quiet * leg.VOLTAGE)
    log = log_with(replace(motion, noise=quiet * motion.noise), FRICTION)
    (found,) = identify(leg.leg_model(), [log]).naming.found
    (torque,) = found.parameters
    assert (found.effect, found.place) == FRICTION[:2]
    assert torque.low <= FRICTION[2]["torque"] <= torque.high
    for width in (torque.value - torque.low, torque.high - torque.value):
        assert 0.01 * torque.value < width < 0.05 * torque.value


def test_a_size_that_may_be_nothing_is_doubted_and_no_other(motion: Measurement) -> None:
    result = identify(leg.leg_model(), [log_with(motion, FRICTION)])
    assert [f.level for f in result.naming.found] == ["confirmed"]
    assert _doubt(result.problem, 0, certain=True) == ""
    assert "may be nothing at all" in _doubt(result.problem, 0, certain=False)


def test_a_size_is_certain_beyond_two_standard_deviations() -> None:
    draws = np.random.default_rng(0).normal(size=(4000, 2)) * [0.1, 3.0]
    assert _certain(np.array([0.25, 0.0]), draws)
    assert not _certain(np.array([0.15, 0.0]), draws)
    assert not _certain(np.zeros(2), draws)
    # Two coordinates together need more: chi-square of two degrees of freedom.
    assert not _certain(np.array([0.2, 3.0]), draws)
    assert _certain(np.array([0.2, 6.0]), draws)
