"""Channels that are empty, dead or nearly dead, and joints that are left out, each with the why."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipeline.logs.quality.finding import Findings
from pipeline.logs.quality.unit_check import column_name
from pipeline.logs.reading.log import Log

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Chance at which a live channel may look frozen somewhere in a log.
_CHANCE: Final = 1e-6
#: Rows that hold one value are looked at from this many on.
_LEAST_RUN: Final = 20
#: Different values up to which a channel of a joint that moves counts as nearly dead.
_FEW_VALUES: Final = 3
#: What a piece of a log says nothing about.
_OF_THE_WHOLE: Final = ("constant", "still", "nearly_dead")


def presence(log: Log, still: Mask, found: Findings, *, whole: bool = True) -> tuple[bool, Mask]:
    """Empty and constant columns, and which joints cannot be compared.

    Args:
        log: The log.
        still: Rows in which a joint rests, shape (N, J).
        found: Takes what is found.
        whole: Whether this is the whole log: in a piece of one a joint may rest, or a drive be off,
            from end to end.

    Returns:
        Whether positions are beyond further checks, and the joints whose effort says nothing,
        shape (J,).
    """
    dead, silent = False, np.zeros(len(log.joints), dtype=np.bool_)
    effort = log.effort
    quantity = "motor_position" if log.position_source == "motor" else "position"
    for j, joint in enumerate(log.joints):
        position, column = column_name(joint, quantity), column_name(joint, effort.channel)
        q, x = log.position[:, j], effort.values[:, j]
        share = float(still[:, j].mean())
        if not np.isfinite(q).any():
            detail = f"holds no number at all, and its {effort.channel} does: where did it move?"
            found.note(position, "empty", 1, "1", "refused", detail)
            dead = silent[j] = True
            continue
        where, check, verdict, why = _silence(log, j, is_constant(q), is_constant(x))
        if why and (whole or check not in _OF_THE_WHOLE):
            silent[j] = check != "still"
            found.note(position if where else column, check, 1, "1", verdict, why)
        found.note(position, "standstill_share", share, "1", "ok", f"{100 * share:.1f} % at rest")
    moving = np.array([not is_constant(log.position[:, j]) for j in range(len(log.joints))])
    if not moving.any():
        found.note("", "constant", 1, "1", "refused", "no joint moves; nothing can be compared")
    elif whole and silent.all() and not dead:
        detail = f"no joint that moves has a live {effort.channel}; nothing can be compared"
        found.note("", "empty", 1, "1", "refused", detail)
    return dead, silent


def _silence(log: Log, j: int, still: bool, flat: bool) -> tuple[bool, str, str, str]:
    """Why a joint is silent: whether its position tells, check, verdict, and reason or nothing."""
    joint, effort = log.joints[j], log.effort
    x, q = effort.values[:, j], log.position[:, j]
    if joint in log.locked:
        return True, "locked", "masked", "locked by the mapping; left out"
    if joint in log.left_out:
        return True, "left_out", "warning", log.left_out[joint]
    if not np.isfinite(x).any():
        return False, "empty", "warning", "holds no number at all: the joint is left out"
    if still and flat:
        return True, "constant", "masked", "position and effort never change: the joint is left out"
    place = f"never changes from {q[np.isfinite(q)][0]:.6g} rad while its {effort.channel} does"
    if still:
        return True, "still", "warning", f"{place}: it stood still, or its sensor is dead"
    values = np.unique(x[np.isfinite(x)])
    if flat:
        why = f"never changes from {values[0]:.6g} {effort.unit} while the joint moves"
        return False, "constant", "warning", f"{why}: a dead sensor; the joint is left out"
    if values.size <= _FEW_VALUES:
        told = ", ".join(f"{v:.6g}" for v in values)
        why = f"takes {values.size} values only ({told} {effort.unit}) while the joint moves"
        return False, "nearly_dead", "warning", f"{why}: nearly dead; the joint is left out"
    return False, "", "", ""


def is_constant(x: Array) -> bool:
    """Whether a series (N,) holds one number and nothing else but empty cells."""
    if not np.isfinite(x[0]) or not np.isfinite(x[-1]):
        x = x[np.isfinite(x)]
    return x.size > 0 and not np.any(np.isfinite(x) & (x != x[0]))


def frozen(x: Array, moving: Mask) -> Mask:
    """Rows of an effort (N,) that hold one value longer than chance allows while the joint moves.

    A live channel repeats a value with some probability p from row to row (rounding, or a rate of
    its own); n repeats in a row come by chance p^n times.

    Args:
        x: Shape (N,).
        moving: Rows in which the joint moves, shape (N,).
    """
    out = np.zeros(x.size, dtype=np.bool_)
    same = np.concatenate([[False], (x[1:] == x[:-1]) & moving[1:]])
    if moving.sum() < 2 * _LEAST_RUN:
        return out
    edges = np.flatnonzero(np.diff(np.concatenate([[0], same.astype(np.int8), [0]])))
    starts, stops = edges[::2], edges[1::2]
    length = stops - starts
    usual = length < max(_LEAST_RUN, int(np.quantile(length, 0.9)) if length.size else 0)
    repeats = float(length[usual].sum()) / max(float(moving.sum() - length[~usual].sum()), 1.0)
    p = min(max(repeats, 1.0 / x.size), 1.0 - 1e-9)
    longest = max(_LEAST_RUN, int(np.ceil(np.log(_CHANCE / x.size) / np.log(p))))
    for start, stop in zip(starts.tolist(), stops.tolist(), strict=True):
        if stop - start >= longest:
            out[start:stop] = True
    return out
