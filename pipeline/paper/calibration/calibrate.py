"""The whole calibration: nearest point, posterior, leave-one-out, readings, sensitivities."""

from __future__ import annotations

import hashlib
import logging
import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from actuators.loading.build import CATALOG
from pipeline.checkpoint import Checkpoint
from pipeline.errors import CalibrationError
from pipeline.paper.calibration import tasks
from pipeline.paper.calibration.prior import PRIOR_FILE, Prior
from pipeline.paper.calibration.problem import fixed_before
from pipeline.paper.calibration.tasks import OUTPUTS, Point, Reading
from pipeline.paper.hexapod import ROBOT
from pipeline.paper.motor_constants import KEYS, friction_ranges
from pipeline.paper.published import EXTRA, HELD, PUBLISHED_FILE, Published

logger = logging.getLogger("legwatt")
_GROUPS = 8  # of walkers, which have to agree
AT_BOUND = 0.02  # coordinates this close to a bound count as lying at it
COUNTS = (1, 2)  # middle legs that Fig. 21 counts as loaded
#: Every axis with either count, and at the vertical axis consumption net of what returns.
READINGS = (
    *(Reading(axis, count) for axis in (0.0, 15.0, 30.0, 45.0, 90.0) for count in COUNTS),
    *(Reading(0.0, count, net=True) for count in COUNTS),
)
#: Targets left out together. What the irreversible actuator costs stands in two of them.
LEAVE_OUT = (
    (HELD,),
    ("walking_ratio_rotor",),
    ("walking_ratio_reversible",),
    ("walking_ratio_irreversible",),
    (EXTRA,),
    ("walking_ratio_irreversible", EXTRA),
)
_EVALUATIONS = 30  # of the full problem, per search


@dataclass(frozen=True)
class Effort:
    """How much is computed."""

    starts: int = 4  #: Of the search for the nearest point, per path: draws of the posterior.
    robots: int = 300  #: In the bank from which the posterior takes them.
    ensembles: int = 2  #: Of walkers in the posterior, each started by itself.
    steps: int = 3000  #: Of their walkers.
    left_out_steps: int = 800  #: Of the one ensemble per target left out.
    sets: int = 250  #: Of the posterior that are evaluated in full.
    left_out_sets: int = 60  #: Likewise, per target left out.
    prior_draws: int = 300  #: From the prior for what it says by itself.
    sobol: int = 256  #: Base sample of the sensitivity analysis, a power of two.
    workers: int = 2  #: Processes.
    seed: int = 1  #: Of everything random.


#: Title of a stage, function of the robot and further arguments, and these by the task's name:
#: results in the order of the names.
_Run = Callable[[str, Callable[..., Any], Mapping[str, tuple[Any, ...]]], list[Any]]


def input_hash(robot: Path, effort: Effort) -> str:
    """Hash of what the tasks depend on: prior, printed values, robot structure, seed, code.

    The calibrated values inside the robot and actuator files are overruled by the prior, but
    everything else in them counts, so their text is part of the hash.
    """
    digest = hashlib.sha256(f"{effort.seed}".encode())
    paper = Path(__file__).parents[1]
    code = [*paper.glob("*.py"), *paper.glob("calibration/*.py")]
    files = [PRIOR_FILE, PUBLISHED_FILE, robot, *sorted(CATALOG.glob("*.toml")), *sorted(code)]
    for path in files:
        digest.update(path.read_bytes())
    return digest.hexdigest()


def calibrate(robot: Path, effort: Effort, work: Path) -> dict[str, Any]:
    """Run everything, going on where an earlier run stopped.

    Args:
        robot: Robot file of the paper's hexapod.
        effort: How much.
        work: Folder for finished tasks.

    Returns:
        Plain results: ``nearest``, ``starts``, ``posterior`` and some of its ``sets``,
        ``left_out``, ``readings``, ``sensitivity``.

    Raises:
        CalibrationError: No admissible point at all.
        SpreadError: Workers ended before the work did.
    """
    task = tasks.base_problem(str(robot))
    unmet = ", ".join(task.feasible.frictions.unmet)
    logger.info("rotor friction leaves unmet: %s", unmet or "none")
    store = Checkpoint(work / "tasks.jsonl", input_hash(robot, effort))

    def run(
        title: str, function: Callable[..., Any], named: Mapping[str, tuple[Any, ...]]
    ) -> list[Any]:
        blocks = {name: (str(robot), *arguments) for name, arguments in named.items()}
        return store.run(partial(_apply, function), blocks, workers=effort.workers, title=title)

    walkers, left_out = _posteriors(run, effort)
    starts = _starts(run, walkers, effort)
    good = [s for s in starts if s.get("admissible")]
    if not good:
        raise CalibrationError("no start reaches a point that meets every target and limit")
    best = min(good, key=lambda s: s["prior_distance"])
    members = _points(run, "posterior", _spread(walkers, effort.sets))
    predicted = {
        key: _points(run, key, _spread(found, effort.left_out_sets))
        for key, found in left_out.items()
    }
    draws = {f"prior/{i}": (effort.seed, i) for i in range(effort.prior_draws)}
    before = run("prior", tasks.prior_point, draws)
    kept = partial(_kept, published=task.published)
    return {
        "nearest": best,
        "starts": starts,
        "paths": [p for p in tasks.PATHS if any(s["path"] == p for s in good)],
        "sets": members,
        "posterior": posterior_summary(walkers, task.prior),
        # The motor's limits are the data sheet's, so a draw beyond them is not what it says.
        "prior": [kept(p) for p in before if p.get("inside")],
        "left_out": {key: [kept(p) for p in points] for key, points in predicted.items()},
        "readings": _readings(run, best),
        "sensitivity": _sensitivity(run, best, task.prior, effort),
        "rotor_friction": [asdict(row) for row in friction_ranges(task.published)],
    }


def _apply(function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    return function(*arguments)


def _posteriors(
    run: _Run, effort: Effort
) -> tuple[list[list[Point]], dict[str, list[list[Point]]]]:
    """Sets by walker of the posterior's ensembles, and of those without some targets."""
    named: dict[str, tuple[Any, ...]] = {
        f"posterior//{i}": (effort.seed, i, (), effort.steps, effort.robots)
        for i in range(effort.ensembles)
    }
    for i, without in enumerate(LEAVE_OUT, start=1):
        own = (effort.seed, 100 * i, without, effort.left_out_steps, effort.robots)
        named[f"posterior/{'+'.join(without)}/0"] = own
    found = run("posterior, and without each target", tasks.posterior, named)
    walkers = [walker for ensemble in found[: effort.ensembles] for walker in ensemble]
    keys = ["+".join(without) for without in LEAVE_OUT]
    return walkers, dict(zip(keys, found[effort.ensembles :], strict=True))


def _spread(walkers: list[list[Point]], count: int) -> list[Point]:
    """So many sets of all walkers' sets, evenly spread over walkers and steps."""
    every = [one for at_step in zip(*walkers, strict=True) for one in at_step]
    return [every[i] for i in np.linspace(0, len(every) - 1, min(count, len(every))).astype(int)]


def _starts(run: _Run, walkers: list[list[Point]], effort: Effort) -> list[Point]:
    """Nearest points to the prior's centre, from the posterior's nearest draws of each path."""
    every = sorted((p for own in walkers for p in own), key=lambda p: float(np.dot(p["z"], p["z"])))
    named = {}
    for path in tasks.PATHS:
        own = [p["z"] for p in every if p["path"] == path][: effort.starts]
        for i, z in enumerate(own):
            named[f"start/{path}/{i}"] = (path, tasks.READ, z, _EVALUATIONS)
    return run("nearest point", tasks.nearest, named)


def _points(run: _Run, kind: str, sets: list[Point]) -> list[Point]:
    """Sets with all that the paper prints and the energy of the whole robot."""
    named = {f"set/{kind}/{i}": (s["path"], s["z"], s["constants"]) for i, s in enumerate(sets)}
    return run(f"whole robot, {kind}", tasks.point_of, named)


def _readings(run: _Run, best: Point) -> list[Point]:
    """Every reading of the paper, with its point closest to the rows where there is one."""
    named = {
        f"reading/{reading}": (best["path"], reading, best["z"], _EVALUATIONS, True)
        for reading in READINGS
    }
    found = run("readings", tasks.nearest, named)
    return [
        asdict(reading) | {"point": None if "failed" in point else point}
        for reading, point in zip(READINGS, found, strict=True)
    ]


def _sensitivity(run: _Run, best: Point, prior: Prior, effort: Effort) -> dict[str, Any]:
    """Sobol indices with every free number uniform within one prior sigma of the nearest point."""
    from SALib.analyze import sobol as analyze
    from SALib.sample import sobol as sample

    z = np.array(best["z"])
    ends = np.clip([z - 1.0, z + 1.0], *prior.ends)
    names = list(prior.keys)
    setup = {"num_vars": z.size, "names": names, "bounds": ends.T.tolist()}
    options: dict[str, Any] = {"calc_second_order": False, "seed": effort.seed}
    rows = sample.sample(setup, effort.sobol, **options)
    block = z.size + 2  # rows of one base point share most of the robot's coordinates
    named = {
        f"sobol/{best['path']}/{i}": (best["path"], rows[i : i + block].tolist())
        for i in range(0, len(rows), block)
    }
    blocks = run("sensitivities", tasks.sensitivity_rows, named)
    y = np.array([row for part in blocks for row in part], dtype=float)
    missing = np.isnan(y).any(axis=1)
    y[missing] = np.nanmean(y, axis=0)  # a robot that tips says nothing; its count is reported
    result: dict[str, Any] = {"names": names, "base": effort.sobol, "missing": int(missing.sum())}
    for output, column in zip(OUTPUTS, y.T, strict=True):
        indices = analyze.analyze(setup, column, print_to_console=False, **options)
        kinds = ("S1", "S1_conf", "ST", "ST_conf")
        result[output] = {kind: np.asarray(indices[kind]).tolist() for kind in kinds}
    return result


def posterior_summary(walkers: list[list[Point]], prior: Prior) -> dict[str, Any]:
    """What the walkers say of every number, and whether they agree.

    Of the prior's coordinates, or SI for the motor's constants: quantiles, mean, standard
    deviation, shares at bounds, nested R-hat, which is made for many short chains (Margossian et
    al., Bayesian Analysis 2024), of eight groups of walkers, and effective sample size (Vehtari et
    al., Bayesian Analysis 16, 667, 2021); of each path its share with a standard error. Of robots
    the bank holds no more than it does: where they matter, their effective number counts as well.

    Args:
        walkers: Sets of each walker of every ensemble, in order.
        prior: Whose coordinates the sets hold.
    """
    from arviz_stats.base import array_stats

    keys = (*prior.keys, *KEYS)
    sets = [[[*p["z"], *(p["constants"][k] for k in KEYS)] for p in own] for own in walkers]
    every = np.array(sets)  # (walkers, steps, numbers)
    unbounded = np.outer([-1, 1], np.full(len(KEYS), np.inf))
    lower, upper = np.concatenate([prior.ends, unbounded], axis=1)
    axes = {"chain_axis": 0, "draw_axis": 1}
    groups = np.arange(len(walkers)) * _GROUPS // len(walkers)
    of_robot = np.array([key.startswith(f"{ROBOT}.") for key in keys])
    drawn = every[..., of_robot].reshape(-1, of_robot.sum())
    counts = np.unique(drawn, axis=0, return_counts=True)[1].astype(float)
    robots = float(counts.sum() ** 2 / (counts**2).sum())

    def effective(values: Any, *, of_robots: bool) -> float:
        draws = float(array_stats.ess(values, **axes))
        return 1 / (1 / draws + 1 / robots) if of_robots else draws

    numbers = {}
    for k, key in enumerate(keys):
        values = every[..., k]
        low, high = np.quantile(values, [0.025, 0.975])
        numbers[key] = {
            "low": float(low),
            "high": float(high),
            "mean": float(values.mean()),
            "spread": float(values.std()),
            "at_lower": float(np.mean(values - lower[k] < AT_BOUND)),
            "at_upper": float(np.mean(upper[k] - values < AT_BOUND)),
            "r_hat": float(array_stats.rhat_nested(values, superchain_ids=groups, **axes)),
            "effective": effective(values, of_robots=bool(of_robot[k])),
        }
    paths = {}
    for path in tasks.PATHS:
        taken = np.array([[float(p["path"] == path) for p in own] for own in walkers])
        share, error = float(taken.mean()), 0.0
        if 0 < share < 1:
            error = math.sqrt(share * (1 - share) / effective(taken, of_robots=True))
        paths[path] = {"share": share, "standard_error": error}
    return {
        "numbers": numbers,
        "paths": paths,
        "walkers": len(walkers),
        "sets": drawn.shape[0],
        "robots": robots,
    }


def _kept(point: Point, published: Mapping[str, Published]) -> Point:
    """What the judgement needs of a set of which only quantiles are shown, to six digits."""
    fixed = fixed_before(published)

    def short(values: Mapping[str, float]) -> dict[str, float]:
        return {key: float(f"{value:.6g}") for key, value in values.items()}

    values = {key: value for key, value in point["values"].items() if key not in fixed}
    totals = {alternative: short(own) for alternative, own in point["totals"].items()}
    return {"values": short(values), "totals": totals}
