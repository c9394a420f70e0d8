"""A machine's model along its logs, as the search for wrong columns asks for it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array, Mask
from pipeline.logs.columns.explaining import Bodies
from pipeline.logs.columns.findings import column_findings, copies
from pipeline.logs.columns.hypotheses import Reading, as_named
from pipeline.logs.columns.search import search
from pipeline.logs.prepared.measurement import Measurement
from pipeline.logs.quality.finding import Finding
from pipeline.logs.reading.log import Log
from pipeline.machine.machine import Bodies as Edited
from pipeline.machine.machine import MachineModel
from pipeline.simulation.predict import Simulator
from pipeline.simulation.rigid_bodies import legs_are_separate

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
    return copied or column_findings(log, search(along, bodies), ratio)


class AlongLogs:
    """Logs of one machine; see `pipeline.logs.columns.search.Along`."""

    def __init__(self, model: MachineModel, measurements: Sequence[Measurement]) -> None:
        """Begin.

        Args:
            model: As its files say.
            measurements: Its logs.
        """
        self._model, self._logs = model, [_surely(model, m) for m in measurements]
        every = sum(len(m) for m in measurements)
        self._rows = {
            rough: [np.arange(0, len(m), max(1, every // most)) for m in measurements]
            for rough, most in ((False, _ROWS), (True, _ROUGH))
        }
        self._efforts: dict[tuple[float, bool], Array] = {}
        self._open = tuple(_open(model))

    def _each(self, rough: bool) -> Iterator[tuple[Measurement, NDArray[np.intp]]]:
        return zip(self._logs, self._rows[rough], strict=True)

    def effort(self, late: float, *, rough: bool) -> Array:
        """Efforts as logged, of columns taken to be late by some time [s], shape (N, J)."""
        key = (late, rough)
        if key not in self._efforts:
            parts = [_later(m, late)[rows] for m, rows in self._each(rough)]
            self._efforts[key] = np.concatenate(parts)
        return self._efforts[key]

    def mask(self, reading: Reading, *, rough: bool) -> Mask:
        """Rows that count, shape (N, J)."""
        mask = np.concatenate([m.mask[rows] for m, rows in self._each(rough)])
        return mask[:, reading.effort_of] & mask[:, reading.position_of]

    def bodies(self, reading: Reading, *, rough: bool) -> Bodies:
        """By the model; rough: on few rows, with the scale of its bodies alone open."""
        of, factor = reading.position_of, reading.position_factor
        ms = []
        for log, rows in self._each(rough):
            m = log.at(rows)
            q, v, a = (x[:, of] * factor for x in (m.q, m.v, m.a))
            ms.append(replace(m, q=q + reading.zero, v=v, a=a))
        base, columns = [], []
        for m in ms:
            simulator = Simulator(m)
            now = simulator.predict(self._model)
            base.append(now.effort[..., 0])
            changed = [base[-1]]
            if not rough:
                models = (self._model.with_bodies(o.edited) for o in self._open)
                steps = (simulator.predict(model, now).effort - now.effort for model in models)
                changed = [d[..., 0] / o.step for d, o in zip(steps, self._open, strict=True)]
            columns.append(np.stack(changed))
        opened = (_Open(self._model.bodies, 1.0, _SCALE, _LIGHTEST - 1.0),) if rough else self._open
        least = np.array([o.least for o in opened])
        carried = [o.spread == _CARRIED and o.least == 0.0 for o in opened]
        return Bodies(
            base=np.concatenate(base),
            columns=np.concatenate(columns, axis=1),
            spread=np.array([o.spread for o in opened]),
            least=least,
            relative=least == _LIGHTEST - 1.0,
            v=np.concatenate([m.v for m in ms]),
            a=np.concatenate([m.a for m in ms]),
            rest=ms[0].rest_speed[of] * np.abs(factor),
            ends=np.flatnonzero(carried),
        )


def _surely(model: MachineModel, m: Measurement) -> Measurement:
    """Without rows of joints in which a rule says what the ground asks of them.

    Feet that squeeze the ground, and a touch-down that the motion does not show, leave half of the
    torque of a leg that stands. Of a leg in the air its bodies say all, and nothing of it hangs on
    what carries the others: no ground is left.
    """
    if not model.floating or model.layout is None or m.standing is None:
        return m
    if legs_are_separate(model, m):
        return m
    held = np.zeros_like(m.mask)
    for leg, standing in enumerate(m.standing.T):
        held[:, model.layout.of(leg)] |= standing[:, None]
    none = np.zeros_like(m.standing)
    return replace(m, mask=m.mask & ~held, standing=none, foot_force=np.zeros((*none.shape, 3)))


def _later(m: Measurement, late: float) -> Array:
    """Efforts (N, J) at times that are later."""
    effort = m.effort[..., 0]
    if late == 0.0:
        return effort
    columns = [np.interp(m.time + late, m.time, column) for column in effort.T]
    return np.stack(columns, axis=1)


class _Open(NamedTuple):
    """A change of bodies: edited, by which step, spread and least value in its units."""

    edited: Edited
    step: float
    spread: float
    least: float


def _open(model: MachineModel) -> Iterator[_Open]:
    rigid, bodies = model.rigid, model.bodies
    moving = {joint: rigid.getJointId(joint) for joint in model.joints}
    total = sum(rigid.inertias[i].mass for i in moving.values())
    lengths = [float(np.linalg.norm(rigid.jointPlacements[i].translation)) for i in moving.values()]
    for joint, i in moving.items():
        body, change = rigid.inertias[i], bodies.body(joint)
        if body.mass > 0.0:
            scaled = replace(change, scale=change.scale * 1.1)
            yield _Open(bodies.with_body(joint, scaled), 0.1, _SCALE, _LIGHTEST - 1.0)
            size = float(
                np.sqrt(0.5 * np.trace(body.inertia) / body.mass + body.lever @ body.lever)
            )
            for axis in np.eye(3):
                shift = tuple(np.add(change.shift, 0.01 * size * axis).tolist())
                edited = bodies.with_body(joint, replace(change, shift=shift))
                yield _Open(edited, 0.01, _SHIFT, -np.inf)
        if i in set(rigid.parents[1:]) or total <= 0.0:
            continue
        unit = 0.1 * total
        for k, arm in enumerate([1.0, *[max(float(np.mean(lengths)), 0.01)] * 3]):
            carried = np.array(change.carried or (0.0,) * 10)
            carried[k] += unit * arm
            edit = replace(change, carried=tuple(carried.tolist()))
            spread, least = (_CARRIED, 0.0) if k == 0 else (_CARRIED * _OUT, -np.inf)
            yield _Open(bodies.with_body(joint, edit), 0.1, spread, least)
