"""Forces of the ground that carry the robot, and who tips or slides.

The paper's rule (section II.B) is the least sum of squared tangential forces, in closed form; the
README of this package has equations and assumptions. What that does not give (feet that would
slide, least joint torques) is one quadratic programme in the forces of one sample: the wrench on
the robot stays, no foot pulls, none leaves its friction cone. It goes to quadprog (the dual method
of Goldfarb and Idnani) through qpsolvers, row by row. What forces on the feet put into the joints,
J^T f, is computed here alone.
"""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Final

import numpy as np
import pinocchio as pin

from actuators.arrays import Array, Mask
from actuators.errors import StanceError
from pipeline.motion.gait import gait_of
from pipeline.motion.motion import Segment, level_ground
from pipeline.motion.walking import stability_margins
from pipeline.robot.kinematics import LegChains, leg_posture
from pipeline.robot.robot import Robot

LEAST_TANGENTIAL, LEAST_TORQUE = "least_tangential", "least_torque"
#: Share of the largest force below which a violated bound is rounding.
_TOLERANCE: Final = 1e-10
#: The same for a friction cone, where so much is left of a light foot's coefficient.
_CONE_TOLERANCE: Final = 1e-13
#: Weight of normal beside tangential forces: what the least tangential forces leave open.
_NORMAL_WEIGHT: Final = 1e-8
#: Weight of the distance from the least tangential forces beside the torques: it decides between
#: forces that take the same.
_TIE: Final = 1e-9
_ROUNDS: Final = 60  # of tangent planes; a handful is usual
_ENOUGH: Final = 6  # rounds after which `_TOLERANCE` will do
#: Share of the largest force: a foot that is exactly unloaded (a tripod at the edge of its
#: stability) still stands, and one on its cone's surface still holds.
_ROUNDING: Final = 1e-9
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

    def torque(self, force: Array) -> Array:
        """What forces put into the legs' joints, shape (N, L, K) [N*m, N where one slides].

        `force`: on every foot [N], shape (N, L, 3).
        """
        return self._posture.force_torques(np.einsum("nji,nfj->nfi", self._turn, force))

    def _to_ground(self, vectors: Array) -> Array:
        return np.einsum("nij,nfj->nfi", self._turn, vectors)


@dataclass(frozen=True)
class GroundForces:
    """How the ground's forces are chosen."""

    rule: str = LEAST_TANGENTIAL  #: Or `LEAST_TORQUE`.
    #: Greatest tangential over normal force [1]; None for no limit.
    friction_coefficient: float | None = None


PAPER: Final = GroundForces()


def out_of_bounds(force: Array, friction_coefficient: float | None) -> Mask:
    """Samples at which a foot pulls or leaves its friction cone, shape (N,), beyond rounding.

    `force`: z along the ground's normal [N], shape (N, F, 3). `friction_coefficient`: None for no
    limit.
    """
    slack = _TOLERANCE * np.abs(force).max(axis=(1, 2), keepdims=True)[..., 0]
    outside = force[..., 2] < -slack
    if friction_coefficient is not None:
        tangential = np.hypot(force[..., 0], force[..., 1])
        outside |= tangential > friction_coefficient * force[..., 2] + slack
    return np.asarray(outside.any(axis=1))


def least_within_bounds(
    start: Array,
    feet: Array,
    friction_coefficient: float | None,
    metric: Array | None = None,
    gradient: Array | float = 0.0,
) -> Array | None:
    """Forces f of one sample that minimise f' metric f / 2 + gradient' f; None where none will do.

    They have the wrench of `start`, no foot pulls, and each holds within its friction cone: planes
    tangent to a cone at a force that was found outside it are added until every force is inside, so
    that what comes out is the minimum over the cone itself, and a sample for which there is none
    over the planes has none over the cone.

    `start`: forces that meet the wrench [N], shape (F, 3). `feet`: points [m], shape (F, 3).
    `friction_coefficient`: greatest tangential over normal force [1]; None for no limit. `metric`:
    positive definite, shape (3 F, 3 F), that of least tangential forces by default. `gradient`:
    shape (3 F,). Returns force [N], shape (F, 3).
    """
    import qpsolvers  # a tenth of a second, for motions that need it

    if metric is None:
        metric = np.diag(np.tile([1.0, 1.0, _NORMAL_WEIGHT], len(feet)))
    count, size, unit = len(feet), float(np.abs(start).max()), float(np.trace(metric)) / start.size
    linear = np.full(start.size, gradient) / (unit * size)
    arm = feet - feet.mean(axis=0)
    arm = arm / np.abs(arm).max()  # newtons beside newton-metres: only the wrench's rows count
    wrench = np.vstack([np.tile(np.eye(3), count), np.hstack([pin.skew(p) for p in arm])])
    _, scale, same = np.linalg.svd(wrench, full_matrices=False)
    same = same[scale > 1e-9 * scale[0]]  # orthonormal; two feet have no moment along their line
    asked = same @ start.ravel() / size
    rows, limits = -np.eye(3 * count)[2::3], np.full(count, _TOLERANCE / 2)
    for done in range(_ROUNDS):
        found = qpsolvers.solve_qp(
            metric / unit, linear, rows, limits, same, asked, solver="quadprog"
        )
        if found is None:
            return None
        force = (found - same.T @ (same @ found - asked)).reshape(count, 3)
        mu = np.inf if friction_coefficient is None else friction_coefficient
        tangential = np.hypot(force[:, 0], force[:, 1])
        slack = _CONE_TOLERANCE if done < _ENOUGH else _TOLERANCE
        out = np.flatnonzero(tangential > mu * np.maximum(force[:, 2], _TOLERANCE) + slack)
        if not out.size:
            unloaded = np.abs(force[:, 2]) < 2 * _TOLERANCE  # and so holds nothing
            force[unloaded, 2] = 0.0
            force[unloaded & (np.abs(force[:, :2]).max(axis=1) < 1e2 * _TOLERANCE)] = 0.0
            return np.asarray(force * size)
        planes = np.zeros((out.size, count, 3))
        planes[np.arange(out.size), out, :2] = force[out, :2] / tangential[out, None]
        planes[np.arange(out.size), out, 2] = -mu
        rows = np.vstack([rows, planes.reshape(out.size, -1)])
        limits = np.append(limits, np.full(out.size, _CONE_TOLERANCE / 2))
    return None


def least_torque_forces(
    start: Array, feet: Array, torque: Array, unit_torque: Array, friction_coefficient: float | None
) -> Array:
    """Forces on the feet for the least sum of squared torques of the Q joints that they load.

    In a frame whose z axis is the ground's normal. `start`: forces that carry the robot, which
    those found are nearest to where torques are the same; samples that break a bound keep theirs
    [N], shape (N, F, 3). `feet`: points [m], shape (N, F, 3). `torque`: what the joints must apply
    without the ground [N*m], shape (N, Q). `unit_torque`: what 1 N along each axis of each foot
    puts into a joint, shape (N, Q, 3 F). Returns forces within the bounds [N], shape (N, F, 3).
    """
    force = np.array(start)
    for row in np.flatnonzero(~out_of_bounds(start, friction_coefficient)):
        metric = unit_torque[row].T @ unit_torque[row]
        tie = _TIE * max(np.trace(metric) / len(metric), np.finfo(float).tiny)
        gradient = -unit_torque[row].T @ torque[row] - tie * start[row].ravel()
        metric += tie * np.eye(len(metric))
        found = least_within_bounds(start[row], feet[row], friction_coefficient, metric, gradient)
        if found is not None:
            force[row] = found
    return force


def refuse_falling(
    robot: Robot, segment: Segment, force: Array, friction_coefficient: float | None
) -> None:
    """Refuse forces that break a bound, as they do only where no forces are within them.

    `force`: on the standing feet, z along the ground's normal [N], shape (N, F, 3).
    `friction_coefficient`: None for no limit.

    Raises:
        StanceError: A foot would have to pull, or the feet would slide; names instant and foot.
    """
    normal = force[..., 2]
    lowest = float(normal.min())  # NaN where any force is
    if not np.isfinite(lowest):
        words = f"the robot tips: in '{segment.name}' the feet stand in one line"
        raise StanceError(f"{words}; stand on feet of both sides")
    slack = _ROUNDING * max(1.0, float(np.abs(normal).max()))
    if lowest < -slack:
        sample, foot = np.argwhere(normal <= lowest + slack)[0]  # the first of those alike
        margin = float(stability_margins(robot, segment)[sample])
        words = f"would have to pull with {-lowest:.1f} N, static margin {1e3 * margin:.1f} mm"
        if segment.foot_target is None:
            words += "; check which feet stand, or shift the body towards them"
        else:
            words += "; spread the feet, lessen slope or load, shorten the stroke, walk slower"
            sways = segment.time.size == 1 or gait_of(robot.spec).margin is not None
            words += "" if sways else ', let the body sway (gait.sway = "least")'
        raise StanceError(
            f"the robot tips at t = {segment.time[sample]:.4g} s ({segment.name}): the foot of leg "
            f"'{segment.stance[foot]}' {words}"
        )
    if friction_coefficient is None:
        return
    beyond = np.hypot(force[..., 0], force[..., 1]) - friction_coefficient * normal
    if beyond.max() > slack:
        sample, foot = np.unravel_index(int(beyond.argmax()), beyond.shape)
        raise StanceError(
            f"the robot slides at t = {segment.time[sample]:.4g} s ({segment.name}), the foot of "
            f"leg '{segment.stance[foot]}' first: no forces hold with a friction coefficient of "
            f"{friction_coefficient:g}; lessen slope or acceleration"
        )
