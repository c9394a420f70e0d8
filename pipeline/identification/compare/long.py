"""Logs too long to be held: surveyed once, then gone through chunk by chunk, every row once.

Identification works on the most informative stretches (`stream.choose`); quality, the gap by
circumstance and the proof on every row. Test rows are those outside of the stretches, and the
blocks left out within them: none had a say.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from pipeline.identification.compare.observe import observe_chunk
from pipeline.logs.errors import VERDICTS, Finding, Quality
from pipeline.logs.prepared.measurement import TEST, TRAIN, UNUSED, VALIDATION, Contact, Measurement
from pipeline.logs.prepared.parts import Parts
from pipeline.logs.prepared.prepare import Prepared
from pipeline.logs.prepared.stream import CHUNK_ROWS, Stream, Survey, prepared_chunks
from pipeline.logs.reading.log import Log
from pipeline.machine.machine import MachineModel
from pipeline.simulation.predict import Simulator

#: More rows than this in all logs together are gone through in chunks.
LONG_ROWS: Final = 100_000
#: Bytes of measurements that are kept between two passes; beyond, the logs are read again.
KEPT_BYTES: Final = 500_000_000
#: Checks whose numbers add up over chunks.
_COUNTS: Final = ("rows", "gaps")
#: Checks whose result holds for the whole log although stretches of it were looked at.
_OF_SURVEY: Final = ("cutoff", "period", "contact", "usable_share", "noise_floor")


@dataclass(eq=False)
class LongLogs:
    """Several logs in chunks."""

    streams: tuple[Stream, ...]  #: One per log.
    surveys: tuple[Survey, ...]  #: What stands for each.
    #: The surveys at the common bandwidth: grid, cut-off and noise for every chunk.
    prepared: tuple[Prepared, ...]
    parts: Parts  #: Of the surveys.
    largest: Mapping[str, Array]  #: As for `judge`.
    contact: Callable[[Log], Contact | None] | None  #: How to tell which feet stand.
    rows: int = CHUNK_ROWS  #: Per chunk.
    _kept: list[tuple[int, Simulator]] = field(default_factory=list)
    _findings: tuple[Finding, ...] = ()

    def span(self, log: int) -> tuple[float, float]:
        """First and last time of a log [s]."""
        found = self.surveys[log].found
        return found.begin, found.end

    def findings(self, surveyed: Sequence[Finding]) -> tuple[Finding, ...]:
        """The judgement on every row, one finding per column and check.

        Args:
            surveyed: Findings on the surveys; what was chosen from them stays.

        Raises:
            LegwattError: A chunk cannot be used.
        """
        if not self._findings:
            gathered = _Gathered()
            for k in range(len(self.streams)):
                for quality, _ in self._chunks(k):
                    gathered.add(quality.findings)
            self._findings = gathered.findings()
        return (*self._findings, *(f for f in surveyed if f.check in _OF_SURVEY))

    def chunks(
        self, model: MachineModel, like: Sequence[Measurement]
    ) -> Iterator[tuple[int, Simulator]]:
        """Every row of every log once: number of the log, and a simulator of a chunk of it.

        Args:
            model: Whose joints and legs the columns are.
            like: Measurements of the surveys, whose noise and rest speed hold for the chunks.

        Raises:
            LegwattError: A chunk cannot be used.
        """
        if self._kept:
            yield from self._kept
            return
        gathered = _Gathered()
        kept: list[tuple[int, Simulator]] = []
        size = 0
        for k in range(len(self.streams)):
            for quality, one in self._chunks(k):
                gathered.add(quality.findings)
                simulator = Simulator(observe_chunk(model, one, self._part(k, one), like[k]))
                size += _bytes(simulator.measurement)
                if size <= KEPT_BYTES:
                    kept.append((k, simulator))
                else:
                    kept.clear()
                yield k, simulator
        self._findings = gathered.findings()
        self._kept = kept if size <= KEPT_BYTES else []

    def _chunks(self, k: int) -> Iterator[tuple[Quality, Prepared]]:
        chunks = prepared_chunks(
            self.streams[k],
            self.prepared[k],
            rows=self.rows,
            largest=self.largest,
            contact=self.contact,
        )
        # One core reads and filters the next chunk while the other simulates this one.
        with ThreadPoolExecutor(max_workers=1) as other:
            coming = other.submit(next, chunks, None)
            while (chunk := coming.result()) is not None:
                coming = other.submit(next, chunks, None)
                yield chunk

    def _part(self, k: int, one: Prepared) -> NDArray[np.int8]:
        """Which rows of a chunk are for the test, shape (N,)."""
        proving = [not ((part == TRAIN).any()) for part in self.parts.part]
        out = np.full(len(one), UNUSED, dtype=np.int8)
        survey = self.surveys[k]
        if proving[k]:
            out[:] = TEST
        elif any(proving):
            pass
        elif np.isfinite(survey.proves_from):
            out[one.time >= survey.proves_from + self.parts.guard] = TEST
        else:
            # Around what naming worked on a filter's reach had a say, too.
            ready = self.prepared[k]
            said = ready.time[np.isin(self.parts.part[k], (TRAIN, VALIDATION))]
            after = np.clip(np.searchsorted(said, one.time), 1, said.size - 1)
            far = np.minimum(np.abs(one.time - said[after - 1]), np.abs(one.time - said[after]))
            out[far > 0.999 * self.parts.guard] = TEST
        return out


def parts_of_surveys(
    parts: Parts, prepared: Sequence[Prepared], surveys: Sequence[Survey]
) -> Parts:
    """Parts of stretches, as they follow from the whole logs.

    Args:
        parts: As `split` cuts the stretches, without regard to a share for the test.
        prepared: The stretches.
        surveys: Of the same logs.
    """
    if not any(np.isfinite(s.proves_from) for s in surveys):
        if any(not (part == TRAIN).any() for part in parts.part):
            return parts
        rule = "tested on every row that had no say in the naming"
        return replace(parts, rule=rule)
    out = []
    for part, block, one, seen in zip(parts.part, parts.block, prepared, surveys, strict=True):
        kinds = part.copy()
        for b in np.unique(block[block >= 0]):
            rows = block == b
            late = one.time[rows] >= seen.proves_from
            if late.all():
                kinds[rows] = TEST
            elif late.any():
                kinds[rows] = UNUSED
            elif kinds[rows][0] == TEST:
                kinds[rows] = TRAIN
        out.append(kinds)
    return replace(parts, part=tuple(out), rule="tested on the last share of every log")


class _Gathered:
    """Findings of chunks, gathered by log, column and check."""

    def __init__(self) -> None:
        self._by_key: dict[tuple[str, str, str], list[Finding]] = {}

    def add(self, findings: Sequence[Finding]) -> None:
        for f in findings:
            self._by_key.setdefault((f.log, f.column, f.check), []).append(f)

    def findings(self) -> tuple[Finding, ...]:
        return tuple(_merged(fs) for fs in self._by_key.values())


def _merged(findings: Sequence[Finding]) -> Finding:
    """One finding for several chunks: the gravest verdict and what it was about."""
    worst = max(findings, key=lambda f: (VERDICTS.index(f.verdict), abs(f.value)))
    if len(findings) == 1:
        return worst
    values = [f.value for f in findings]
    total = sum(values) if worst.check in _COUNTS else worst.value
    if worst.check == "rows":
        return replace(worst, value=total, detail=f"{int(total)} rows in {len(findings)} chunks")
    # Overlooked in a chunk: a joint may rest throughout it.
    verdict = "masked" if worst.verdict == "refused" else worst.verdict
    detail = f"{worst.detail}; {len(findings)} chunks: {min(values):.4g} to {max(values):.4g}"
    return replace(worst, value=total, verdict=verdict, detail=detail)


def _bytes(m: Measurement) -> int:
    return sum(value.nbytes for value in vars(m).values() if isinstance(value, np.ndarray))
