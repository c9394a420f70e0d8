"""Inertial parameters of a link as a log shows them, in place of the robot file's."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar, Final

import numpy as np
import pinocchio as pin

from pipeline.effects.base import Effect, Parameter, Place, Values
from pipeline.logs.errors import EffectError
from pipeline.machine.machine import MachineModel

#: In the order of `pin.Inertia.toDynamicParameters`: about the origin of the joint's frame.
NAMES: Final = ("mass", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
UNITS: Final = ("kg", *("kg*m",) * 3, *("kg*m^2",) * 6)


class RigidBodyParameters(Effect):
    """Mass, first moments and rotational inertia of a link.

    Moments are taken about the frame of the joint that carries the link, along its axes.
    """

    name = "rigid_body_parameters"
    place_kind = "link"
    parameters: ClassVar = tuple(
        Parameter(n, u, 0.0 if n in ("mass", "Ixx", "Iyy", "Izz") else -1e6, 1e6)
        for n, u in zip(NAMES, UNITS, strict=True)
    )
    coordinates: ClassVar = ()
    competes: ClassVar = False
    signature = "acceleration"
    excitation = "moves all joints at once, fast and slowly, through all their travel"

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Put them in the place of the file's.

        Raises:
            EffectError: No body has such parameters.
        """
        values = {**x, **shape}
        ten = np.array([values[n] for n in NAMES])
        if not physical(ten):
            raise EffectError(
                f"{self.name} at {place[0]}: no body has such parameters; its pseudo-inertia must "
                "be positive definite"
            )
        rigid = model.rigid.copy()
        rigid.inertias[rigid.getJointId(model.carrier(place[0]))] = (
            pin.Inertia.FromDynamicParameters(ten)
        )
        identified = tuple(dict.fromkeys((*model.identified, place[0])))
        return replace(model, rigid=rigid, identified=identified)


def physical(ten: np.ndarray) -> bool:
    """Whether ten inertial parameters are those of a body.

    The pseudo-inertia [[tr(I) / 2 - I, m c], [(m c)^T, m]] is positive definite (Wensing, Kim and
    Slotine, RA-L 2018).
    """
    m, c = ten[0], ten[1:4]
    xx, xy, yy, xz, yz, zz = ten[4:]
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    pseudo = np.zeros((4, 4))
    pseudo[:3, :3] = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    pseudo[:3, 3] = pseudo[3, :3] = c
    pseudo[3, 3] = m
    scale = np.sqrt(np.maximum(np.diag(pseudo), 1e-300))
    return bool(m > 0 and np.linalg.eigvalsh(pseudo / np.outer(scale, scale))[0] > 0)
