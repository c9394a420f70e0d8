"""One period of a gait as a motion, standing, static stability, and the sway that keeps it.

A segment ends at every lift-off and touch-down of any leg, so that the same feet stand all along.

The sway is a quadratic programme on a spline. Of all periodic paths w(t) of the body over its feet,
in the ground's plane and the body's axes, the one with the least mean of |w|^2 + (T/2 pi)^4 |w''|^2
is taken. Two points must stay inside every support polygon by the margin: the centre of mass
(static stability), and that about which the ground's forces have no tipping moment (its dynamic
counterpart). Both depend on w through the legs, too, so the programme is solved with their exact
values and measured rates at the last path until the path stands still.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np
import pinocchio as pin

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.motion.footfall import LEAST_FEET
from pipeline.motion.gait import Gait, foot_lift, gait_of, gait_table, neutral_feet
from pipeline.motion.motion import (
    Motion,
    Segment,
    base_motion,
    base_quaternions,
    foot_course,
    surge,
)
from pipeline.robot.kinematics import (
    edge_distances,
    foot_positions,
    leg_posture,
    refuse_beyond_limits,
    solve_positions,
    solve_rates,
    start_postures,
    support_margin,
)
from pipeline.robot.robot import Robot, inverse_dynamics


def stance_and_centre(robot: Robot, segment: Segment) -> tuple[Array, Array]:
    """Standing feet (N, F, 3) and centre of mass (N, 3) from the base, world's directions [m]."""
    q = segment.configuration
    stance = [robot.leg_names.index(leg) for leg in segment.stance]
    feet = foot_positions(robot.chains, robot.leg_positions(q))[:, stance]
    feet, data = np.einsum("nij,nfj->nfi", robot.base_rotation(q), feet), robot.model.createData()
    return feet, np.array([pin.centerOfMass(robot.model, data, row) for row in q]) - q[:, :3]


def stability_margins(robot: Robot, segment: Segment) -> Array:
    """Margin of static stability of a robot with a floating base [m], shape (N,).

    The distance of the centre of mass's vertical projection from the nearest edge of the support
    polygon; negative outside.
    """
    feet, centre = stance_and_centre(robot, segment)
    return support_margin(feet, centre[:, :2])


def standing_posture(robot: Robot, feet: tuple[str, ...] | None = None) -> Segment:
    """Standing still with every foot at mid-stroke; legs that do not stand are lifted.

    The lifted ones hold the middle of their transfer, as if the gait had stopped at mid-support
    (section II.C of the paper). `feet`: legs that stand; the robot file's by default.

    Raises:
        LegwattError: A foot is out of reach, a joint beyond its limits, or fewer than three stand.
    """
    spec = robot.spec
    stance = spec.standing_feet if feet is None else feet
    if len(stance) < LEAST_FEET:
        words = f"{len(stance)} feet; a statically stable stance needs at least {LEAST_FEET}"
        raise LegwattError(f"{spec.path}: standing.feet: the robot stands on {words}")
    table = gait_table(spec)
    ground, body = table.ground, table.body
    target = neutral_feet(table, spec)
    start = start_postures(robot, target @ body)
    lifted = [leg not in stance for leg in robot.leg_names]
    if any(lifted):
        target[lifted, 2] += foot_lift(table, spec)
    time, in_base = np.zeros(1), (target @ body)[None]
    q = robot.joint_positions(solve_positions(robot.chains, in_base, start, time))
    refuse_beyond_limits(robot, q, time)
    still = robot.tangent(np.zeros_like(q))
    base = np.hstack([np.zeros((1, 3)), base_quaternions(ground, body, time)])
    return Segment(
        name="standing on " + ", ".join(stance),
        time=time,
        configuration=robot.configuration(q, base),
        velocity=still,
        acceleration=still,
        stance=stance,
        ground_normal=ground[:, 2].copy(),
        foot_target=in_base,
    )


_DEGREE: Final = 5  # of the spline: its acceleration is smooth, its jerk steady
_KNOTS_PER_STANCE: Final = 4
_FEWEST_KNOTS, _MOST_KNOTS = 16, 48
_ROUNDS: Final = 12
_STILL: Final = 1e-5  # [m] of the path between two rounds
_STEP: Final = 1e-3  # [m] for the rates of the two points
_FLAT: Final = 1e-6  # of a leg's Jacobian: a direction below it is none
_KEPT: Final = 1e-4  # [m] by which the margin may be missed between samples


@cache
def _basis(knots: int, order: int) -> Callable[[Array], Array]:
    """The periodic B-splines on [0, 1], or a derivative of them: (N,) to (N, knots)."""
    from scipy.interpolate import BSpline

    around = np.eye(knots)[np.arange(-_DEGREE, knots) % knots]
    at = np.arange(-_DEGREE, knots + _DEGREE + 1) / knots
    spline = BSpline(at, around, _DEGREE, extrapolate="periodic")
    return spline.derivative(order) if order else spline


@dataclass(frozen=True)
class Sway:
    """A periodic path of the body."""

    coefficients: Array  #: Of the spline [m], shape (knots, 2).
    period: float  #: [s].

    def course(self, share: Array) -> Array:
        """The path and its rates at shares of the period (N,), in the body's axes, (3, N, 3)."""
        out = np.zeros((3, share.size, 3))
        for order in range(3):
            rows = _basis(len(self.coefficients), order)(share)
            out[order, :, :2] = rows @ self.coefficients / self.period**order
        return out


def _points(robot: Robot, segment: Segment) -> tuple[Array, Array, Array, Array]:
    """What has to stay inside the support, and the standing feet, in the world.

    Centre of mass and point without tipping moment seen from above, (N, 2) each, height of the
    first over the feet's plane (N,), feet (N, F, 3) [m].
    """
    q, v, a = segment.configuration, segment.velocity, segment.acceleration
    normal, rotation = segment.ground_normal, robot.base_rotation(q)
    feet, centre = stance_and_centre(robot, segment)
    height = (centre - feet[:, 0]) @ normal / normal[2]
    wrench = inverse_dynamics(robot.model, (q, v, a))[:, :6]
    force, moment = (np.einsum("nij,nj->ni", rotation, x) for x in (wrench[:, :3], wrench[:, 3:]))
    # r on the feet's plane with the moment about it along the normal: n x (M - r x F) = 0.
    zero = np.cross(normal, moment) + (feet[:, 0] @ normal)[:, None] * force
    zero /= (force @ normal)[:, None]
    place = q[:, None, :3]
    return centre[:, :2] + place[:, 0, :2], zero[:, :2] + place[:, 0, :2], height, feet + place


def followed_ways(robot: Robot, gait: Gait, posture: Array) -> Array:
    """Directions along the ground in which every leg lets the body move over a standing foot.

    A leg of two joints moves its foot in a plane; sway across it would drag the foot. `posture`: at
    mid-support, shape (L, K). Returns orthonormal columns in the ground's plane, shape (2, ways).
    """
    (jacobians,) = leg_posture(robot.chains, posture[None]).jacobians
    across = [(np.eye(3) - j @ np.linalg.pinv(j, rcond=_FLAT)) for j in jacobians]
    _, size, rows = np.linalg.svd(np.concatenate(across) @ gait.table.body.T[:, :2])
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
    place, bend = _basis(knots, 0)(share), _basis(knots, 2)(share) / (2 * np.pi) ** 2
    own = (place.T @ place + bend.T @ bend) / share.size  # of the coefficients along one way
    cost: Array = np.kron(own, np.eye(ways.shape[1])).astype(np.float64)
    sway, margin = Sway(np.zeros((knots, 2)), gait.period), gait.margin
    for _ in range(_ROUNDS):
        matrix, bound = _constraints(robot, sway, walked)
        found = _solved(cost, matrix @ onto, bound + margin)
        if found is None:
            most = _attainable(matrix @ onto, bound)
            if gait.table.stability_margin is not None or not most > 0 or margin < gait.margin:
                raise LegwattError(
                    f"{gait.source}: no sway of the body keeps the {gait.title} from tipping with "
                    f"a margin of {1e3 * margin:.1f} mm, about {1e3 * most:.1f} mm is attainable: "
                    "lower gait.stability_margin, lessen slope or load, raise gait.duty_factor or "
                    "gait.period, or shorten the stroke"
                )
            margin = most / 2
            found = _solved(cost, matrix @ onto, bound + margin)
            assert found is not None
        before, sway = sway, Sway((onto @ found).reshape(knots, 2), gait.period)
        if np.abs(sway.coefficients - before.coefficients).max(initial=0.0) < _STILL:
            return sway
    matrix, bound = _constraints(robot, sway, walked)
    if (matrix @ sway.coefficients.ravel() - bound).min() < margin - _KEPT:
        words = f"no margin of {1e3 * margin:.1f} mm; raise gait.duty_factor or gait.period"
        raise LegwattError(f"{gait.source}: the body's sway keeps {words}")
    return sway


def _constraints(robot: Robot, sway: Sway, walked: Callable[[Sway], Motion]) -> tuple[Array, Array]:
    """Rows of `matrix @ coefficients - bound`: distances inside the support's edges [m]."""
    knots, coefficients = len(sway.coefficients), sway.coefficients.ravel()
    gravity = float(np.linalg.norm(robot.model.gravity.linear))
    moved = [Sway(sway.coefficients + by, sway.period) for by in _STEP * np.eye(2)]
    still: list[tuple[Array, Array]] = []
    moving: list[tuple[Array, Array]] = []
    for segment, *others in zip(*(walked(path).segments for path in (sway, *moved)), strict=True):
        centre, zero, height, feet = _points(robot, segment)
        rates = [(_points(robot, other)[0] - centre) / _STEP for other in others]
        rate = np.stack(rates, axis=-1)  # (N, 2 world, 2 body)
        share = segment.time / sway.period
        place = _basis(knots, 0)(share)
        # How long a pendulum of the centre's height falls: acceleration moves the point back by it.
        fall = (height / gravity / sway.period**2)[:, None]
        ahead = place - fall * _basis(knots, 2)(share)
        for found, point, basis in ((still, centre, place), (moving, zero, ahead)):
            distance, inward = edge_distances(feet, point)
            used = np.isfinite(distance)
            moves = np.einsum("nij,nk->nikj", rate, basis).reshape(len(point), 2, -1)
            row = np.einsum("nek,nkc->nec", inward, moves)[used]
            found.append((row, row @ coefficients - distance[used]))
    matrices, bounds = zip(*still, *moving, strict=True)
    return np.concatenate(matrices), np.concatenate(bounds)


def _solved(cost: Array, matrix: Array, bound: Array) -> Array | None:
    """The least coefficients with `matrix @ coefficients >= bound`; None where there are none."""
    from qpsolvers import solve_qp

    if not cost.size:  # the legs let the body sway nowhere
        return np.zeros(0) if (bound <= 0).all() else None
    return solve_qp(cost, np.zeros(cost.shape[0]), -matrix, -bound, solver="quadprog")


def _attainable(matrix: Array, bound: Array) -> float:
    """The largest margin that any path keeps, as far as these constraints know [m]."""
    from scipy.optimize import linprog

    rows = np.hstack([-matrix, np.ones((bound.size, 1))])
    goal = np.append(np.zeros(matrix.shape[1]), -1.0)
    best = linprog(goal, A_ub=rows, b_ub=-bound, bounds=(-10, 10), method="highs").x
    return 0.0 if best is None else float(best[-1])


DEFAULT_SAMPLES: Final = 751  # per half period: one every 2 ms at the paper's period
#: However short a segment is, its energy needs that many.
FEWEST_SAMPLES: Final = 25
#: In half a period, while the sway is sought.
SWAY_SAMPLES: Final = 121


def walking_motion(robot: Robot, *, samples: int = DEFAULT_SAMPLES, swayed: bool = True) -> Motion:
    """One period of the robot file's gait.

    `samples`: in half a period, ends included, 2 at least; a segment has its share of them, and
    `FEWEST_SAMPLES` where there are as many. `swayed`: False for a body that does not sway to keep
    the margin, which takes a fraction of the time. Returns closed segments, one for every set of
    legs that stand, from t = 0.

    Raises:
        LegwattError: The numbers contradict each other, too few feet stand, or no sway keeps the
            margin. A foot target lies outside a leg's reach.
    """
    gait = gait_of(robot.spec)
    start = start_postures(robot, gait.neutral @ gait.table.body)
    if gait.margin is None or not swayed:
        return _motion(robot, gait, start, samples, None)
    sway = least_sway(robot, gait, start, lambda s: _motion(robot, gait, start, SWAY_SAMPLES, s))
    return _motion(robot, gait, start, samples, sway)


def _motion(robot: Robot, gait: Gait, start: Array, samples: int, sway: Sway | None) -> Motion:
    segments, body, normal = [], gait.table.body, gait.table.ground[:, 2].copy()
    for begin, end, stance in gait.footfall.stances():
        n = max(round(2 * (end - begin) * (samples - 1)) + 1, min(samples, FEWEST_SAMPLES))
        passed = np.linspace(0.0, 1.0, n)
        time = gait.period * begin + gait.period * (end - begin) * passed
        time[-1] = gait.period * end  # the instant at which the next one starts, to the last bit
        share = begin + (end - begin) * passed
        shift = surge(gait, share)
        if sway is not None:
            shift = shift + sway.course(share)
        courses = []
        for leg, name in enumerate(gait.legs):
            stands = name in stance
            length = gait.footfall.duty if stands else 1 - gait.footfall.duty
            since = gait.footfall.since(name, begin, stood=stands)
            local = (since + (end - begin) * passed) / length
            courses.append(foot_course(gait, leg, local, stands=stands))
        # From the unswayed body, axes along the ground, to the base and its axes: (3, N, L, 3).
        feet, rate, rate_2 = (np.stack(courses, axis=2) - shift[:, :, None]) @ body
        q = solve_positions(robot.chains, feet, start, time)
        refuse_beyond_limits(robot, robot.joint_positions(q), time)
        q_dot, q_ddot = solve_rates(robot.chains, q, rate, rate_2, time)
        place, velocity, acceleration = base_motion(gait, time, shift)
        segments.append(
            Segment(
                name="support of " + ", ".join(stance),
                time=time,
                configuration=robot.configuration(robot.joint_positions(q), place),
                velocity=robot.tangent(robot.chains.by_joint(q_dot), velocity),
                acceleration=robot.tangent(robot.chains.by_joint(q_ddot), acceleration),
                stance=stance,
                ground_normal=normal,
                foot_target=feet,
                rocks=len(stance) < LEAST_FEET,
            )
        )
    return Motion(tuple(segments))
