"""The tasks of a calibration: each a pure function of its arguments, run in worker processes.

Every random number comes from ``default_rng([seed, task])``, so the result does not depend on
order, interruptions or the number of workers.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from actuators.arrays import Array
from actuators.energy.energy import stage_energy
from actuators.loading.build import load_catalog
from pipeline.errors import PipelineError
from pipeline.paper.calibration.posterior import Posterior, sample
from pipeline.paper.calibration.prior import load_prior
from pipeline.paper.calibration.problem import Evaluation, Problem
from pipeline.paper.hexapod import (
    MIDDLE_LEGS,
    POSTURE,
    PUBLISHED_LEG,
    Demand,
    drawn,
    joined,
    printed_leg,
    totals,
)
from pipeline.paper.motor_constants import KEYS
from pipeline.paper.published import EVEN, EXTRA, load_published
from pipeline.robot.robot_file import load_robot_file

#: A set of numbers with what follows from it, as it is stored.
Point = dict[str, Any]
#: Paths of the foot that the search may choose.
PATHS = ("cubic", "harmonic", "quintic", "cycloid")
#: Outputs of the sensitivity analysis.
OUTPUTS = (
    *("walking_ratio_rotor", "walking_ratio_reversible", "walking_ratio_irreversible"),
    *(EXTRA, EVEN),
)
_PULL = 3.0  # the nearest point: a third of a half width counts like one prior sigma
_STRICT = 60.0  # whether a reading can be met at all: the prior hardly counts,
_FREE = 0.97  # and inside its printed precision a row does not pull against the motor's limits
_THIN = 10  # every so many steps of a walker are kept


@dataclass(frozen=True)
class Reading:
    """How the paper is read."""

    axis_deg: float = 0.0  #: Angle of joint 1's axis in the frontal plane [deg].
    legs: int = 1  #: Middle legs that Fig. 21 counts as loaded.
    net: bool = False  #: Whether consumption is E_el(+) - E_el(-) instead of E_el(+).


#: The reading that the default robot file follows.
READ = Reading()


@cache
def base_problem(robot: str) -> Problem:
    """The problem of the files; calibrated numbers in them are overruled by the prior's."""
    spec = load_robot_file(Path(robot))
    return Problem(spec, load_catalog(), load_prior(), load_published())


def problem(
    robot: str, path: str, reading: Reading = READ, without: tuple[str, ...] = ()
) -> Problem:
    """One reading of the paper, without some targets, as a problem of its own."""
    base = base_problem(robot)
    axis = {"joint_1_axis_angle": math.radians(reading.axis_deg)}
    spec = base.spec.with_gait(transfer_path=path).with_parameters(axis)
    return replace(
        base, spec=spec, standing_legs=reading.legs, without=without, net=reading.net, _robots={}
    )


def nearest(
    robot: str,
    path: str,
    reading: Reading,
    start: list[float],
    evaluations: int,
    strictly: bool = False,
) -> Point:
    """The admissible point nearest to the prior's centre, from one start.

    Args:
        robot: Robot file.
        path: Transfer path.
        reading: Of the paper.
        start: Coordinates (D,).
        evaluations: At most so many of the full problem.
        strictly: Whether to go, where that misses a row, as close to the rows as the bounds allow:
            what is then still missed is out of reach of this reading, whatever the prior says.
    """
    task = problem(robot, path, reading)
    z = _feasible(task, np.array(start))
    every = np.arange(z.size)
    found: Point = {}
    try:
        z = task.solve(z, columns=task.actuator_columns, pull=_PULL)
        z = task.solve(z, columns=every, pull=_PULL, evaluations=evaluations)
        found = _stored(task, z, task.evaluate(z), path)
        if strictly and not found["admissible"]:
            z = task.solve(z, columns=every, pull=_STRICT, free=_FREE, evaluations=evaluations)
            found = _stored(task, z, task.evaluate(z), path)
    except PipelineError as error:
        return found or {"failed": str(error), "path": path}
    return found


def _feasible(task: Problem, z: Array) -> Array:
    """Draw the robot's coordinates towards the centre until the robot can stand and walk."""
    z, own = z.copy(), task.robot_columns
    for scale in (1.0, 0.5, 0.5, 0.5, 0.0):
        z[own] *= scale
        try:
            task.robot(z)
        except PipelineError:
            continue
        break
    return z


@dataclass(frozen=True)
class Robots:
    """R robots drawn from the prior, in order of what the ideal actuator's printed leg draws."""

    demand: Demand  #: What they ask of their joints; a robot is a set.
    paths: tuple[str, ...]  #: The foot's path of each.
    coordinates: Array  #: Of each robot's numbers, (R, D).


@cache
def robots(robot: str, seed: int, count: int) -> Robots:
    """Draw robots, each with a path, that stand and walk as printed.

    Those that turn the motor faster than it may turn are left out: no actuator mends that.
    """
    rng = np.random.default_rng([seed, 4000])
    tasks = {path: problem(robot, path) for path in PATHS}
    ideal = base_problem(robot).catalog.chain("ideal")
    fastest = ideal.motor.max_speed / np.asarray(ideal.ratio)  # of a joint [rad/s]
    found: list[tuple[Demand, str, Array]] = []
    while len(found) < count:
        path = PATHS[int(rng.integers(len(PATHS)))]
        task = tasks[path]
        z = task.prior.draw(rng)
        try:
            demand = task.robot(z).demand
        except PipelineError:
            continue
        if np.abs(demand.series.velocity).max() <= fastest:
            found.append((demand, path, z[task.robot_columns]))
    demands, paths, coordinates = zip(*found, strict=True)
    demand = joined(demands)
    order = np.argsort(drawn(demand, ideal)[PUBLISHED_LEG])
    return Robots(demand.taken(order), tuple(paths[i] for i in order), np.array(coordinates)[order])


def posterior(
    robot: str, seed: int, number: int, without: tuple[str, ...], steps: int, bank_size: int
) -> list[list[Point]]:
    """One ensemble of walkers in the posterior.

    Args:
        robot: Robot file.
        seed: Of the run.
        number: Of the ensemble; no two of a run have the same.
        without: Targets left out, which the others then predict.
        steps: Of every walker; the first three tenths are left out.
        bank_size: Robots to choose from.

    Returns:
        Per walker its sets over the steps that are kept: path, coordinates ``z`` and constants.
    """
    own = robots(robot, seed, bank_size)
    density = Posterior(problem(robot, PATHS[0], without=without), own.demand)
    chain = sample(density, [seed, 5000, number], steps)[::_THIN]
    return [sets_of(density, own, chain[:, w]) for w in range(chain.shape[1])]


def sets_of(density: Posterior, own: Robots, x: Array) -> list[Point]:
    """Walkers (N, D) as sets of numbers."""
    _, values = density.evaluate(x)
    prior, chosen = density.task.prior, x[:, 0].astype(np.intp)
    z = np.empty((len(x), len(prior.free)))
    z[:, density.task.robot_columns] = own.coordinates[chosen]
    for i in density.task.actuator_columns:
        free = prior.free[i]
        z[:, i] = [free.coordinate(value) for value in values[free.key]]
    return [
        {
            "path": own.paths[robot],
            "z": row.tolist(),
            "constants": {key: float(values[key][k]) for key in KEYS},
        }
        for k, (robot, row) in enumerate(zip(chosen, z, strict=True))
    ]


def prior_point(robot: str, seed: int, draw: int) -> Point:
    """A draw from the prior: what follows without the paper's energies; see `point_of`."""
    rng = np.random.default_rng([seed, 1000, draw])
    path = PATHS[int(rng.integers(len(PATHS)))]
    task = problem(robot, path)
    (constants,) = task.feasible.draws(rng, 1)[:, : len(KEYS)]
    z = task.prior.draw(rng).tolist()
    return point_of(robot, path, z, dict(zip(KEYS, map(float, constants), strict=True)))


def point_of(robot: str, path: str, z: list[float], constants: dict[str, float]) -> Point:
    """A set of numbers with all that the paper prints and the energy of the whole robot.

    The energy is left out where a motor leaves its limits.
    """
    task = replace(problem(robot, path), constants=constants)
    at = np.array(z)
    try:
        point = task.evaluate(at)
    except PipelineError as error:
        return {"failed": str(error), "path": path}
    inside = max(point.excess.values()) <= 0
    found = _stored(task, at, point, path) | {"inside": inside}
    if inside:
        chains = {name: outcome.chain for name, outcome in point.outcomes.items()}
        found["totals"] = totals(point.robot.robot, chains)
    return found


def _stored(task: Problem, z: Array, point: Evaluation, path: str) -> Point:
    """What is kept of a set: plain numbers."""
    p, found = point.robot.robot.spec.parameters, point.outcomes
    numbers = task.numbers(z)

    def by_leg(energy: Mapping[str, Array]) -> dict[str, float]:
        return {leg: float(energy[leg][0]) for leg in MIDDLE_LEGS}

    return {
        "z": z.tolist(),
        "constants": {key: numbers[key] for key in KEYS},
        "posture": {k: p[k] for k in POSTURE},
        "values": dict(point.values),
        "drawn": {name: by_leg(o.drawn) for name, o in found.items()},
        "returned": {name: by_leg(o.returned) for name, o in found.items()},
        "excess": dict(point.excess),
        "errors": {t.name: (point.values[t.name] - t.centre) / t.half_width for t in task.targets},
        "unmet": task.unmet(point),
        "prior_distance": float(0.5 * z @ z),
        "admissible": task.admissible(point),
        "electrical_over_mechanical": _electrical_over_mechanical(point),
        "path": path,
    }


def _electrical_over_mechanical(point: Evaluation) -> dict[str, float]:
    """E_el(+) over E_m(+) of the ideal actuator, by joint of the printed leg."""
    walking = point.outcomes["ideal"].walking
    joints = [name for name in walking.joint.joints if name.startswith(f"{PUBLISHED_LEG}_")]
    (el,), (m,) = (printed_leg(stage_energy(walking, stage).forward) for stage in ("el", "m"))
    return {
        joint: float(e / given) if given > 0 else math.inf
        for joint, e, given in zip(joints, el, m, strict=True)
    }


def sensitivity_rows(robot: str, path: str, rows: list[list[float]]) -> list[list[float]]:
    """`OUTPUTS` at several coordinates, NaN where the robot cannot walk.

    A break-even is 0 where the irreversible actuator always uses less.
    """
    task = problem(robot, path)
    out = []
    for row in rows:
        try:
            values = task.evaluate(np.array(row)).values
        except PipelineError:
            out.append([math.nan] * len(OUTPUTS))
            continue
        even = 0.0 if math.isnan(values[EVEN]) else values[EVEN]
        out.append([*(values[name] for name in OUTPUTS[:-1]), even])
    return out
