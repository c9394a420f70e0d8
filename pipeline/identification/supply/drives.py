"""Power into every drive along a log: work, friction, copper.

What flows into a motor's terminals is what it turns into motion and what its winding loses,

    u i = k_t i w + R i^2,    k_t i w = tau v + friction

with torque tau and speed v of the joint's bodies and speed w of the motor (Krishnan, Electric Motor
Drives, 2001, section 2.2). The motor's torque is the log's own, or the model's at a joint whose
effort is not in the log; what the motor gives and the bodies do not take is friction: that of
gears, bearings and seals, what rotors store, and what the bodies' file has wrong.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuators.arrays import Array, Mask
from actuators.errors import LegwattError
from pipeline.logs.filters import LowPass, smoother_noise
from pipeline.logs.log import Log
from pipeline.machine.machine import MachineModel
from pipeline.simulation.predict import Simulator


@dataclass(frozen=True, eq=False)
class DrivePower:
    """Power into every drive along one log, positive from supply to motor, shapes (N, J) [W]."""

    time: Array  #: Shape (N,) [s].
    speed: Array  #: Of the joints [rad/s].
    work: Array  #: Torque of the bodies times speed.
    friction: Array  #: Of the motor's mechanical power what is no work.
    copper: Array  #: R i^2.
    current: Array  #: Of the motors [A].
    known: Mask  #: Rows in which all of it is known, shape (N,).
    step: float  #: Between rows without a gap [s].
    reach: float  #: Time within which the low-pass of the motion blurs [s].
    by_model: tuple[str, ...]  #: Joints whose torque is the model's.

    @property
    def electrical(self) -> Array:
        """Into the motors' terminals."""
        return self.work + self.friction + self.copper


def drive_power(model: MachineModel, one: Log) -> DrivePower:
    """Power into every drive along one log.

    Raises:
        LegwattError: A joint has no motor.
    """
    for a in model.actuators:
        if a.motor is None:
            raise LegwattError(
                f"joint '{a.name}': no motor, so that its copper losses are not known; name the "
                "drivetrain option as alternative"
            )
    predicted = Simulator(one).predict(model)
    assert one.raw is not None
    assert one.known is not None
    assert one.moved is not None
    logged = np.asarray(np.isfinite(one.raw).any(axis=0))
    off = np.zeros(one.v.shape, dtype=np.bool_) if one.off is None else one.off
    work = np.where(off, 0.0, predicted.torque * one.v)
    terminals = _at_terminals(model, one, predicted.motor_torque, logged)
    mechanical, copper, current = (np.where(off, 0.0, x) for x in terminals)
    return DrivePower(
        time=one.time,
        speed=one.v,
        work=work,
        friction=mechanical - work,
        copper=copper,
        current=current,
        known=np.asarray(np.where(logged, one.known | off, one.moved).all(axis=1)),
        step=1.0 / one.rate,
        reach=1.0 / one.bandwidth,
        by_model=tuple(j for j, seen in zip(one.joints, logged, strict=True) if not seen),
    )


def _at_terminals(
    model: MachineModel, one: Log, motor_torque: Array, logged: Mask
) -> tuple[Array, Array, Array]:
    """Mechanical power of the motors [W], copper losses [W] and currents [A], each (N, J).

    Efforts are not filtered: what a filter takes off a current that jumps is missing in R i^2. What
    its noise adds there on average is taken off.
    """
    assert one.raw is not None
    assert one.known is not None
    raw, lowpass = np.nan_to_num(one.raw), LowPass(one.rate, one.bandwidth)
    noise = smoother_noise(raw, one.known, one.pieces, lowpass, in_band=False)
    noise = np.where(np.isfinite(noise), noise, 0.0)
    mechanical, copper, current = (np.empty_like(one.v) for _ in range(3))
    # Coupled motors first: what they bring to the other joint must be known.
    order = sorted(range(len(model.actuators)), key=lambda k: not model.actuators[k].coupled_to)
    own = motor_torque.copy()
    for k in order:
        a = model.actuators[k]
        assert a.motor is not None
        channel = one.channels[0] if logged[k] else ""
        constant, resistance = (
            float(np.asarray(x)) for x in (a.motor.torque_constant, a.motor.resistance)
        )
        speed = a.ratio * model.drivetrains.turned(k, one.v)
        seen = (raw[:, k] - a.effort_offset) / a.gains.get(channel, 1.0)
        per_ampere = {"torque": a.ratio * constant, "current": 1.0, "voltage": resistance}
        if channel == "torque":
            own[:, k] = seen - model.drivetrains.carried(k, own)
        i = own[:, k] / (a.ratio * constant)
        if channel == "current":
            i = seen
        elif channel == "voltage":
            i = (seen - constant * speed) / resistance
        blur = noise[k] / per_ampere[channel] if channel in per_ampere else 0.0
        current[:, k], copper[:, k] = i, resistance * (i * i - blur * blur)
        mechanical[:, k] = seen - copper[:, k] if channel == "power" else constant * i * speed
    return mechanical, copper, current
