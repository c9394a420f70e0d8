"""A trial's log made ready as the workflow makes it ready, with and without its noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.blind.twin.files import csv_bytes
from pipeline.identification.compare.observe import observe
from pipeline.identification.regression.design_matrix import Bench, make_bench
from pipeline.identification.workflow.options import Options
from pipeline.identification.workflow.setup import Setup, setup, take_in
from pipeline.logs.errors import PreparationError
from pipeline.logs.prepared.measurement import Measurement

Array = NDArray[np.float64]


def trial_bench(
    log: Path, robot: Path, actuators: Path, exact: Mapping[str, Mapping[str, Array]], scratch: Path
) -> tuple[Setup, Bench, dict[str, Measurement]]:
    """The nominal machine, its log ready for least squares, and logs without noise beside it.

    Args:
        log: Of the trial.
        robot: Robot file.
        actuators: Folder of actuator files.
        exact: Name to columns of a log without noise, of the same motion.
        scratch: Folder for such logs as files.

    Raises:
        GapError: The log cannot be used.
        PipelineError: The robot cannot.
    """
    given, seen = _measured(log, robot, actuators)
    out = {}
    for name, columns in exact.items():
        path = scratch / f"{name}.csv"
        path.write_bytes(csv_bytes(dict(columns)))
        _, other = _measured(path, robot, actuators, seen.bandwidth)
        if len(other) != len(seen):
            raise PreparationError(f"{name}: {len(other)} rows where the trial has {len(seen)}")
        out[name] = other
    mask = np.logical_and.reduce([seen.mask, *(m.mask for m in out.values())])
    bench = make_bench(replace(seen, mask=mask))
    same = {"mask": mask, "part": seen.part, "block": seen.block, "rest_speed": seen.rest_speed}
    return given, bench, {name: replace(m, **same) for name, m in out.items()}


def _measured(
    log: Path, robot: Path, actuators: Path, cutoff: float | None = None
) -> tuple[Setup, Measurement]:
    options = Options((log,), robot=robot, actuators=actuators, cutoff=cutoff)
    given = setup(options)
    intake, parts, _ = take_in(given, options)
    (measurement,) = observe(given.model, intake.prepared, parts)
    return given, measurement
