"""What a column would be beside those that are told, against fitting it with them."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.regression.identify import Options, identify
from pipeline.regression.laws.bodies import Bodies
from pipeline.regression.result import Level
from pipeline.regression.statistics.bandwidth import prepare
from pipeline.regression.statistics.gram import Columns, system
from pipeline.regression.statistics.noise import Colour
from pipeline.regression.statistics.rivals import added
from pipeline.regression.statistics.solve import Fit, Prior, beyond_chance
from tests.pipeline.regression.arms import Array, arm, heavier, log


def fit_of(columns: dict[str, np.ndarray], tau: np.ndarray) -> Fit:
    """Regressions of one joint whose bodies are kept."""
    model = arm(1)
    bodies = Bodies.of(model)
    n, known = len(tau), np.zeros((len(tau), 1, bodies.nominal.size))
    all_columns = Columns(known, [columns], {}, np.zeros((n, 1)))
    blocks = [(k, k + n // 10) for k in range(0, n, n // 10)]
    noise = [Colour(np.zeros(0), 0.1, 0.1, 1.0)]
    one = system(all_columns, tau[:, None], blocks, noise)
    return Fit(one, Prior(bodies, 0.0, np.full(len(one.keys), 1e-9)))


def test_a_column_beside_others_is_what_a_fit_with_it_says() -> None:
    rng = np.random.default_rng(2)
    a, b = rng.normal(size=(2, 1000))
    c = 0.8 * a + 0.6 * rng.normal(size=1000)
    tau = a + 0.5 * b + 0.2 * c + 0.1 * rng.normal(size=1000)
    fit = fit_of({"a": a, "b": b, "c": c, "d": 0.7 * b + rng.normal(size=1000)}, tau)
    told, rivals = [("0", "a"), ("0", "b")], [("0", "c"), ("0", "d")]
    weight = np.ones(10)
    found = added(fit, weight, told, rivals)
    before = fit.solve(weight, fit.columns(told))
    for k, rival in enumerate(rivals):
        after = fit.solve(weight, fit.columns([*told, rival]))
        assert found.size[k] == pytest.approx(after[-1], rel=1e-6)
        assert found.moves[k] == pytest.approx(after[:-1] - before, rel=1e-5, abs=1e-9)
    assert found.error[0] == pytest.approx(0.1 / (0.6 * np.sqrt(1000)), rel=0.1)


def test_a_law_stands_only_where_the_log_tells_it_from_others() -> None:
    model = arm(1)
    model.gravity.linear = np.array([9.0, 0.0, -4.0])
    heavy = heavier(model, {0: 1.3})

    def quadrants(v: Array, load: Array) -> Array:
        drives = v * load > 0
        return np.sign(v) * np.abs(load) * np.where(drives, 0.25, 0.05)

    def share(v: Array, load: Array) -> Array:
        return 0.15 * np.sign(v) * np.abs(load)

    for law, bodies in ((quadrants, heavy), (share, heavy)):
        train, _ = log(bodies, {0: law}, seconds=60, seed=3)
        (found,) = identify(prepare([train], model), model, options=Options(draws=10)).friction
        # Half of the difference between the quadrants is a scale of the bodies: nobody can tell.
        assert found.law == "load-dependent"
        assert found.level is Level.APPROXIMATE


def test_what_nothing_else_could_be_is_confirmed() -> None:
    model = arm(2)
    train, _ = log(model, {0: lambda v, load: 0.4 * np.sign(v)}, seconds=40, seed=3)
    found = identify(prepare([train], model), model, options=Options(draws=10)).friction[0]
    assert (found.law, found.level) == ("Coulomb", Level.CONFIRMED)


def test_ranks_tell_what_a_mean_of_few_failures_does_not() -> None:
    rng = np.random.default_rng(1)
    first, second = 1.0 + rng.random(24), np.ones(24)
    assert beyond_chance(first, second, 0.05)
    first[3] = 1e4  # the mean has an error as large as itself now
    assert beyond_chance(first, second, 0.05)
    assert not beyond_chance(second, first, 0.05)
    assert not beyond_chance(rng.normal(size=24), rng.normal(size=24), 0.001)
