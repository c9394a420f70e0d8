"""The whole calibration: nearest point, ensemble, leave-one-out, readings, sensitivities."""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from actuators.loading.build import CATALOG
from pipeline.paper.calibration import search
from pipeline.paper.calibration.checkpoint import Checkpoint
from pipeline.paper.calibration.machine import MIDDLE_LEGS
from pipeline.paper.calibration.prior import PRIOR_FILE
from pipeline.paper.calibration.problem import EXTRA, Problem, fixed_before
from pipeline.paper.calibration.search import Reading
from pipeline.paper.constants.rotor_friction import HELD, friction_ranges
from pipeline.paper.errors import CalibrationError
from pipeline.paper.published import PUBLISHED_FILE, Published

#: Plain results of one task.
Point = dict[str, Any]
#: Given a title and a total, returns what is called per finished task.
Progress = Callable[[str, int], Callable[[int], None]]
logger = logging.getLogger("legwatt")
AXES_DEG = (0.0, 15.0, 30.0, 45.0, 90.0)
COUNTS = (1, 2)  # middle legs that Fig. 21 counts as loaded
#: Every axis with either count, and at the vertical axis consumption net of what returns.
READINGS = (
    *(Reading(axis, count) for axis in AXES_DEG for count in COUNTS),
    *(Reading(0.0, count, net=True) for count in COUNTS),
)
OUTPUTS = (
    "walking_ratio_rotor",
    "walking_ratio_reversible",
    "walking_ratio_irreversible",
    "walking_extra_J",
    "break_even_standing_fraction",
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


@dataclass(frozen=True)
class Effort:
    """How much is computed.

    Attributes:
        starts: Of the search for the nearest point, per transfer path.
        draws: From the prior for the ensemble.
        prior_draws: From the prior for what it says by itself.
        left_out_draws: Per target left out.
        reading_starts: Per reading.
        sobol: Base sample of the sensitivity analysis, a power of two.
        workers: Processes.
        seed: Of everything random.
    """

    starts: int = 4
    draws: int = 560
    prior_draws: int = 2000
    left_out_draws: int = 60
    reading_starts: int = 2
    sobol: int = 512
    workers: int = 2
    seed: int = 1


def input_hash(robot: Path, effort: Effort) -> str:
    """Hash of what the tasks depend on: prior, printed values, robot structure, effort, code.

    The calibrated values inside the robot and actuator files are overruled by the prior, but
    everything else in them counts, so their text is part of the hash.
    """
    digest = hashlib.sha256(f"{effort.seed}".encode())
    paper = Path(__file__).parents[1]
    names = (
        *(f"calibration/{n}" for n in ("search", "problem", "machine", "quantities", "prior")),
        *(f"constants/{n}" for n in ("motor_constants", "rotor_friction", "table_entries")),
    )
    code = [paper / f"{name}.py" for name in names]
    for path in [PRIOR_FILE, PUBLISHED_FILE, robot, *sorted(CATALOG.glob("*.toml")), *code]:
        digest.update(path.read_bytes())
    return digest.hexdigest()


def calibrate(
    robot: Path,
    effort: Effort,
    work: Path,
    progress: Progress,
) -> dict[str, Any]:
    """Run everything, going on where an earlier run stopped.

    Args:
        robot: Robot file.
        effort: How much.
        work: Folder for finished tasks.
        progress: Given a title and a total, returns what is called per finished task.

    Returns:
        Plain results: ``nearest``, ``starts``, ``ensemble``, ``left_out``, ``readings``,
        ``sensitivity``.

    Raises:
        CalibrationError: No admissible point at all.
    """
    task = _task(robot)
    store = Checkpoint(work / "tasks.jsonl", input_hash(robot, effort))
    with ProcessPoolExecutor(effort.workers) as pool:
        run = _Run(str(robot), effort, store, pool, progress)
        starts = run.starts()
        good = [s for s in starts if s.get("admissible")]
        if not good:
            raise CalibrationError("no start reaches a point that meets every target and limit")
        best = min(good, key=lambda s: s["prior_distance"])
        paths = tuple(p for p in search.PATHS if any(s["path"] == p for s in good))
        ensemble = run.drawn("member", search.member, paths, effort.draws, "ensemble")
        unmoved = run.drawn("prior", search.prior_member, paths, effort.prior_draws, "prior")
        left_out = {"+".join(targets): run.without(targets, paths) for targets in LEAVE_OUT}
        members = run.with_totals("ensemble", [m for m in ensemble if m.get("admissible")])
        # The motor's limits are the data sheet's, so a draw beyond them is not what it says.
        before = run.with_totals("prior", [m for m in unmoved if m.get("inside")])
        predicted = {
            key: run.with_totals(key, [m for m in tries if m.get("admissible")])
            for key, tries in left_out.items()
        }
        readings = run.readings(best["path"])
        sensitivity = _sensitivity(pool, store, str(robot), best, effort, progress)
    published = task.published
    return {
        "nearest": best,
        "starts": starts,
        "paths": paths,
        "ensemble": members,
        "prior": [_kept(p, published) for p in before],
        "draws": len(ensemble),
        "left_out": {
            key: [_kept(p, published) for p in points] for key, points in predicted.items()
        },
        "left_out_draws": effort.left_out_draws,
        "readings": readings,
        "sensitivity": sensitivity,
        "rotor_friction": [asdict(row) for row in friction_ranges(published)],
    }


def _task(robot: Path) -> Problem:
    """The problem of a robot file; bad input is an error here, before any process starts.

    Raises:
        CalibrationError: The robot is none that the paper's numbers can be of.
    """
    task = search.base_problem(str(robot))
    missing = [leg for leg in MIDDLE_LEGS if leg not in {own.name for own in task.spec.legs}]
    if missing or not task.spec.floating:
        raise CalibrationError(
            f"{robot.name}: the paper's numbers are those of a walking hexapod with the middle "
            f"legs {' and '.join(MIDDLE_LEGS)}; this robot "
            + (f"has no leg '{missing[0]}'" if missing else "is on a stand")
        )
    logger.info("rotor friction leaves unmet: %s", ", ".join(task.sliver.frictions.unmet) or "none")
    return task


@dataclass(frozen=True)
class _Run:
    """The tasks of one calibration, each with the name under which its result is kept.

    Attributes:
        robot: Robot file.
        effort: How much.
        store: Of finished tasks.
        pool: Of processes.
        progress: As for `calibrate`.
    """

    robot: str
    effort: Effort
    store: Checkpoint
    pool: ProcessPoolExecutor
    progress: Progress

    def starts(self) -> list[Point]:
        """Nearest points to the prior's centre from every start."""
        seed, number = self.effort.seed, self.effort.starts
        tasks = [
            (f"start/{path}/{i}", (self.robot, path, search.READ, seed, i, 30))
            for path in search.PATHS
            for i in range(number)
        ]
        done = self.progress("nearest point", number * len(search.PATHS))
        return self.store.run(self.pool, search.nearest, tasks, done)

    def drawn(
        self, kind: str, task: Callable[..., Point], paths: tuple[str, ...], draws: int, title: str
    ) -> list[Point]:
        """Draws of the ensemble or of the prior.

        Args:
            kind: Begins the tasks' names.
            task: Makes one draw.
            paths: Transfer paths that are possible.
            draws: How many.
            title: Of the progress.
        """
        tasks = [
            (f"{kind}/{'+'.join(paths)}/{i}", (self.robot, paths, self.effort.seed, i))
            for i in range(draws)
        ]
        return self.store.run(self.pool, task, tasks, self.progress(title, draws))

    def without(self, targets: tuple[str, ...], paths: tuple[str, ...]) -> list[Point]:
        """Draws that do not know some of the targets."""
        draws = self.effort.left_out_draws
        tasks = [
            (f"without/{'+'.join(targets)}/{i}", (self.robot, paths, self.effort.seed, i, targets))
            for i in range(draws)
        ]
        done = self.progress(f"without {' and '.join(targets)}", draws)
        return self.store.run(self.pool, search.member, tasks, done)

    def with_totals(self, kind: str, points: list[Point]) -> list[Point]:
        """Points with the energy of the whole robot."""
        tasks = [
            (f"totals/{kind}/{i}", (self.robot, p["path"], p["z"], p["constants"]))
            for i, p in enumerate(points)
        ]
        done = self.progress(f"whole robot, {kind}", len(points))
        found = self.store.run(self.pool, search.robot_totals, tasks, done)
        return [p | {"totals": t} for p, t in zip(points, found, strict=True)]

    def readings(self, path: str) -> list[Point]:
        """Every other reading of the paper, with its nearest point where there is one."""
        seed, number = self.effort.seed, self.effort.reading_starts
        tasks = [
            (f"reading/{_task_name(reading)}/{i}", (self.robot, path, reading, seed, i, 30))
            for reading in READINGS
            for i in range(number)
        ]
        done = self.progress("readings", len(READINGS) * number)
        found = self.store.run(self.pool, search.read, tasks, done)
        grouped = []
        for r, reading in enumerate(READINGS):
            tries = [p for p in found[r * number : (r + 1) * number] if "failed" not in p]
            chosen = min(tries, key=_reading_cost) if tries else None
            grouped.append(asdict(reading) | {"point": chosen})
        return grouped


def _task_name(reading: Reading) -> str:
    """A name for the reading's tasks."""
    return f"{reading.axis_deg:g}/{reading.legs}/{'net' if reading.net else 'drawn'}"


def _kept(point: dict[str, Any], published: Mapping[str, Published]) -> dict[str, Any]:
    """What the judgement needs of a set of which only quantiles are shown, to six digits."""
    fixed = fixed_before(published)

    def short(value: float) -> float:
        return float(f"{value:.6g}")

    return {
        "values": {k: short(v) for k, v in point["values"].items() if k not in fixed},
        "totals": {a: {k: short(v) for k, v in t.items()} for a, t in point["totals"].items()},
    }


def _reading_cost(point: dict[str, Any]) -> float:
    """Misfit first, distance from the prior second."""
    worst = max(max(abs(e) for e in point["errors"].values()) - 1, 0.0)
    return 1e3 * worst + 1e3 * max(max(point["excess"].values()), 0.0) + point["prior_distance"]


def _sensitivity(
    pool: ProcessPoolExecutor,
    store: Checkpoint,
    robot: str,
    best: dict[str, Any],
    effort: Effort,
    progress: Progress,
) -> dict[str, Any]:
    """Sobol indices with every free number uniform within one prior sigma of the nearest point."""
    from SALib.analyze import sobol as analyze
    from SALib.sample import sobol as sample

    prior = search.base_problem(robot).prior
    z = np.array(best["z"])
    low = np.maximum(z - 1.0, prior.lower)
    high = np.minimum(z + 1.0, prior.upper)
    setup = {
        "num_vars": z.size,
        "names": list(prior.keys),
        "bounds": np.stack([low, high], axis=1).tolist(),
    }
    rows = sample.sample(setup, effort.sobol, calc_second_order=False, seed=effort.seed)
    block = z.size + 2  # rows of one base point share most of the robot's coordinates
    blocks = [rows[i : i + block].tolist() for i in range(0, len(rows), block)]
    outputs = store.run(
        pool,
        search.sensitivity_row,
        [(f"sobol/{best['path']}/{i}", (robot, best["path"], b)) for i, b in enumerate(blocks)],
        progress("sensitivities", len(blocks)),
    )
    y = np.array([row for part in outputs for row in part], dtype=float)
    missing = np.isnan(y).any(axis=1)
    y[missing] = np.nanmean(y, axis=0)  # a robot that tips says nothing; its count is reported
    result: dict[str, Any] = {
        "names": list(prior.keys),
        "base": effort.sobol,
        "missing": int(missing.sum()),
    }
    for i, output in enumerate(OUTPUTS):
        indices = analyze.analyze(
            setup, y[:, i], calc_second_order=False, print_to_console=False, seed=effort.seed
        )
        result[output] = {
            k: np.asarray(indices[k]).tolist() for k in ("S1", "S1_conf", "ST", "ST_conf")
        }
    return result
