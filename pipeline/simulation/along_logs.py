"""A machine's model along its logs, as the search for wrong columns asks for it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array, Mask
from pipeline.logs.checks import DEG, WRONG
from pipeline.logs.columns.explaining import (
    RATIOS,
    Bodies,
    Causes,
    Reading,
    as_named,
    copied_velocities,
)
from pipeline.logs.columns.findings import column_findings, copy_findings
from pipeline.logs.columns.search import search
from pipeline.logs.errors import Finding
from pipeline.logs.prepared.measurement import Measurement
from pipeline.logs.read import Recording
from pipeline.machine.machine import BodyChange, MachineModel
from pipeline.simulation.predict import Prediction, Simulator
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
#: ... and a drive's torque over its effort: a tenth for the motor's constant, one for its gear.
_OFF: Final = 0.15
#: Scale of all of a body, gain of an effort, and the mass an end carries ...
_ALL, _GAIN, _MASS = "scale", "gain", "mass"
#: ... and their least change: bodies lighter than a tenth of what the model says are none.
_LEAST: Final = {_ALL: -0.9, _GAIN: -0.9, _MASS: 0.0}


def wrong_columns(
    model: MachineModel, measurements: Sequence[Measurement], log: Recording, ratio: Array | None
) -> list[Finding]:
    """Columns that are not what their names say; none where the motion asks for no other reading.

    Args:
        model: As its files say.
        measurements: All logs of it.
        log: The first of them as read, for the names in its file.
        ratio: Gear ratios, shape (J,), or None.
    """
    channel = log.effort
    gears = {abs(float(r)) for r in ratio} if ratio is not None else set()
    causes = Causes(
        units=(*WRONG[channel], *(f for r in gears for f in (r, 1.0 / r) if r != 1.0)),
        ratios=tuple(sorted({DEG, *(gears or RATIOS)})),
        coarse=_ground_unknown(model, measurements),
    )
    along, as_logged = AlongLogs(model, measurements, causes), as_named(len(model.joints))
    mask = along.mask(as_logged, rough=False)
    bodies = along.bodies(as_logged, rough=False)
    units = (1.0, *WRONG["velocity"])
    if copied := copied_velocities(along.effort(0.0, rough=False), bodies, mask, units):
        return copy_findings(log, copied)
    mended = search(along, bodies)
    return column_findings(log, mended, ratio) if mended.steps or mended.pushed else []


class AlongLogs:
    """Logs of one machine; see `pipeline.logs.columns.search.Along`."""

    def __init__(
        self, model: MachineModel, measurements: Sequence[Measurement], causes: Causes
    ) -> None:
        """Begin.

        Args:
            model: As its files say.
            measurements: Its logs.
            causes: What may be wrong with their columns.
        """
        self.causes = causes
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
            parts = []
            for m, rows in self._each(rough):
                effort = m.effort[..., 0]
                if late != 0.0:
                    series = [np.interp(m.time + late, m.time, own) for own in effort.T]
                    effort = np.stack(series, axis=1)
                parts.append(effort[rows])
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
            gains = base[-1] * np.eye(len(of))[:, None]
            bodies = base[-1][None] if rough else self._columns(simulator, now)
            columns.append(np.concatenate([bodies, gains]))
        opened = [_Open("", _ALL, BodyChange(), 1.0, _SCALE)] if rough else [*self._open]
        opened += [_Open(joint, _GAIN, BodyChange(), 1.0, _OFF) for joint in self._model.joints]
        least = np.array([_LEAST.get(o.what, -np.inf) for o in opened])
        return Bodies(
            base=np.concatenate(base),
            columns=np.concatenate(columns, axis=1),
            spread=np.array([o.spread for o in opened]),
            least=least,
            relative=np.array([o.what in (_ALL, _GAIN) for o in opened]),
            v=np.concatenate([m.v for m in ms]),
            a=np.concatenate([m.a for m in ms]),
            rest=ms[0].rest_speed[of] * np.abs(factor),
            ends=np.flatnonzero([o.what == _MASS for o in opened]),
        )

    def _columns(self, simulator: Simulator, now: Prediction) -> Array:
        """Change of the effort per unit of each open parameter, shape (P, N, J).

        One prediction serves the like changes of all legs that leave each other alone.
        """
        model, separate = self._model, legs_are_separate(self._model, simulator.measurement)
        groups: dict[tuple[str, object], list[int]] = {}
        for k, o in enumerate(self._open):
            leg, number = model.in_leg(o.joint)
            groups.setdefault((o.what, number if separate and leg >= 0 else o.joint), []).append(k)
        out = np.zeros((len(self._open), *now.torque.shape))
        for group in groups.values():
            bodies = model.bodies
            for k in group:
                bodies = bodies.with_body(self._open[k].joint, self._open[k].change)
            moved = simulator.predict(model.with_bodies(bodies), now).effort - now.effort
            for k in group:
                own = model.own_leg(self._open[k].joint) if len(group) > 1 else slice(None)
                out[k][:, own] = moved[:, own, 0] / self._open[k].step
        return out


def _ground_unknown(model: MachineModel, measurements: Sequence[Measurement]) -> bool:
    """Whether the ground pushes on feet by forces that no column tells."""
    stands = [m for m in measurements if model.floating and m.standing is not None]
    return any(m.foot_force is None or np.isnan(m.foot_force).any() for m in stands)


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


class _Open(NamedTuple):
    """A change of the body of one joint: which, by what step, with which spread."""

    joint: str
    what: str
    change: BodyChange
    step: float
    spread: float


def _open(model: MachineModel) -> Iterator[_Open]:
    rigid = model.rigid
    moving = {joint: rigid.getJointId(joint) for joint in model.joints}
    total = sum(rigid.inertias[i].mass for i in moving.values())
    lengths = [float(np.linalg.norm(rigid.jointPlacements[i].translation)) for i in moving.values()]
    for joint, i in moving.items():
        body, change = rigid.inertias[i], model.bodies.body(joint)
        if body.mass > 0.0:
            scaled = replace(change, scale=change.scale * 1.1)
            yield _Open(joint, _ALL, scaled, 0.1, _SCALE)
            size = float(
                np.sqrt(0.5 * np.trace(body.inertia) / body.mass + body.lever @ body.lever)
            )
            for name, axis in zip("xyz", np.eye(3), strict=True):
                shift = tuple(np.add(change.shift, 0.01 * size * axis).tolist())
                yield _Open(joint, f"centre {name}", replace(change, shift=shift), 0.01, _SHIFT)
        if i in set(rigid.parents[1:]) or total <= 0.0:
            continue
        arm = max(float(np.mean(lengths)), 0.01)
        for k, what in enumerate((_MASS, "moment x", "moment y", "moment z")):
            carried = np.array(change.carried or (0.0,) * 10)
            carried[k] += 0.1 * total * (arm if k else 1.0)
            edited = replace(change, carried=tuple(carried.tolist()))
            yield _Open(joint, what, edited, 0.1, _CARRIED * (_OUT if k else 1.0))
