"""The catalogue of effects, by name."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from actuators.errors import closest
from pipeline.gap.effects.backdrive_loss import BackdriveLoss
from pipeline.gap.effects.backlash import Backlash
from pipeline.gap.effects.base import Effect
from pipeline.gap.effects.base_tilt import BaseTilt
from pipeline.gap.effects.center_of_mass_offset import CenterOfMassOffset
from pipeline.gap.effects.coulomb_friction import CoulombFriction
from pipeline.gap.effects.direction_dependent_friction import DirectionDependentFriction
from pipeline.gap.effects.effort_gain import EffortGain
from pipeline.gap.effects.effort_offset import EffortOffset
from pipeline.gap.effects.internal_foot_force import InternalFootForce
from pipeline.gap.effects.joint_elasticity import JointElasticity
from pipeline.gap.effects.link_mass import LinkMass
from pipeline.gap.effects.load_dependent_friction import LoadDependentFriction
from pipeline.gap.effects.parallel_spring import ParallelSpring
from pipeline.gap.effects.position_offset import PositionOffset
from pipeline.gap.effects.rotor_inertia import RotorInertia
from pipeline.gap.effects.stribeck_friction import StribeckFriction
from pipeline.gap.effects.time_delay import TimeDelay
from pipeline.gap.effects.torque_constant_error import TorqueConstantError
from pipeline.gap.effects.torque_ripple import TorqueRipple
from pipeline.gap.effects.transmission_coupling import BareCoupling, TransmissionCoupling
from pipeline.gap.effects.viscous_friction import ViscousFriction
from pipeline.gap.effects.winding_heating import SensedHeating, WindingHeating
from pipeline.gap.errors import EffectError
from pipeline.gap.model import MachineModel

EFFECTS: Final[Mapping[str, Effect]] = MappingProxyType(
    {
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
        _BARE_COUPLING if bare and e.name == _BARE_COUPLING.name else e for e in EFFECTS.values()
    ]
    # A log with the motors' temperature has places for this one, any other for the plain one.
    return (*effects, _SENSED_HEATING)
