"""What every step over measured logs returns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.api.result import Result
from pipeline.identification.workflow.setup import Setup
from pipeline.logs.errors import Finding
from reports.table import Table

#: What every result of logs begins with: verb, tables, sidecar, inputs, machine, findings.
Common = tuple[
    str,
    dict[str, Table],
    Callable[[], dict[str, Any]],
    tuple[Path, ...],
    Setup,
    Sequence[Finding],
]


@dataclass(frozen=True, eq=False)
class LogResult(Result):
    """What one step finds in logs."""

    given: Setup  #: The machine as the step computed it.
    findings: Sequence[Finding]  #: What the logs are worth.

    @property
    def quality(self) -> Table:
        """What the logs are worth: one row per judgement."""
        return self.table("quality")
