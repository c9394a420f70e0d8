"""Step 1 of the workflow: read all logs, judge them, bring them to one grid and bandwidth."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.identification.compare.bandwidth import LEAST_CUTOFF, step_rate
from pipeline.identification.compare.long import LongLogs
from pipeline.logs.columns.findings import explained
from pipeline.logs.errors import LogContentError, PreparationError
from pipeline.logs.prepared.contact import Contact
from pipeline.logs.prepared.cycles import period, with_repeated_noise
from pipeline.logs.prepared.prepare import Prepared, prepare
from pipeline.logs.prepared.read_off import signal_findings
from pipeline.logs.prepared.settings import Settings, choose_settings
from pipeline.logs.quality.cannot_tell import cannot_tell
from pipeline.logs.quality.finding import Finding, refuse
from pipeline.logs.quality.quality import judge
from pipeline.logs.quality.unit_check import OF_LIMITS
from pipeline.logs.reading.expected import Expected
from pipeline.logs.reading.log import Log
from pipeline.logs.reading.log_format import column_name

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class LoadedLogs:
    """Logs that were accepted."""

    prepared: tuple[Prepared, ...]  #: One per log, in the order given.
    findings: tuple[Finding, ...]  #: Rows of `quality.csv`.
    settings: Settings  #: Common to all.
    of_logs: tuple[Finding, ...] = ()  #: Of the findings those that no bandwidth changes.
    #: The logs chunk by chunk where `prepared` holds but stretches of them, else None.
    long: LongLogs | None = None

    def at(self, prepared: Sequence[Prepared]) -> LoadedLogs:
        """The same logs at another bandwidth, with what is found at it."""
        found = [f for one in prepared for f in filter_findings(one)]
        return replace(
            self,
            prepared=tuple(prepared),
            settings=prepared[0].settings,
            findings=(*self.of_logs, *found),
        )


def prepare_logs(
    logs: Sequence[Log],
    expected: Expected,
    *,
    cutoff: float | None = None,
    largest: Mapping[str, Array] | None = None,
    contact: Callable[[Log], Contact | None] | None = None,
    wrong_columns: Callable[[Sequence[Prepared]], Sequence[Finding]] | None = None,
) -> LoadedLogs:
    """Judge and prepare logs that were read already; see `take_in`.

    Args:
        logs: As read.
        expected: The robot's names, limits and ratios.
        cutoff: Of the low-pass, instead of the one the data ask for [Hz].
        largest: Channel to the largest magnitude the drive can give, shape (J,).
        contact: How to tell which feet stand.
        wrong_columns: The search that says what a position beyond its limits is, and the line that
            mends it.

    Raises:
        GapError: A log is unusable or does not fit the others.
    """
    qualities = [judge(log, expected, largest=largest) for log in logs]
    for quality in qualities:
        quality.refuse(overlooked=OF_LIMITS if wrong_columns else ())
    beyond = [f for q in qualities for f in q.findings if f.verdict == "refused"]
    if beyond and wrong_columns:
        try:
            ready = _prepared(logs, [q.usable for q in qualities], cutoff, contact)
            refuse(explained(beyond, wrong_columns(ready)))
        except PreparationError:
            refuse(beyond)
    prepared = _prepared(logs, [q.usable for q in qualities], cutoff, contact)
    found = tuple(finding for quality in qualities for finding in quality.findings)
    return LoadedLogs((), (), prepared[0].settings, found).at(prepared)


def _prepared(
    logs: Sequence[Log],
    usable: Sequence[tuple[Mask, Mask]],
    cutoff: float | None,
    contact: Callable[[Log], Contact | None] | None,
) -> list[Prepared]:
    """Logs at one grid and bandwidth."""
    channels = {log.effort.channel for log in logs}
    if len(channels) > 1:
        raise LogContentError(
            f"the logs are compared in different channels ({', '.join(sorted(channels))}); set "
            "effort in a mapping file"
        )
    settings = choose_settings(logs, usable, cutoff=cutoff)
    prepared = [
        prepare(log, settings, usable=good, contact=contact(log) if contact else None)
        for log, good in zip(logs, usable, strict=True)
    ]
    return with_repeated_noise(prepared)


def filter_findings(one: Prepared) -> list[Finding]:
    """Bandwidth, usable share and noise floor of one prepared log."""
    name = one.log.name
    out = [Finding(name, "", "cutoff", one.cutoff, "Hz", "ok", one.settings.reason)]
    cycle = period(one)
    if cycle is not None:
        out.append(Finding(name, "", "period", cycle, "s", "ok", "the motion repeats"))
    if one.contact is not None:
        stances = len(one.pieces) + one.events.size
        detail = f"contact from {one.contact.source}; {stances} stretches of one stance"
        out.append(Finding(name, "", "contact", stances, "1", "ok", detail))
    out += _resolution(one)
    for j, joint in enumerate(one.joints):
        column = column_name(joint, one.channel)
        usable = float(one.mask[:, j].mean())
        verdict = "ok" if usable > 0.98 else "masked"
        detail = f"{100 * usable:.1f} % of the rows can be compared"
        out.append(Finding(name, column, "usable_share", usable, "1", verdict, detail))
        floor = float(one.noise[j])
        if np.isfinite(floor):
            detail = f"within the bandwidth, from {one.noise_basis}"
            out.append(Finding(name, column, "noise_floor", floor, one.unit, "ok", detail))
    return [*out, *signal_findings(one), *cannot_tell(one.log, one.v, one.effort, one.mask)]


def _resolution(one: Prepared) -> list[Finding]:
    """Refuse positions rounded so that no cut-off at which a robot's motion shows would do."""
    j, rate = step_rate(one)
    if rate >= min(one.cutoff, LEAST_CUTOFF):
        return []
    quantity = "motor_position" if one.log.position_source == "motor" else "position"
    change = np.abs(np.diff(one.log.position[:, j]))
    step = float(change[change > 0].min())
    detail = (
        f"moves in steps of {step:.3g} rad, {rate:.3g} a second: a velocity and acceleration up to "
        f"{LEAST_CUTOFF:g} Hz, as a robot's motion needs, show the steps alone; log positions with "
        "more digits, or the velocity beside them"
    )
    column = column_name(one.joints[j], quantity)
    return [Finding(one.log.name, column, "resolution", step, "rad", "refused", detail)]
