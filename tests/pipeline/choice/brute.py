"""One design after the other through its full chain: what every evaluation is held against."""

from __future__ import annotations

from collections.abc import Sequence
from types import MappingProxyType

import numpy as np

from actuators.chain import Chain
from actuators.elements.element import Element, Friction, Inertia, Ratio
from actuators.elements.hypoid import Hypoid
from actuators.energy.energy import supply_of
from actuators.energy.limits import limit_rows
from actuators.loading.build import WINDING
from actuators.shaft import DCMotor
from actuators.supply import Driver
from pipeline.choice.designs import Designs
from pipeline.choice.loads import Load


def chain_of(d: Designs, i: int, *, closed: bool) -> Chain:
    """One design, element by element; its brake is closed or open."""
    ratio, load = float(d.ratio[i]), float(d.load[i])
    gear: Element = Ratio("transmission", ratio)
    if load >= 1.0:
        gear = Hypoid("transmission", ratio, pinion_angle=np.pi / 4, friction=load)
        load = 0.0
    friction = Friction("friction", coulomb=d.coulomb[i], load=load, viscous=d.viscous[i])
    elements = [gear, friction]
    if closed:  # it holds like dry friction and is gone in motion
        elements.append(Friction("brake", excess=d.brake_torque[i], stribeck_speed=1e-12))
    elements.append(Inertia("rotor", d.inertia[i]))
    constants = (d.torque_constant, d.resistance, d.max_speed, d.voltage)
    limits = (d.continuous_current, d.peak_current)
    motor = DCMotor(WINDING, *(number[i] for number in (*constants, *limits)))
    return Chain("design", tuple(elements), motor, MappingProxyType({"m": "rotor"}))


def in_full(
    d: Designs, i: int, loads: Sequence[Load], joints: Sequence[str], fraction: float = 0.0
) -> tuple[list[float], bool]:
    """One design through its chain: mean power of every mode, and whether it is within limits."""
    powers, fits = [], True
    driver = Driver("driver", d.driver_resistance[i], d.idle[i], d.switching[i])
    for load in loads:
        mode, series = load.mode, load.series.of(joints)
        closed = mode.stands and mode.hold == "brake"
        result = chain_of(d, i, closed=closed).inverse(series)
        lost = driver.loss(result.current, d.bus[i]) - d.idle[i]
        lost += 0.0 if closed else d.brake_power[i]
        flow = supply_of(result.electrical_power + lost, series.time, joints, fraction)
        locks = d.load[i] >= 1.0 or (closed and d.brake_torque[i] > 0.0)
        on = (result.current != 0).any(axis=0).sum() if locks and not mode.drivers else len(joints)
        powers.append(flow.supplied_energy.sum() / load.duration + d.idle[i] * on)
        still = d.standstill[i] if mode.stands else 1.0
        for row in limit_rows(result):
            if row.quantity != "voltage":
                fits &= row.peak <= row.limit * (still if row.quantity == "rms_current" else 1.0)
        volts = result.current * d.resistance[i] + result.motor.velocity * d.torque_constant[i]
        drop = d.driver_resistance[i] * np.abs(result.current)
        fits &= (np.abs(volts) + drop).max() <= d.voltage[i]
        torque = series.torque
        rms = np.sqrt(np.trapezoid(torque**2, series.time, axis=0) / load.duration)
        fits &= np.abs(torque).max() <= d.gear_peak[i] and rms.max() <= d.gear_continuous[i]
        fits &= np.abs(result.motor.velocity).max() <= d.gear_speed[i]
        if closed and d.brake_torque[i] > 0.0:
            fits &= np.abs(torque).max() / d.ratio[i] <= d.brake_torque[i]
    return powers, bool(fits)
