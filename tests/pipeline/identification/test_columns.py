"""What competes on a log: columns that one prediction serves, places and orders on offer."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.effects.bodies import AXES, LinkMass, last_links
from pipeline.effects.motor import TorqueRipple
from pipeline.effects.registry import effect_named
from pipeline.identification.regression.design_matrix import (
    Accepted,
    effect_columns,
    make_data_sets,
)
from pipeline.identification.regression.floor import left_open
from pipeline.identification.regression.problem import Problem
from pipeline.identification.regression.tolerances import grouped, nuisance_column
from pipeline.identification.results import UNCERTAINTIES
from pipeline.identification.selection.pool import make_pool
from pipeline.logs.prepared.measurement import TEST, TRAIN, VALIDATION, Measurement
from pipeline.machine.machine import MachineModel, machine_of_robot
from tests.pipeline.identification import bench_leg as leg
from tests.pipeline.robot.walkers import MIXED, walker

J2 = ("rm_joint_2",)
COULOMB = effect_named("coulomb_friction")


def problem_of(log: Measurement, model: MachineModel | None = None) -> Problem:
    return Problem(leg.leg_model() if model is None else model, make_data_sets([log]), log.noise)


@pytest.fixture(scope="module")
def walking(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    """Legs of two to seven joints and an arm, with measured feet."""
    model = machine_of_robot(walker(tmp_path_factory.mktemp("mixed"), MIXED, arm=True), None)
    rng, n, j = np.random.default_rng(3), 60, len(model.joints)
    block = np.arange(n) // 6
    part = np.array([TRAIN, VALIDATION, TEST], dtype=np.int8)[block % 3]
    q, v, a = (rng.normal(0.0, 0.3, (n, j)) for _ in range(3))
    log = Measurement(
        name="made",
        time=np.arange(n) / 100.0,
        joints=model.joints,
        q=q,
        v=v,
        a=a,
        channels=("torque",),
        effort=rng.normal(size=(n, j, 1)),
        noise=np.full((j, 1), 0.01),
        mask=np.ones((n, j), dtype=np.bool_),
        part=part,
        block=block,
        pieces=(slice(0, n),),
        rest_speed=np.full(j, 1e-3),
        standing=np.ones((n, len(MIXED)), dtype=np.bool_),
        foot_force=rng.normal(20.0, 5.0, (n, len(MIXED), 3)),
    )
    return problem_of(log, model)


def same(one: dict[int, np.ndarray], other: dict[int, np.ndarray]) -> None:
    assert set(one) == set(other)
    for joint, column in one.items():
        np.testing.assert_allclose(column, other[joint], atol=1e-6 * abs(other[joint]).max())


def test_columns_of_legs_alike_and_not_are_those_of_each_alone(walking: Problem) -> None:
    """One prediction serves the like tolerances of all legs, whatever legs and joints these are."""
    data_set, base = walking.data_sets[0], walking.predictions[0]
    groups = grouped(walking.model, data_set.measurement, walking.tolerances)
    assert max(len(g) for g in groups) == len(MIXED)
    for nuisance, column in zip(walking.tolerances, walking.tolerance_columns(0), strict=True):
        same(column, nuisance_column(data_set, base, nuisance, walking.sigma))
    payload = LinkMass()
    for place in payload.places(walking.model, data_set.measurement):
        alone = effect_columns(data_set, base, payload, place, {}, walking.sigma)
        for one, other in zip(walking.columns(0, payload, place, {}), alone, strict=True):
            same(one, other)


def test_a_payload_is_offered_where_it_is() -> None:
    model = leg.leg_model()
    (link,) = last_links(model)
    where = dict(zip(AXES, (0.02, -0.05, 0.21), strict=True))
    truth = COULOMB.apply(
        LinkMass().apply(model, (link,), {"mass": 1.5, **where}), J2, {"torque": 1}
    )
    log = leg.only(leg.measured(truth, leg.leg_motion()), ("current",))
    offered = [t for t in make_pool(problem_of(log)).terms if isinstance(t.effect, LinkMass)]
    shape, _ = [t.shape for t in offered if t.shape]  # beside friction, and beside none
    for axis, value in where.items():
        assert shape[axis] == pytest.approx(value, abs=0.02)


def test_the_strongest_order_of_a_ripple_is_offered_first() -> None:
    ripple, log = TorqueRipple(), leg.leg_motion()
    values = {"amplitude": 0.5, "order": 37.3, "phase": 0.4}
    truth = COULOMB.apply(ripple.apply(leg.leg_model(), J2, values), J2, {"torque": 1.0})
    log = leg.only(leg.measured(truth, log), ("current",))
    terms = [t for t in make_pool(problem_of(log)).terms if isinstance(t.effect, TorqueRipple)]
    first = next(t for t in terms if t.place == J2)
    orders = ripple.orders(log, 1)
    assert first.shape["order"] == pytest.approx(37.3, abs=float(orders[1] - orders[0]))
    # Those beside it are other orders, not the same once more.
    own = [t.shape["order"] for t in terms if t.place == J2]
    assert np.diff(np.sort(own)).min() > 3 * (orders[1] - orders[0])


def test_what_a_log_leaves_open_is_its_tolerances_and_the_scatter_of_estimates() -> None:
    log = leg.only(leg.measured(leg.leg_model(), leg.leg_motion(duration=8.0)), ("current",))
    none = problem_of(log)
    none = none.judged(UNCERTAINTIES[0], none.weights)
    # Of tolerances alone, each by its stated size.
    data_set, square = none.data_sets[0], np.zeros(3)
    rows = data_set.parts[TEST]
    priors = none.precision[: len(none.tolerances)]
    for column, prior in zip(none.tolerance_columns(0), priors, strict=True):
        for j, x in column.items():
            square[j] += float(np.sum(x[rows, 0] ** 2)) / prior / data_set.weight**2
    count = log.mask[data_set.rows[rows]].sum(axis=0)
    expected = np.sqrt(square / count) * none.sigma[:, 0]
    np.testing.assert_allclose(left_open(none)[:, 0], expected, rtol=1e-9)
    # An estimate that one log alone made adds its scatter, at its joint only.
    friction = none.with_accepted([Accepted(COULOMB, J2, {"torque": 0.3}, {})])
    more = left_open(friction)[:, 0] ** 2 - expected**2
    assert more[1] > 0.0
    assert abs(more[[0, 2]]).max() < 1e-9 * more[1] + 1e-12
