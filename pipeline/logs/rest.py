"""Rows whose filter sees a shaft stop or turn back, or other feet stand than before."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from actuators.arrays import Array, Mask

#: Below this many rest speeds a joint counts as standing: friction may take any value there.
STANDING: Final = 2.5
#: How far to either side a filter sees with weight, in periods of its cut-off.
SEEN: Final = 1.0
#: A reach that takes more than this share of what moves is halved ...
MOST_TAKEN: Final = 0.5
#: ... this often, and then nothing but the event itself is left out.
HALVED: Final = 3


def near_rest(
    v: Array, rest: Array, pieces: Sequence[slice], rate: float, bandwidth: float
) -> Mask:
    """Rows (N, J) whose filter sees a shaft stop or turn back.

    There friction takes any value up to its level, and the filtered speed does not tell which: a
    law of friction says nothing about such rows, and no name may rest on them. A leg turns back
    several times a second: where most of a joint's motion lies within the filter's reach of a
    reversal, that reach is narrowed, see `narrowed`.

    Args:
        v: Speed, shape (N, J) [rad/s].
        rest: Rest speed, shape (J,) [rad/s].
        pieces: Stretches without a gap.
        rate: [Hz].
        bandwidth: Of the filter [Hz].
    """
    still = np.abs(v) < STANDING * rest
    # A fast joint turns back between two samples, neither of which is slow.
    turned = np.signbit(v[1:]) != np.signbit(v[:-1])
    still[1:] |= turned
    still[:-1] |= turned
    reach = int(np.ceil(SEEN * rate / bandwidth)) if np.isfinite(bandwidth) else 0
    return narrowed(still, np.abs(v) >= STANDING * rest, pieces, reach)


def narrowed(event: Mask, wanted: Mask, pieces: Sequence[slice], reach: int) -> Mask:
    """Rows (N, C) within a reach of an event, the reach halved where it takes most that is wanted.

    A prediction passes the filter that the measurement passed, so that a row near an event is less
    sure and not wrong: half of the rows are worth more than none.

    Args:
        event: Shape (N, C).
        wanted: Rows that would count but for the reach, shape (N, C).
        pieces: Stretches without a gap.
        reach: Rows to either side.
    """
    out = within(event, pieces, reach)
    for k in range(1, HALVED + 1):
        lost = (out & wanted).sum(axis=0) > MOST_TAKEN * wanted.sum(axis=0)
        if reach == 0 or not lost.any():
            break
        out[:, lost] = within(event[:, lost], pieces, reach >> k if k < HALVED else 0)
    return out


def within(event: Mask, pieces: Sequence[slice], reach: int) -> Mask:
    """Rows (N, C) at most `reach` rows from an event, not across gaps."""
    out = np.zeros_like(event)
    for piece in pieces:
        count = np.cumsum(np.pad(event[piece], ((reach + 1, reach), (0, 0))), axis=0)
        out[piece] = count[2 * reach + 1 :] > count[: -2 * reach - 1]
    return out
