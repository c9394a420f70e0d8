"""A machine's model along its logs, as the search for wrong columns asks for it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipeline.logs.columns.explaining import FLOOR, Bodies
from pipeline.logs.columns.findings import column_findings, copies
from pipeline.logs.columns.hypotheses import Reading, as_named
from pipeline.logs.columns.search import search
from pipeline.logs.prepared.measurement import Measurement, unfiltered
from pipeline.logs.quality.finding import Finding
from pipeline.logs.reading.log import Log
from pipeline.machine.machine import Bodies as Edited
from pipeline.machine.machine import MachineModel
from pipeline.simulation.predict import Simulator
from pipeline.simulation.rigid_bodies import legs_are_separate

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Rows that are compared, of all logs together, and of them those of a rough comparison.
_ROWS: Final = 1200
_ROUGH: Final = 300
#: How far models of machines are off, one standard deviation: masses,
_SCALE: Final = 0.3
#: centres of mass over the bodies' size,
_SHIFT: Final = 0.3
#: what an end carries over the mass of all that moves, and how far out over the links' length.
_CARRIED: Final = 0.2
_OUT: Final = 0.5
#: Share of an effort that is left where a rule stands for the forces of the ground.
_BY_RULE: Final = 0.3
#: Bodies lighter than this share of what the model says are none.
_LIGHTEST: Final = 0.1


def wrong_columns(
    model: MachineModel, measurements: Sequence[Measurement], log: Log, ratio: Array | None
) -> list[Finding]:
    """Columns that are not what their names say; none where the motion asks for no other reading.

    Args:
        model: As its files say.
        measurements: All logs of it.
        log: The first of them as read, for the names in its file.
        ratio: Gear ratios, shape (J,), or None.
    """
    along, as_logged = AlongLogs(model, measurements), as_named(len(model.joints))
    mask = along.mask(as_logged, rough=False)
    bodies = along.bodies(as_logged, rough=False)
    copied = copies(log, along.effort(0.0, rough=False), bodies, mask)
    return copied or column_findings(log, search(along), ratio)


class AlongLogs:
    """Logs of one machine; see `pipeline.logs.columns.search.Along`."""

    def __init__(self, model: MachineModel, measurements: Sequence[Measurement]) -> None:
        """Begin.

        Args:
            model: As its files say.
            measurements: Its logs.
        """
        self._model, self._logs = model, measurements
        every = sum(len(m) for m in measurements)
        self._rows = {
            rough: [np.arange(0, len(m), max(1, every // most)) for m in measurements]
            for rough, most in ((False, _ROWS), (True, _ROUGH))
        }
        self._efforts: dict[tuple[float, bool], Array] = {}
        self._open = tuple(_open(model))

    def effort(self, late: float, *, rough: bool) -> Array:
        """Efforts as logged, of columns taken to be late by some time [s], shape (N, J)."""
        key = (late, rough)
        if key not in self._efforts:
            self._efforts[key] = np.concatenate(
                [
                    _later(m, late)[rows]
                    for m, rows in zip(self._logs, self._rows[rough], strict=True)
                ]
            )
        return self._efforts[key]

    def mask(self, reading: Reading, *, rough: bool) -> Mask:
        """Rows that count, shape (N, J)."""
        mask = np.concatenate(
            [m.mask[rows] for m, rows in zip(self._logs, self._rows[rough], strict=True)]
        )
        if not reading.late.size:
            return mask
        return mask[:, reading.effort_of] & mask[:, reading.position_of]

    def bodies(self, reading: Reading, *, rough: bool) -> Bodies:
        """By the model; rough: on few rows, with the scale of its bodies alone open."""
        ms = [
            _read(m, rows, reading) for m, rows in zip(self._logs, self._rows[rough], strict=True)
        ]
        opened = () if rough else self._open
        base, columns = [], []
        for m in ms:
            simulator = Simulator(m)
            now = simulator.predict(self._model)
            base.append(now.effort[..., 0])
            changed = [
                (simulator.predict(self._model.with_bodies(edited), now).effort - now.effort)[
                    ..., 0
                ]
                / step
                for edited, step, _, _ in opened
            ]
            columns.append(np.stack([base[-1]] if rough else changed))
        spread = [_SCALE] if rough else [spread for _, _, spread, _ in opened]
        least = [_LIGHTEST - 1.0] if rough else [least for _, _, _, least in opened]
        rest = ms[0].rest_speed[reading.position_of] * np.abs(reading.position_factor)
        return Bodies(
            np.concatenate(base),
            np.concatenate(columns, axis=1),
            np.array(spread),
            np.array(least),
            np.array([True])
            if rough
            else np.array([least == _LIGHTEST - 1.0 for _, _, _, least in opened]),
            np.concatenate([m.v for m in ms]),
            np.concatenate([m.a for m in ms]),
            rest,
            np.flatnonzero([s == _CARRIED and low == 0.0 for _, _, s, low in opened]),
            FLOOR if all(_ground_known(self._model, m) for m in ms) else _BY_RULE,
        )


def _ground_known(model: MachineModel, m: Measurement) -> bool:
    return not model.floating or legs_are_separate(model, m)


def _later(m: Measurement, late: float) -> Array:
    """Efforts (N, J) at times that are later."""
    effort = m.effort[..., 0]
    if late == 0.0:
        return effort
    columns = [np.interp(m.time + late, m.time, column) for column in effort.T]
    return np.stack(columns, axis=1)


def _read(m: Measurement, rows: NDArray[np.intp], r: Reading) -> Measurement:
    """Some rows of a measurement, its positions read otherwise."""

    def kept(x: Array | None) -> Array | None:
        return None if x is None else x[rows]

    of, factor = r.position_of, r.position_factor
    return replace(
        m,
        time=m.time[rows],
        q=m.q[rows][:, of] * factor + r.zero,
        v=m.v[rows][:, of] * factor,
        a=m.a[rows][:, of] * factor,
        effort=m.effort[rows],
        mask=m.mask[rows],
        part=m.part[rows],
        block=m.block[rows],
        pieces=(slice(0, rows.size),),
        lowpass=unfiltered,
        kernel=None,
        base_roll=kept(m.base_roll),
        base_pitch=kept(m.base_pitch),
        standing=None if m.standing is None else m.standing[rows],
        foot_force=kept(m.foot_force),
        open_winding=None if m.open_winding is None else m.open_winding[rows],
        temperature=kept(m.temperature),
        unsure=kept(m.unsure),
    )


def _open(model: MachineModel) -> Iterator[tuple[Edited, float, float, float]]:
    """Bodies' changes: edited, by which step, spread and least value in its units."""
    rigid, bodies = model.rigid, model.bodies
    moving = {joint: rigid.getJointId(joint) for joint in model.joints}
    total = sum(rigid.inertias[i].mass for i in moving.values())
    lengths = [float(np.linalg.norm(rigid.jointPlacements[i].translation)) for i in moving.values()]
    for joint, i in moving.items():
        body, change = rigid.inertias[i], bodies.body(joint)
        if body.mass > 0.0:
            scaled = replace(change, scale=change.scale * 1.1)
            yield bodies.with_body(joint, scaled), 0.1, _SCALE, _LIGHTEST - 1.0
            size = float(
                np.sqrt(0.5 * np.trace(body.inertia) / body.mass + body.lever @ body.lever)
            )
            for axis in np.eye(3):
                shift = tuple(np.add(change.shift, 0.01 * size * axis).tolist())
                yield bodies.with_body(joint, replace(change, shift=shift)), 0.01, _SHIFT, -np.inf
        if i in set(rigid.parents[1:]) or total <= 0.0:
            continue
        unit = 0.1 * total
        for k, arm in enumerate([1.0, *[max(float(np.mean(lengths)), 0.01)] * 3]):
            carried = np.array(change.carried)
            carried[k] += unit * arm
            edit = replace(change, carried=tuple(carried.tolist()))
            spread, least = (_CARRIED, 0.0) if k == 0 else (_CARRIED * _OUT, -np.inf)
            yield bodies.with_body(joint, edit), 0.1, spread, least
