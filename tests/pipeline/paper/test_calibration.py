"""The fit of the paper's unpublished numbers against ways to the same answer without it."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import emcee
import numpy as np
import pytest
from scipy import stats

from pipeline.paper.calibration import (
    SOLVED,
    Bank,
    Point,
    Posterior,
    Target,
    bank,
    moves,
    sample,
    shipped,
)
from pipeline.paper.hexapod import Outcome, chain_at
from pipeline.paper.published import HELD, KEYS


@pytest.fixture(scope="module")
def own() -> Bank:
    return bank(3, 6)


@pytest.fixture(scope="module")
def density(own: Bank) -> Posterior:
    return Posterior(shipped(), own)


@pytest.fixture(scope="module")
def walkers(density: Posterior) -> np.ndarray:
    """From the prior, with a density (3, D)."""
    rng = np.random.default_rng(5)
    found = np.empty((0, density.size))
    while len(found) < 3:
        x = density.start(rng, 100)
        found = np.concatenate([found, x[np.isfinite(density(x))]])
    return found[:3]


@pytest.fixture(scope="module")
def best(study: dict[str, Any]) -> Point:
    near = study["nearest"]
    constants = [near["constants"][key] for key in KEYS]
    return Point(near["path"], np.array(near["z"]), np.array(constants))


def point(density: Posterior, x: np.ndarray) -> Point:
    """A walker (size,) as a set of numbers."""
    (z,) = density.evaluate(x[None])[1]
    return Point(str(density.robots.paths[int(x[0])]), z, x[density.constants][: len(KEYS)])


def test_many_sets_at_once_are_each_set_by_itself(density, walkers):
    """What walkers ask for comes out of the exact machine: solved targets, all others, limits."""
    for x in walkers:
        values, excess = density.task.evaluate(point(density, x))
        assert excess.max() <= 0
        assert values["irreversible_leg_energy_3s"] == 0
        assert values[HELD] == pytest.approx(-x[density.constants][-1], rel=1e-7)
        for name, aim in zip(density.aimed, x[density.aims], strict=True):
            target = density.targets[name]
            wanted = target.centre + aim * target.half_width
            assert values[name] == pytest.approx(wanted, abs=1e-3 * target.half_width)
        for name, target in density.targets.items():
            missed = abs(values[name] - target.centre)
            assert missed <= target.half_width * (1 + 1e-3), name


def test_the_density_is_the_priors_over_the_slope_of_every_solved_target(density, walkers):
    """N(z) of all coordinates, and |dz / dt| of those that a target t took the place of."""
    log, found = density.evaluate(walkers)
    sets = density.sets(walkers)
    expected = -0.5 * (walkers[:, density.numbers] ** 2).sum(axis=1)
    for name, column in density.solved.items():
        z = found[:, column]
        both = [density.target(name, sets.at(column, z + d)) for d in (-1e-4, 1e-4)]
        slope = (both[1] - both[0]) / 2e-4
        expected += -0.5 * z**2 - np.log(np.abs(slope))
        sets = sets.at(column, z)
    np.testing.assert_allclose(log, expected, atol=0.02)


def test_a_set_beyond_a_motors_limit_has_no_density(own, density, walkers):
    task, sets = density.task, density.sets(walkers)
    sets = replace(sets, z=density.evaluate(walkers)[1])
    values, motor = task.values(sets.z, sets.constants), task.catalog.chain("ideal").motor
    chains = [chain_at(task.catalog, name, values) for name in task.catalog.alternatives]
    every = [Outcome(sets.demand, chain).excess for chain in chains]
    for quantity, key in (("speed", "max_speed"), ("current", "peak_current")):
        peak = (1 + np.max([own[quantity] for own in every], axis=0)) * getattr(motor, key)
        catalog = task.catalog.replaced(f"motor_re40_24v.{key}", 0.95 * peak.min())
        assert np.isneginf(Posterior(replace(task, catalog=catalog), own)(walkers)).all(), quantity


def test_a_target_rises_or_falls_with_the_number_that_is_solved_for(density):
    """Else two sets would give one target, and the density would miss one of them."""
    sets = density.sets(density.start(np.random.default_rng(2), 20))
    assert density.solved.keys() == SOLVED.keys()
    for name, column in density.solved.items():
        along = np.linspace(*density.task.prior.ends[:, column], 9)
        values = [density.target(name, sets.at(column, np.full(20, z))) for z in along]
        steps = np.diff(values, axis=0)
        assert (steps > 0).all() or (steps < 0).all(), name


class Bell:
    """A Gaussian in place of the posterior: two continuous coordinates, a robot, constants."""

    continuous, constants, size = np.array([1, 2]), slice(3, 7), 7
    robots = SimpleNamespace(z=np.zeros((5, 1)))
    task = shipped()

    def start(self, rng: np.random.Generator, count: int) -> np.ndarray:
        return np.concatenate([np.zeros((count, 1)), rng.normal(size=(count, 6))], axis=1)

    def __call__(self, x: np.ndarray) -> np.ndarray:
        z = (x[:, self.continuous] - [0.6, -0.5]) / [0.5, 0.9]
        inside = (x[:, 0] >= 0) & (x[:, 0] < 5)
        return np.where(inside, -0.5 * (z**2).sum(axis=1), -np.inf)


def test_steps_towards_another_gaussian_leave_the_density_as_it_is():
    bell: Any = Bell()
    rng = np.random.default_rng(3)
    kinds = moves(bell, rng, np.zeros(2), np.array([[1.0, 0.0], [0.4, 1.2]]))
    sampler = emcee.EnsembleSampler(60, bell.size, bell, moves=kinds, vectorize=True)
    sampler.random_state = np.random.RandomState(4).get_state()
    sampler.run_mcmc(bell.start(rng, 60), 2500, skip_initial_state_check=True)
    found = sampler.get_chain()[300:].reshape(-1, bell.size)
    np.testing.assert_allclose(found[:, 1:3].mean(axis=0), [0.6, -0.5], atol=0.04)
    np.testing.assert_allclose(found[:, 1:3].std(axis=0), [0.5, 0.9], rtol=0.05)
    share = np.bincount(found[:, 0].astype(int)) / len(found)
    np.testing.assert_allclose(share, 0.2, atol=0.03)


def test_the_files_hold_the_nearest_point(best, spec, catalog):
    prior = shipped().prior
    values = zip((*prior.keys, *KEYS), (*prior.values(best.z), *best.constants), strict=True)
    for key, value in values:
        owner, name = key.split(".")
        entry = spec.parameters.parameter(name) if owner == "robot" else catalog.parameter(key)
        assert entry.value == pytest.approx(value, rel=1e-6), key
        assert entry.basis == "calibrated"
        assert entry.interval is not None
    assert spec.gait["transfer_path"] == best.path


def test_a_point_is_admissible_with_every_row_met_and_no_limit_exceeded(best):
    values, excess = shipped().evaluate(best)
    assert shipped().admissible(values, excess)
    for name, target in shipped().targets.items():
        for factor, good in ((0.99, True), (1.01, False)):
            changed = values | {name: target.centre + factor * target.half_width}
            assert shipped().admissible(changed, excess) == good, name
    assert not shipped().admissible(values, np.array([1e-6]))
    assert shipped().admissible(values, np.array([0.0]))


def one_drawn(wide: Posterior, rng: np.random.Generator) -> np.ndarray:
    """A draw of the prior inside the motor's limits, (size,)."""
    while True:
        x = wide.start(rng, 50)
        good = np.flatnonzero(np.isfinite(wide(x)))
        if good.size:
            return x[good[0]]


def printed(wide: Posterior, truth: np.ndarray, rng: np.random.Generator) -> dict[str, Target]:
    """The targets as a paper would print them of the truth, somewhere inside their widths."""
    values, _ = shipped().evaluate(point(wide, truth))
    targets = shipped().targets
    centre = {n: values[n] + rng.uniform(-1, 1) * t.half_width for n, t in targets.items()}
    # Where in its width the torque of Table VI lies is drawn together with the motor's constants.
    centre[HELD] = values[HELD] + targets[HELD].centre + truth[wide.constants][-1]
    return {name: t._replace(centre=centre[name]) for name, t in targets.items()}


def ranks_of_the_truth(replicates: int) -> dict[str, list[float]]:
    """Where the truth lies among the draws of its own posterior, number by number."""
    own, rng = bank(4, 60), np.random.default_rng(11)
    wide = Posterior(shipped(), own, {})
    ranks: dict[str, list[float]] = {}
    for seed in range(replicates):
        truth = one_drawn(wide, rng)
        density = Posterior(shipped(), own, printed(wide, truth, rng))
        chain = sample(density, [9, seed], 240)
        last = chain[[0, len(chain) // 2, -1]].reshape(-1, density.size)
        order = last[:, 0] - truth[0] + rng.uniform(-0.5, 0.5, len(last))  # robots are few
        below = density.evaluate(last)[1] < point(wide, truth).z
        columns = {shipped().prior.keys[i]: below[:, i] for i in wide.free} | {"robot": order < 0}
        for key, smaller in columns.items():
            ranks.setdefault(key, []).append(float(smaller.mean()))
    return ranks


@pytest.mark.slow
def test_ranks_of_the_truth_are_uniform_over_draws_of_the_prior():
    """Simulation-based calibration (Talts et al., arXiv 1804.06788).

    A set is drawn from the prior, its targets are printed, the posterior of what is printed is
    sampled: the rank of the truth among its draws is uniform in every number.
    """
    ranks = ranks_of_the_truth(40)
    p = {key: stats.kstest(column, "uniform").pvalue for key, column in ranks.items()}
    assert min(p.values()) > 0.01 / len(p)  # one in a hundred over all numbers together
