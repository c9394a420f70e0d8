"""The fit of the paper's unpublished numbers against ways to the same answer without it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import emcee
import numpy as np
import pytest
from scipy import stats

from actuators.loading.build import CATALOG, Catalog, load_catalog
from pipeline.paper import calibration
from pipeline.paper.calibration import (
    EXACT,
    ROBOT_FILE,
    SOLVED,
    Posterior,
    Robots,
    Target,
    agreement,
    base_problem,
    moves,
    nearest_point,
    robots,
    sample,
    sets_of,
    verdict,
)
from pipeline.paper.hexapod import outcome
from pipeline.paper.motor_constants import KEYS
from pipeline.paper.prior import Prior
from pipeline.paper.published import EXTRA, HELD
from pipeline.robot.robot_file import RobotSpec, load_robot_file


@pytest.fixture(scope="module")
def own() -> Robots:
    return robots(3, 6)


@pytest.fixture(scope="module")
def density(own: Robots) -> Posterior:
    return Posterior(base_problem(), own.demand)


@pytest.fixture(scope="module")
def walkers(density: Posterior) -> np.ndarray:
    """From the prior, with a density (3, D)."""
    rng = np.random.default_rng(5)
    found = np.empty((0, density.size))
    while len(found) < 3:
        x = density.start(rng, 100)
        found = np.concatenate([found, x[np.isfinite(density(x))]])
    return found[:3]


def test_many_sets_at_once_are_each_set_by_itself(
    own: Robots, density: Posterior, walkers: np.ndarray
) -> None:
    """What walkers ask for comes out of the exact machine: solved targets, all others, limits."""
    for x, found in zip(walkers, sets_of(density, own, walkers), strict=True):
        alone = replace(base_problem().along(found["path"]), constants=found["constants"])
        values, excess = alone.evaluate(np.array(found["z"]))
        assert excess.max() <= 0
        assert values["irreversible_leg_energy_3s"] == 0
        assert values[HELD] == pytest.approx(-x[density.constants][-1], rel=1e-7)
        for name, aim in zip(density.aimed, x[density.aims], strict=True):
            target = density.targets[name]
            wanted = target.centre + aim * target.half_width
            assert values[name] == pytest.approx(wanted, abs=1e-3 * target.half_width)
        for target in density.task.targets:
            missed = abs(values[target.name] - target.centre)
            assert missed <= target.half_width * (1 + 1e-3), target.name


def test_the_density_is_the_priors_over_the_slope_of_every_solved_target(
    density: Posterior, walkers: np.ndarray
) -> None:
    """N(z) of all coordinates, and |dz / dt| of those that a target t took the place of."""
    log, values = density.evaluate(walkers)
    sets = density.as_sets(walkers)
    expected = -0.5 * (walkers[:, density.numbers] ** 2).sum(axis=1)
    for name, free in density.solved.items():
        z = np.array([free.coordinate(value) for value in values[free.key]])
        both = [
            density.target(name, sets.with_number(free.key, free.at(z + d))) for d in (-1e-4, 1e-4)
        ]
        slope = (both[1] - both[0]) / 2e-4
        expected += -0.5 * z**2 - np.log(np.abs(slope))
        sets = sets.with_number(free.key, values[free.key])
    np.testing.assert_allclose(log, expected, atol=0.02)


def test_a_set_beyond_a_motors_limit_has_no_density(
    own: Robots, density: Posterior, walkers: np.ndarray
) -> None:
    found = density.as_sets(walkers)
    found = replace(found, values=density.evaluate(walkers)[1])
    motor = density.task.catalog.chain("ideal").motor
    chains = [density.chain(name, found.values) for name in density.task.catalog.alternatives]
    every = [outcome(found.demand, chain).excess for chain in chains]
    for quantity, key in (("speed", "max_speed"), ("current", "peak_current")):
        peak = (1 + np.max([own[quantity] for own in every], axis=0)) * getattr(motor, key)
        catalog = density.task.catalog.replaced(f"motor_re40_24v.{key}", 0.95 * peak.min())
        other = Posterior(replace(density.task, catalog=catalog), own.demand)
        assert np.isneginf(other(walkers)).all(), quantity


def test_a_target_rises_or_falls_with_the_number_that_is_solved_for(density: Posterior) -> None:
    """Else two sets would give one target, and the density would miss one of them."""
    x = density.start(np.random.default_rng(2), 20)
    sets = density.as_sets(x)
    assert density.solved.keys() == SOLVED.keys()
    for name, free in density.solved.items():
        numbers = (free.at(np.full(len(x), z)) for z in np.linspace(*free.ends, 9))
        values = [density.target(name, sets.with_number(free.key, n)) for n in numbers]
        steps = np.diff(values, axis=0)
        assert (steps > 0).all() or (steps < 0).all(), name


class Bell:
    """A Gaussian in place of the posterior: two continuous coordinates, a robot, constants."""

    continuous, constants, size = np.array([1, 2]), slice(3, 7), 7
    robots = SimpleNamespace(count=5)
    task = SimpleNamespace(
        feasible=SimpleNamespace(draws=lambda rng, count: rng.uniform(size=(count, 4)))
    )

    def start(self, rng: np.random.Generator, count: int) -> np.ndarray:
        return np.concatenate([np.zeros((count, 1)), rng.normal(size=(count, 6))], axis=1)

    def __call__(self, x: np.ndarray) -> np.ndarray:
        z = (x[:, self.continuous] - [0.6, -0.5]) / [0.5, 0.9]
        inside = (x[:, 0] >= 0) & (x[:, 0] < 5)
        return np.where(inside, -0.5 * (z**2).sum(axis=1), -np.inf)


def test_steps_towards_another_gaussian_leave_the_density_as_it_is() -> None:
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


def test_agreement_of_walkers_is_measured() -> None:
    """R-hat is 1 where walkers agree, far from it where each stays by itself."""
    values = np.random.default_rng(0).normal(size=(16, 40))
    assert agreement(values) < 1.05
    assert agreement(values + 2 * np.arange(16)[:, None]) > 1.5


def test_the_files_hold_the_nearest_point(
    results: dict[str, Any], spec: RobotSpec, catalog: Catalog, prior: Prior
) -> None:
    nearest = results["nearest"]
    for key, value in (prior.values(np.array(nearest["z"])) | nearest["constants"]).items():
        owner, name = key.split(".")
        entry = spec.parameters.parameter(name) if owner == "robot" else catalog.parameter(key)
        assert entry.value == pytest.approx(value, rel=1e-6), key
        assert entry.basis == "calibrated"
        assert entry.interval is not None
    assert spec.gait["transfer_path"] == nearest["path"]


def test_the_search_stays_at_the_stored_point(
    results: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    best = results["nearest"]
    monkeypatch.setattr(calibration, "_EVALUATIONS", (1, 1))
    found = nearest_point(best)
    assert found is not None
    np.testing.assert_allclose(found["z"], best["z"], atol=1e-3)


def test_a_point_is_admissible_with_every_row_met_and_no_limit_exceeded(
    results: dict[str, Any],
) -> None:
    best = results["nearest"]
    task = replace(base_problem().along(best["path"]), constants=best["constants"])
    values, excess = task.evaluate(np.array(best["z"]))
    assert task.admissible(values, excess)

    def changed(name: str, value: float) -> bool:
        return task.admissible({**values, name: value}, excess)

    for name in (*EXACT, "walking_ratio_rotor", EXTRA, "rotor_voltage_2", "robot_mass"):
        assert not changed(name, 1.01 * values[name] + 2.0), name
    for name in ("reversible_motor_torque_3", "rotor_motor_torque_2"):
        assert changed(name, 1.0), name  # a prediction, and what is contradicted
    assert not task.admissible(values, np.array([1e-6]))
    assert task.admissible(values, np.array([0.0]))


@pytest.mark.parametrize(
    ("shift", "spread", "word"),
    [
        (0.0, 0.85, "not determined"),
        (0.0, 0.84, "narrowed"),
        (0.0, 0.29, "determined"),
        (0.5, 0.6, "narrowed"),
        (-0.51, 0.95, "moved"),
        (1.96, 0.95, "moved"),
        (-1.97, 0.95, "driven out"),
    ],
)
def test_a_number_driven_from_the_prior_is_not_called_undetermined(
    shift: float, spread: float, word: str
) -> None:
    assert verdict(shift, spread, 1.0).startswith(word)


def test_what_is_found_is_written_into_copies_with_its_intervals(
    results: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The stored set written again leaves every value as it is, and the shipped files alone."""
    best = results["nearest"]
    z = np.array([*best["z"], *(best["constants"][key] for key in KEYS)])
    sets = z + 1e-3 * np.random.default_rng(1).normal(size=(16, 20, z.size)) * np.abs(z)
    posture = calibration.posture_of(best)
    monkeypatch.setattr(calibration, "calibrate", lambda *given: (best, sets, [posture]))
    shipped = [ROBOT_FILE, *CATALOG.glob("*.toml")]
    before = [path.read_bytes() for path in shipped]
    calibration.main(["--into", str(tmp_path)])
    assert [path.read_bytes() for path in shipped] == before
    robot = load_robot_file(tmp_path / "hexapod.toml").parameters
    ours = load_robot_file(ROBOT_FILE).parameters
    assert {**robot} == pytest.approx({**ours}, rel=1e-7)
    written = {(c, p.name): p for c, p in load_catalog(tmp_path / "actuators").rows()}
    for component, parameter in load_catalog().rows():
        found = written[component, parameter.name]
        assert found.value == pytest.approx(parameter.value, rel=1e-7)
        if parameter.basis == "calibrated":
            assert found.interval is not None
            assert found.interval[0] <= found.value <= found.interval[1]
            assert found.interval[1] - found.interval[0] < 0.1 * abs(found.value)


def one_drawn(wide: Posterior, rng: np.random.Generator) -> np.ndarray:
    """A draw of the prior inside the motor's limits, (1, D)."""
    while True:
        x = wide.start(rng, 50)
        good = np.flatnonzero(np.isfinite(wide(x)))
        if good.size:
            return x[good[:1]]


def printed(
    wide: Posterior, own: Robots, truth: np.ndarray, rng: np.random.Generator
) -> tuple[Target, ...]:
    """The targets as a paper would print them of the truth, somewhere inside their widths."""
    (found,) = sets_of(wide, own, truth)
    alone = replace(base_problem().along(found["path"]), constants=found["constants"])
    values, _ = alone.evaluate(np.array(found["z"]))
    centre = {t.name: values[t.name] + rng.uniform(-1, 1) * t.half_width for t in alone.targets}
    held = next(t for t in alone.targets if t.name == HELD)
    # Where in its width the torque of Table VI lies is drawn together with the motor's constants.
    centre[HELD] = values[HELD] + held.centre + truth[0, wide.constants][-1]
    return tuple(replace(t, centre=centre[t.name]) for t in alone.targets)


def ranks_of_the_truth(replicates: int) -> dict[str, list[float]]:
    """Where the truth lies among the draws of its own posterior, number by number."""
    own, task = robots(4, 60), base_problem()
    rng = np.random.default_rng(11)
    wide = Posterior(task, own.demand, ())
    ranks: dict[str, list[float]] = {}
    for seed in range(replicates):
        truth = one_drawn(wide, rng)
        density = Posterior(task, own.demand, printed(wide, own, truth, rng))
        chain = sample(density, [9, seed], 240)
        last = chain[[0, len(chain) // 2, -1]].reshape(-1, density.size)
        (_, true), (_, values) = wide.evaluate(truth), density.evaluate(last)
        order = last[:, 0] - truth[0, 0] + rng.uniform(-0.5, 0.5, len(last))  # robots are few
        below = {f.key: values[f.key] < true[f.key] for f in wide.free} | {"robot": order < 0}
        for key, smaller in below.items():
            ranks.setdefault(key, []).append(float(smaller.mean()))
    return ranks


@pytest.mark.slow
def test_ranks_of_the_truth_are_uniform_over_draws_of_the_prior() -> None:
    """Simulation-based calibration (Talts et al., arXiv 1804.06788).

    A set is drawn from the prior, its targets are printed, the posterior of what is printed is
    sampled: the rank of the truth among its draws is uniform in every number.
    """
    ranks = ranks_of_the_truth(40)
    p = {key: stats.kstest(column, "uniform").pvalue for key, column in ranks.items()}
    assert min(p.values()) > 0.01 / len(p)  # one in a hundred over all numbers together
