"""Motions and logs made of arrays, with known content."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.logs.errors import Quality
from pipeline.logs.log_format import Expected
from pipeline.logs.prepared.prepare import Prepared, prepare
from pipeline.logs.prepared.stream import Stream, prepared_chunks, survey
from pipeline.logs.quality.quality import judge
from pipeline.logs.reading.log import Log
from pipeline.logs.reading.mapping import Mapping
from pipeline.logs.signals.derivatives import Settings, choose_settings

Array = NDArray[np.float64]


def motion(n: int = 2000, rate: float = 500.0) -> tuple[Array, Array, Array, Array]:
    """Time, position, velocity and acceleration of a two-joint multi-sine, analytic."""
    t = np.arange(n) / rate
    w = 2 * np.pi * np.array([[0.7, 1.1], [1.9, 2.3]])  # [rad/s], (component, joint)
    amplitude = np.array([[0.9, 0.8], [0.3, 0.25]])
    phase = w[:, None, :] * t[None, :, None] + np.array([0.2, 1.1])
    q = (amplitude[:, None, :] * np.sin(phase)).sum(axis=0)
    v = ((amplitude * w)[:, None, :] * np.cos(phase)).sum(axis=0)
    a = (-(amplitude * w**2)[:, None, :] * np.sin(phase)).sum(axis=0)
    return t, q, v, a


def made_log(q: Array, effort: Array, rate: float = 500.0, **more: object) -> Log:
    """A log straight from arrays."""
    n, joints = q.shape
    names = tuple("abcdefghijklmnopqr"[:joints])
    time = np.arange(n) / rate
    values = {"time": time, "position": q, "torque": effort} | more
    return Log(name="made", joints=names, position_source="joint", **values)  # type: ignore[arg-type]


def stream_prepared(
    path: Path,
    expected: Expected,
    mapping: Mapping | None = None,
    *,
    settings: Settings | None = None,
    rows: int = 50_000,
) -> Iterator[tuple[Quality, Prepared]]:
    """A long log chunk by chunk, as identification does it for several."""
    stream = Stream(path, expected, mapping)
    seen = survey(stream).log
    quality = judge(seen, expected)
    quality.refuse()
    settings = settings or choose_settings([seen], [quality.usable])
    known = prepare(seen, settings, usable=quality.usable)
    yield from prepared_chunks(stream, known, rows=rows)
