"""Rules by which the ground's forces are chosen among those that carry the robot.

The paper's rule is the least sum of squared tangential forces (`contact_forces`). The other starts
from its forces and adds internal forces to them, which change joint torques and leave the robot's
motion as it is.

Forces of the feet against each other, which leave the wrench on the robot as it is. All foot forces
that meet one wrench are one of them plus a combination z of internal forces, which span the null
space of the six equations of balance. What no closed form gives (feet that would pull or slide,
least joint torques) is then a small problem in z alone, and balance holds to rounding whatever z
comes out. A quadratic in z within bounds goes to quadprog (the dual method of Goldfarb and Idnani)
through qpsolvers, row by row and only where a bound is active.

Stances that no forces can satisfy, named with instant, foot, margin and what to do about it. Slope,
payload and a shift of the body each move the centre of mass over the feet. How far towards the edge
over which the robot tips is a matter of geometry: with and without each of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import LegwattError, StanceError, closest
from pipeline.motion.gait import body_rotation, gait_of, gait_table
from pipeline.motion.motion import Segment
from pipeline.motion.support import stability_margins, stance_and_centre, support_edges
from pipeline.robot.robot import Robot

#: Weight of normal beside tangential forces: what the least tangential forces leave open.
NORMAL_WEIGHT = 1e-8
#: Share of the largest force below which a violated bound is rounding.
TOLERANCE = 1e-10
#: The same for a friction cone, where so much is left of a light foot's coefficient.
_CONE_TOLERANCE = 1e-13
_ROUNDS = 60  # of tangent planes; a handful is usual
_ENOUGH = 6  # rounds after which `TOLERANCE` will do
_HALVINGS = 40
_MOST_FRICTION = 1e3  # beyond this no coefficient is looked for


def internal_basis(feet: Array) -> Array:
    """Orthonormal basis of the forces that add up to no force and no moment.

    `feet`: foot points [m], shape (N, F, 3), F >= 3, not in one line; or two. Returns shape (N, F,
    3, D) with D = 3 F - 6; for two feet 1, a squeeze along their line.
    """
    n, count, _ = feet.shape
    if count == 2:
        along = feet[:, 1] - feet[:, 0]
        along /= np.sqrt(2.0) * np.linalg.norm(along, axis=1)[:, None]
        return np.stack([along, -along], axis=1)[..., None]
    arm = feet - feet.mean(axis=1, keepdims=True)
    arm = arm / np.abs(arm).max()  # newtons beside newton-metres: only the null space counts
    balance = np.zeros((n, count, 3, 6))
    balance[..., :3] = np.eye(3)
    for axis in range(3):
        after, last = (axis + 1) % 3, (axis + 2) % 3
        balance[:, :, last, 3 + axis] = arm[..., after]
        balance[:, :, after, 3 + axis] = -arm[..., last]
    q, _ = np.linalg.qr(balance.reshape(n, 3 * count, 6), mode="complete")
    return np.asarray(q[..., 6:]).reshape(n, count, 3, -1)


def out_of_bounds(force: Array, friction_coefficient: float | None) -> NDArray[np.bool_]:
    """Samples at which a foot pulls or leaves its friction cone, shape (N,), beyond rounding.

    `force`: z along the ground's normal [N], shape (N, F, 3). `friction_coefficient`: None for no
    limit.
    """
    slack = TOLERANCE * np.abs(force).max(axis=(1, 2), keepdims=True)[..., 0]
    normal = force[..., 2]
    outside = normal < -slack
    if friction_coefficient is not None:
        tangential = np.hypot(force[..., 0], force[..., 1])
        outside = outside | (tangential > friction_coefficient * normal + slack)
    return np.asarray(outside.any(axis=1))


def least_within_bounds(
    metric: Array, gradient: Array, start: Array, basis: Array, friction_coefficient: float | None
) -> Array | None:
    """Forces of one sample that minimise z' metric z / 2 + gradient' z; None where none will do.

    No foot pulls, and each holds within its friction cone: planes tangent to a cone at a force that
    was found outside it are added until every force is inside, so that what comes out is the
    minimum over the cone itself, and a sample for which there is none over the planes has none over
    the cone.

    `metric`: positive definite, shape (D, D). `gradient`: at z = 0, shape (D,). `start`: force at
    z = 0 [N], shape (F, 3). `basis`: of the internal forces, shape (F, 3, D).
    `friction_coefficient`: greatest tangential over normal force [1]; None for no limit. Returns
    force [N], shape (F, 3).
    """
    import qpsolvers  # a tenth of a second, for motions that need it

    size = float(np.abs(start).max())
    unit = float(np.trace(metric)) / metric.shape[0]
    metric, gradient, at_zero = metric / unit, gradient / (unit * size), start / size
    # Rows of  G z <= h: that no foot pulls, then tangent planes; with what rounding needs.
    rows, limits = _cleaned(-basis[:, 2]), at_zero[:, 2] + TOLERANCE / 2
    for done in range(_ROUNDS):
        z = qpsolvers.solve_qp(metric, gradient, rows, limits, solver="quadprog")
        if z is None:
            return None
        force = at_zero + basis @ z
        feet = np.empty(0, dtype=np.intp)
        if friction_coefficient is not None:
            tangential = np.hypot(force[:, 0], force[:, 1])
            slack = _CONE_TOLERANCE if done < _ENOUGH else TOLERANCE
            feet = np.flatnonzero(tangential > friction_coefficient * force[:, 2] + slack)
        if not feet.size:
            unloaded = np.abs(force[:, 2]) < 2 * TOLERANCE  # and so holds nothing
            force[unloaded, 2] = 0.0
            force[unloaded & (np.abs(force[:, :2]).max(axis=1) < 1e2 * TOLERANCE)] = 0.0
            return np.asarray(force * size)
        toward = force[feet, :2] / tangential[feet, None]
        across = np.einsum("pi,pid->pd", toward, basis[feet, :2])
        along = np.einsum("pi,pi->p", toward, at_zero[feet, :2])
        inside = friction_coefficient * at_zero[feet, 2] - along + _CONE_TOLERANCE / 2
        rows = np.vstack([rows, _cleaned(across - friction_coefficient * basis[feet, 2])])
        limits = np.concatenate([limits, inside])
    return None


def _cleaned(rows: Array) -> Array:
    """Without what rounding leaves of forces that do not act on a bound at all."""
    return np.where(np.abs(rows) < 1e-12, 0.0, rows)


def held_by_friction(start: Array, basis: Array, friction_coefficient: float) -> Array | None:
    """Least tangential forces of one sample within the friction cones; None where there are none.

    `start`: forces that meet the wrench [N], shape (F, 3). `basis`: shape (F, 3, D).
    `friction_coefficient`: greatest tangential over normal force [1].
    """
    weight = np.array([1.0, 1.0, NORMAL_WEIGHT])
    flat = (start.size, basis.shape[-1])
    metric = basis.reshape(flat).T @ (basis * weight[:, None]).reshape(flat)
    gradient = np.einsum("fi,fid->d", start * weight, basis)
    return least_within_bounds(metric, gradient, start, basis, friction_coefficient)


def least_friction(start: Array, basis: Array, enough: float) -> float:
    """The least friction coefficient with which any forces meet the wrench of one sample.

    `start`: forces that meet the wrench [N], shape (F, 3). `basis`: shape (F, 3, D). `enough`: a
    coefficient that suffices; infinite where none is known.
    """
    low, high = 0.0, enough
    if not np.isfinite(enough):
        high = 1.0
        while held_by_friction(start, basis, high) is None:
            high *= 2.0
            if high > _MOST_FRICTION:
                return np.inf
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if held_by_friction(start, basis, middle) is None:
            low = middle
        else:
            high = middle
    return high


LEAST_TANGENTIAL, LEAST_TORQUE = "least_tangential", "least_torque"
RULES = (LEAST_TANGENTIAL, LEAST_TORQUE)
#: Weight of the distance from the least tangential forces beside the torques: it decides between
#: forces that take the same.
_TIE = 1e-9


@dataclass(frozen=True)
class GroundForces:
    """How the ground's forces are chosen.

    Raises:
        LegwattError: No such rule, or a friction coefficient that no ground has.
    """

    rule: str = LEAST_TANGENTIAL  #: One of `RULES`.
    #: Greatest tangential over normal force [1]; None for no limit.
    friction_coefficient: float | None = None

    def __post_init__(self) -> None:
        if self.rule not in RULES:
            raise LegwattError(f"--forces {self.rule}: no such rule; {closest(self.rule, RULES)}")
        mu = self.friction_coefficient
        if mu is not None and not (0 < mu < np.inf):
            raise LegwattError(f"friction coefficient {mu:g}: expected a finite number above 0")


PAPER = GroundForces()


def least_torque_forces(
    start: Array,
    feet: Array,
    torque: Array,
    unit_torque: Array,
    foot: NDArray[np.intp],
    friction_coefficient: float | None = None,
) -> Array:
    """Forces on K feet for the least sum of squared torques of the Q joints that they load.

    All are in a frame whose z axis is the ground's normal.

    Args:
        start: Forces that carry the robot, which those found are nearest to where torques are the
            same [N], shape (N, K, 3). Samples that break a bound keep theirs.
        feet: Points [m], shape (N, K, 3).
        torque: What the joints must apply without the ground [N*m], shape (N, Q).
        unit_torque: What a force of 1 N on its foot along each axis puts into a joint, shape (N,
            Q, 3) [N*m/N].
        foot: Which of the K feet loads each joint, shape (Q,).
        friction_coefficient: Greatest tangential over normal force [1]; None for no limit.

    Returns:
        Forces within the bounds [N], shape (N, K, 3).
    """
    force = np.array(start)
    rows = np.flatnonzero(~out_of_bounds(start, friction_coefficient))
    start, basis = start[rows], internal_basis(feet)[rows]
    needed = torque[rows] - np.einsum("nqi,nqi->nq", unit_torque[rows], start[:, foot])
    effect = -np.einsum("nqi,nqid->nqd", unit_torque[rows], basis[:, foot])
    metric = effect.transpose(0, 2, 1) @ effect
    mean = np.trace(metric, axis1=1, axis2=2) / metric.shape[-1]
    tie = _TIE * np.maximum(mean, np.finfo(float).tiny)
    metric += tie[:, None, None] * np.eye(metric.shape[-1])
    gradient = np.einsum("nqd,nq->nd", effect, needed)
    z = -np.linalg.solve(metric, gradient[..., None])[..., 0]
    found = start + np.einsum("nkid,nd->nki", basis, z)
    for i in np.flatnonzero(out_of_bounds(found, friction_coefficient)):
        bounded = least_within_bounds(
            metric[i], gradient[i], start[i], basis[i], friction_coefficient
        )
        found[i] = start[i] if bounded is None else bounded
    force[rows] = found
    return force


#: Less than that towards the edge is no cause [m].
_NOTABLE = 1e-3
#: Share of the largest force: a foot that is exactly unloaded (a tripod at the edge of its
#: stability) still stands, and one on its cone's surface still holds.
_ROUNDING = 1e-9


def refuse_falling(
    robot: Robot, segment: Segment, force: Array, feet: Array, friction_coefficient: float | None
) -> None:
    """Refuse forces that break a bound, as they do only where no forces are within them.

    `force`: on the standing feet, z along the ground's normal [N], shape (N, K, 3). `feet`: in the
    same frame [m], shape (N, K, 3). `friction_coefficient`: None for no limit.

    Raises:
        StanceError: A foot would have to pull. The feet would slide.
    """
    normal = force[..., 2]
    lowest = float(normal.min())  # NaN where any force is
    if not np.isfinite(lowest):
        raise StanceError(
            f"the robot tips: in '{segment.name}' the feet stand in one line and carry no moment "
            "across it; stand on feet of both sides"
        )
    slack = _ROUNDING * max(1.0, float(np.abs(normal).max()))
    if lowest < -slack:
        sample, foot = np.argwhere(normal <= lowest + slack)[0]  # the first of those alike
        margin = stability_margins(robot, segment)[sample]
        raise StanceError(
            f"the robot tips at t = {segment.time[sample]:.4g} s ({segment.name}): the foot of leg "
            f"'{segment.stance[foot]}' would have to pull with {-lowest:.1f} N, "
            f"{_margin_and_remedy(robot, segment, int(sample), float(margin))}"
        )
    if friction_coefficient is None:
        return
    beyond = np.hypot(force[..., 0], force[..., 1]) - friction_coefficient * normal
    sliding = np.flatnonzero(beyond.max(axis=1) > slack)
    if sliding.size:
        most, worst = friction_coefficient, int(sliding[0])
        tangential, normal = np.hypot(force[..., 0], force[..., 1]), force[..., 2]
        endless = np.where(tangential > 0, np.inf, 0.0)
        ratio = np.divide(tangential, normal, out=endless, where=normal > 0)
        bases = internal_basis(feet[sliding])
        for row, basis in zip(sliding, bases, strict=True):
            if held_by_friction(force[row], basis, most) is None:
                most, worst = least_friction(force[row], basis, float(ratio[row].max())), int(row)
        foot = segment.stance[int(ratio[worst].argmax())]
        raise StanceError(
            f"the robot slides at t = {segment.time[worst]:.4g} s ({segment.name}), the foot of "
            f"leg '{foot}' first: no forces hold with a friction coefficient below {most:.3g}, "
            f"{friction_coefficient:g} is given ({most - friction_coefficient:.3g} short); lessen "
            "slope or acceleration, or give the coefficient of a rougher ground"
        )


def _margin_and_remedy(robot: Robot, segment: Segment, sample: int, margin: float) -> str:
    """How much margin there is, what takes it, and what to change so that the robot stands."""
    words = f"static margin {1e3 * margin:.1f} mm"
    if segment.foot_target is None:
        return f"{words}; check which feet stand, or shift the body towards them"
    said = [
        f"{what} takes {1e3 * -inward:.0f} mm ({how})"
        for inward, what, how in sorted(_shifts(robot, segment, sample))
        if inward < -_NOTABLE
    ]
    general = ["spread the feet", "shorten the stroke"]
    if margin > 0:  # the bodies' acceleration tips it
        general.append("walk slower (gait.period)")
    if segment.time.size > 1 and gait_of(robot.spec).margin is None:
        general.append('let the body sway (gait.sway = "least")')
    remedy = f"{', '.join(general[:-1])} or {general[-1]}"
    return f"{words}: {', '.join(said)}; or {remedy}" if said else f"{words}; {remedy}"


def _shifts(robot: Robot, segment: Segment, sample: int) -> list[tuple[float, str, str]]:
    """By how much each cause moves the centre of mass inwards [m], what it is, what to change."""
    table = gait_table(robot.spec)
    rotation = robot.base_rotation(segment.configuration[[sample]])
    turn = np.eye(3) if rotation is None else rotation[0]
    feet, centre = (x[sample] for x in stance_and_centre(robot, segment))
    edges = support_edges(feet[None])
    distance = np.where(edges.used, edges.distance(centre[None, :2]), np.inf)[0]
    inward = edges.inward[0, int(distance.argmin())]
    normal = segment.ground_normal
    height = (centre - feet[0]) @ normal
    slopes = [key for key in ("slope_forward", "slope_left") if getattr(table, key)]
    # Down along the normal instead of plumb: where the centre would stand on level ground.
    found = [(height * (normal - [0, 0, 1 / normal[2]]), "the slope", "lessen", slopes)]
    if table.payload_mass:
        place = turn @ [table.payload_x, table.payload_y, table.payload_z]
        share = table.payload_mass / (robot.mass - table.payload_mass)
        keys = ["payload_mass", *(f"payload_{x}" for x in "xyz" if getattr(table, f"payload_{x}"))]
        found.append((share * (place - centre), "the payload", "change", keys))
    shifts = [key for key in ("body_x", "body_y") if getattr(table, key)]
    ahead = turn @ body_rotation(table).T @ [table.body_x, table.body_y, 0.0]
    found.append((ahead, "the body's shift", "change", shifts))
    return [
        (float(inward @ by[:2]), what, f"{verb} {' or '.join(f'gait.{key}' for key in keys)}")
        for by, what, verb, keys in found
        if keys
    ]
