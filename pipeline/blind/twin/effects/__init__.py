"""Everything the twin can hide, by name."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from actuators.errors import closest
from pipeline.blind.twin.effects.base import STRENGTH, Effect, Hidden
from pipeline.blind.twin.effects.bodies import (
    BaseTilt,
    CenterOfMassOffset,
    InternalFootForce,
    LinkMass,
)
from pipeline.blind.twin.effects.drive import (
    Backlash,
    JointElasticity,
    ParallelSpring,
    RotorInertia,
    TorqueConstantError,
    TorqueRipple,
    TransmissionCoupling,
    WindingHeating,
)
from pipeline.blind.twin.effects.friction import (
    BackdriveLoss,
    CoulombFriction,
    DirectionDependentFriction,
    LoadDependentFriction,
    StribeckFriction,
    ViscousFriction,
)
from pipeline.blind.twin.effects.sensing import EffortOffset, PositionOffset, TimeDelay
from pipeline.blind.twin.effects.uncatalogued import (
    CableLoom,
    FluidDrag,
    MagneticSaturation,
    Sticking,
)
from pipeline.blind.twin.errors import TwinError
from pipeline.blind.twin.reference import Reference

EFFECTS: dict[str, Effect] = {
    effect.name: effect
    for effect in (
        CoulombFriction(),
        ViscousFriction(),
        StribeckFriction(),
        LoadDependentFriction(),
        DirectionDependentFriction(),
        BackdriveLoss(),
        RotorInertia(),
        LinkMass(),
        CenterOfMassOffset(),
        BaseTilt(),
        JointElasticity(),
        Backlash(),
        TorqueRipple(),
        TransmissionCoupling(),
        ParallelSpring(),
        TorqueConstantError(),
        WindingHeating(),
        EffortOffset(),
        PositionOffset(),
        TimeDelay(),
        InternalFootForce(),
        CableLoom(),
        FluidDrag(),
        Sticking(),
        MagneticSaturation(),
    )
}
CATALOGUE = tuple(name for name, effect in EFFECTS.items() if effect.in_catalogue)
UNCATALOGUED = tuple(name for name, effect in EFFECTS.items() if not effect.in_catalogue)

__all__ = ["CATALOGUE", "EFFECTS", "UNCATALOGUED", "Effect", "Hidden", "draw", "effect_named"]


def effect_named(name: str, motion: str) -> Effect:
    """An effect that can be hidden in a motion.

    Raises:
        TwinError: Unknown, or it cannot act in this motion.
    """
    if name not in EFFECTS:
        raise TwinError(f"effect '{name}' is not known; {closest(name, list(EFFECTS))}")
    effect = EFFECTS[name]
    if motion not in effect.motions:
        raise TwinError(
            f"effect '{name}' cannot act in motion '{motion}'; use {' or '.join(effect.motions)}"
        )
    return effect


def draw(effect: Effect, rng: np.random.Generator, ref: Reference) -> Hidden:
    """Place and size: log-uniform in strength over the noise, inside the physical range."""
    strength = float(np.exp(rng.uniform(*np.log(STRENGTH))))
    hidden = effect.draw(rng, ref, strength * ref.noise_torque)
    return replace(hidden, strength=hidden.expected_torque / ref.noise_torque)
