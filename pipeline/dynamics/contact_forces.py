"""Ground forces that carry the robot with the least sum of squared tangential forces.

The rule of section II.B of the paper in closed form; the README of this package has equations and
assumptions. What forces on the feet put into the joints, J^T f, is computed here alone.
"""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Final

import numpy as np

from actuators.arrays import Array, Mask
from pipeline.dynamics.force_rules import least_within_bounds, out_of_bounds
from pipeline.motion.motion import level_ground
from pipeline.robot.kinematics import LegChains, leg_posture

_UNLOADED: Final = 1e-9  # share of the largest load below which a foot bears none


@dataclass(frozen=True)
class ContactForces:
    """Forces of the ground on the feet during one segment."""

    legs: tuple[str, ...]  #: All legs, in the robot file's order.
    stance: tuple[str, ...]  #: Those whose feet carry load.
    time: Array  #: Shape (N,) [s].
    position: Array  #: Foot points in the base frame [m], shape (N, L, 3).
    #: On the robot, in the world frame [N], shape (N, L, 3); zero in the air.
    force_world: Array
    #: Unit normal of the ground in the world frame, shape (3,).
    normal: Array = field(default_factory=level_ground)

    @property
    def normal_force(self) -> Array:
        """Along the ground's normal, positive where the ground presses [N], shape (N, L)."""
        return self._in_ground[..., 2]

    @cached_property
    def _in_ground(self) -> Array:
        return self.force_world @ ground_frame(self.normal).T

    @property
    def friction_needed(self) -> Array:
        """Tangential over normal force per foot [1], shape (N, L).

        NaN where no load rests; infinite where a foot without load would have to hold.
        """
        normal = self.normal_force
        tangential = np.hypot(self._in_ground[..., 0], self._in_ground[..., 1])
        nothing = _UNLOADED * float(np.abs(normal).max())
        idle = np.where((normal >= -nothing) & (tangential > nothing), np.inf, np.nan)
        return np.divide(tangential, normal, out=idle, where=normal > nothing)


def ground_frame(normal: Array) -> Array:
    """The smallest rotation from the world to a frame whose z axis is a normal, shape (3, 3).

    `normal`: upward unit vector in the world frame, shape (3,).
    """
    x, y, z = normal
    return np.array(
        [
            [1 - x * x / (1 + z), -x * y / (1 + z), -x],
            [-x * y / (1 + z), 1 - y * y / (1 + z), -y],
            [x, y, z],
        ]
    )


def least_tangential_forces(
    wrench: Array, feet: Array, friction_coefficient: float | None = None
) -> Array:
    """Foot forces that add up to a wrench, with the least sum of squared tangential forces.

    Of what that leaves open the normal forces have the least spread, and no foot pulls. Without a
    friction coefficient no foot braces against another; with one, every force lies in its cone.

    `wrench`: force and moment about the origin that the ground must supply, in a frame whose z axis
    is the ground's normal [N, N*m], shape (N, 6). `feet`: foot points in the same frame [m], shape
    (N, F, 3), F >= 2; two meet all of the wrench but the moment about their line.
    `friction_coefficient`: greatest tangential over normal force [1]; None for no limit. Returns
    forces on the robot [N], shape (N, F, 3). Rows that nothing satisfies come back in the closed
    form, with a foot that pulls or slides, for the caller to refuse; those of feet in one line are
    not finite.
    """
    force = _closed_form(wrench, feet)
    for row in np.flatnonzero(force[..., 2].min(axis=1) < 0):
        pushing = _pushing(wrench[row], feet[row])
        force[row] = force[row] if pushing is None else pushing
    if friction_coefficient is not None:
        for row in np.flatnonzero(out_of_bounds(force, friction_coefficient)):
            held = least_within_bounds(force[row], feet[row], friction_coefficient)
            force[row] = force[row] if held is None else held
    return force


def _closed_form(wrench: Array, feet: Array) -> Array:
    """The least tangential forces and the normals of least squares, bounds left aside."""
    count = feet.shape[1]
    centre = feet.mean(axis=1)
    x, y, z = (feet - centre[:, None] * [1.0, 1.0, 0.0]).transpose(2, 0, 1)
    xx, yy, xy = (np.einsum("nf,nf->n", a, b) for a, b in ((x, x), (y, y), (x, y)))
    # Tangential: equal shares plus a rotation about the centroid, by Lagrange's multipliers.
    yaw = wrench[:, 5] - (centre[:, 0] * wrench[:, 1] - centre[:, 1] * wrench[:, 0])
    turn = (yaw / (xx + yy))[:, None]
    t_x = wrench[:, 0, None] / count - turn * y
    t_y = wrench[:, 1, None] / count + turn * x
    # Normal: what vertical force and the tipping moments leave, by least squares about the
    # centroid: N_i = total/F + a x_i + b y_i, with sum y N = moment_x and -sum x N = moment_y.
    total = wrench[:, 2]
    moment_x = wrench[:, 3] + np.einsum("nf,nf->n", z, t_y) - centre[:, 1] * total
    moment_y = wrench[:, 4] - np.einsum("nf,nf->n", z, t_x) + centre[:, 0] * total
    with np.errstate(divide="ignore", invalid="ignore"):  # feet in one line: not finite, refused
        if count == 2:  # the moment across their line; nothing meets the one along it
            lean = (y[:, 0] * moment_x - x[:, 0] * moment_y) / (xx + yy)
            n = total[:, None] / 2 + lean[:, None] * [1.0, -1.0]
        else:
            det = xx * yy - xy * xy
            a, b = (-moment_y * yy - moment_x * xy) / det, (moment_x * xx + moment_y * xy) / det
            n = total[:, None] / count + a[:, None] * x + b[:, None] * y
    return np.stack([t_x, t_y, n], axis=-1)


def _pushing(wrench: Array, feet: Array) -> Array | None:
    """Forces of one sample of which no normal force pulls, or None where there are none.

    A foot that then bears nothing holds nothing either: the others share anew.
    """
    force = _closed_form(wrench[None], feet[None])[0]
    if force[:, 2].min() >= 0:
        return np.asarray(force)
    if len(feet) <= 3 or not np.isfinite(force).all():
        return None
    found = least_within_bounds(force, feet, None)
    if found is None:
        return None
    loaded = found[:, 2] > 0
    shared = _pushing(wrench, feet[loaded]) if loaded.sum() >= 3 else None
    if shared is not None:
        found[~loaded], found[loaded] = 0.0, shared
    return found


class FeetOnGround:
    """Legs at N samples and their feet on a plane.

    Forces are in the ground's frame: origin in the base's, z axis along the ground's normal.

    `q`: joint positions by leg [rad, m], shape (N, L, K). `turn`: from the base's axes to the
    ground's, shape (N, 3, 3).
    """

    def __init__(self, chains: LegChains, q: Array, turn: Array) -> None:
        self._posture, self._turn = leg_posture(chains, q), turn
        self.in_base = self._posture.feet  #: Foot points in the base frame [m], shape (N, L, 3).
        #: The same in the ground's frame.
        self.points = self._to_ground(self.in_base)

    def least_tangential(
        self,
        wrench: Array,
        standing: Mask,
        friction_coefficient: float | None = None,
        least: int = 3,
    ) -> Array:
        """Forces that supply a wrench, with the least tangential parts.

        `wrench`: demanded of the base, in its frame [N, N*m], shape (N, 6). `standing`: which feet
        do, shape (N, L). `least`: feet that stand; samples with fewer have no forces. Returns shape
        (N, L, 3) [N]; zero in the air. See `least_tangential_forces`.
        """
        feet = self.points
        turned = self._to_ground(wrench.reshape(-1, 2, 3)).reshape(-1, 6)
        force = np.zeros(feet.shape)
        codes = standing @ (1 << np.arange(feet.shape[1]))
        for code in np.unique(codes):
            rows = np.flatnonzero(codes == code)
            stance = np.flatnonzero(standing[rows[0]])
            if stance.size >= least:
                own = np.ix_(rows, stance)
                force[own] = least_tangential_forces(turned[rows], feet[own], friction_coefficient)
        return force

    def to_base(self, vectors: Array) -> Array:
        """From the ground's axes to the base's, shape (N, L, 3)."""
        return np.einsum("nji,nfj->nfi", self._turn, vectors)

    def torque(self, force: Array) -> Array:
        """What forces put into the legs' joints, shape (N, L, K) [N*m, N where one slides].

        `force`: on every foot [N], shape (N, L, 3).
        """
        return self._posture.force_torques(self.to_base(force))

    def _to_ground(self, vectors: Array) -> Array:
        return np.einsum("nij,nfj->nfi", self._turn, vectors)
