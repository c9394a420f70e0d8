"""The catalogue of effects, by name."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from actuators.errors import closest
from pipeline.effects.base import Effect
from pipeline.effects.bodies.base_tilt import BaseTilt
from pipeline.effects.bodies.center_of_mass_offset import CenterOfMassOffset
from pipeline.effects.bodies.internal_foot_force import InternalFootForce
from pipeline.effects.bodies.link_mass import LinkMass
from pipeline.effects.bodies.rigid_body_parameters import RigidBodyParameters
from pipeline.effects.drive.backlash import Backlash
from pipeline.effects.drive.joint_elasticity import JointElasticity
from pipeline.effects.drive.parallel_spring import ParallelSpring
from pipeline.effects.drive.rotor_inertia import RotorInertia
from pipeline.effects.drive.torque_constant_error import TorqueConstantError
from pipeline.effects.drive.torque_ripple import TorqueRipple
from pipeline.effects.drive.transmission_coupling import BareCoupling, TransmissionCoupling
from pipeline.effects.drive.winding_heating import SensedHeating, WindingHeating
from pipeline.effects.flexible.friction_curve import FrictionCurveEffect
from pipeline.effects.flexible.position_curve import PositionCurveEffect
from pipeline.effects.friction.joint_friction import JointFrictionLaw
from pipeline.effects.friction.presets import (
    BackdriveLoss,
    CoulombFriction,
    DirectionDependentFriction,
    LoadDependentFriction,
    QuadraticDrag,
    StribeckFriction,
    ViscousFriction,
)
from pipeline.effects.friction.warming_friction import WarmingFriction
from pipeline.effects.sensing.effort_gain import EffortGain
from pipeline.effects.sensing.effort_offset import EffortOffset
from pipeline.effects.sensing.position_offset import PositionOffset
from pipeline.effects.sensing.time_delay import TimeDelay
from pipeline.logs.errors import EffectError
from pipeline.machine.machine import MachineModel

EFFECTS: Final[Mapping[str, Effect]] = MappingProxyType(
    {
        effect.name: effect
        for effect in (
            CoulombFriction(),
            ViscousFriction(),
            QuadraticDrag(),
            StribeckFriction(),
            LoadDependentFriction(),
            DirectionDependentFriction(),
            BackdriveLoss(),
            JointFrictionLaw(),
            WarmingFriction(),
            FrictionCurveEffect(),
            PositionCurveEffect(),
            RotorInertia(),
            RigidBodyParameters(),
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
            EffortGain(),
            PositionOffset(),
            TimeDelay(),
            InternalFootForce(),
        )
    }
)
_BARE_COUPLING: Final = BareCoupling()
_SENSED_HEATING: Final = SensedHeating()


def effect_named(name: str) -> Effect:
    """An effect of the catalogue.

    Raises:
        EffectError: Unknown name; the message offers the closest one.
    """
    if name not in EFFECTS:
        raise EffectError(f"no effect '{name}'; {closest(name, list(EFFECTS))}")
    return EFFECTS[name]


def catalogue(model: MachineModel) -> tuple[Effect, ...]:
    """Every effect in the form in which it competes for this machine."""
    bare = any(a.motor is None for a in model.actuators)
    effects = [
        _BARE_COUPLING if bare and e.name == _BARE_COUPLING.name else e
        for e in EFFECTS.values()
        if e.competes
    ]
    # A log with the motors' temperature has places for this one, any other for the plain one.
    return (*effects, _SENSED_HEATING)
