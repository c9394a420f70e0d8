"""A log against the first simulation of its motion: rows that are left, what fits nothing.

A real gap, however large an effect is missing, must pass.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from actuators.arrays import Array
from pipeline.identification.where import FEWEST_ROWS
from pipeline.logs.log import Log
from pipeline.logs.log_format import column_name
from pipeline.logs.recording import Finding
from pipeline.logs.reduce import INSTEAD
from pipeline.simulation.predict import Prediction

#: Median correlation below which a log has little in common with the simulation. Friction alone can
#: do that, so it is said and no more.
_WEAK: Final = 0.45
#: Efforts that are exchanged in time against their own motion, to see whether they belong to it,
#: and the share of those that explains as much, from which on they do not.
_SHIFTS: Final = 60
_CHANCE: Final = 0.05


def against_model(m: Log, prediction: Prediction) -> list[Finding]:
    """A log against a first simulation of its motion, before anything is fitted."""
    predicted, found = m.smooth(prediction.effort)[..., 0], []
    for j in range(len(m.joints)):
        x, y = m.effort[m.mask[:, j], j, 0], predicted[m.mask[:, j], j]
        if x.size >= FEWEST_ROWS and np.ptp(x) > 0.0 and np.ptp(y) > 0.0:
            found.append(float(np.corrcoef(x, y)[0, 1]))
    agree = float(np.median(found)) if found else 1.0
    if agree >= _WEAK:
        return []
    detail = (
        f"{m.channels[0]}s have little in common with the simulation (median correlation "
        f"{agree:.2f}): mostly friction, swapped joints, or the log of another robot"
    )
    weak = Finding(m.name, "", "correlation", agree, "1", "warning", detail)
    return [weak, *_of_another_motion(m, predicted)]


def _of_another_motion(m: Log, predicted: Array) -> list[Finding]:
    """Efforts that do not belong to the motion beside them, by any reading.

    Bodies, those of the robot and any that hang on the joint, dry and viscous friction and an
    offset explain some of every joint's effort. Where efforts that are shifted against their
    motion are explained as well as the ones in place, those belong to another motion or robot.
    """
    columns = []
    for j in range(len(m.joints)):
        rows = m.mask[:, j]
        x = m.effort[rows, j, 0]
        if x.size < FEWEST_ROWS or np.ptp(x) == 0.0 or np.ptp(predicted[rows, j]) == 0.0:
            continue
        q, v, a = (y[rows, j] for y in (m.q, m.v, m.a))
        readings = (np.ones_like(v), predicted[rows, j], np.sign(v), v, np.sin(q), np.cos(q), a)
        X = np.stack(readings, axis=1)
        basis = np.linalg.qr(X / np.maximum(np.abs(X).max(axis=0), 1e-300))[0]
        columns.append((x - x.mean(), basis))

    def explained(share: float) -> float:
        rolled = [(np.roll(x, round(share * x.size)), basis) for x, basis in columns]
        rests = [1.0 - float(((basis.T @ y) ** 2).sum() / (y @ y)) for y, basis in rolled]
        return -float(np.log(np.maximum(rests, 1e-12)).sum())

    here = explained(0.0)
    others = [explained(share) for share in np.linspace(0.05, 0.95, _SHIFTS)]
    chance = float(np.mean([other >= here for other in others]))
    if chance <= _CHANCE or not columns:
        return []
    detail = (
        f"{m.channels[0]}s follow neither from the bodies of this robot nor from friction along "
        f"this motion (shifted in time, {100 * chance:.0f} % of the shifts explain them as well): "
        "the log of another robot, or joints are swapped"
    )
    return [Finding(m.name, "", "another_motion", chance, "1", "suspected", detail)]


def rows_left(m: Log) -> list[Finding]:
    """How many rows are compared, and what removed the others; refused where hardly any is left.

    A log or joint without rows gets the one reason that took most, and what to log instead.
    """
    share = float(m.mask.mean())
    alive = m.mask.sum(axis=0) >= FEWEST_ROWS
    if not alive.any():
        detail = f"near zero rows left ({int(m.mask.sum())} of {m.mask.size})"
        detail += _most_taken([(why, float(np.mean(part))) for why, part in m.removed])
        return [Finding(m.name, "", "rows_left", share, "1", "refused", detail)]
    means = [(100.0 * float(np.mean(part)), why) for why, part in m.removed]
    taken = "; ".join(f"{part:.0f} % {why}" for part, why in means if part >= 0.5)
    detail = f"{100 * share:.0f} % of all joints' rows are compared"
    detail += f"; not those with {taken}" if taken else ""
    out = [Finding(m.name, "", "rows_left", share, "1", "ok", detail)]
    for j in np.flatnonzero(~alive):
        detail = f"{int(m.mask[:, j].sum())} rows left to compare: the joint is left out"
        detail += _most_taken([(why, float(part[j])) for why, part in m.removed])
        column = column_name(m.joints[j], m.channels[0])
        out.append(Finding(m.name, column, "rows_left", 0.0, "1", "warning", detail))
    return out


def _most_taken(removed: Sequence[tuple[str, float]]) -> str:
    """What took most rows, with what to log instead; empty where nothing did."""
    why, part = max(removed, key=lambda one: one[1], default=("", 0.0))
    return f"; {100 * part:.0f} % {why}: {INSTEAD[why]}" if why else ""
