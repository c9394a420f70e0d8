"""Step 2: where measured and predicted effort disagree, by joint and circumstance.

The rows of a joint are sorted in several ways (support or transfer, direction, speed, load, power,
position, time); every band gets its share of the squared gap of all joints and how much of it lies
beyond the noise floor. A cause shows as a band that stands out. Rows that are not compared are told
with what took them, and joints whose accelerations are too noisy for their bandwidth.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array, Mask
from pipeline.columns import frame
from pipeline.effects.base import CHANNEL_UNITS
from pipeline.identification.settings import LAW, SURE
from pipeline.logs.log import Finding, Log, column_name
from pipeline.logs.reduce import INSTEAD
from pipeline.simulation.predict import Prediction, Simulator

if TYPE_CHECKING:
    from pandas import DataFrame

#: The way of sorting that leaves a joint whole.
WHOLE: Final = "joint"
#: Fewer rows in a band say nothing.
FEWEST_ROWS: Final = 20


def gap_of(m: Log, prediction: Prediction, channel: int = 0) -> Array:
    """Measured minus predicted effort at the log's bandwidth, NaN where masked, shape (N, J)."""
    rest = prediction.rest
    if rest is None:
        rest = m.effort[..., channel] - m.smooth(prediction.effort[..., channel])
    return np.where(m.mask, rest, np.nan)


def where(
    logs: Sequence[Log], predictions: Sequence[Prediction], legs: Mapping[str, int]
) -> DataFrame:
    """Table the gap of all rows of several logs, ranked by its part above the noise floor.

    `legs`: joint to its leg's column in `Log.standing`; empty without legs.
    """
    sums = dict[tuple[int, str, str], Array]()
    for m, prediction in zip(logs, predictions, strict=True):
        rest = gap_of(m, prediction)
        for j in range(len(m.joints)):
            for by, names, band in _bands(m, prediction, j, legs):
                good = np.isfinite(rest[:, j]) & (band >= 0)
                r, own = rest[good, j], band[good].astype(np.intp)
                each = [np.bincount(own, x, len(names)) for x in (np.ones_like(r), r * r, r)]
                for k, name in enumerate(names):
                    now = np.array([x[k] for x in each])
                    sums[j, by, name] = sums.get((j, by, name), 0.0) + now
    noise = np.sqrt(np.mean([m.noise[:, 0] ** 2 for m in logs], axis=0)).tolist()
    total = sum(s[1] for (_, by, _), s in sums.items() if by == WHOLE)
    unit, out = CHANNEL_UNITS[logs[0].channels[0]], []
    for (j, by, name), one in sums.items():
        count, square, plain = one.tolist()
        if count < FEWEST_ROWS:
            continue
        gap = float(np.sqrt(square / count))
        excess = max(0.0, 1.0 - (noise[j] / gap) ** 2) if gap > 0 else 0.0
        share = square / total if total > 0 else 0.0
        head = (logs[0].joints[j], by, name)
        row = (*head, int(count), gap, plain / count, noise[j], unit, share, excess)
        out.append((-share * excess, head, row))
    return frame("where", [(k, *row) for k, (_, _, row) in enumerate(sorted(out), start=1)])


def _bands(
    m: Log, prediction: Prediction, j: int, legs: Mapping[str, int]
) -> Iterator[tuple[str, tuple[str, ...], NDArray[Any]]]:
    """Ways of sorting one joint's rows: how, the bands, and that of each row (N,); -1 in none."""
    v, load, known = m.v[:, j], prediction.torque[:, j], m.mask[:, j]
    rest = float(m.rest_speed[j]) if m.rest_speed.size else 0.0
    if not known.any():
        return
    yield WHOLE, ("all",), np.zeros(v.size)
    if m.standing is not None and m.joints[j] in legs:
        yield "phase", ("transfer", "support"), m.standing[:, legs[m.joints[j]]]
    moving = known & (np.abs(v) > rest)
    yield "direction", ("negative", "positive"), _only(v > 0.0, moving)
    yield "power", ("driven", "driving"), _only(v * load > 0.0, moving & (v * load != 0.0))
    if moving.any():
        yield "speed", ("slow", "middle", "fast"), _only(_thirds(np.abs(v), moving), moving)
    yield "load", ("light", "middle", "heavy"), _thirds(np.abs(load), known)
    for by, names, x in (
        ("position", ("low", "middle", "high"), m.q[:, j]),
        ("time", ("first", "middle", "last"), m.time),
    ):
        edges = np.linspace(float(x.min()), float(x.max()), 4)[1:3]
        yield by, names, np.digitize(x, edges, right=True)


def _thirds(x: Array, among: Mask) -> NDArray[np.intp]:
    return np.digitize(x, np.quantile(x[among], [1 / 3, 2 / 3]), right=True)


def _only(band: NDArray[Any], rows: Mask) -> NDArray[Any]:
    return np.where(rows, band, -1)


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


def shrunk(m: Log, base: Prediction) -> list[Finding]:
    """Joints at which noise of accelerations shrinks what is estimated of masses and inertias.

    Least squares give the coefficient of a noisy column times 1 - r, r the noise's share of what
    the other columns (weight, friction, an offset) leave of it: here the share of the effort that
    another draw of the noise asks for. It is told where r is more than laws hold to at best, and
    more than `SURE` standard errors of the coefficient (the test of Durbin, Wu and Hausman; for
    robots Janot, Vandanjon and Gautier, Control Engineering Practice 48, 2016).

    Args:
        m: The log.
        base: By the model as it is; of a robot on legs nothing is told.
    """
    out = list[Finding]()
    if m.a_noise is None or m.sign is None or base.rest is not None:
        return out

    def asked(a: Array) -> Array:
        return Simulator(replace(m, a=a)).predict(base.model).effort[..., 0] - base.effort[..., 0]

    still = asked(0.0 * m.a)
    moving, weight, noise, dry = map(
        m.smooth, (-still, base.effort[..., 0] + still, asked(m.a + m.a_noise), m.sign)
    )
    for j, joint in enumerate(m.joints):
        rows = m.mask[:, j] & m.has_say
        if rows.sum() < FEWEST_ROWS:
            continue
        others = np.stack(
            [weight[rows, j], dry[rows, j], m.v[rows, j], np.ones(rows.sum())], axis=1
        )
        both = np.stack([moving[rows, j], m.effort[rows, j, 0]], axis=1)
        x, y = (both - others @ np.linalg.lstsq(others, both)[0]).T
        told = max(float(x @ x), 1e-300)
        share = float(noise[rows, j] @ noise[rows, j]) / told
        scatter = np.mean((y - x * (x @ y) / told) ** 2) * max(1.0, m.rate / (2.0 * m.bandwidth))
        if share > LAW and share * np.sqrt(told) > SURE * np.sqrt(scatter):
            detail = (
                f"noise of accelerations is {100 * share:.2g} % of what tells masses and inertias "
                f"here, which are estimated too small by as much: the cut-off of {m.bandwidth:.3g} "
                "Hz is too high for these positions; give a lower cutoff, or log velocities"
            )
            column = column_name(joint, m.channels[0])
            out.append(Finding(m.name, column, "regressor_noise", share, "1", "warning", detail))
    return out
