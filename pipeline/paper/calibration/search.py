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
from pipeline.paper.calibration.machine import POSTURE, catalog_with, with_transfer_path
from pipeline.paper.calibration.prior import PRIOR_FILE, load_prior
from pipeline.paper.calibration.problem import EXTRA, Evaluation, Problem
from pipeline.paper.calibration.quantities import DIMENSIONS, IDS
from pipeline.paper.calibration.whole_robot import totals
from pipeline.paper.constants.motor_constants import KEYS
from pipeline.paper.constants.rotor_friction import HELD
from pipeline.paper.published import PUBLISHED_FILE, load_published
from pipeline.robot.robot_file import load_robot_file

Array = NDArray[np.float64]
#: Paths of the foot that the search may choose.
PATHS = ("cubic", "harmonic", "quintic", "cycloid")
_PULL = 3.0  # the nearest point: a third of a half width counts like one prior sigma
_FIRM = 8.0  # a member of the ensemble: close to its own goal
_STRICT = 60.0  # whether a reading can be met at all: the prior hardly counts,
_FREE = 0.97  # and inside its printed precision a row does not pull against the motor's limits
_SPAN = 0.85  # goals of members spread over this part of the half widths


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
    robot: str, path: str, reading: Reading, seed: int, start: int, evaluations: int
) -> dict[str, Any]:
    """The admissible point nearest to the prior's centre, from one start.

    Args:
        robot: Robot file.
        path: Transfer path.
        reading: Of the paper.
        seed: Of the run.
        start: 0 starts at the prior's centre, others at a random draw.
        evaluations: At most so many of the full problem.
    """
    task = problem(robot, path, reading)
    size = len(task.prior.free)
    centre = np.zeros(size)
    z = centre if start == 0 else task.prior.draw(np.random.default_rng([seed, start]))
    z = _feasible(task, z)
    try:
        z = task.solve(z, centre, columns=task.actuator_columns, pull=_PULL)
        z = task.solve(
            z,
            centre,
            columns=np.arange(size),
            pull=_PULL,
            evaluations=evaluations,
        )
        point = task.evaluate(z)
    except PipelineError as error:
        return {"failed": str(error), "path": path}
    return summary(task, z, point) | {"path": path}


def read(
    robot: str, path: str, reading: Reading, seed: int, start: int, evaluations: int
) -> dict[str, Any]:
    """As `nearest`, and where that misses a row, as close to the rows as the bounds allow.

    What is then still missed is out of reach of this reading, whatever the prior says.
    """
    found = nearest(robot, path, reading, seed, start, evaluations)
    if "failed" in found or found["admissible"]:
        return found
    task = problem(robot, path, reading)
    z = np.array(found["z"])
    try:
        z = task.solve(
            z,
            np.zeros(z.size),
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


def member(
    robot: str, paths: tuple[str, ...], seed: int, draw: int, without: tuple[str, ...] = ()
) -> dict[str, Any]:
    """One draw from the prior, moved by its actuators as little as needed to be admissible.

    The motor's constants and the torque of Table VI are drawn from all that give Tables IV to VI.

    Args:
        robot: Robot file.
        paths: Transfer paths to choose from.
        seed: Of the run.
        draw: Number of the draw.
        without: Targets left out, which the others then predict.
    """
    rng = np.random.default_rng([seed, 5000 if without else 1000, draw])
    path = paths[int(rng.integers(len(paths)))]
    task = problem(robot, path, without=without)
    z0 = task.prior.draw(rng)
    task.constants, held = task.sliver.draw(rng)
    goal = rng.uniform(-_SPAN, _SPAN, len(task.targets))
    for i, target in enumerate(task.targets):
        if target.name == HELD:
            goal[i] = (-held - target.centre) / target.half_width * _SPAN
    try:
        task.robot(z0)  # a body that cannot stand as printed is not worth a search
        z = task.solve(z0, z0, columns=task.actuator_columns, pull=_FIRM, goal=goal)
        point = task.evaluate(z)
    except PipelineError as error:
        return {"failed": str(error), "path": path}
    return summary(task, z, point) | {"path": path}


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


def prior_member(robot: str, paths: tuple[str, ...], seed: int, draw: int) -> dict[str, Any]:
    """The draw of `member` as it is, not moved: what follows without the paper's energies."""
    rng = np.random.default_rng([seed, 1000, draw])
    path = paths[int(rng.integers(len(paths)))]
    task = problem(robot, path)
    z = task.prior.draw(rng)
    task.constants, _ = task.sliver.draw(rng)
    try:
        point = task.evaluate(z)
    except PipelineError as error:
        return {"failed": str(error), "path": path}
    numbers = task.numbers(z)
    return {
        "path": path,
        "z": z.tolist(),
        "constants": {key: numbers[key] for key in KEYS},
        "values": dict(point.values),
        "inside": max(point.excess.values()) <= 0,
    }


def _over(joints: tuple[str, ...], result: Any) -> dict[str, float]:
    from actuators.energy.energy import stage_energy

    electrical, mechanical = stage_energy(result, "el").forward, stage_energy(result, "m").forward
    return {
        joint: float(electrical[j] / mechanical[j]) if mechanical[j] > 0 else math.inf
        for j, joint in enumerate(joints)
        if joint.startswith("rm_")
    }


def robot_totals(
    robot: str, path: str, z: list[float], constants: dict[str, float]
) -> dict[str, Any]:
    """Energy of the whole robot at one point: walking, standing on three feet and on all.

    Returns:
        Per alternative ``cycle_J``, ``stand_3_W`` and ``stand_6_W``.
    """
    task = problem(robot, path)
    task.constants = constants
    point = task.evaluate(np.array(z))
    ratio = task.catalog.parameter("requirement.ratio").value
    catalog = catalog_with(task.catalog, task.numbers(np.array(z)), ratio)
    return totals(point.robot.robot, catalog)


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
