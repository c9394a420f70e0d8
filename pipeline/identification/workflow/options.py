"""What a run of the workflow is asked to do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

#: The steps; without one all but `forward` run, which needs goals and the servos' law.
STEPS: Final = {
    "read": "judge the logs: quality.csv",
    "where": "where model and machine disagree: where.csv and the where-map",
    "name": "which effects the model lacks: candidates.csv, found.csv",
    "add": "the same, and write the effects into model.toml",
    "forward": "drive the model under its servos' law and compare positions: forward.csv",
    "power": "what the supply gives, against the sum over the drives: power.csv",
    "shrink": "the gap with and without the effects of a model file (--model)",
}
DEFAULT_OUT: Final = Path("reports/out/gap")


@dataclass(frozen=True)
class Options:
    """Logs, machine and choices of one run; names and defaults are those of the command line."""

    logs: tuple[Path, ...]  #: CSV or Parquet, to learn from.
    step: str = "all"  #: One of `STEPS`, or ``all``.
    robot: Path | None = None  #: Robot file or URDF; the model file's or the hexapod by default.
    model: Path | None = None  #: Model file with effects found earlier.
    #: File with a table ``[gait]`` that was walked instead of the robot file's.
    gait: Path | None = None
    holdout: tuple[Path, ...] = ()  #: Test logs.
    #: ``fixed``, ``level`` or ``measured``; as log and robot say by default.
    base: str | None = None
    gait_start: float | None = None  #: Time in the log at which a period of the gait begins [s].
    mapping: Path | None = None  #: Mapping file for foreign columns.
    alternative: str | None = None  #: Actuator between joint and supply, by name.
    actuators: Path | None = None  #: Folder of actuator files of one's own.
    #: Numbers that differ from the files', by their keys.
    changes: Mapping[str, object] = field(default_factory=dict)
    effort: str | None = None  #: Channel to compare; the log's most direct by default.
    cutoff: float | None = None  #: Bandwidth of the comparison [Hz]; the data's own by default.
    #: Last share of every log that is for the test; blocks in between by default.
    prove_last: float | None = None
    #: Folder for what is written; the model file names its robot relative to it.
    out: Path = DEFAULT_OUT
