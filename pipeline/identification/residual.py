"""The gap by joint and circumstance, the one noise floor, and what a model leaves, in words.

The rows of a joint are sorted in several ways (support or transfer, direction, speed, load, power,
position, time); every band gets its share of the squared gap of all joints and how much of it lies
beyond the noise floor. A cause shows as a band that stands out. Rows that are not compared are told
with what took them, and joints whose accelerations are too noisy for their bandwidth. The floor is
of the sensors in the band, with what the model's own inputs make of it.
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
from pipeline.identification import results as limits
from pipeline.identification.fit import Fit, independent
from pipeline.identification.results import Residual
from pipeline.identification.settings import COLOURED, FEWEST_ROWS, LAW, SURE, TELLING
from pipeline.identification.tolerances import Slope
from pipeline.logs.log import TEST, TRAIN, VALIDATION, Finding, Log, column_name
from pipeline.logs.reduce import INSTEAD
from pipeline.simulation.equations import is_on_legs, motion_noise
from pipeline.simulation.predict import Prediction, Simulator

if TYPE_CHECKING:
    from pandas import DataFrame

#: The way of sorting that leaves a joint whole.
WHOLE: Final = "joint"

_BINS: Final = 12
#: What is said of a remainder that depends on nothing.
NO_VARIABLE: Final = "depends on no single variable of the motion"


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


def floor_of(measurements: Sequence[Log], *parts: int) -> Array:
    """Standard deviation of the noise, shape (J, C), of the logs with rows in some parts.

    Args:
        measurements: One per log.
        parts: Training and validation rows by default: test logs have no say, in this neither.
    """
    own = [m for m in measurements if np.isin(m.part, parts or (TRAIN, VALIDATION)).any()]
    return np.asarray(np.sqrt(np.mean([m.noise**2 for m in own or measurements], axis=0)))


def noise_left(fit: Fit, floor: Array) -> tuple[Array, Array]:
    """Noise of torque and motion, and what the estimates leave open, each (J, C).

    Args:
        fit: What is told.
        floor: Sensors' noise, shape (J, C).
    """
    logs = [d.measurement for d in fit.design.data_sets]
    # On legs that of the motion stands in the rows' covariances and not in the sensors' noise.
    moved = [motion_noise(fit.design.model, m) for m in logs if is_on_legs(fit.design.model, m)]
    noise = np.hypot(floor, np.mean(moved, axis=0)) if moved else floor
    open_ = np.zeros_like(floor)
    stated = np.zeros(fit.design.size, dtype=np.bool_)
    for t, columns in zip(fit.design.terms, fit.design.columns, strict=True):
        stated[columns] = bool(t.block) and t.bound == 1.0 and not isinstance(t.effect, Slope)
    for e in fit.design.equations:
        if e.joint >= len(floor):  # a base
            continue
        # Test rows, where there are any: another motion may ask for what the first did not show.
        rows = e.chunk < 0 if (e.chunk < 0).any() else e.chunk >= 0
        live, at = fit.among(e.ids)
        told = ~stated[e.ids[live]]
        X, at = e.X[live[told]][:, rows], at[told]
        grow = (fit.spread[fit.active] / np.sqrt(np.diag(fit.covariance)))[at]
        own = fit.covariance[np.ix_(at, at)] * np.outer(grow, grow)
        # What the file does not hold is as unsure as its stated size.
        rest = np.flatnonzero(stated[e.ids] & np.isin(e.ids, fit.offered))
        tolerated = fit.design.unit[e.ids[rest]] ** 2 @ e.X[rest][:, rows] ** 2
        open_[e.joint, e.channel] = np.sqrt(np.mean(np.sum(X * (own @ X), axis=0) + tolerated))
    return noise, open_


def residuals(
    measurements: Sequence[Log], predictions: Sequence[Prediction]
) -> tuple[Residual, ...]:
    """What a model leaves, by joint and channel, described where it is significant.

    On test rows or on those that were learnt from, whichever is more against its noise: a test that
    does not go where the model fails does not make it true.

    Args:
        measurements: One per log.
        predictions: Of the model, one per log.
    """
    first, out = measurements[0], []
    part, q, v, a, time = (
        np.concatenate([getattr(m, name) for m in measurements])
        for name in ("part", "q", "v", "a", "time")
    )
    sides = [(which, floor_of(measurements, *which)) for which in ((TEST,), (TRAIN, VALIDATION))]
    load = np.concatenate([p.torque for p in predictions])
    for j, joint in enumerate(first.joints):
        series = {"position": q[:, j], "time": time, "load": load[:, j]}
        against = {f"{name}, as friction does": x for name, x in series.items()}
        series |= {"velocity": v[:, j], "acceleration": a[:, j]}
        for k, other in enumerate(first.joints if len(first.joints) <= 8 else ()):
            if k != j:
                series |= {f"position of {other}": q[:, k], f"velocity of {other}": v[:, k]}
        for c, channel in enumerate(first.channels):
            pairs = zip(measurements, predictions, strict=True)
            rest = np.concatenate([gap_of(m, p, c)[:, j] for m, p in pairs])
            known = np.isfinite(rest)
            own = [rest[known & np.isin(part, which)] for which, _ in sides]
            sizes = [float(np.sqrt(np.mean(x**2))) if x.size else 0.0 for x in own]
            errors = zip(sizes, (float(floor[j, c]) for _, floor in sides), strict=True)
            error, level = max(errors, key=lambda pair: pair[0] / max(pair[1], 1e-300))
            text = ""
            if error > limits.UNEXPLAINED * level:
                both = (rest, series), (rest * np.sign(v[:, j]), against)
                every = ((explained(x, one), name) for x, of in both for name, one in of.items())
                share, variable = max(every)
                if share >= TELLING:
                    text = f"depends on the {variable} ({100 * share:.0f} % of it)"
                elif error > COLOURED * level:
                    text = NO_VARIABLE
            text = f"what is left in {joint} {text}" if text else ""
            unit = CHANNEL_UNITS[channel]
            out.append(Residual(joint, channel, error, level, unit, bool(text), text, own[0].size))
    return tuple(out)


def explained(rest: Array, variable: Array) -> float:
    """Share of a remainder's variance that a step curve over a variable explains, adjusted.

    Adjusted as a coefficient of determination is, by the independent samples of what it leaves.
    """
    good = np.isfinite(rest) & np.isfinite(variable)
    y, x = rest[good], variable[good]
    if y.size < 5 * _BINS or np.ptp(x) == 0:
        return 0.0
    edges = np.unique(np.quantile(x, np.linspace(0, 1, _BINS + 1)[1:-1]))
    index = np.searchsorted(edges, x)
    counts = np.maximum(np.bincount(index, minlength=edges.size + 1), 1)
    left = y - (np.bincount(index, y, edges.size + 1) / counts)[index]
    # Of what the curve leaves: a remainder that hangs on a slow variable is slow itself.
    samples = y.size * independent(left)
    if samples <= _BINS + 1:
        return 0.0
    adjusted = float(left @ left) * (samples - 1.0) / (samples - _BINS)
    return 1.0 - adjusted / max(float(np.sum((y - y.mean()) ** 2)), 1e-300)
