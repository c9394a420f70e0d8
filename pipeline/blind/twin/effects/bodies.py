"""Hidden errors of bodies and ground: payload, centre of mass, slope, squeezing feet."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np

from pipeline.blind.twin.effects.base import Effect, Hidden, Units, sized
from pipeline.blind.twin.errors import TwinError
from pipeline.blind.twin.plant import on_slope, with_bodies
from pipeline.blind.twin.reference import Reference, link_of
from pipeline.blind.twin.setup import Setup
from pipeline.blind.twin.walking import squeeze_torque, walking_plan


def _any_body(rng: np.random.Generator, ref: Reference) -> str:
    """Joint that carries a body, a floating base's included, all alike."""
    names = [name for name in ref.setup.plant.model.names if name != "universe"]
    return str(names[rng.integers(len(names))])


def _carrier(setup: Setup, link: str) -> str:
    """Joint that carries a link."""
    robot = setup.plant.robot
    for name in robot.model.names:
        if name != "universe" and link_of(robot, name) == link:
            return str(name)
    raise TwinError(f"no joint carries a link '{link}'; name a moving link of {robot.spec.name}")


class LinkMass(Effect):
    """A payload at a link's centre of mass; its mass alone, as a point."""

    name = "link_mass"
    units: ClassVar[Units] = {"mass": "kg"}

    def draw(self, rng: np.random.Generator, ref: Reference, torque: float) -> Hidden:
        """Any link."""
        joint = _any_body(rng, ref)
        trial = 0.05  # [kg]
        per_kg = ref.change(with_bodies(ref.setup.plant, payload={joint: trial})) / trial
        own = ref.robot.model.inertias[ref.robot.model.getJointId(joint)].mass
        # Beyond the tolerance of the link's own mass, at most doubling it.
        size, torque = sized(torque, per_kg, 0.12 * own, 1.0 * own)
        return self.hidden((link_of(ref.robot, joint),), torque, mass=size)

    def apply(self, setup: Setup, hidden: Hidden) -> Setup:
        """Add the point mass."""
        joint = _carrier(setup, hidden.place[0])
        plant = with_bodies(setup.plant, payload={joint: hidden.parameters["mass"]})
        return replace(setup, plant=plant)


class CenterOfMassOffset(Effect):
    """A centre of mass that lies elsewhere than drawn, in the frame of the link's joint."""

    name = "center_of_mass_offset"
    units: ClassVar[Units] = {"x": "m", "y": "m", "z": "m"}

    def draw(self, rng: np.random.Generator, ref: Reference, torque: float) -> Hidden:
        """Any link; along a random direction in which the torque feels it."""
        joint = _any_body(rng, ref)
        direction = rng.standard_normal(3)
        direction /= np.linalg.norm(direction)
        trial = 1e-3  # [m]
        plant = with_bodies(ref.setup.plant, shift={joint: trial * direction})
        size, torque = sized(torque, ref.change(plant) / trial, 0.01, 0.08)
        x, y, z = size * direction
        return self.hidden((link_of(ref.robot, joint),), torque, x=x, y=y, z=z)

    def apply(self, setup: Setup, hidden: Hidden) -> Setup:
        """Shift it."""
        p = hidden.parameters
        joint = _carrier(setup, hidden.place[0])
        shift = np.array([p["x"], p["y"], p["z"]])
        return replace(setup, plant=with_bodies(setup.plant, shift={joint: shift}))


class BaseTilt(Effect):
    """Ground, or a stand, that is not level."""

    name = "base_tilt"
    units: ClassVar[Units] = {"roll": "rad", "pitch": "rad"}

    def draw(self, rng: np.random.Generator, ref: Reference, torque: float) -> Hidden:
        """In any direction, up to 10 degrees on the stand, 2 degrees where it has to walk."""
        heading = rng.uniform(0, 2 * np.pi)
        roll, pitch = np.cos(heading), np.sin(heading)
        trial = 3e-3  # [rad], small enough for a walking robot not to tip
        plant = on_slope(ref.setup.plant, trial * roll, trial * pitch)
        steepest = 0.035 if ref.robot.floating else 0.17
        size, torque = sized(torque, ref.change(plant) / trial, 0.012, steepest)
        return self.hidden(("ground",), torque, roll=size * roll, pitch=size * pitch)

    def apply(self, setup: Setup, hidden: Hidden) -> Setup:
        """Tilt gravity in the ground's frame."""
        p = hidden.parameters
        return replace(setup, plant=on_slope(setup.plant, p["roll"], p["pitch"]))


class InternalFootForce(Effect):
    """Feet that squeeze the ground, seen by sensors of normal force alone.

    The size is what the controller is told to push with; its own position control takes up most of
    it against the feet's rubber. The log's facts hold what reached the ground.
    """

    name = "internal_foot_force"
    units: ClassVar[Units] = {"commanded_lateral": "N"}
    motions: ClassVar[tuple[str, ...]] = ("walk",)

    def draw(self, rng: np.random.Generator, ref: Reference, torque: float) -> Hidden:
        """Inward or outward, always clear of what walking brings about by itself."""
        segment = ref.motion.segments[0]
        push = squeeze_torque(ref.robot, segment.configuration, segment.stance, 1.0)
        per_newton = float(np.sqrt(np.mean(push**2, axis=0)).max())
        size, torque = sized(torque, per_newton, 60.0, 250.0)
        return self.hidden(("ground",), torque, commanded_lateral=size * rng.choice([-1.0, 1.0]))

    def apply(self, setup: Setup, hidden: Hidden) -> Setup:
        """Ask the controller's feed-forward for it; measure normal forces only."""
        force = hidden.parameters["commanded_lateral"]
        plan = walking_plan(setup.plant.robot, periods=setup.plan.cycles or (3.0,), squeeze=force)
        sensors = replace(setup.sensors, foot_force="normal")
        return replace(setup, plan=plan, sensors=sensors, squeeze=force)
