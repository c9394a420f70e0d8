"""Sense of dry friction over the travel since a reversal, by Dahl's law.

Dahl, "A solid friction model", Aerospace Corporation TOR-0158(3107-18)-1, 1968, his exponent 1:

    ds = (d - s) |dq| / travel,   d = sgn(dq)

so that along a stretch that does not turn s = d + (s_0 - d) exp(-|q - q_0| / travel). After some
travels s is the sign of the motion; at standstill it keeps its value.
"""

from typing import Final

import numpy as np

from actuators.arrays import Array

#: A step in time this many times the usual one is a gap, after which nothing is remembered.
GAP: Final = 5.0


def presliding(time: Array, position: Array, direction: Array, travel: float) -> Array:
    """Return the sense of dry friction, -1 to 1, (N,).

    Args:
        time: (N,) [s], not decreasing; a gap is a break, and so is a repeated stamp at another
            angle: at the same one, as where a series is split at a reversal, motion goes on.
        position: (N,) [rad].
        direction: Where a block begins, -1 to 1, (N,).
        travel: Positive [rad].
    """
    if position.size < 2:
        return np.asarray(direction, dtype=float)
    step = np.diff(time)
    usual = float(np.median(step[step > 0.0])) if (step > 0.0).any() else 0.0
    moved = np.diff(position)
    way = np.sign(moved)
    broken = ((step <= 0.0) & (moved != 0.0)) | (step > GAP * max(usual, 1e-300))
    edges = np.concatenate([[True], (way[1:] != way[:-1]) | broken[1:] | broken[:-1]])
    starts = np.flatnonzero(edges)
    stops = np.append(starts[1:], way.size)
    out = np.empty(position.size)
    out[0] = now = float(direction[0])
    for a, b in zip(starts.tolist(), stops.tolist(), strict=True):
        if broken[a]:
            out[a + 1] = now = float(direction[a + 1])
            continue
        d = way[a]
        if d == 0.0:
            out[a + 1 : b + 1] = now
            continue
        slid = np.abs(position[a + 1 : b + 1] - position[a])
        out[a + 1 : b + 1] = d + (now - d) * np.exp(-slid / travel)
        now = float(out[b])
    return out
