"""Which stretches of a long log naming works on: those that tell most, spread over the log.

The log is cut into stretches of equal length. Each is described by how much every joint moves and
works in it (variance of position, speed, change of speed and effort, over their means along the
whole log) and by the tenth of the log it lies in. Stretches are taken one after another; the next
is the one that adds most to the sum of the logarithms of what those taken so far tell, the
D-criterion of optimal design (Fedorov 1972) with a diagonal information matrix. A joint that moves
in one minute of an hour is thus seen, and an hour of the same gait is not seen twice.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from pipeline.logs.reading.log import Log

#: Rows of one stretch.
STRETCH: Final = 4096
#: Rows between two looked at: the speed of a robot changes little within them.
EVERY: Final = 8
#: Parts of the log that count as different times.
TIMES: Final = 10
#: What every description starts with, in means along the log.
START: Final = 0.02


@dataclass(frozen=True, eq=False)
class Scan:
    """Stretches of a log and what they tell."""

    first: NDArray[np.intp]  #: First row of each stretch, shape (B,).
    #: Shape (B, D), at least zero; zero where nothing of a stretch can be compared.
    information: Array
    rows: int  #: Of the log.
    begin: float  #: Its first time [s].
    end: float  #: Its last time [s].


def scan(pieces: Iterable[Log]) -> Scan:
    """Describe the stretches of a log given piece by piece; stretches end with pieces."""
    first: list[int] = []
    variances: list[Array] = []
    middle: list[float] = []
    rows, begin, end = 0, np.inf, -np.inf
    for piece in pieces:
        for start in range(0, len(piece), STRETCH):
            part = slice(start, min(start + STRETCH, len(piece)))
            if part.stop - part.start < STRETCH // 2 and len(piece) > STRETCH:
                continue
            first.append(rows + start)
            variances.append(_information(piece, part))
            middle.append(float(piece.time[(part.start + part.stop) // 2]))
        rows += len(piece)
        begin, end = min(begin, float(piece.time[0])), max(end, float(piece.time[-1]))
    table = np.array(variances)
    table /= np.maximum(table.mean(axis=0), 1e-300)
    share = (np.array(middle) - begin) / max(end - begin, 1e-300)
    when = np.minimum((TIMES * share).astype(int), TIMES - 1)
    times = np.eye(TIMES)[when] * (table.sum(axis=1, keepdims=True) > 0)
    return Scan(np.array(first, dtype=np.intp), np.hstack([table, times]), rows, begin, end)


def _information(piece: Log, part: slice) -> Array:
    """Variances of position, speed, change of speed and effort of every joint, (4 J,)."""
    q, effort = piece.position[part][::EVERY], piece.effort.values[part][::EVERY]
    good = np.logical_and(*piece.rows(part).finite)[::EVERY].all(axis=1)
    if good.sum() < 10:
        return np.zeros(4 * q.shape[1])
    q, effort = q[good], effort[good]
    series = (q, np.diff(q, axis=0), np.diff(q, n=2, axis=0), effort)
    return np.concatenate([x.var(axis=0) for x in series])


def choose(found: Scan, count: int, among: NDArray[np.bool_] | None = None) -> NDArray[np.intp]:
    """Numbers of at most `count` stretches, among those marked (B,), that tell most together."""
    open_ = found.information.sum(axis=1) > 0
    if among is not None:
        open_ &= among
    known = np.full(found.information.shape[1], START)
    taken: list[int] = []
    for _ in range(min(count, int(open_.sum()))):
        gain = np.log1p(found.information / known).sum(axis=1)
        best = int(np.argmax(np.where(open_, gain, -np.inf)))
        open_[best] = False
        known = known + found.information[best]
        taken.append(best)
    return np.sort(np.array(taken, dtype=np.intp))
