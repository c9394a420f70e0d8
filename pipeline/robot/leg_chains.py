"""Constant geometry of legs: serial chains of three revolute joints from the base to a foot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from actuators.errors import closest
from pipeline.errors import UrdfError

Array = NDArray[np.float64]
JOINTS_PER_LEG = 3


@dataclass(frozen=True)
class LegChains:
    """Constant geometry of L legs with three joints each, read from a Pinocchio model.

    Attributes:
        names: Leg names.
        rotation: Placement of each joint in its parent, shape (3 joints, L, 3, 3).
        offset: Origin of each joint in its parent [m], shape (3 joints, L, 3).
        axis: Unit axis of each joint in its own frame, shape (3 joints, L, 3).
        foot: Foot point in the frame of the last joint [m], shape (L, 3).
    """

    names: tuple[str, ...]
    rotation: Array
    offset: Array
    axis: Array
    foot: Array

    @cached_property
    def along(self) -> tuple[tuple[int, Array] | None, ...]:
        """Where a joint's axis is a coordinate axis in every leg: which one, and its sign (L, 1).

        None where it is not. A rotation about a coordinate axis turns two components only.
        """
        found: list[tuple[int, Array] | None] = []
        for axis in self.axis:
            coordinate = int(np.argmax(np.abs(axis[0])))
            rest = np.delete(axis, coordinate, axis=1)
            found.append(None if rest.any() else (coordinate, np.sign(axis[:, coordinate, None])))
        return tuple(found)

    @cached_property
    def turned(self) -> tuple[bool, ...]:
        """Whether a joint's placement in its parent is rotated in any leg."""
        return tuple(
            not np.array_equal(r, np.broadcast_to(np.eye(3), r.shape)) for r in self.rotation
        )

    @cached_property
    def _parts(self) -> dict[tuple[int, ...], LegChains]:
        return {}

    def of(self, legs: Sequence[int]) -> LegChains:
        """Some of the legs, by index; made once for each choice."""
        key = tuple(legs)
        if key not in self._parts:
            own = list(key)
            self._parts[key] = LegChains(
                tuple(self.names[i] for i in own),
                self.rotation[:, own],
                self.offset[:, own],
                self.axis[:, own],
                self.foot[own],
            )
        return self._parts[key]


def leg_chains(
    model: pin.Model, legs: Sequence[tuple[str, Sequence[str], str]], base_joint: int
) -> LegChains:
    """Read the legs' geometry out of a model.

    Args:
        model: Pinocchio model.
        legs: For each leg its name, its three joint names from the base outward and the foot frame.
        base_joint: Index of the joint that carries the base (0 for a fixed base).

    Raises:
        UrdfError: A joint or frame is missing, not revolute, or not the child of the one before.
    """
    n_legs = len(legs)
    rotation = np.empty((JOINTS_PER_LEG, n_legs, 3, 3))
    offset = np.empty((JOINTS_PER_LEG, n_legs, 3))
    axis = np.empty((JOINTS_PER_LEG, n_legs, 3))
    foot = np.empty((n_legs, 3))
    for i, (leg, joints, frame_name) in enumerate(legs):
        if len(joints) != JOINTS_PER_LEG:
            raise UrdfError(f"leg '{leg}' names {len(joints)} joints; a leg has {JOINTS_PER_LEG}")
        parent = base_joint
        for j, joint in enumerate(joints):
            if not model.existJointName(joint):
                raise UrdfError(
                    f"leg '{leg}': joint '{joint}' is not in the URDF; "
                    f"{closest(joint, list(model.names)[1:])}"
                )
            index = model.getJointId(joint)
            if model.parents[index] != parent:
                raise UrdfError(
                    f"leg '{leg}': joint '{joint}' hangs on '{model.names[model.parents[index]]}', "
                    f"not on '{model.names[parent]}'; list the joints from the base outward"
                )
            if model.joints[index].nq != 1 or model.joints[index].nv != 1:
                found = "continuous" if model.joints[index].nv == 1 else "of several coordinates"
                raise UrdfError(
                    f"leg '{leg}': joint '{joint}' is {found}; a leg's are of type revolute, "
                    "with limits"
                )
            placement = model.jointPlacements[index]
            rotation[j, i] = placement.rotation
            offset[j, i] = placement.translation
            axis[j, i] = _axis(model, index, leg, joint)
            parent = index
        if not model.existFrame(frame_name):
            known = [frame.name for frame in model.frames]
            raise UrdfError(
                f"leg '{leg}': foot '{frame_name}' is not a frame of the URDF; "
                f"{closest(frame_name, known)}"
            )
        frame = model.frames[model.getFrameId(frame_name)]
        if frame.parentJoint != parent:
            raise UrdfError(f"leg '{leg}': foot '{frame_name}' is not carried by '{joints[-1]}'")
        foot[i] = frame.placement.translation
    return LegChains(tuple(leg for leg, _, _ in legs), rotation, offset, axis, foot)


def _axis(model: pin.Model, index: int, leg: str, joint: str) -> Array:
    # The motion subspace of a revolute joint is (0, axis): ask Pinocchio rather than parse names.
    data = model.joints[index].createData()
    q = pin.neutral(model)
    model.joints[index].calc(data, q[model.joints[index].idx_q :][:1])
    subspace = np.asarray(data.S).reshape(6)
    if np.any(np.abs(subspace[:3]) > 0) or abs(np.linalg.norm(subspace[3:]) - 1) > 1e-9:
        raise UrdfError(f"leg '{leg}': joint '{joint}' slides; a leg's are of type revolute")
    return subspace[3:]
