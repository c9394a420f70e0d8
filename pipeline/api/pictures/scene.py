"""A robot's surfaces and legs in any configuration, placed by Pinocchio."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pinocchio as pin

from actuators.arrays import Array
from pipeline.motion.gait import gait_table
from pipeline.robot.robot import Robot
from reports.figures.robot.solids import JointMark, Leg, Solid, outline, sphere, sticks
from reports.figures.robot.visuals import Visuals, read_visuals
from reports.figures.walk import Body

_STEEL = 7850.0  # [kg/m^3]
_LOAD = (0.94, 0.89, 0.26)  # yellow, as no link of ours


@dataclass(frozen=True, eq=False)
class Scene:
    """What there is to see of a robot."""

    robot: Robot  #: The robot.

    @cached_property
    def visuals(self) -> Visuals:
        """Surfaces of its links, read once."""
        return read_visuals(self.robot.urdf, self.robot.spec.urdf.parent)

    @cached_property
    def load(self) -> Solid | None:
        """The payload as a ball of steel of its mass in the base's frame; None without one."""
        table = gait_table(self.robot.spec)
        if not table.payload_mass:
            return None
        ball = sphere(float(np.cbrt(6 * table.payload_mass / (np.pi * _STEEL))) / 2, _LOAD)
        place = np.array([table.payload_x, table.payload_y, table.payload_z])
        return ball.moved(pin.SE3(np.eye(3), place).homogeneous)

    @cached_property
    def zero(self) -> Array:
        """The configuration in which every joint is at zero, shape (nq,)."""
        joints = np.zeros((1, len(self.robot.joints)))
        return self.robot.configuration(joints, np.zeros((1, 3)))[0]

    @cached_property
    def _bodies_of_legs(self) -> dict[str, list[int]]:
        """The trunk and the moving bodies of each leg, from the base outward."""
        number, trunk = self.robot.model.getJointId, int(self.robot.floating)
        return {
            leg.name: [trunk, *(int(number(joint)) for joint in leg.joints)]
            for leg in self.robot.spec.legs
        }

    @cached_property
    def bare(self) -> tuple[str, ...]:
        """Legs of which the URDF shows nothing but spheres; they are drawn as sticks."""
        shown = {s.body for s in self._solids(self.zero) if s.kind != "sphere"}
        return tuple(leg for leg, own in self._bodies_of_legs.items() if not shown & {*own[1:]})

    @property
    def remark(self) -> str:
        """What is to be said of legs drawn as sticks; empty where none is."""
        if not self.bare:
            return ""
        every = len(self.bare) == len(self.robot.spec.legs)
        which = "legs" if every else f"legs {', '.join(self.bare)}"
        return f"{which} without shapes in the URDF: sticks between their joints"

    def _solids(self, configuration: Array) -> list[Solid]:
        """Surfaces in the world: what the URDF shows, then the payload."""
        model, data = self.robot.model, self.robot.model.createData()
        pin.framesForwardKinematics(model, data, configuration)
        every = [*self.visuals.solids]
        if self.load is not None:
            every.append((self.robot.spec.base_link, self.load))
        out = []
        for link, solid in every:
            frame = model.getFrameId(link, pin.FrameType.BODY)
            placed = solid.moved(data.oMf[frame].homogeneous)
            out.append(replace(placed, body=int(model.frames[frame].parentJoint)))
        return out

    def legs(self, configuration: Array) -> list[Leg]:
        """Legs in one configuration, shape (nq,)."""
        robot, model = self.robot, self.robot.model
        data = model.createData()
        pin.computeJointJacobians(model, data, configuration)
        pin.updateFramePlacements(model, data)
        slides = dict(zip(robot.joints, robot.sliding, strict=True))

        def mark(joint: str) -> JointMark:
            k = model.getJointId(joint)
            column = pin.getJointJacobian(model, data, k, pin.LOCAL_WORLD_ALIGNED)[
                :, model.joints[k].idx_v
            ]
            axis = column[:3] if slides[joint] else column[3:]
            return JointMark(joint, data.oMi[k].translation.copy(), axis, bool(slides[joint]))

        return [
            Leg(
                leg.name,
                tuple(mark(joint) for joint in leg.joints),
                data.oMf[model.getFrameId(leg.foot, pin.FrameType.BODY)].translation.copy(),
            )
            for leg in robot.spec.legs
        ]

    def at(self, configuration: Array) -> tuple[list[Solid], list[Leg]]:
        """Surfaces, with sticks for bare legs, and legs in one configuration, shape (nq,)."""
        solids, legs = self._solids(configuration), self.legs(configuration)
        for leg in legs:
            if leg.name in self.bare:
                solids += sticks(leg, legs, self._bodies_of_legs[leg.name])
        return solids, legs

    def bodies(self, configurations: Array, origin: Array) -> list[Body]:
        """Every moving body and its way through configurations of shape (S, nq).

        Args:
            configurations: One for each step.
            origin: What the picture follows, shape (S, 3) [m].
        """
        model, data = self.robot.model, self.robot.model.createData()
        legs = self.legs(configurations[0])
        # The trunk and what it carries are in no leg.
        leg_of = {body: leg for leg, own in self._bodies_of_legs.items() for body in own[1:]}
        parts: dict[tuple[int, str, bool], list[Solid]] = {}
        solids = self._solids(configurations[0])
        for i, solid in enumerate(solids):
            load = self.load is not None and i == len(solids) - 1
            key = (solid.body, leg_of.get(solid.body, ""), load)
            parts.setdefault(key, []).append(solid)
        for leg in legs:
            if leg.name in self.bare:
                for stick in sticks(leg, legs, self._bodies_of_legs[leg.name]):
                    parts.setdefault((stick.body, leg.name, False), []).append(stick)
        placed = []
        for configuration in configurations:
            pin.forwardKinematics(model, data, configuration)
            placed.append([data.oMi[body].homogeneous for body, _, _ in parts])
        placements = np.array(placed)  # (S, bodies, 4, 4)
        moved = placements @ np.linalg.inv(placements[0])
        return [
            Body(
                "_".join(word for word in (str(model.names[body]), leg, "load" * load) if word),
                leg,
                tuple(own),
                moved[:, i, :3, 3] - origin,
                moved[:, i, :3, :3],
                load,
            )
            for i, ((body, leg, load), own) in enumerate(parts.items())
        ]

    def trunk_outline(self) -> Array:
        """The trunk from above in its own frame, counter-clockwise, shape (P, 2) [m].

        Where the URDF shows nothing of it, the outline of the legs' first joints.
        """
        trunk = [s for s in self._solids(self.zero) if s.body <= 1]
        points = [s.corners[:, :2] for s in (trunk[:-1] if self.load is not None else trunk)]
        points = points or [np.array([leg.joints[0].position[:2] for leg in self.legs(self.zero)])]
        return outline(np.concatenate(points))


def mass_centre(robot: Robot, configurations: Array) -> Array:
    """Centre of mass in the world, shape (N, nq) to (N, 3) [m]."""
    data = robot.model.createData()
    return np.array([pin.centerOfMass(robot.model, data, q).copy() for q in configurations])
