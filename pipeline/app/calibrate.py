"""The verb calibrate: fit what the paper does not print and store it in the project's files."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

from pipeline.calibration.calibrate import Effort, calibrate
from pipeline.calibration.prior import load_prior
from pipeline.calibration.store import AT_LEAST, calibrated_numbers, save

WORK = Path(".calibration")


def run_calibrate(options: argparse.Namespace) -> int:
    """Calibrate, going on where an interrupted run stopped, and store the result.

    Raises:
        PipelineError: Unusable robot, prior or target file, or no admissible point.
    """
    results = calibrate(
        options.robot,
        Effort(workers=options.workers, seed=options.seed),
        WORK,
        _progress,
    )
    results["robot"] = options.robot.name
    for path in save(results, options.robot):
        print(path.name)
    numbers = calibrated_numbers(results, load_prior())
    print(f"{len(results['ensemble'])} of {results['draws']} draws became sets of the ensemble")
    for verdict in ("not determined", "against the prior"):
        keys = [n.key for n in numbers if n.verdict == verdict]
        print(f"{verdict}: {', '.join(keys) or 'none'}")
    bound = [f"{n.key} ({n.bound}, {n.at_bound:.0%})" for n in numbers if n.at_bound >= AT_LEAST]
    print(f"at a bound in 5 % of the sets or more: {', '.join(bound) or 'none'}")
    print("run `make urdf` to build the URDFs from the calibrated robot file")
    return 0


def _progress(title: str, total: int) -> Callable[[int], None]:
    """A progress bar on a terminal, nothing elsewhere."""
    from tqdm import tqdm

    bar = tqdm(total=total, desc=title, disable=not sys.stderr.isatty(), leave=True)

    def tick(count: int) -> None:
        bar.update(count)
        if bar.n >= total:
            bar.close()

    return tick
