"""What a voltage log shows of torque constants and viscous friction, in words.

With k, R and n of motor and gear, and friction b v at the joint, the voltage has one part in
proportion to the joint's speed,

    U = ... + (k n + R b / (k n)) v,

so that speed shows the sum alone; loads and rows with the drive off have to tell its parts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from actuators.chain import Chain
from actuators.elements.element import Friction
from pipeline.identification.results import Naming
from pipeline.logs.log import Log


def voltage_remarks(
    actuators: Sequence[Chain], naming: Naming, measurements: Sequence[Log]
) -> tuple[str, ...]:
    """A sentence per joint; none where something else than voltage alone is compared.

    Args:
        actuators: Before anything found is added.
        naming: What was found.
        measurements: The logs.
    """
    if measurements[0].channels != ("voltage",):
        return ()
    return tuple(
        _sentence(k, a, naming, measurements)
        for k, a in enumerate(actuators)
        if a.motor is not None
    )


def voltage_per_speed(actuator: Chain, naming: Naming) -> tuple[float, float, float, float]:
    """Sum [V*s/rad], k at the joint [N*m/A], R [ohm] and b at the joint [N*m*s/rad]."""
    assert actuator.motor is not None
    tolerance = {
        kind: value
        for (kind, place), (value, _) in naming.tolerances.items()
        if place == actuator.name
    }
    found: dict[str, Mapping[str, float]] = {
        f.effect: one.values
        for f in naming.found
        for one in f.each
        if one.place == (actuator.name,)
    }
    factor = 1.0 + tolerance.get("torque_constant_error", 0.0)
    factor *= 1.0 + found.get("torque_constant_error", {}).get("relative", 0.0)
    constant = float(np.asarray(actuator.motor.torque_constant)) * factor * actuator.ratio
    resistance = float(np.asarray(actuator.motor.resistance))
    resistance *= 1.0 + tolerance.get("resistance", 0.0)
    viscous, speed = found.get("viscous_friction", {}).get("coefficient", 0.0), 1.0
    for effect in ("joint_friction", "friction_curve"):
        viscous += found.get(effect, {}).get("viscous", 0.0)
    for element in actuator.elements:
        speed *= float(np.asarray(element.gearing))
        if isinstance(element, Friction):
            viscous += float(np.asarray(element.viscous)) * speed**2
    return constant + resistance * viscous / constant, constant, resistance, viscous


def _sentence(column: int, actuator: Chain, naming: Naming, measurements: Sequence[Log]) -> str:
    total, constant, resistance, viscous = voltage_per_speed(actuator, naming)
    free = sum(
        int((m.mask[:, column] & m.open_winding[:, column]).sum())
        for m in measurements
        if m.open_winding is not None
    )
    told = (
        f"{free} rows with the drive off tell them apart, as long as the winding is open there, as "
        "the mapping file says"
        if free
        else "the torque constant is held to what its file states, and friction takes the rest"
    )
    return (
        f"{actuator.name}: speed shows torque constant and viscous friction in one sum only, "
        f"k + R b / k = {total:.3g} V*s/rad at the joint (here k = {constant:.3g} N*m/A, "
        f"R = {resistance:.3g} ohm, b = {viscous:.3g} N*m*s/rad); {told}."
    )
