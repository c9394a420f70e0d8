"""The verb calibrate: fit what the paper does not print and store it in the project's files."""

from __future__ import annotations

import argparse
from pathlib import Path

from pipeline.atomic import output_errors
from pipeline.cli.options import AddVerb, named_path
from pipeline.errors import CalibrationError
from reports.folder import holding

WORK = Path(".calibration")


def add_verb(add: AddVerb) -> None:
    """Declare the verb."""
    text = "fit the unpublished numbers to the paper's figures and store them"
    calibrate = add("calibrate", text, run_calibrate)
    robot = named_path("urdf/hexapod.toml")
    calibrate.add_argument("--robot", type=named_path, default=robot, help="robot file")
    calibrate.add_argument("--workers", type=int, default=2, help="number of processes")
    calibrate.add_argument("--seed", type=int, default=1, help="of the random numbers")


def run_calibrate(options: argparse.Namespace) -> int:
    """Calibrate, going on where an interrupted run stopped, and store the result.

    Raises:
        PipelineError: Unusable robot, prior or target file, or no admissible point.
    """
    from pipeline.paper.calibration.calibrate import Effort, calibrate
    from pipeline.paper.calibration.prior import load_prior
    from pipeline.paper.calibration.store import AT_LEAST, calibrated_numbers, save

    if options.workers < 1:
        raise CalibrationError(f"--workers {options.workers}: at least one process is needed")
    if options.seed < 0:
        raise CalibrationError(f"--seed {options.seed}: expected zero or a positive number")
    refuse_other_robot(options.robot)
    with holding(WORK), output_errors(WORK):
        results = calibrate(options.robot, Effort(workers=options.workers, seed=options.seed), WORK)
        results["robot"] = options.robot.name
        for path in save(results, options.robot):
            print(path.name)
    numbers = calibrated_numbers(results, load_prior())
    worst = max(numbers, key=lambda n: n.r_hat)
    least = min(n.effective_sample_size for n in numbers)
    print(
        f"posterior of {results['posterior']['walkers']} walkers: greatest R-hat {worst.r_hat:.3f} "
        f"({worst.parameter}), least effective sample size {least:.0f}"
    )
    shares = results["posterior"]["paths"].items()
    print("path of the foot: " + ", ".join(f"{name} {p['share']:.0%}" for name, p in shares))
    for verdict in ("not determined", "against the prior"):
        keys = [n.parameter for n in numbers if n.verdict == verdict]
        print(f"{verdict}: {', '.join(keys) or 'none'}")
    bound = [
        f"{n.parameter} ({n.bound}, {n.at_bound:.0%})" for n in numbers if n.at_bound >= AT_LEAST
    ]
    print(f"at a bound in 5 % of the posterior or more: {', '.join(bound) or 'none'}")
    print("run `make urdf` to build the URDFs from the calibrated robot file")
    return 0


def refuse_other_robot(path: Path) -> None:
    """Refuse a robot that the paper does not print numbers of, before twenty minutes are spent.

    Args:
        path: Robot file.

    Raises:
        RobotFileError: It cannot be used at all.
        CalibrationError: It does not walk, lacks the middle legs, or holds no numbers of its own
            to write the result into.
    """
    from pipeline.paper.calibration.prior import load_prior
    from pipeline.paper.hexapod import MIDDLE_LEGS, POSTURE, ROBOT
    from pipeline.robot.robot_file import load_robot_file, read_toml

    spec = load_robot_file(path)
    such = "calibrate fits the paper's hexapod; give urdf/hexapod.toml or a copy of it"
    if not spec.floating:
        raise CalibrationError(f"{path}: its base is fixed, so it does not walk; {such}")
    names = [leg.name for leg in spec.legs]
    lacking = [leg for leg in MIDDLE_LEGS if leg not in names]
    if lacking:
        raise CalibrationError(f"{path}: has no leg '{lacking[0]}'; {such}")
    keys = (key.split(".") for key in load_prior().keys)
    wanted = [*POSTURE, *(name for component, name in keys if component == ROBOT)]
    own = read_toml(path).get("parameters", {})
    lacking = [name for name in dict.fromkeys(wanted) if name not in own]
    if lacking:
        raise CalibrationError(
            f"{path}: the result is written into this file, which does not hold "
            f"{', '.join(lacking)}; {such}"
        )
