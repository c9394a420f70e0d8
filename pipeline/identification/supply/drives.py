"""Along a log: what the supply gave, and power into every drive: work, friction, copper.

What flows into a motor's terminals is what it turns into motion and what its winding loses,

    u i = k_t i w + R i^2,    k_t i w = tau v + friction

with torque tau and speed v of the joint's bodies and speed w of the motor (Krishnan, Electric Motor
Drives, 2001, section 2.2). The motor's torque is the log's own, or the model's at a joint whose
effort is not in the log; what the motor gives and the bodies do not take is friction: that of
gears, bearings and seals, what rotors store, and what the bodies' file has wrong.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from pandas import DataFrame

from actuators.arrays import Array, Mask
from actuators.errors import LegwattError
from pipeline.logs.filters import LowPass, smoother_noise
from pipeline.logs.log import Log, Recording
from pipeline.machine.machine import MachineModel
from pipeline.simulation.predict import Simulator

#: Share of equal neighbours from which on a column holds its last value between samples.
_REPEATED: Final = 0.5


@dataclass(frozen=True, eq=False)
class DrivePower:
    """Power into every drive along one log, positive from supply to motor."""

    time: Array  #: Shape (N,) [s].
    speed: Array  #: Of the joints, shape (N, J) [rad/s].
    #: ``work`` of the bodies, ``friction`` (of the motor's mechanical power what is no work) and
    #: ``copper``, each of shape (N, J) [W].
    parts: Mapping[str, Array]
    current: Array  #: Of the motors, shape (N, J) [A].
    known: Mask  #: Rows in which all of it is known, shape (N,).
    step: float  #: Between rows without a gap [s].
    reach: float  #: Time within which the low-pass of the motion blurs [s].
    by_model: tuple[str, ...]  #: Joints whose torque is the model's.

    @property
    def electrical(self) -> Array:
        """Into the motors' terminals, shape (N, J) [W]."""
        return np.asarray(sum(self.parts.values()))


def drive_power(model: MachineModel, one: Log) -> DrivePower:
    """Power into every drive along one log.

    Efforts are not filtered: what a filter takes off a current that jumps is missing in R i^2. What
    its noise adds there on average is taken off.

    Raises:
        LegwattError: A joint has no motor.
    """
    simulator = Simulator(one)
    predicted = simulator.predict(model)
    assert one.raw is not None
    assert one.known is not None
    assert one.moved is not None
    logged = np.asarray(np.isfinite(one.raw).any(axis=0))
    raw, lowpass = np.nan_to_num(one.raw), LowPass(one.rate, one.bandwidth)
    noise = np.nan_to_num(smoother_noise(raw, one.known, one.pieces, lowpass))
    mechanical, copper, current = (np.empty_like(one.v) for _ in range(3))
    own = predicted.motor_torque.copy()
    # Coupled motors first: what they bring to the other joint must be known.
    for k in sorted(range(len(one.joints)), key=lambda k: not model.actuators[k].coupled_to):
        a, channel = model.actuators[k], one.channels[0] if logged[k] else ""
        if a.motor is None:
            raise LegwattError(
                f"joint '{a.name}': no motor, so that its copper losses are not known; name the "
                "drivetrain option as alternative"
            )
        constant = float(np.asarray(a.motor.torque_constant))
        resistance = float(np.asarray(a.motor.resistance))
        efforts = {"torque": a.ratio * constant, "current": 1.0, "voltage": resistance}
        per_ampere = efforts.get(channel, np.inf)
        back = constant * a.ratio * model.drivetrains.turned(k, one.v)  # [V]
        seen = (raw[:, k] - a.effort_offset) / a.gains.get(channel, 1.0)
        if channel == "torque":
            own[:, k] = seen - model.drivetrains.carried(k, own)
        i = own[:, k] / (a.ratio * constant)
        if channel in ("current", "voltage"):
            i = (seen - (back if channel == "voltage" else 0.0)) / per_ampere
        current[:, k] = i
        copper[:, k] = resistance * (i * i - (noise[k] / per_ampere) ** 2)
        mechanical[:, k] = seen - copper[:, k] if channel == "power" else back * i
    on = np.ones_like(one.known) if one.off is None else ~one.off
    # Forces of the ground that fit logged torques best hold a part of the drives' friction.
    work = simulator.rigid(model)[1] * one.v * on
    return DrivePower(
        time=one.time,
        speed=one.v,
        parts={"work": work, "friction": mechanical * on - work, "copper": copper * on},
        current=current * on,
        known=np.asarray(np.where(logged, one.known | ~on, one.moved).all(axis=1)),
        step=1.0 / one.rate,
        reach=1.0 / one.bandwidth,
        by_model=tuple(j for j, seen in zip(one.joints, logged, strict=True) if not seen),
    )


def supply_samples(log: Recording, shortest: float) -> DataFrame:
    """The supply's samples of one log, each the mean over the time since the one before.

    Columns ``begin``, ``end`` [s], ``power`` [W], ``voltage`` [V], NaN where it is not known.

    Args:
        log: As read; the supply's columns may be empty or hold their value between samples.
        shortest: Samples closer together than this [s] are averaged.

    Raises:
        LegwattError: There is no power at the supply, or it cannot be one.
    """
    voltage, current, power = (
        _sampled(log.time, log.of(name)) for name in ("supply", "supply_current", "supply_power")
    )
    measured = power or current
    if measured is None or (power is None and voltage is None):
        have = "a voltage alone" if voltage else "a current alone" if current else "no column"
        raise LegwattError(
            f"{log.name}: {have} of the supply; log supply__power_W, or supply__current_A with "
            "supply__voltage_V, which [constants] of a mapping file can state"
        )
    at = measured[0]
    u = np.full(at.size, np.nan) if voltage is None else np.interp(at, *voltage)
    p = power[1] if power is not None else u * measured[1]
    wrong = ""
    if voltage is not None and (voltage[1] <= 0.0).any():
        wrong = (
            f"'s voltage falls to {voltage[1].min():.4g} V; expected a positive one, leave cells "
            "empty where it was not measured"
        )
    elif np.ptp(p) == 0.0:
        wrong = f" gives {p[0]:.4g} W in every sample: a dead sensor, or a stated value"
    elif np.median(p) <= 0.0:
        wrong = (
            f" gives {np.median(p):.4g} W at the middle sample; expected power out of it to be "
            "positive; flip the column in a mapping file"
        )
    if wrong:
        raise LegwattError(f"{log.name}: the supply{wrong}")
    place = np.floor((at - at[0]) / shortest * (1.0 + 1e-9))
    group = np.concatenate([[0], np.cumsum(np.diff(place) > 0)])
    end = at[np.flatnonzero(np.diff(np.append(group, group[-1] + 1)))]
    p, u = (np.bincount(group, x) / np.bincount(group) for x in (p, u))
    return DataFrame({"begin": end[:-1], "end": end[1:], "power": p[1:], "voltage": u[1:]})


def _sampled(time: Array, values: Array | None) -> tuple[Array, Array] | None:
    """Instants and values of a column where it has samples of its own; None without any."""
    if values is None or not np.isfinite(values).any():
        return None
    time, values = time[np.isfinite(values)], values[np.isfinite(values)]
    changes = np.flatnonzero(np.diff(values)) + 1
    if 1 < changes.size < (1.0 - _REPEATED) * values.size:
        # Repeated between samples, which come every so many rows.
        every = max(1, int(np.quantile(np.diff(changes), 0.05)))
        rows = np.arange(changes[0] % every, values.size, every)
        time, values = time[rows], values[rows]
    return time, values
