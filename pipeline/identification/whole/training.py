"""From logs to what the regression of a whole machine is fitted to: motion, and torque at joints.

Only rows that may be learnt from go in, cut out of the log before anything is filtered: what
proves leaves no trace. Where a log tells a motor's current or voltage, torque at the joint is what
the data sheet makes of it, less what the model's drivetrain is known to take.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from actuators.elements.motor import DCMotor
from actuators.shaft import ShaftSeries
from pipeline.effects.bodies.link_mass import MASS_TOLERANCE
from pipeline.identification.whole.errors import NotWholeError
from pipeline.logs.prepared.measurement import CHOOSE, FIT
from pipeline.logs.prepared.parts import Parts
from pipeline.logs.prepared.prepare import Prepared
from pipeline.logs.quality.skew import skew
from pipeline.logs.reading.log import Log
from pipeline.machine.machine import MachineModel
from pipeline.regression import Rows, Run

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
#: A gap in time of more than this share of the cut-off's period ends a run.
LONGEST_GAP: Final = 0.25
#: A velocity that comes later than its position by this share of the cut-off's period is left out,
#: looked for up to so long [s].
LATE: Final = 0.05
LATEST: Final = 0.1
#: Shortest run worth filtering, in samples.
SHORTEST: Final = 64


def training_runs(
    prepared: Sequence[Prepared], parts: Parts, model: MachineModel, columns: NDArray[np.intp]
) -> list[Run]:
    """Recordings to learn from, one per stretch without a gap.

    Args:
        prepared: Logs.
        parts: Of them.
        model: The machine.
        columns: Joints to learn, in order, (K,).

    Raises:
        NotWholeError: The channel does not tell a torque, or too little is left to learn from.
    """
    out = []
    for one, part in zip(prepared, parts.part, strict=True):
        log = one.log
        torque, told = joint_torque(log, model)
        known = told[:, columns].all(axis=1)
        good = known & np.isfinite(log.position[:, columns]).all(axis=1) & _inside(one, part)
        velocity = _velocity(one, good, columns)
        for rows in _stretches(log.time, good, LONGEST_GAP / one.cutoff):
            out.append(
                Run(
                    log.time[rows],
                    log.position[np.ix_(rows, columns)],
                    torque[np.ix_(rows, columns)],
                    None if velocity is None else velocity[rows],
                )
            )
    if not out:
        raise NotWholeError("no stretch of the log is long enough to learn from")
    return out


def _velocity(one: Prepared, good: Mask, columns: NDArray[np.intp]) -> Array | None:
    """The logged velocity, where it is one and comes with the position, (N, K)."""
    log = one.log
    if log.velocity is None or not np.isfinite(log.velocity[np.ix_(good, columns)]).all():
        return None
    step = float(np.median(np.diff(log.time)))
    for k in map(int, columns):
        rate = one.lowpass(np.gradient(np.interp(one.time, log.time, log.position[:, k]), one.time))
        told = one.lowpass(np.interp(one.time, log.time, log.velocity[:, k]))
        found = skew(told, rate, step, longest=LATEST)
        if found is not None and abs(found.lag) * one.cutoff > LATE:
            return None
    return np.asarray(log.velocity[:, columns])


def _inside(one: Prepared, part: NDArray[np.int8]) -> Mask:
    """Rows of the log that may be learnt from, guards towards what proves left out, (N,)."""
    known = np.flatnonzero(np.isin(part, (FIT, CHOOSE)))
    labelled = np.flatnonzero(part >= FIT)
    learn = np.zeros(part.size, dtype=np.bool_)
    if known.size == 0:
        return np.zeros(len(one.log), dtype=np.bool_)
    learn[known] = True
    # A guard between two parts that both are learnt from is learnt from, too.
    before = np.searchsorted(labelled, np.arange(part.size), side="right") - 1
    after = np.minimum(before + 1, labelled.size - 1)
    between = (part < FIT) & (before >= 0)
    learn |= between & learn[labelled[np.maximum(before, 0)]] & learn[labelled[after]]
    time = one.log.time
    index = np.clip(np.searchsorted(one.time, time), 1, one.time.size - 1)
    both = learn[index - 1] & learn[index]
    return np.asarray(both & (time >= one.time[0]) & (time <= one.time[-1]))


def _stretches(time: Array, good: Mask, longest: float) -> list[NDArray[np.intp]]:
    """Rows of the log without a gap of more than `longest` [s]."""
    step = float(np.median(np.diff(time)))
    rows = np.flatnonzero(good)
    if rows.size == 0:
        return []
    cuts = np.flatnonzero(np.diff(time[rows]) > max(longest, 2.0 * step)) + 1
    return [piece for piece in np.split(rows, cuts) if piece.size >= SHORTEST]


def joint_torque(log: Log, model: MachineModel) -> tuple[Array, Mask]:
    """Torque that motors give, at the joint side, (N, J) [N*m], and where it is known, (N, J).

    Raises:
        NotWholeError: Neither torque, current nor voltage is compared.
    """
    effort = log.effort
    values, known = np.array(effort.values), np.isfinite(effort.values)
    if effort.channel != "torque":
        for k, a in enumerate(model.actuators):
            if a.motor is None or effort.channel == "power":
                raise NotWholeError(f"{effort.channel} alone does not tell the joints' torque")
            _refuse_unknown(a.name, a.motor, effort.channel)
            constant = float(np.asarray(a.motor.torque_constant))
            if effort.channel == "voltage":
                speed = a.ratio * np.gradient(log.position[:, k], log.time)
                resistance = float(np.asarray(a.motor.resistance))
                values[:, k] = (values[:, k] - constant * speed) / resistance
            values[:, k] *= constant * a.ratio
    if log.torque_off is not None:
        free = np.full_like(log.torque_off, log.torque_off_bridge == "open")
        values = np.where(log.torque_off & free, 0.0, values)
        known = np.where(log.torque_off, free, known)
    return values, np.asarray(known & log.valid)


def _refuse_unknown(joint: str, motor: DCMotor, channel: str) -> None:
    """Refuse motors that are known worse than the bodies they would weigh.

    Raises:
        NotWholeError: Torque constant or resistance are open by more than a link's mass.
    """
    open_by = motor.torque_constant_spread
    what = "torque constant"
    if channel == "voltage" and motor.resistance_spread > open_by:
        open_by, what = motor.resistance_spread, "winding's resistance"
    if open_by > MASS_TOLERANCE:
        raise NotWholeError(
            f"the {what} of {joint} is known to {100 * open_by:.0f} % only, bodies to "
            f"{100 * MASS_TOLERANCE:.0f} %: {channel} does not tell its torque"
        )


def without_known(rows: Rows, model: MachineModel, rigid: pin.Model) -> Array:
    """Torque of rows less what the model's own drivetrains take, (N, J) [N*m].

    Args:
        rows: Of the regression, joints in the order of `rigid`.
        model: The machine.
        rigid: Its bodies.
    """
    names = list(rigid.names)[1:]
    q, v, a = rows.fine
    if not any(model.actuator(n).path for n in names):
        return rows.tau
    data = rigid.createData()
    load = np.array([pin.rnea(rigid, data, *row) for row in zip(q, v, a, strict=True)])
    taken = np.zeros_like(load)
    for k, name in enumerate(names):
        actuator = model.actuator(name)
        sense = np.tanh(v[:, k] / max(3.0 * float(rows.sigma_v[k]), 1e-9))
        at = slice(k, k + 1)
        side = ShaftSeries(
            joints=(name,),
            time=np.arange(len(q), dtype=float),
            position=q[:, at],
            velocity=v[:, at],
            acceleration=a[:, at],
            torque=load[:, at],
            direction=sense[:, None],
        )
        for element in actuator.path:
            side = element.moving(side)
        taken[:, k] = actuator.ratio * side.torque[:, 0] - load[:, k]
    return np.asarray(rows.tau - rows.filtered(taken))
