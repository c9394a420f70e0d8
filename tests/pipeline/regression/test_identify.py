"""The whole identification on small arms whose truth is known."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.regression.errors import RegressionError
from pipeline.regression.identify import Options, identify
from pipeline.regression.laws.friction import LAWS, kind
from pipeline.regression.preprocess import Run, low_pass, rows
from pipeline.regression.result import Level, Result
from pipeline.regression.statistics.bandwidth import prepare
from tests.pipeline.regression.arms import arm, heavier, log

FEW = Options(draws=10)


def coulomb_viscous(c: float, d: float):
    return lambda v, load: c * np.sign(v) + d * v


def test_error(result: Result, run: Run, cutoff: float) -> float:
    r = rows([run], cutoff=cutoff, rate=200.0)
    return float(np.sqrt(((r.tau - result.predict(r.q, r.v, r.a, 200.0, cutoff)) ** 2).mean()))


test_error.__test__ = False  # type: ignore[attr-defined]


@pytest.fixture(scope="module")
def wrong_arm() -> tuple[Result, Run, float, Run]:
    """Bodies 20 % off, three laws of friction, coloured noise."""
    laws = {
        0: coulomb_viscous(0.8, 0.0),
        1: coulomb_viscous(0.5, 0.6),
        2: lambda v, load: np.zeros_like(v),
    }
    model = arm()
    train, test = log(heavier(model, {1: 1.2, 2: 0.8}), laws, seconds=60)
    prepared = prepare([train], model)
    return identify(prepared, model, options=FEW), test, prepared.cutoff, train


def test_bodies_that_are_off_are_refitted_and_friction_named_beside(wrong_arm) -> None:
    result = wrong_arm[0]
    assert result.refit
    assert [f.law for f in result.friction] == ["Coulomb", "Coulomb and viscous", "none"]
    assert {(t.place, t.kind) for t in result.terms if t.level is Level.CONFIRMED} == {
        ("joint_1", "Coulomb"),
        ("joint_2", "Coulomb"),
        ("joint_2", "viscous"),
    }


def test_sizes_lie_in_their_intervals(wrong_arm) -> None:
    truth = {
        ("joint_1", "Coulomb"): 0.8,
        ("joint_2", "Coulomb"): 0.5,
        ("joint_2", "viscous"): 0.6,
    }
    for term in wrong_arm[0].terms:
        if (true := truth.get((term.place, term.kind))) is not None:
            # Intervals of 95 %: three of them, widened to what three should all hold.
            wide = 1.4 * 0.5 * (term.high - term.low)
            assert abs(term.value - true) < wide
            assert term.high - term.low < 0.2


def test_the_model_predicts_rows_it_never_saw_to_their_noise(wrong_arm) -> None:
    result, test, cutoff, _ = wrong_arm
    assert test_error(result, test, cutoff) < 1.5 * np.sqrt(
        np.mean([n.level**2 for n in result.noise])
    )


def test_base_parameters_hold_the_truth(wrong_arm) -> None:
    base = wrong_arm[0].base
    assert wrong_arm[0].condition > 1
    far = [b for b in base if abs(b.far) > 0]
    assert len(far) == len(base) > 10
    assert all(b.low <= b.value <= b.high for b in base)


def test_friction_is_a_function_of_speed_and_load(wrong_arm) -> None:
    friction = wrong_arm[0].friction[1]
    high, low = friction(np.array([2.0, -2.0]))
    assert high == pytest.approx(0.5 + 0.6 * 2.0, rel=0.1)
    assert low == pytest.approx(-high, rel=1e-6)


def test_a_true_urdf_is_left_alone() -> None:
    model = arm(2)
    train, _ = log(model, {0: coulomb_viscous(0.4, 0.0)}, seconds=40, seed=3)
    result = identify(prepare([train], model), model, options=FEW)
    assert not result.refit
    assert [f.law for f in result.friction] == ["Coulomb", "none"]


def test_a_motor_that_turns_with_another_joint_is_found() -> None:
    model = arm(3)
    own = coulomb_viscous(0.3, 0.0)
    train, _ = log(
        model, {0: own, 1: own}, coupled=(2, 1, coulomb_viscous(0.4, 0.3)), seconds=60, seed=4
    )
    result = identify(prepare([train], model), model, options=FEW)
    assert [(c.motor, c.other, c.ratio) for c in result.couplings] == [(2, 1, 1.0)]
    sizes = {t.term.split(":")[1]: t.value for t in result.terms if ":" in t.term}
    assert sizes["coulomb"] == pytest.approx(0.4, rel=0.15)
    assert sizes["viscous"] == pytest.approx(0.3, rel=0.15)


def test_a_law_outside_the_catalogue_is_not_given_a_name() -> None:
    def bump(v, load):
        return 0.5 * np.sign(v) * (0.3 + 2 * np.exp(-(((np.abs(v) - 1.0) / 0.2) ** 2)))

    model = arm(2)
    train, _ = log(model, {1: bump}, seconds=60, noise=0.01, seed=5)
    prepared = prepare([train], model)
    result = identify(prepared, model, options=FEW)
    friction = result.friction[1]
    assert friction.law == "a law that is not in the catalogue"
    assert friction.level is Level.APPROXIMATE
    assert friction(np.array([1.0]))[0] == pytest.approx(bump(np.array([1.0]), 0)[0], rel=0.3)
    assert friction(np.array([0.4]))[0] < 0.5 * friction(np.array([1.0]))[0]


def test_the_same_rows_give_the_same_answer() -> None:
    model = arm(2)
    train, _ = log(model, {0: coulomb_viscous(0.4, 0.2)}, seconds=25, seed=6)
    prepared = prepare([train], model)
    first, second = (identify(prepared, model, options=FEW) for _ in range(2))
    assert first.terms == second.terms
    assert first.sizes == second.sizes


def test_too_few_rows_are_refused_with_their_number() -> None:
    model = arm(2)
    train, _ = log(model, {}, seconds=1.0)
    with pytest.raises(RegressionError, match="expected 4 or more"):
        identify(rows([train], cutoff=5.0), model)


def test_another_number_of_joints_is_refused() -> None:
    train, _ = log(arm(2), {}, seconds=5.0)
    with pytest.raises(RegressionError, match="3 joints, the rows 2"):
        identify(rows([train], cutoff=5.0), arm(3))


def test_the_cutoff_keeps_the_motion_and_leaves_out_what_a_rigid_arm_does_not_do() -> None:
    model = arm(2)
    train, _ = log(model, {}, seconds=40, seed=7)
    # A vibration of the position that no rigid arm would have at that torque.
    t = train.time[:, None]
    shaken = Run(train.time, train.q + 2e-4 * np.sin(2 * np.pi * 23 * t), train.tau)
    cutoff = prepare([shaken], model).cutoff
    assert 0.8 < cutoff < 23


def test_low_pass_has_no_phase_and_half_amplitude_at_the_cutoff() -> None:
    t = np.arange(0, 10, 0.005)
    x = np.sin(2 * np.pi * 5 * t)[:, None]
    y = low_pass(x, 200.0, 5.0)[500:-500]
    np.testing.assert_allclose(y, 0.5 * x[500:-500], atol=0.01)


def test_every_law_is_made_of_terms_that_have_a_kind_and_a_unit() -> None:
    assert {kind(t) for law in LAWS for t in law.terms} <= {
        "Coulomb",
        "viscous",
        "quadratic",
        "by direction",
        "load-dependent",
        "Stribeck",
        "saturating",
    }
    assert len({(law.name, law.terms) for law in LAWS}) == len(LAWS)
