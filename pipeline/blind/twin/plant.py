"""The machine as it truly is: rigid bodies, motors, transmission, friction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from pipeline.blind.twin.errors import TwinError
from pipeline.blind.twin.laws.bristle import BristleLaw
from pipeline.blind.twin.laws.extra import ExtraTorque, StickingSpot
from pipeline.blind.twin.machine import Machine
from pipeline.robot.robot import Robot

Array = NDArray[np.float64]
#: Deflection of the rotor's bristles in steady sliding [rad] at the joint.
_ROTOR_DEFLECTION = 1e-4
COPPER = 0.0039  # [1/K], temperature coefficient of resistance
MAGNET = -0.0011  # [1/K], of the torque constant (NdFeB)


@dataclass(frozen=True)
class Heating:
    """Windings that warm up while the log runs.

    A first-order thermal circuit: tau dT/dt = R_th R I^2 + T_drive - T.

    Attributes:
        rise: T_drive, the rise that idle losses and housing drive it towards [K], shape (J,).
        thermal_resistance: R_th [K/W], shape (J,).
        time_constant: tau [s].
    """

    rise: Array
    thermal_resistance: Array
    time_constant: float


@dataclass(frozen=True)
class Plant:
    """Everything the forward simulation needs to know of the machine.

    Joint arrays have shape (J,) in the robot file's order and are referred to the joint.

    Attributes:
        robot: The nominal robot, for names and geometry.
        model: Bodies as they are, masses within their tolerance; armature zero.
        machine: The actuator's data sheet.
        torque_constant: True k_t of every motor, at no current and room temperature [N*m/A].
        saturation_current: Current at which k_t has fallen by half, infinite without [A].
        resistance: [ohm].
        rotor_inertia: Reflected [kg*m^2].
        rotor: Friction at the motor's shaft.
        gear: Friction at the joint, loaded by the torque that reaches the link.
        coupling: Motor angles over joint angles, both at the joint side, shape (J, J).
        stiffness: Of the transmission [N*m/rad]; infinite where it is rigid.
        damping: Of the transmission where it is elastic [N*m*s/rad].
        gap: Backlash, whole width [rad].
        extra: Further torques at joints.
        sticking: Stretches of higher friction.
        heating: None for windings at room temperature.
    """

    robot: Robot
    model: pin.Model
    machine: Machine
    torque_constant: Array
    saturation_current: Array
    resistance: Array
    rotor_inertia: Array
    rotor: BristleLaw
    gear: BristleLaw
    coupling: Array
    stiffness: Array
    damping: Array
    gap: Array
    extra: tuple[ExtraTorque, ...] = ()
    sticking: tuple[StickingSpot, ...] = ()
    heating: Heating | None = None

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the columns."""
        return self.robot.joints

    @property
    def elastic(self) -> NDArray[np.bool_]:
        """Which joints have a motor that turns apart from its link, shape (J,)."""
        return np.isfinite(self.stiffness)


def nominal_plant(robot: Robot, machine: Machine) -> Plant:
    """The machine exactly as drawn and as its data sheets say."""
    n = len(robot.joints)
    ratio = machine.ratio
    coulomb = np.full(n, ratio * machine.rotor_coulomb)
    rotor = replace(
        BristleLaw.none(n),
        coulomb=coulomb,
        viscous=np.full(n, ratio**2 * machine.rotor_viscous),
        stiffness=np.maximum(coulomb, 0.1) / _ROTOR_DEFLECTION,
    )
    return Plant(
        robot=robot,
        model=robot.model.copy(),
        machine=machine,
        torque_constant=np.full(n, machine.torque_constant),
        saturation_current=np.full(n, np.inf),
        resistance=np.full(n, machine.resistance),
        rotor_inertia=np.full(n, machine.reflected_inertia),
        rotor=rotor,
        gear=BristleLaw.none(n),
        coupling=np.eye(n),
        stiffness=np.full(n, np.inf),
        damping=np.zeros(n),
        gap=np.zeros(n),
    )


def with_bodies(
    plant: Plant,
    *,
    scale: Mapping[str, float] | None = None,
    payload: Mapping[str, float] | None = None,
    shift: Mapping[str, Array] | None = None,
) -> Plant:
    """A plant whose bodies differ; each body is named by the joint that carries it.

    Args:
        plant: Where to start from.
        scale: Factor on mass and rotational inertia [1].
        payload: Point mass added at the body's centre of mass [kg].
        shift: Displacement of the centre of mass in the joint's frame [m], shape (3,).

    Raises:
        TwinError: No such joint.
    """
    model = plant.model.copy()
    for joint in {*(scale or {}), *(payload or {}), *(shift or {})}:
        if not model.existJointName(joint):
            raise TwinError(f"no body hangs on a joint '{joint}'; known: {', '.join(model.names)}")
        index = model.getJointId(joint)
        body = model.inertias[index]
        factor = (scale or {}).get(joint, 1.0)
        model.inertias[index] = pin.Inertia(
            factor * body.mass + (payload or {}).get(joint, 0.0),
            body.lever + (shift or {}).get(joint, np.zeros(3)),
            factor * body.inertia,
        )
    return replace(plant, model=model)


def on_slope(plant: Plant, roll: float, pitch: float) -> Plant:
    """The same machine on tilted ground; the world frame stays with the ground.

    Args:
        plant: Where to start from.
        roll: Of the ground about its x axis [rad].
        pitch: Of the ground about its y axis [rad].
    """
    model = plant.model.copy()
    tilt = pin.rpy.rpyToMatrix(roll, pitch, 0.0)  # ground -> level
    model.gravity.linear = tilt.T @ plant.robot.model.gravity.linear
    return replace(plant, model=model)
