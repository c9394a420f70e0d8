"""The tasks of a calibration: each a pure function of its arguments, run in worker processes.

Every random number comes from ``default_rng([seed, task])``, so the result does not depend on
order, interruptions or the number of workers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuators.loading.build import CATALOG, load_catalog
from pipeline.errors import PipelineError
from pipeline.paper.calibration.batch import Bank, bank, drawn
from pipeline.paper.calibration.machine import POSTURE, RobotPart, catalog_with, with_transfer_path
from pipeline.paper.calibration.posterior import Posterior, sample
from pipeline.paper.calibration.prior import PRIOR_FILE, load_prior
from pipeline.paper.calibration.problem import EXTRA, Evaluation, Problem
from pipeline.paper.calibration.quantities import DIMENSIONS, IDS
from pipeline.paper.calibration.whole_robot import totals
from pipeline.paper.constants.motor_constants import KEYS
from pipeline.paper.published import PUBLISHED_FILE, load_published
from pipeline.robot.robot_file import load_robot_file

Array = NDArray[np.float64]
#: Paths of the foot that the search may choose.
PATHS = ("cubic", "harmonic", "quintic", "cycloid")
_PULL = 3.0  # the nearest point: a third of a half width counts like one prior sigma
_STRICT = 60.0  # whether a reading can be met at all: the prior hardly counts,
_FREE = 0.97  # and inside its printed precision a row does not pull against the motor's limits
_THIN = 10  # every so many steps of a walker are kept


@cache
def base_problem(
    robot: str,
    prior: str = str(PRIOR_FILE),
    published: str = str(PUBLISHED_FILE),
    catalog: str = str(CATALOG),
) -> Problem:
    """The problem of the files; calibrated numbers in them are overruled by the prior's."""
    return Problem(
        load_robot_file(Path(robot)),
        load_catalog(catalog),
        load_prior(Path(prior)),
        load_published(IDS, DIMENSIONS, Path(published)),
    )


@dataclass(frozen=True)
class Reading:
    """How the paper is read.

    Attributes:
        axis_deg: Angle of joint 1's axis in the frontal plane [deg].
        legs: Middle legs that Fig. 21 counts as loaded.
        net: Whether consumption is E_el(+) - E_el(-) instead of E_el(+).
    """

    axis_deg: float = 0.0
    legs: int = 1
    net: bool = False


#: The reading that the default robot file follows.
READ = Reading()


def problem(
    robot: str, path: str, reading: Reading = READ, without: tuple[str, ...] = ()
) -> Problem:
    """One reading of the paper as a problem of its own.

    Args:
        robot: Robot file.
        path: Transfer path.
        reading: Of the paper.
        without: Targets left out.
    """
    base = base_problem(robot)
    spec = with_transfer_path(base.spec, path).with_parameters(
        {"joint_1_axis_angle": math.radians(reading.axis_deg)}
    )
    return replace(
        base,
        spec=spec,
        standing_legs=reading.legs,
        without=without,
        net=reading.net,
        _robots={},
    )


def nearest(
    robot: str, path: str, reading: Reading, start: list[float], evaluations: int
) -> dict[str, Any]:
    """The admissible point nearest to the prior's centre, from one start.

    Args:
        robot: Robot file.
        path: Transfer path.
        reading: Of the paper.
        start: Coordinates (D,).
        evaluations: At most so many of the full problem.
    """
    task = problem(robot, path, reading)
    z = _feasible(task, np.array(start))
    try:
        z = task.solve(z, columns=task.actuator_columns, pull=_PULL)
        z = task.solve(z, columns=np.arange(z.size), pull=_PULL, evaluations=evaluations)
        point = task.evaluate(z)
    except PipelineError as error:
        return {"failed": str(error), "path": path}
    return summary(task, z, point) | {"path": path}


def read(
    robot: str, path: str, reading: Reading, start: list[float], evaluations: int
) -> dict[str, Any]:
    """As `nearest`, and where that misses a row, as close to the rows as the bounds allow.

    What is then still missed is out of reach of this reading, whatever the prior says.
    """
    found = nearest(robot, path, reading, start, evaluations)
    if "failed" in found or found["admissible"]:
        return found
    task = problem(robot, path, reading)
    z = np.array(found["z"])
    try:
        z = task.solve(
            z,
            columns=np.arange(z.size),
            pull=_STRICT,
            free=_FREE,
            evaluations=evaluations,
        )
        point = task.evaluate(z)
    except PipelineError:
        return found
    return summary(task, z, point) | {"path": path}


def _feasible(task: Problem, z: Array) -> Array:
    """Draw the robot's coordinates towards the centre until the robot can stand and walk."""
    z = z.copy()
    for _ in range(4):
        try:
            task.robot(z)
        except PipelineError:
            z[task.robot_columns] /= 2
        else:
            return z
    z[task.robot_columns] = 0.0
    return z


@dataclass(frozen=True)
class Robots:
    """Robots drawn from the prior, in order of what the ideal actuator's printed leg draws.

    Attributes:
        demand: What they ask of their joints; a robot is a column.
        paths: The foot's path of each.
        coordinates: Of each robot's numbers, (R, D).
    """

    demand: Bank
    paths: tuple[str, ...]
    coordinates: Array


@cache
def robots(robot: str, seed: int, count: int) -> Robots:
    """Draw robots, each with a path, that stand and walk as printed.

    Those that turn the motor faster than it may turn are left out: no actuator mends that.

    Args:
        robot: Robot file.
        seed: Of the run.
        count: How many.
    """
    rng = np.random.default_rng([seed, 4000])
    tasks = {path: problem(robot, path) for path in PATHS}
    ideal = tasks[PATHS[0]].catalog.chain("ideal")
    fastest = ideal.motor.max_speed / np.asarray(ideal.ratio)  # of a joint [rad/s]
    parts: list[RobotPart] = []
    paths: list[str] = []
    coordinates: list[Array] = []
    while len(parts) < count:
        path = PATHS[int(rng.integers(len(PATHS)))]
        task = tasks[path]
        z = task.prior.draw(rng)
        try:
            part = task.robot(z)
        except PipelineError:
            continue
        if np.abs(part.series.velocity).max() <= fastest:
            parts.append(part)
            paths.append(path)
            coordinates.append(z[task.robot_columns])
    demand = bank(parts)
    order = np.argsort(drawn(demand, ideal))
    return Robots(demand.taken(order), tuple(paths[i] for i in order), np.array(coordinates)[order])


def posterior(
    robot: str, seed: int, number: int, without: tuple[str, ...], steps: int, bank_size: int
) -> list[list[dict[str, Any]]]:
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
    task = problem(robot, PATHS[0], without=without)
    density = Posterior(task, own.demand)
    chain = sample(density, [seed, 5000, number], steps)[::_THIN]
    return [_sets(density, own, chain[:, w]) for w in range(chain.shape[1])]


def _sets(density: Posterior, own: Robots, x: Array) -> list[dict[str, Any]]:
    """Walkers (N, D) as sets of numbers."""
    _, values = density.evaluate(x)
    prior, columns = density.task.prior, density.task.actuator_columns
    z = np.empty((len(x), len(prior.free)))
    chosen = x[:, 0].astype(np.intp)
    z[:, density.task.robot_columns] = own.coordinates[chosen]
    for i in columns:
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


def prior_member(robot: str, paths: tuple[str, ...], seed: int, draw: int) -> dict[str, Any]:
    """A draw from the prior: what follows without the paper's energies."""
    rng = np.random.default_rng([seed, 1000, draw])
    path = paths[int(rng.integers(len(paths)))]
    task = problem(robot, path)
    constants, _ = task.sliver.draw(rng)
    return point_of(robot, path, task.prior.draw(rng).tolist(), constants)


def point_of(robot: str, path: str, z: list[float], constants: dict[str, float]) -> dict[str, Any]:
    """A set of numbers with all that the paper prints and the energy of the whole robot.

    The energy is left out where a motor leaves its limits.
    """
    task = problem(robot, path)
    task.constants = constants
    at = np.array(z)
    try:
        point = task.evaluate(at)
    except PipelineError as error:
        return {"failed": str(error), "path": path}
    inside = max(point.excess.values()) <= 0
    found = summary(task, at, point) | {"path": path, "inside": inside}
    if inside:
        ratio = task.catalog.parameter("requirement.ratio").value
        catalog = catalog_with(task.catalog, task.numbers(at), ratio)
        found["totals"] = totals(point.robot.robot, catalog)
    return found


def summary(task: Problem, z: Array, point: Evaluation) -> dict[str, Any]:
    """What is kept of a point: plain numbers."""
    p = point.robot.robot.spec.parameters
    ideal = point.actuators.walking["ideal"]
    numbers = task.numbers(z)
    outcomes = point.actuators.outcomes
    return {
        "z": z.tolist(),
        "constants": {key: numbers[key] for key in KEYS},
        "posture": {k: p[k] for k in POSTURE},
        "values": dict(point.values),
        "drawn": {name: dict(o.drawn) for name, o in outcomes.items()},
        "returned": {name: dict(o.returned) for name, o in outcomes.items()},
        "excess": dict(point.excess),
        "errors": {t.name: (point.values[t.name] - t.centre) / t.half_width for t in task.targets},
        "unmet": task.unmet(point),
        "prior_distance": float(0.5 * z @ z),
        "admissible": task.admissible(point),
        "electrical_over_mechanical": _over(ideal.joint.joints, ideal),
    }


def _over(joints: tuple[str, ...], result: Any) -> dict[str, float]:
    from actuators.energy.energy import stage_energy

    electrical, mechanical = stage_energy(result, "el").forward, stage_energy(result, "m").forward
    return {
        joint: float(electrical[j] / mechanical[j]) if mechanical[j] > 0 else math.inf
        for j, joint in enumerate(joints)
        if joint.startswith("rm_")
    }


def sensitivity_row(robot: str, path: str, rows: list[list[float]]) -> list[list[float]]:
    """Outputs of the sensitivity analysis at several coordinates.

    Returns:
        Per row the three walking ratios, the energy difference [J] and the break-even (0 where the
        irreversible actuator always uses less), NaN where the robot cannot walk.
    """
    task = problem(robot, path)
    out = []
    for row in rows:
        try:
            values = task.evaluate(np.array(row)).values
        except PipelineError:
            out.append([math.nan] * 5)
            continue
        even = values["break_even_standing_fraction"]
        out.append(
            [
                values["walking_ratio_rotor"],
                values["walking_ratio_reversible"],
                values["walking_ratio_irreversible"],
                values[EXTRA],
                0.0 if math.isnan(even) else even,
            ]
        )
    return out
