"""What is beside bodies and friction, found on arms that are wrong in other ways besides."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from pipeline.regression.identify import Options, identify
from pipeline.regression.laws.extras import MECHANICAL, Extra, Kind
from pipeline.regression.laws.friction import QUADRANT
from pipeline.regression.preprocess import Run
from pipeline.regression.result import Level, Result
from pipeline.regression.searching import GAIN, least_cost
from pipeline.regression.statistics.bandwidth import prepare
from tests.pipeline.regression.arms import Array, Law, arm, heavier, log

ALL = frozenset({*MECHANICAL, Kind.GAIN})
SECONDS = 60.0
Wrong = Callable[[Array, Array, Array], None]


def dry(c: float, d: float) -> Law:
    return lambda v, load: c * np.sign(v) + d * v


LAWS = {0: dry(0.5, 0.0), 1: dry(0.5, 0.3), 2: dry(0.2, 0.1)}


def tilted() -> tuple[object, Run]:
    """An arm on a slope, so that every joint feels its weight; its second link is too heavy."""
    model = arm(3)
    model.gravity.linear = np.array([4.0, 5.0, -7.4])
    return model, log(heavier(model, {1: 1.2}), LAWS, seconds=SECONDS, seed=4)[0]


def upright() -> tuple[object, Run]:
    model = arm(3)
    return model, log(heavier(model, {1: 1.2}), LAWS, seconds=SECONDS, seed=4)[0]


def found(machine: tuple[object, Run], wrong: Wrong, kinds: frozenset[Kind] = ALL) -> Result:
    model, run = machine
    q, tau = run.q.copy(), run.tau.copy()
    wrong(run.time, q, tau)
    rows = prepare([Run(run.time, q, tau)], model)
    return identify(rows, model, options=Options(draws=10, extras=kinds))


def kept(result: Result) -> list[tuple[Kind, int]]:
    return [(e.extra.kind, e.extra.joint) for e in result.extras]


def friction_is_what_it_was(result: Result) -> bool:
    return [f.law for f in result.friction] == [
        "Coulomb",
        "Coulomb and viscous",
        "Coulomb and viscous",
    ]


def nothing(t: Array, q: Array, tau: Array) -> None:
    """Wrong in no way."""


def spring(t: Array, q: Array, tau: Array) -> None:
    tau[:, 2] += 3.0 * (q[:, 2] - 0.3)


def ripple(t: Array, q: Array, tau: Array) -> None:
    tau[:, 2] += 0.3 * np.sin(23.0 * q[:, 2] + 0.7)


def late(t: Array, q: Array, tau: Array) -> None:
    tau[:, 1] = np.interp(t - 0.02, t, tau[:, 1])


def zero(t: Array, q: Array, tau: Array) -> None:
    q[:, 1] += 0.12


def too_little(t: Array, q: Array, tau: Array) -> None:
    tau[:, 1] *= 0.75


def all_too_little(t: Array, q: Array, tau: Array) -> None:
    tau *= 0.75


def bump(t: Array, q: Array, tau: Array) -> None:
    tau[:, 1] += 1.2 * np.exp(-(((q[:, 1] - 0.1) / 0.25) ** 2))


@pytest.mark.parametrize(
    ("machine", "wrong", "kind", "joint", "size"),
    [
        pytest.param(tilted, late, Kind.LATE, 1, 0.02, marks=pytest.mark.slow),
        pytest.param(upright, zero, Kind.ZERO, 1, 0.12, marks=pytest.mark.slow),
        (tilted, too_little, Kind.GAIN, 1, -0.25),
    ],
)
def test_what_is_wrong_is_found_alone_and_its_size_lies_in_the_interval(
    machine: Callable[[], tuple[object, Run]], wrong: Wrong, kind: Kind, joint: int, size: float
) -> None:
    result = found(machine(), wrong)
    assert kept(result) == [(kind, joint)]
    (one,) = result.extras
    assert one.level is Level.CONFIRMED
    # An interval of 95 %, half as wide again: one draw of the noise has to lie in it.
    assert abs(one.values[0] - size) < 1.5 * one.halves[0]
    assert one.halves[0] < 0.15 * abs(size)
    assert friction_is_what_it_was(result)


@pytest.mark.slow
def test_a_ripple_is_found_alone_with_its_order_and_both_its_sizes() -> None:
    result = found(tilted(), ripple)
    assert kept(result) == [(Kind.RIPPLE, 2)]
    (one,) = result.extras
    assert one.extra.order == pytest.approx(23.0, abs=0.05)
    np.testing.assert_allclose(one.values, 0.3 * np.array([np.cos(0.7), np.sin(0.7)]), atol=0.012)
    assert friction_is_what_it_was(result)


def test_a_spring_is_found_alone_and_predicted_with_its_own_sign() -> None:
    """The model with the spring has a torque more that grows with the angle by its stiffness."""
    machine = tilted()
    result = found(machine, spring)
    assert kept(result) == [(Kind.SPRING, 2)]
    (one,) = result.extras
    assert abs(one.values[0] - 3.0) < 1.5 * one.halves[0] < 0.3
    offset = next(t for t in result.terms if t.place == "joint_3" and t.term == "offset")
    assert offset.value == pytest.approx(-3.0 * 0.3, abs=0.05)
    q = machine[1].q[:400]
    still = np.zeros_like(q)
    bare = replace(result, extras=()).predict(q, still, still)
    more = result.predict(q, still, still) - bare
    np.testing.assert_allclose(more[:, 2], one.values[0] * q[:, 2], atol=1e-9)
    assert friction_is_what_it_was(result)


def test_of_a_machine_with_friction_and_wrong_bodies_nothing_else_is_found() -> None:
    """Coloured noise of several percent, every link off."""
    model = arm(3)
    factors = {0: 0.8, 1: 1.3, 2: 0.7}
    run, _ = log(heavier(model, factors), LAWS, seconds=60, seed=8, noise=0.06)
    result = found((model, run), nothing)
    assert kept(result) == []
    assert friction_is_what_it_was(result)


def test_two_upright_joints_of_an_arm_that_is_right_have_no_extras() -> None:
    """The zero of the first is felt nowhere, which is no reason to fail."""
    model = arm(2)
    run, _ = log(model, {0: dry(0.4, 0.0)}, seconds=30, seed=3)
    assert kept(found((model, run), nothing)) == []


def test_a_scale_that_all_joints_share_is_that_of_the_bodies() -> None:
    result = found(tilted(), all_too_little)
    assert kept(result) == []
    assert result.refit
    sizes = {t.place: t.value for t in result.terms if t.kind == "Coulomb"}
    assert sizes["joint_2"] == pytest.approx(0.75 * 0.5, rel=0.1)


def test_a_torque_over_the_angle_without_a_name_is_not_called_a_spring() -> None:
    result = found(tilted(), bump)
    assert kept(result) == [(Kind.CURVE, 1)]
    assert not result.extras[0].extra.named


def quadrants(driving: float, driven: float, seed: int = 0) -> tuple[Array, Array, Array]:
    """Gram and moment of torque with friction by quadrant on |t| s and t, and its passive rows."""
    rng = np.random.default_rng(seed)
    torque, sign = rng.standard_normal(4000), np.sign(rng.standard_normal(4000))
    heavy = np.abs(torque) * sign
    power = np.sign(torque) * sign
    friction = heavy * np.where(power > 0, driving, driven)
    # Mean share in both quadrants, and half the difference, which has the torque's own shape.
    columns = np.column_stack([heavy, 0.5 * torque])
    rows = np.array([[-1.0, 0.5], [-1.0, -0.5]])
    seen = friction + 0.01 * rng.standard_normal(4000)
    return columns.T @ columns, columns.T @ seen, rows


def test_friction_by_quadrant_that_takes_energy_is_within_bounds() -> None:
    gram, moment, rows = quadrants(0.3, 0.1)
    bound, x = least_cost(gram, moment, [rows])
    free, _ = least_cost(gram, moment, [np.zeros((1, 2))])
    assert bound == pytest.approx(free, abs=1e-6)
    np.testing.assert_allclose(x, [0.2, 0.2], atol=2e-3)


def test_friction_by_quadrant_that_gives_energy_is_held_at_the_bound_and_costs() -> None:
    gram, moment, rows = quadrants(0.3, -0.3)
    bound, x = least_cost(gram, moment, [rows])
    free, _ = least_cost(gram, moment, [np.zeros((1, 2))])
    assert bound > free + 1.0
    assert (rows @ x).max() == pytest.approx(GAIN, abs=1e-6)


def by_quadrant(v: Array, load: Array) -> Array:
    """More of the load is lost while the motor drives than while it is driven, never gained."""
    return np.sign(v) * np.abs(load) * np.where(np.sign(load) * v > 0, 0.3, 0.12)


@pytest.mark.slow
def test_friction_by_quadrant_is_no_scale() -> None:
    model, _ = tilted()
    run, _ = log(model, {**LAWS, 1: by_quadrant}, seconds=SECONDS, seed=4)
    result = found((model, run), nothing)
    assert kept(result) == []
    assert result.friction[1].law.endswith("load-dependent by quadrant")


def test_a_general_law_may_differ_by_quadrant_until_a_scale_is_found() -> None:
    """Beside bodies of any size a scale at every joint would leave none to be told."""
    from pipeline.regression.state import State

    model, run = tilted()
    state = State(prepare([run], model), model, None, Options())
    assert all(QUADRANT in c.terms for c in state._general())
    state.extras = [Extra(Kind.GAIN, 1)]
    assert not any(QUADRANT in c.terms for c in state._general())
    assert [QUADRANT in c.terms for c in state._general(scaled=True)] == [True, False, True]
