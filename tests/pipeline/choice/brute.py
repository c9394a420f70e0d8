"""One design after the other through its full chain: what every search is held against."""

from __future__ import annotations

import numpy as np

from actuators.energy.energy import supply_of
from actuators.energy.limits import limit_rows
from pipeline.choice.parts.designs import Designs
from pipeline.choice.search import Demanded


def in_full(designs: Designs, i: int, demanded: Demanded) -> tuple[float, bool]:
    """One design through its chain: mean power, and whether its motor is within limits."""
    power, fits = 0.0, True
    for track in demanded.tracks:
        mode = track.load.mode
        engaged = not mode.stands or mode.hold == "brake"
        result = designs.chain(i, engaged=engaged).inverse(track.series)
        driver = designs.taken(np.array([i]))
        lost = driver.driver.loss(result.current, driver.bus) - driver.idle
        flow = supply_of(result.electrical_power + lost, result.joint.time, demanded.joints)
        spent = flow.supplied_energy.sum() / track.load.duration
        idle = not mode.drivers and designs.locks(engaged)[i]
        on = (result.current != 0).any(axis=0).sum() if idle else len(demanded.joints)
        power += track.share * (spent + designs.idle[i] * on)
        fits &= not any(row.breach for row in limit_rows(result))
        volts = result.current * designs.resistance[i]
        volts = np.abs(volts + result.motor.velocity * designs.torque_constant[i])
        left = driver.driver_resistance * np.abs(result.current)
        fits &= (volts + left).max() <= designs.voltage[i]
        torque = result.joint.torque
        fits &= np.abs(torque).max() <= designs.gear_peak[i]
        fits &= np.sqrt((track.weight @ torque**2).max()) <= designs.gear_continuous[i]
        fits &= np.abs(result.motor.velocity).max() <= designs.gear_speed[i]
    return power, bool(fits)
