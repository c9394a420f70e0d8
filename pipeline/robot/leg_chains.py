"""Constant geometry of legs: serial chains of joints of one coordinate from the base to a foot.

Legs may differ in their number of joints. Shorter ones are filled up at their outer end with
joints of zero axis, which neither turn nor slide, so that all legs stay one batched array;
`LegChains.counts` says how many are real.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import LegwattError, closest

#: Of a leg; fewer follow no path, more are no leg.
FEWEST_JOINTS, MOST_JOINTS = 1, 7


@dataclass(frozen=True, eq=False)
class LegChains:
    """Constant geometry of L legs with up to K joints each, read from a Pinocchio model."""

    names: tuple[str, ...]  #: Leg names.
    rotation: Array  #: Placement of each joint in its parent, shape (K joints, L, 3, 3).
    offset: Array  #: Origin of each joint in its parent [m], shape (K joints, L, 3).
    #: Unit axis of each joint in its own frame, shape (K joints, L, 3); zero where a leg has no
    #: such joint.
    axis: Array
    slides: NDArray[np.bool_]  #: Whether a joint is prismatic, shape (K joints, L).
    foot: Array  #: Foot point in the frame of the last joint [m], shape (L, 3).
    #: Posture about which a leg with joints to spare moves least, shape (L, K) [rad, m].
    nominal: Array

    @property
    def depth(self) -> int:
        """K, the largest number of joints of any leg."""
        return int(self.axis.shape[0])

    @cached_property
    def real(self) -> NDArray[np.bool_]:
        """Which joints exist, shape (L, K); the others fill up shorter legs."""
        return np.asarray(self.axis.any(axis=-1).T, dtype=np.bool_)

    @cached_property
    def counts(self) -> NDArray[np.intp]:
        """Joints of each leg, shape (L,)."""
        return np.asarray(self.real.sum(axis=1), dtype=np.intp)

    @cached_property
    def turning_only(self) -> bool:
        """Whether every leg has K joints and none of them slides: angles need no mask."""
        return bool(self.real.all() and not self.slides.any())

    @cached_property
    def along(self) -> tuple[tuple[int, Array] | None, ...]:
        """Where a joint's axis is a coordinate axis in every leg: which one, and its sign (L, 1).

        None where it is not. A rotation about a coordinate axis turns two components only. The
        sign is zero where a leg has no such joint.
        """
        found: list[tuple[int, Array] | None] = []
        for axis in self.axis:
            coordinate = int(np.argmax(np.abs(axis).max(axis=0)))
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
    def reach(self) -> Array:
        """Length of each leg stretched out, from its first joint [m], shape (L,)."""
        links = np.linalg.norm(self.offset[1:], axis=-1).sum(axis=0)
        reach: Array = links + np.linalg.norm(self.foot, axis=-1)
        return reach

    @cached_property
    def _parts(self) -> dict[tuple[int, ...], LegChains]:
        return {}

    def of(self, legs: Sequence[int]) -> LegChains:
        """Some of the legs, by index; made once for each choice.

        The depth stays, so that joints keep their columns.
        """
        key = tuple(legs)
        if key not in self._parts:
            own = list(key)
            self._parts[key] = LegChains(
                tuple(self.names[i] for i in own),
                self.rotation[:, own],
                self.offset[:, own],
                self.axis[:, own],
                self.slides[:, own],
                self.foot[own],
                self.nominal[own],
            )
        return self._parts[key]

    def shortened(self, depth: int) -> LegChains:
        """The same with only so many joints: without those that fill up shorter legs."""
        return replace(
            self,
            rotation=self.rotation[:depth],
            offset=self.offset[:depth],
            axis=self.axis[:depth],
            slides=self.slides[:depth],
            nominal=self.nominal[:, :depth],
        )


def leg_chains(
    model: pin.Model,
    legs: Sequence[tuple[str, Sequence[str], str]],
    base_joint: int,
    nominal: Array | None = None,
) -> LegChains:
    """Read the legs' geometry out of a model.

    `legs`: for each leg its name, its joint names from the base outward and the foot frame.
    `base_joint`: index of the joint that carries the base (0 for a fixed base). `nominal`: posture
    about which legs with joints to spare move least, shape (L, K); zero by default.

    Raises:
        LegwattError: A joint or frame is missing, of several coordinates, or not the child of the
            one before.
    """
    n_legs, depth = len(legs), max((len(joints) for _, joints, _ in legs), default=0)
    rotation = np.tile(np.eye(3), (depth, n_legs, 1, 1))
    offset = np.zeros((depth, n_legs, 3))
    axis = np.zeros((depth, n_legs, 3))
    slides = np.zeros((depth, n_legs), dtype=np.bool_)
    foot = np.empty((n_legs, 3))
    for i, (leg, joints, frame_name) in enumerate(legs):
        if not FEWEST_JOINTS <= len(joints) <= MOST_JOINTS:
            raise LegwattError(
                f"leg '{leg}' names {len(joints)} joints; a leg has {FEWEST_JOINTS} to "
                f"{MOST_JOINTS}"
            )
        parent = base_joint
        for j, joint in enumerate(joints):
            if not model.existJointName(joint):
                if model.existFrame(joint, pin.FrameType.FIXED_JOINT):
                    raise LegwattError(
                        f"leg '{leg}': joint '{joint}' is fixed; list those that move"
                    )
                raise LegwattError(
                    f"leg '{leg}': joint '{joint}' is not in the URDF; "
                    f"{closest(joint, list(model.names)[1:])}"
                )
            inner, parent = parent, int(model.getJointId(joint))
            if model.parents[parent] != inner:
                raise LegwattError(
                    f"leg '{leg}': joint '{joint}' hangs on '{model.names[model.parents[parent]]}',"
                    f" not on '{model.names[inner]}'; list the joints from the base outward"
                )
            placement = model.jointPlacements[parent]
            rotation[j, i] = placement.rotation
            offset[j, i] = placement.translation
            axis[j, i], slides[j, i] = _axis(model, parent, leg, joint)
        if not model.existFrame(frame_name):
            hint = closest(frame_name, [frame.name for frame in model.frames])
            raise LegwattError(
                f"leg '{leg}': foot '{frame_name}' is not a frame of the URDF; {hint}"
            )
        frame = model.frames[model.getFrameId(frame_name)]
        if frame.parentJoint != parent:
            raise LegwattError(
                f"leg '{leg}': foot '{frame_name}' is not carried by '{joints[-1]}', the last of "
                f"its joints, but by '{model.names[frame.parentJoint]}'; list the joints up to "
                "there"
            )
        foot[i] = frame.placement.translation
    stance = np.zeros((n_legs, depth)) if nominal is None else nominal
    names = tuple(leg for leg, _, _ in legs)
    return LegChains(names, rotation, offset, axis, slides, foot, stance)


def _axis(model: pin.Model, index: int, leg: str, joint: str) -> tuple[Array, bool]:
    """Unit axis of a joint in its own frame, and whether it slides along it."""
    if model.joints[index].nq != 1 or model.joints[index].nv != 1:
        raise LegwattError(
            f"leg '{leg}': joint '{joint}' is of several coordinates; a leg's joints are of type "
            "revolute, continuous or prismatic"
        )
    # The motion subspace is (0, axis) or (axis, 0): ask Pinocchio rather than parse names.
    data = model.joints[index].createData()
    q = pin.neutral(model)
    model.joints[index].calc(data, q[model.joints[index].idx_q :][:1])
    subspace = np.asarray(data.S).reshape(6)
    slides = bool(np.any(np.abs(subspace[:3]) > 0))
    axis, other = (subspace[:3], subspace[3:]) if slides else (subspace[3:], subspace[:3])
    if other.any() or abs(np.linalg.norm(axis) - 1) > 1e-9:
        raise LegwattError(f"leg '{leg}': joint '{joint}' neither turns nor slides along one axis")
    return axis, slides
