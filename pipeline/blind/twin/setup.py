"""A machine ready to be run: plant, controller, plan, sensors, ground, and its tolerances."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.blind.twin.controller import Controller, Plan
from pipeline.blind.twin.laws.ground import Ground
from pipeline.blind.twin.machine import Machine
from pipeline.blind.twin.plant import Plant, nominal_plant, with_bodies
from pipeline.blind.twin.sensors import NoiseLevel, Sensors
from pipeline.blind.twin.simulator import Record, Simulation
from pipeline.robot.robot import Robot

Array = NDArray[np.float64]
MASS_TOLERANCE = 0.03  # on every link's mass and rotational inertia [1]
TORQUE_CONSTANT_TOLERANCE = 0.02  # on every motor's k_t [1]
ENCODER_TOLERANCE = 2e-3  # on every joint encoder's zero [rad]


def stream(seed: int, purpose: str) -> np.random.Generator:
    """Random numbers for one purpose, so that drawing one thing never moves another.

    Args:
        seed: Of the trial.
        purpose: E.g. ``"noise"``.
    """
    return np.random.default_rng(np.random.SeedSequence([seed, zlib.crc32(purpose.encode())]))


@dataclass(frozen=True)
class Setup:
    """One machine and what it is told to do.

    Attributes:
        plant: The machine.
        controller: Its gains.
        plan: What it is to follow.
        sensors: How it is measured.
        ground: Under a walking robot, else None.
        squeeze: Lateral force by which standing feet squeeze the ground [N].
    """

    plant: Plant
    controller: Controller
    plan: Plan
    sensors: Sensors
    ground: Ground | None
    squeeze: float = 0.0

    @property
    def substeps(self) -> int:
        """Simulation steps per sample of the controller: 0.5 ms, 0.33 ms with elastic joints."""
        return 3 if bool(self.plant.elastic.any()) else 2

    def run(self) -> Record:
        """Simulate it."""
        return Simulation(
            self.plant, self.controller, self.plan, substeps=self.substeps, ground=self.ground
        ).run()


def nominal_setup(
    robot: Robot, machine: Machine, plan: Plan, noise: NoiseLevel, rate: float = 500.0
) -> Setup:
    """The machine exactly as its data sheets say, measured without bias."""
    n = len(robot.joints)
    return Setup(
        plant=nominal_plant(robot, machine),
        controller=Controller(),
        plan=plan,
        sensors=Sensors(rate, noise, np.zeros(n), np.zeros(n)),
        ground=Ground() if robot.floating else None,
    )


def with_tolerances(setup: Setup, seed: int) -> tuple[Setup, dict[str, dict[str, float]]]:
    """A machine that differs from its data sheets as machines do.

    Args:
        setup: The nominal machine.
        seed: Of the trial.

    Returns:
        The machine, and what was drawn: factors on masses by joint, factors on k_t by joint,
        encoder zeros by joint [rad].
    """
    rng = stream(seed, "tolerances")
    plant = setup.plant
    joints = plant.joints
    bodies = [name for name in plant.model.names if name != "universe"]
    mass = dict(zip(bodies, 1 + MASS_TOLERANCE * rng.uniform(-1, 1, len(bodies)), strict=True))
    torque_constant = 1 + TORQUE_CONSTANT_TOLERANCE * rng.uniform(-1, 1, len(joints))
    zero = ENCODER_TOLERANCE * rng.uniform(-1, 1, len(joints))
    plant = with_bodies(plant, scale=mass)
    plant = replace(plant, torque_constant=plant.torque_constant * torque_constant)
    sensors = replace(setup.sensors, position_offset=setup.sensors.position_offset + zero)
    drawn = {
        "mass_factor": {name: float(value) for name, value in mass.items()},
        "torque_constant_factor": dict(zip(joints, torque_constant.tolist(), strict=True)),
        "encoder_zero_rad": dict(zip(joints, zero.tolist(), strict=True)),
    }
    return replace(setup, plant=plant, sensors=sensors), drawn
