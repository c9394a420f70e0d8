"""The sampler of the paper's unpublished numbers against ways to the same answer without it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from pipeline.paper.calibration import tasks
from pipeline.paper.calibration.calibrate import posterior_summary
from pipeline.paper.calibration.posterior import Posterior, sample
from pipeline.paper.calibration.prior import Prior
from pipeline.paper.calibration.problem import Problem, Target
from pipeline.paper.motor_constants import KEYS
from pipeline.paper.published import EXTRA, HELD


@pytest.fixture(scope="module")
def own(robot_file: str) -> tasks.Robots:
    return tasks.robots(robot_file, 3, 6)


@pytest.fixture(scope="module")
def task(robot_file: str) -> Problem:
    return tasks.problem(robot_file, "harmonic")


def drawn(density: Posterior, count: int) -> np.ndarray:
    """Walkers from the prior that have a density."""
    rng = np.random.default_rng(5)
    found = np.empty((0, density.size))
    while len(found) < count:
        x = density.start(rng, 100)
        found = np.concatenate([found, x[np.isfinite(density(x))]])
    return found[:count]


def test_many_sets_at_once_are_each_set_by_itself(
    own: tasks.Robots, task: Problem, robot_file: str
) -> None:
    """What walkers ask for comes out of the exact machine: solved targets, all others, limits."""
    density = Posterior(task, own.demand)
    walkers = drawn(density, 3)
    for x, found in zip(walkers, tasks.sets_of(density, own, walkers), strict=True):
        alone = replace(tasks.problem(robot_file, found["path"]), constants=found["constants"])
        point = alone.evaluate(np.array(found["z"]))
        assert max(point.excess.values()) <= 0
        assert point.values["irreversible_leg_energy_3s"] == 0
        assert point.values[HELD] == pytest.approx(-x[density.constants][-1], rel=1e-7)
        for name, aim in zip(density.aimed, x[density.aims], strict=True):
            target = density.targets[name]
            wanted = target.centre + aim * target.half_width
            assert point.values[name] == pytest.approx(wanted, abs=1e-3 * target.half_width)
        for target in task.targets:
            missed = abs(point.values[target.name] - target.centre)
            assert missed <= target.half_width * (1 + 1e-3), target.name


def test_a_target_rises_or_falls_with_the_number_that_is_solved_for(
    own: tasks.Robots, task: Problem
) -> None:
    """Else two sets would give one target, and the density would miss one of them."""
    density = Posterior(task, own.demand)
    x = density.start(np.random.default_rng(2), 20)
    sets = density.as_sets(x)
    for name, free in density.solved.items():
        numbers = (free.at(np.full(len(x), z)) for z in np.linspace(*free.ends, 9))
        values = [density.target(name, sets.with_number(free.key, n)) for n in numbers]
        steps = np.diff(values, axis=0)
        assert (steps > 0).all() or (steps < 0).all(), name


def test_targets_left_out_are_not_asked_for(own: tasks.Robots, robot_file: str) -> None:
    task = tasks.problem(robot_file, "harmonic", without=(HELD, EXTRA))
    density = Posterior(task, own.demand)
    assert not {HELD, EXTRA} & density.targets.keys()
    assert HELD not in density.solved
    assert EXTRA not in density.solved
    assert "harmonic_drive.coulomb" in {free.key for free in density.free}


def test_agreement_of_walkers_is_measured(prior: Prior) -> None:
    """R-hat is 1 where walkers agree, far from it where each stays by itself."""
    rng = np.random.default_rng(0)

    def walkers(apart: float) -> list[list[dict[str, object]]]:
        return [
            [
                {
                    "z": rng.normal(size=len(prior.free)) + apart * k,
                    "constants": dict.fromkeys(KEYS, float(rng.normal())),
                    "path": "cubic" if rng.uniform() < 0.25 else "harmonic",
                }
                for _ in range(40)
            ]
            for k in range(16)
        ]

    together, apart = (posterior_summary(walkers(a), prior) for a in (0.0, 2.0))
    for key in prior.keys:
        assert together["numbers"][key]["r_hat"] < 1.05
        assert together["numbers"][key]["effective"] > 300
        assert apart["numbers"][key]["r_hat"] > 1.5
    share = together["paths"]["cubic"]
    assert share["share"] == pytest.approx(0.25, abs=4 * share["standard_error"])
    assert together["paths"]["quintic"]["share"] == 0


def one_drawn(wide: Posterior, rng: np.random.Generator) -> np.ndarray:
    """A draw of the prior inside the motor's limits, (1, D)."""
    while True:
        x = wide.start(rng, 50)
        good = np.flatnonzero(np.isfinite(wide(x)))
        if good.size:
            return x[good[:1]]


def printed(
    wide: Posterior, own: tasks.Robots, truth: np.ndarray, rng: np.random.Generator
) -> tuple[Target, ...]:
    """The targets as a paper would print them of the truth, somewhere inside their widths."""
    (found,) = tasks.sets_of(wide, own, truth)
    alone = replace(wide.task, without=(), constants=found["constants"], _robots={})
    alone.spec = tasks.problem(str(wide.task.spec.path), found["path"]).spec
    values = alone.evaluate(np.array(found["z"])).values
    centre = {t.name: values[t.name] + rng.uniform(-1, 1) * t.half_width for t in alone.targets}
    held = next(t for t in alone.targets if t.name == HELD)
    # Where in its width the torque of Table VI lies is drawn together with the motor's constants.
    centre[HELD] = values[HELD] + held.centre + truth[0, wide.constants][-1]
    return tuple(replace(t, centre=centre[t.name]) for t in alone.targets)


def ranks_of_the_truth(robot_file: str, replicates: int) -> dict[str, list[float]]:
    """Where the truth lies among the draws of its own posterior, number by number."""
    own, task = tasks.robots(robot_file, 4, 60), tasks.problem(robot_file, "harmonic")
    rng = np.random.default_rng(11)
    wide = Posterior(replace(task, without=(*(t.name for t in task.targets),)), own.demand)
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
def test_ranks_of_the_truth_are_uniform_over_draws_of_the_prior(robot_file: str) -> None:
    """Simulation-based calibration (Talts et al., arXiv 1804.06788).

    A set is drawn from the prior, its targets are printed, the posterior of what is printed is
    sampled: the rank of the truth among its draws is uniform in every number.
    """
    ranks = ranks_of_the_truth(robot_file, 40)
    p = {key: stats.kstest(column, "uniform").pvalue for key, column in ranks.items()}
    print({key: round(value, 3) for key, value in p.items()})
    assert min(p.values()) > 0.01 / len(p)  # one in a hundred over all numbers together
