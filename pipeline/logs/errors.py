"""Findings of the judgement on a log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from actuators.errors import LegwattError


@dataclass(frozen=True)
class Finding:
    """One check of one column."""

    log: str  #: Name of the log.
    column: str  #: Header in the log format, or the joint, or empty for the log as a whole.
    check: str  #: What was looked at.
    value: float  #: The number found.
    unit: str  #: Of `value`.
    #: ``ok``, ``masked``, ``warning``, ``suspected`` (the run goes on with the log as it is, and
    #: nothing counts as explained) or ``refused``.
    verdict: str
    detail: str  #: In words, with the remedy where there is one.


class Findings(list[Finding]):
    """A list of one log's findings that fills in its name."""

    def __init__(self, log: str) -> None:
        super().__init__()
        self._log = log

    def note(
        self, column: str, check: str, value: float, unit: str, verdict: str, detail: str
    ) -> None:
        """Add one."""
        self.append(Finding(self._log, column, check, float(value), unit, verdict, detail))


def refuse(findings: Sequence[Finding]) -> None:
    """Stop where a finding refuses its log.

    Raises:
        LegwattError: Names the log, the first refused column and how many there are.
    """
    refused = [finding for finding in findings if finding.verdict == "refused"]
    for first in refused[:1]:
        column = f", column '{first.column}'" if first.column else ""
        more = f" ({len(refused) - 1} more like this)" if len(refused) > 1 else ""
        raise LegwattError(f"{first.log}{column}: {first.detail}{more}")
