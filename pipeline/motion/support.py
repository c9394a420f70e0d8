"""Static stability over the standing feet, and the body's sway that keeps it.

The least sway of the body that keeps a margin of stability: a quadratic programme on a spline. Of
all periodic paths w(t) of the body over its feet, in the ground's plane and the body's axes, the
one with the least mean of |w|^2 + (T/2 pi)^4 |w''|^2 is taken: a sway once per period counts as
much for its size as for its acceleration. Two points must stay inside every support polygon by the
margin: the centre of mass (static stability), and the point about which the ground's forces have no
tipping moment (its dynamic counterpart; the two differ by what the bodies' acceleration asks). Both
depend on w through the legs, too, so the programme is solved with their exact values and measured
rates at the last path until the path stands still.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.motion.feet import Course, base_quaternions
from pipeline.motion.footfall import LEAST_FEET
from pipeline.motion.gait import Gait, body_rotation, gait_table, lifts, neutral_feet
from pipeline.motion.motion import Ground, Motion, Segment
from pipeline.robot.inverse.inverse_kinematics import (
    refuse_beyond_limits,
    solve_positions,
    start_postures,
)
from pipeline.robot.kinematics import foot_jacobians, foot_positions
from pipeline.robot.robot import Robot

_ON_EDGE = 1e-12  # [m]


@dataclass(frozen=True)
class SupportEdges:
    """Lines between any two feet, seen from above, and which of them bound the hull."""

    start: Array  #: A point of each line [m], shape (N, E, 2).
    edge: Array  #: Along it, to the other foot [m], shape (N, E, 2).
    length: Array  #: Of that [m], shape (N, E).
    #: Whether all feet lie on it or to its left, so that it bounds the hull, shape (N, E).
    used: NDArray[np.bool_]

    @property
    def inward(self) -> Array:
        """Unit vectors to the left of the lines, shape (N, E, 2)."""
        left = np.stack([-self.edge[..., 1], self.edge[..., 0]], axis=-1)
        return np.asarray(left / self.length[..., None])

    def distance(self, point: Array) -> Array:
        """How far points, shape (N, 2), lie to the left of every line [m], shape (N, E)."""
        return _left_of(self.start, self.edge, self.length, point[:, None])


def _left_of(start: Array, edge: Array, length: Array, point: Array) -> Array:
    d = point - start
    return np.asarray((edge[..., 0] * d[..., 1] - edge[..., 1] * d[..., 0]) / length)


def support_edges(feet: Array) -> SupportEdges:
    """The lines between any two feet.

    `feet`: foot points [m], shape (N, F, 2 or more), in any order around the hull.
    """
    xy = feet[..., :2]
    n_feet = xy.shape[1]
    pairs = np.array([(i, j) for i in range(n_feet) for j in range(n_feet) if i != j])
    start = xy[:, pairs[:, 0]]
    edge = xy[:, pairs[:, 1]] - start
    length = np.hypot(edge[..., 0], edge[..., 1])
    used = np.ones(length.shape, dtype=np.bool_)
    for k in range(n_feet):
        used &= _left_of(start, edge, length, xy[:, k, None]) >= -_ON_EDGE
    return SupportEdges(start, edge, length, used)


def stance_and_centre(robot: Robot, segment: Segment) -> tuple[Array, Array]:
    """Standing feet (N, F, 3) and centre of mass (N, 3) from the base, world's directions [m]."""
    q = segment.configuration
    stance = [robot.leg_names.index(leg) for leg in segment.stance]
    feet = foot_positions(robot.chains, robot.leg_positions(q))[:, stance]
    rotation = robot.base_rotation(q)
    if rotation is not None:
        feet = np.einsum("nij,nfj->nfi", rotation, feet)
    data = robot.model.createData()
    return feet, np.array([pin.centerOfMass(robot.model, data, row) for row in q]) - q[:, :3]


def support_margin(feet: Array, point: Array) -> Array:
    """Distance of a point from the nearest edge of the feet's convex hull, seen from above.

    `feet`: foot points [m], shape (N, F, 3), the same order around the hull at every sample not
    being required. `point`: projected point [m], shape (N, 2). Returns margin [m], shape (N,);
    negative outside the hull.
    """
    edges = support_edges(feet)
    margin: Array = np.where(edges.used, edges.distance(point), np.inf).min(axis=1)
    return margin


def stability_margins(robot: Robot, segment: Segment) -> Array:
    """Margin of static stability of a robot with a floating base along a segment.

    The distance of the centre of mass's vertical projection from the nearest edge of the support
    polygon [m], shape (N,); negative outside.
    """
    feet, centre = stance_and_centre(robot, segment)
    return support_margin(feet, centre[:, :2])


def standing_posture(robot: Robot, feet: tuple[str, ...] | None = None) -> Segment:
    """Standing still with every foot at mid-stroke; legs that do not stand are lifted.

    The lifted ones hold the middle of their transfer, as if the gait had stopped at mid-support
    (section II.C of the paper). Height, shift and tilt of the body and the slope of the ground are
    those of ``[gait]``.

    `feet`: legs that stand; the robot file's by default.

    Raises:
        LegwattError: A foot target lies outside a leg's reach. Fewer than three feet stand, or a
            joint's limits forbid it.
    """
    spec = robot.spec
    stance = spec.standing_feet if feet is None else feet
    if len(stance) < LEAST_FEET:
        raise LegwattError(
            f"{spec.path}: standing.feet: the robot stands on {len(stance)} feet; a statically "
            f"stable stance needs at least {LEAST_FEET}"
        )
    table = gait_table(spec)
    ground, body = Ground(table.slope_forward, table.slope_left), body_rotation(table)
    target = neutral_feet(table, spec)
    start = start_postures(robot, target @ body)
    lifted = [i for i, leg in enumerate(robot.leg_names) if leg not in stance]
    if lifted:
        target[lifted, 2] += lifts(table, spec)[lifted]
    time = np.zeros(1)
    in_base = (target @ body)[None]
    q = solve_positions(robot.chains, in_base, start, time)
    refuse_beyond_limits(robot, robot.joint_positions(q), time)
    still = robot.tangent(np.zeros((1, len(robot.joints))))
    base = np.hstack([np.zeros((1, 3)), base_quaternions(ground, body, time)])
    return Segment(
        name="standing on " + ", ".join(stance),
        time=time,
        configuration=robot.configuration(robot.joint_positions(q), base),
        velocity=still,
        acceleration=still,
        stance=stance,
        ground_normal=ground.normal,
        foot_target=in_base,
    )


_DEGREE = 5  # of the spline: its acceleration is smooth, its jerk steady
_KNOTS_PER_STANCE = 4
_FEWEST_KNOTS, _MOST_KNOTS = 16, 48
_ROUNDS = 12
_STILL = 1e-5  # [m] of the path between two rounds
_STEP = 1e-3  # [m] for the rates of the two points
_FLAT = 1e-6  # of a leg's Jacobian: a direction below it is none
_KEPT = 1e-4  # [m] by which the margin may be missed between samples


@cache
def _bump(order: int) -> Callable[[Array], Array]:
    """The uniform B-spline on [0, degree + 1], or a derivative of it."""
    from scipy.interpolate import BSpline

    basis = BSpline.basis_element(np.arange(_DEGREE + 2.0), extrapolate=False)
    spline = basis.derivative(order) if order else basis
    return lambda u: np.nan_to_num(spline(u))


def _rows(knots: int, share: Array, order: int) -> Array:
    """Values of the periodic basis, or of a derivative by the share, shape (N, knots)."""
    u = np.mod(share[:, None] * knots - np.arange(knots), knots)
    return _bump(order)(u) * float(knots) ** order


@dataclass(frozen=True)
class Sway:
    """A periodic path of the body."""

    coefficients: Array  #: Of the spline [m], shape (knots, 2).
    period: float  #: [s].

    def course(self, share: Array) -> Course:
        """The path at shares of the period, shape (N,), in the body's axes; z is zero."""
        parts = []
        for order in range(3):
            value = np.zeros((share.size, 3))
            rows = _rows(len(self.coefficients), share, order)
            value[:, :2] = rows @ self.coefficients / self.period**order
            parts.append(value)
        return Course(*parts)

    def moved(self, by: Array) -> Sway:
        """The path shifted as a whole by a vector, shape (2,)."""
        return Sway(self.coefficients + by, self.period)


def _points(robot: Robot, segment: Segment) -> tuple[Array, Array, Array, Array]:
    """What has to stay inside the support, and the standing feet, in the world.

    Centre of mass and point without tipping moment seen from above, (N, 2) each, height of the
    first over the feet's plane (N,), feet (N, F, 3) [m].
    """
    q, v, a = segment.configuration, segment.velocity, segment.acceleration
    place, rotation = q[:, :3], robot.base_rotation(q)
    turn = np.broadcast_to(np.eye(3), (q.shape[0], 3, 3)) if rotation is None else rotation
    feet, centre = stance_and_centre(robot, segment)
    world, centre = feet + place[:, None], centre + place
    normal = segment.ground_normal
    height = ((centre - world[:, 0]) @ normal) / normal[2]
    wrench = np.asarray(pin.rneaInParallel(1, robot.pool(1), q.T, v.T, a.T)).T[:, :6]
    force, moment = (np.einsum("nij,nj->ni", turn, x) for x in (wrench[:, :3], wrench[:, 3:]))
    # r on the feet's plane with the moment about it along the normal: n x (M - r x F) = 0.
    depth = ((world[:, 0] - q[:, :3]) @ normal)[:, None]
    zero = np.cross(normal, moment) + depth * force
    zero = q[:, :3] + zero / (force @ normal)[:, None]
    return centre[:, :2], zero[:, :2], height, world


def followed_ways(robot: Robot, gait: Gait, posture: Array) -> Array:
    """Directions along the ground in which every leg lets the body move over a standing foot.

    A leg of two joints moves its foot in a plane; sway across it would drag the foot.

    `posture`: joint positions at mid-support, shape (L, K). Returns orthonormal columns in the
    ground's plane, shape (2, ways).
    """
    _, jacobians = foot_jacobians(robot.chains, posture[None])
    across = [(np.eye(3) - j @ np.linalg.pinv(j, rcond=_FLAT)) for j in jacobians[0]]
    _, size, rows = np.linalg.svd(np.concatenate(across) @ gait.body.T[:, :2])
    return np.asarray(rows[size < _FLAT].T)


def least_sway(robot: Robot, gait: Gait, posture: Array, walked: Callable[[Sway], Motion]) -> Sway:
    """The least path of the body that keeps the gait's margin.

    `posture`: joint positions at mid-support, shape (L, K).

    Raises:
        LegwattError: No path keeps it; says how much of a margin one could.
    """
    assert gait.margin is not None
    stances = len(gait.footfall.stances())
    knots = min(max(_KNOTS_PER_STANCE * stances, _FEWEST_KNOTS), _MOST_KNOTS)
    ways = followed_ways(robot, gait, posture)
    onto = np.kron(np.eye(knots), ways)  # from coefficients along the ways to those along x and y
    share = np.arange(8 * knots) / (8 * knots)
    place, bend = _rows(knots, share, 0), _rows(knots, share, 2) / (2 * np.pi) ** 2
    own = (place.T @ place + bend.T @ bend) / share.size  # of the coefficients along one way
    cost: Array = np.asarray(np.kron(own, np.eye(ways.shape[1])), dtype=np.float64)
    sway = Sway(np.zeros((knots, 2)), gait.period)
    margin = gait.margin
    for _ in range(_ROUNDS):
        matrix, bound = _constraints(robot, sway, walked)
        found = _solved(cost, matrix @ onto, bound + margin)
        if found is None:
            from scipy.optimize import linprog

            # The largest margin that any path keeps, as far as this round knows [m].
            rows = np.hstack([-matrix @ onto, np.ones((bound.size, 1))])
            goal = np.append(np.zeros(onto.shape[1]), -1.0)
            best = linprog(goal, A_ub=rows, b_ub=-bound, bounds=(-10, 10), method="highs").x
            most = np.nan if best is None else float(best[-1])
            if gait.margin_stated or not most > 0 or margin < gait.margin:
                raise LegwattError(_unattainable(gait, margin, most, burdens(robot)))
            margin = most / 2
            found = _solved(cost, matrix @ onto, bound + margin)
            assert found is not None
        new = (onto @ found).reshape(knots, 2)
        step = new - sway.coefficients
        sway = Sway(new, gait.period)
        if np.abs(step).max(initial=0.0) < _STILL:
            return sway
    matrix, bound = _constraints(robot, sway, walked)
    left = matrix @ sway.coefficients.ravel() - bound
    if left.min() < margin - _KEPT:
        raise LegwattError(
            f"{gait.source}: the body's sway comes to no rest: {1e3 * left.min():.1f} mm of "
            f"{1e3 * margin:.1f} mm of margin are kept; raise gait.duty_factor or gait.period"
        )
    return sway


def _constraints(robot: Robot, sway: Sway, walked: Callable[[Sway], Motion]) -> tuple[Array, Array]:
    """Rows of `matrix @ coefficients - bound`: distances inside the support's edges [m]."""
    knots, coefficients = len(sway.coefficients), sway.coefficients.ravel()
    gravity = float(np.linalg.norm(robot.model.gravity.linear))
    paths = [sway, *(sway.moved(_STEP * axis) for axis in np.eye(2))]
    still: list[tuple[Array, Array]] = []
    moving: list[tuple[Array, Array]] = []
    for segment, *others in zip(*(walked(path).segments for path in paths), strict=True):
        centre, zero, height, feet = _points(robot, segment)
        rates = [(_points(robot, other)[0] - centre) / _STEP for other in others]
        rate = np.stack(rates, axis=-1)  # (N, 2 world, 2 body)
        share = segment.time / sway.period
        place = _rows(knots, share, 0)
        # How long a pendulum of the centre's height falls: acceleration moves the point back by it.
        fall = (height / gravity / sway.period**2)[:, None]
        ahead = place - fall * _rows(knots, share, 2)
        edges = support_edges(feet)
        for found, point, basis in ((still, centre, place), (moving, zero, ahead)):
            moves = np.einsum("nij,nk->nikj", rate, basis).reshape(point.shape[0], 2, -1)
            row = np.einsum("nek,nkc->nec", edges.inward, moves)[edges.used]
            found.append((row, row @ coefficients - edges.distance(point)[edges.used]))
    matrices, bounds = zip(*still, *moving, strict=True)
    return np.concatenate(matrices), np.concatenate(bounds)


def _solved(cost: Array, matrix: Array, bound: Array) -> Array | None:
    from qpsolvers import solve_qp

    if not cost.size:  # the legs let the body sway nowhere
        return np.zeros(0) if (bound <= 0).all() else None
    return solve_qp(cost, np.zeros(cost.shape[0]), -matrix, -bound, solver="quadprog")


def burdens(robot: Robot) -> str:
    """What of ``[gait]`` makes the body sway further, as ``--set`` names it; empty without."""
    table = gait_table(robot.spec)
    keys = ("slope_forward", "slope_left", "payload_mass", "body_x", "body_y")
    return ", ".join(f"gait.{key}" for key in keys if getattr(table, key))


def _unattainable(gait: Gait, margin: float, most: float, burden: str) -> str:
    """What to say where no path keeps the margin."""
    remedy = "raise gait.duty_factor or gait.period, or shorten the stroke"
    remedy = f"lessen {burden}; {remedy}" if burden else remedy
    if not most > 0:
        return (
            f"{gait.source}: no sway of the body keeps the {gait.title} from tipping (margin "
            f"{1e3 * most:.1f} mm at best); {remedy}"
        )
    return (
        f"{gait.source}: no sway of the body keeps a margin of {1e3 * margin:.1f} mm; about "
        f"{1e3 * most:.1f} mm is attainable: lower gait.stability_margin, or {remedy}"
    )
