"""Effects of bodies and ground."""

from dataclasses import replace
from typing import Final

import numpy as np
import pinocchio as pin

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.effects.base import Effect, Place, Values
from pipeline.machine.machine import MachineModel

#: In the order of `pin.Inertia.toDynamicParameters`: about the origin of the joint's frame.
NAMES: Final = ("mass", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
#: Where a payload is in the frame of its link's joint.
AXES: Final = ("x", "y", "z")
FARTHEST: Final = 10.0  # [m]
#: Ten inertial parameters of a unit rotational inertia that is the same about all axes.
ALIKE: Final = np.isin(NAMES, ("Ixx", "Iyy", "Izz")).astype(float)


class RigidBodyParameters(Effect):
    """Mass, first moments and rotational inertia of a link, in place of the robot file's.

    Moments are taken about the frame of the joint that carries the link, along its axes.
    """

    name = "rigid_body_parameters"

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Put them in the place of the file's.

        Raises:
            LegwattError: No body has such parameters.
        """
        ten, rigid = np.array([{**x, **shape}[n] for n in NAMES]), model.robot.model.copy()
        if not physical(ten):
            raise LegwattError(
                f"{self.name} at {place[0]}: no body has such parameters; its pseudo-inertia must "
                "be positive definite"
            )
        joint = rigid.getJointId(model.carrier(place[0]))
        rigid.inertias[joint] = pin.Inertia.FromDynamicParameters(ten)
        return replace(model, robot=replace(model.robot, model=rigid))

    def known(self, values: Values, spread: Values) -> float:
        """Middle one of how well mass, centre and moments of inertia are known [1]."""
        mass, turning = values["mass"], ("Ixx", "Iyy", "Izz")
        arm = np.sqrt(0.5 * max(values[n] for n in turning) / mass)
        scales = {n: max(values[n], 1e-300) for n in turning}
        scales |= {"mass": mass, **dict.fromkeys(("mx", "my", "mz"), mass * arm)}
        return float(np.median([spread[n] / size for n, size in scales.items()]))


def physical(ten: Array) -> bool:
    """Whether ten inertial parameters are those of a body.

    The pseudo-inertia [[tr(I) / 2 - I, m c], [(m c)^T, m]] is positive definite (Wensing, Kim and
    Slotine, RA-L 2018).
    """
    pseudo = pin.PseudoInertia.FromDynamicParameters(ten).toMatrix()
    scale = np.sqrt(np.maximum(np.diag(pseudo), 1e-300))
    return bool(ten[0] > 0 and np.linalg.eigvalsh(pseudo / np.outer(scale, scale))[0] > 0)


class LinkMass(Effect):
    """A payload at the link's centre of mass or where it is said to be, about which it is alike.

    Its rotational inertia is the same about all axes; a point mass has none.
    """

    name = "link_mass"

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Add the mass."""
        joint, own = model.carrier(place[0]), x.get("inertia", 0.0)
        if any(axis in shape for axis in AXES):
            centre = np.array([shape.get(axis, 0.0) for axis in AXES])
            return _carrying(model, joint, point_mass(x["mass"], centre) + own * ALIKE)
        if own:
            model = _carrying(model, joint, own * ALIKE)
        body = model.bodies.body(joint)
        changed = replace(body, payload=body.payload + x["mass"])
        return model.with_bodies(model.bodies.with_body(joint, changed))

    def plausible(self, model: MachineModel, place: Place, x: Values, shape: Values) -> bool:
        """Something of the link is left, and the payload is within reach and no second robot."""
        masses = [body.mass for body in model.robot.model.inertias]
        own = masses[model.rigid.getJointId(model.carrier(place[0]))]
        near = max(abs(shape.get(axis, 0.0)) for axis in AXES) <= FARTHEST
        return bool(near and -0.9 * own < x["mass"] < 2.0 * sum(masses))


def last_links(model: MachineModel) -> list[str]:
    """Links that carry no other, and a floating base: what loads are put on."""
    carriers = {link: model.rigid.getJointId(joint) for link, joint in model.robot.links.items()}
    inner = {int(p) for k, p in enumerate(model.rigid.parents) if k in carriers.values()}
    base = 1 if model.robot.floating else 0
    return [link for link, k in carriers.items() if k not in inner or k == base]


def point_mass(mass: float, place: Array) -> Array:
    """Ten inertial parameters of a point mass [kg] at a place (3,) [m]."""
    return np.asarray(pin.Inertia(mass, place, np.zeros((3, 3))).toDynamicParameters())


def _carrying(model: MachineModel, joint: str, more: Array) -> MachineModel:
    body = model.bodies.body(joint)
    carried = tuple((np.array(body.carried or (0.0,) * len(more)) + more).tolist())
    return model.with_bodies(model.bodies.with_body(joint, replace(body, carried=carried)))


class CenterOfMassOffset(Effect):
    """Displacement of a link's centre of mass in the frame of its joint."""

    name = "center_of_mass_offset"

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Displace it."""
        joint = model.carrier(place[0])
        body = model.bodies.body(joint)
        moved = np.add(body.shift, [x[axis] for axis in AXES]).tolist()
        return model.with_bodies(model.bodies.with_body(joint, replace(body, shift=(*moved,))))


class BaseTilt(Effect):
    """Ground, or a stand, that is not level: gravity does not point along its normal."""

    name = "base_tilt"

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Tilt it further."""
        roll, pitch = model.bodies.tilt
        return model.with_bodies(replace(model.bodies, tilt=(roll + x["roll"], pitch + x["pitch"])))
