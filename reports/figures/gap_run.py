"""Which figures a run of `gap` draws, and from what."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from actuators.arrays import Array
from pipeline.effects.base import CHANNEL_UNITS
from pipeline.effects.registry import effect_named
from pipeline.identification.compare.circumstances import WHOLE, Stage, Where, gap_of, overall
from pipeline.identification.supply.account import Account
from pipeline.identification.workflow.outcome import Outcome, signature_name
from pipeline.logs.grid import runs_of
from pipeline.logs.prepared.measurement import TEST, Measurement
from pipeline.simulation.found_bodies import FoundBodies
from pipeline.simulation.predict import Prediction
from reports.figures.bars import gap_waterfall_figure, power_shares_figure
from reports.figures.gap import (
    GapTrace,
    WhereGroup,
    gap_signature_figure,
    gap_time_figure,
    power_time_figure,
    where_map_figure,
)
from reports.figures.style import save_figure
from reports.pages.gap_report import write_report
from reports.typeset import unit_text

if TYPE_CHECKING:
    from pandas import DataFrame

#: A stretch of time that a picture can show [s].
_LONGEST = 8.0
#: Ways of sorting in the order in which the map shows them.
SHOWN = (WHOLE, "phase", "direction", "speed", "load", "power", "reversal", "position", "time")
TITLES = {WHOLE: "all", "power": "joint is"}


def write_where_map(rows: Sequence[Where], joints: Sequence[str], robot: str, out: Path) -> None:
    """Draw `where_map`."""
    ratio = {(r.joint, r.by, r.band): r.gap / r.noise_floor for r in rows if r.noise_floor > 0}
    groups, place = [], {band: k for k, band in enumerate(_ORDER)}
    ordered = sorted(rows, key=lambda r: place.get(r.band, len(place)))
    for by in SHOWN:
        bands = tuple(dict.fromkeys(r.band for r in ordered if r.by == by))
        if not bands:
            continue
        table = np.array([[ratio.get((j, by, band), np.nan) for band in bands] for j in joints])
        groups.append(WhereGroup(TITLES.get(by, by), bands, table))
    figure = where_map_figure(
        joints,
        groups,
        title=f"{robot}: where model and machine disagree",
        subtitle="root mean square gap in units of the noise floor; 1 is noise",
    )
    save_figure(figure, out, "where_map")


#: Order of bands within a group; bands not listed keep the order of their ranks.
_ORDER = (
    *("support", "transfer", "negative", "positive", "slow", "light", "low", "first", "middle"),
    *("fast", "heavy", "high", "last", "driving", "driven", "near", "away"),
)


def _words(label: str) -> str:
    """An effect's name in words; its place keeps the robot's own names."""
    effect, at, place = label.partition(" at ")
    return f"{effect.replace('_', ' ')}{at}{place}"


def _stretch(measurements: Sequence[Measurement]) -> tuple[int, slice]:
    """Log and rows around the test block in which most rows of most joints count."""
    best, found = -1.0, (0, slice(0, len(measurements[0])))
    for k, m in enumerate(measurements):
        for start, stop in np.column_stack(runs_of(m.part == TEST)).tolist():
            count = float(m.mask[start:stop].sum())
            if count > best:
                size = max(2, int(_LONGEST * m.rate))
                first = max(0, min((start + stop - size) // 2, len(m) - size))
                best, found = count, (k, slice(first, min(first + size, len(m))))
    return found


def write_signature(
    measurements: Sequence[Measurement],
    without: Stage,
    with_: Stage,
    joint: int,
    effect: str,
    place: Sequence[str],
    name: str,
    out: Path,
) -> None:
    """Draw an effect's gap against the variable on which it depends.

    Args:
        measurements: One per log.
        without: The model before the effect.
        with_: The model with it.
        joint: Column.
        effect: Name of the effect.
        place: Of the effect.
        name: File name.
        out: Folder.
    """
    variable = effect_named(effect).signature
    label, x = "", []
    rest: list[list[Array]] = [[], []]
    for k, m in enumerate(measurements):
        label, values = signature_variable(variable, m, without.predictions[k], joint, place)
        x.append(values)
        for part, stage in zip(rest, (without, with_), strict=True):
            part.append(gap_of(m, stage.predictions[k])[:, joint])
    first = measurements[0]
    figure = gap_signature_figure(
        label,
        np.concatenate(x),
        (np.concatenate(rest[0]), np.concatenate(rest[1])),
        float(first.noise[joint, 0]),
        CHANNEL_UNITS[first.channels[0]],
        title=_words(f"{effect[:1].upper()}{effect[1:]} at {first.joints[joint]}"),
        subtitle="all compared rows; line: running mean, band: noise, 2 sigma",
    )
    save_figure(figure, out, name)


def signature_variable(
    variable: str, m: Measurement, prediction: Prediction, joint: int, place: Sequence[str] = ()
) -> tuple[str, Array]:
    """Label and values (N,) of the variable against which an effect shows.

    Args:
        variable: Key of the effect's signature.
        m: The log.
        prediction: Of the model without the effect.
        joint: Column.
        place: Of the effect; a coupled joint's other joint stands in it.
    """
    name, load = m.joints[joint], prediction.torque[:, joint]
    if variable == "position":
        return f"position of {name} [rad]", m.q[:, joint]
    if variable == "acceleration":
        return f"acceleration of {name} [rad/s²]", m.a[:, joint]
    if variable in ("load", "support"):
        return f"load on {name} [N·m]", load
    if variable == "torque rate":
        return f"rate of the load on {name} [N·m/s]", m.derivative(load)
    if variable == "effort rate":
        unit = CHANNEL_UNITS[m.channels[0]]
        rate = m.derivative(m.lowpass(prediction.effort[:, joint, 0]))
        return f"rate of {name}'s {m.channels[0]} [{unit_text(unit)}/s]", rate
    if variable == "time":
        return "time [s]", m.time
    others = [m.joints.index(p) for p in place if p in m.joints and p != name]
    if variable == "velocity of the other joint" and others:
        return f"velocity of {m.joints[others[0]]} [rad/s]", m.v[:, others[0]]
    return f"velocity of {name} [rad/s]", m.v[:, joint]


def write_power_figures(balance: Account, robot: str, out: Path) -> None:
    """Draw `power_in_time` of the first log and `power_shares`."""
    title = f"{robot}: power at the supply"
    save_figure(power_time_figure(balance, title=title), out, "power_in_time")
    title = f"{robot}: what the supply gives"
    save_figure(power_shares_figure(balance.shares, title=title), out, "power_shares")


def write_pictures_and_page(
    outcome: Outcome, bodies: FoundBodies, tables: Mapping[str, DataFrame], folder: Path
) -> None:
    """Every figure, then the page that shows them."""
    compared, model, validated = outcome.compared, outcome.given.model, outcome.validated
    write_where_map(compared.rows, model.joints, model.name, folder)
    first, *rest = validated.stages
    figure = gap_waterfall_figure(
        overall(first.gap),
        [(_words(stage.label), overall(stage.gap)) for stage in rest],
        outcome.noise,
        outcome.naming.unit,
        title=f"{model.name}: the gap, effect by effect",
        subtitle="root mean square over all joints, on test data",
    )
    save_figure(figure, folder, "waterfall")
    log, rows = _stretch(compared.measurements)
    m = compared.measurements[log]
    traces = []
    series = [
        m.lowpass(s.predictions[log].effort[..., 0])
        for s in (validated.stages[0], validated.stages[-1])
    ]
    for j in outcome.shown:
        traces.append(
            GapTrace(
                joint=m.joints[j],
                time=m.time[rows],
                measured=m.effort[rows, j, 0],
                compared=m.mask[rows, j],
                before=series[0][rows, j],
                after=series[1][rows, j],
                noise_floor=float(m.noise[j, 0]),
                unit=CHANNEL_UNITS[m.channels[0]],
                held_out=m.part[rows] == TEST,
            )
        )
    figure = gap_time_figure(
        traces,
        title="Measured and predicted, without and with what was found",
        subtitle=f"log '{m.name}', low-passed at {m.bandwidth:.3g} Hz; shaded: test; "
        "grey band: noise, 2 sigma",
        channel=m.channels[0],
    )
    save_figure(figure, folder, "in_time")
    for found, pair, joint in zip(
        outcome.naming.found, validated.pairs, validated.joints, strict=True
    ):
        name = signature_name(found)
        if name in outcome.signatures:
            stem, place = Path(name).stem, found.place
            write_signature(compared.measurements, *pair, joint, found.effect, place, stem, folder)
    write_report(outcome, bodies, tables, folder)
