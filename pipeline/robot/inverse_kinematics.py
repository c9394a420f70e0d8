"""Joint positions, velocities and accelerations from a prescribed foot path, and joints' limits.

Positions come from damped Gauss-Newton: the step ``J^T (J J^T + m^2 1)^-1 e`` with the error e of
the foot and a damping m that falls with it (Nakamura and Hanafusa 1986; Wampler 1986). A leg with
joints to spare stays near its start posture, which names the knee's branch; one that lacks a
direction puts its foot as near to the target as it gets. A path is followed from coarse to fine: a
few samples are solved from the start posture, those between start from a spline through them.

Rates of a leg of three joints that moves its foot in all directions are exact:
``q' = J^-1 x'`` and ``q'' = J^-1 (x'' - J' q')``. Those of any other leg are the derivatives of a
quintic spline through its positions.
"""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.robot.kinematics import LegChains, column_rates, foot_positions, leg_posture
from pipeline.robot.robot import Robot

#: A foot nearer to its target has reached it, far below what a sensor sees [m].
ACCEPTED = 1e-9
_JUMP = 0.2  # [rad] between two samples that no velocity explains: another branch lies further off
_PATH = 16  # samples; fewer are too coarse for velocities to predict the next position
_ITERATIONS = 60  # at most; a handful is usual
_MAX_STEP = 0.35  # [rad] per iteration, keeps the knee on the branch of the start posture
_REACHED, _STILL = 1e-13, 1e-12  # [m], [rad] of a step: what is left is out of reach
_LEAST_DAMPING, _DAMPING = 1e-8, 1e-2  # [m], relaxed as the iteration comes close
_STRIDE = 16  # samples of a path between those that are solved first
#: Share of a leg's reach within which a spline's guess is trusted to lie on the path's branch.
_NEAR = 5e-3
#: Of the largest singular value: a direction in which the foot hardly moves, whatever the posture,
#: is one that the leg lacks.
_RANK = 1e-2
#: Determinant of a Jacobian over the cube of its norm, at which rates are rounding errors.
_SINGULAR = 1e-8
_DEGREE = 5  # of the spline that gives rates


@lru_cache
def directions(chains: LegChains) -> NDArray[np.intp]:
    """In how many directions each leg moves its foot, shape (L,), in postures drawn at random."""
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (25, *chains.real.shape))
    values = np.linalg.svd(leg_posture(chains, q).columns, compute_uv=False)
    ranks: NDArray[np.intp] = (values > _RANK * values[..., :1]).sum(axis=-1).max(axis=0)
    return ranks


def reach(chains: LegChains, target: Array, start: Array) -> tuple[Array, Array]:
    """Joint positions that bring the feet as close to their targets as their legs get.

    `target`: in the base frame [m], shape (N, L, 3). `start`: posture that names the branch
    [rad, m], shape (L, K), or one for every sample. Returns joint positions, shape (N, L, K), and
    by how much a foot misses [m], shape (N, L), nothing where its leg lacks a direction.
    """
    n = len(target)
    q = np.broadcast_to(start, (*target.shape[:2], start.shape[-1])).copy()
    if start.ndim == 2 and n > 4 * _STRIDE:
        from scipy.interpolate import CubicSpline

        knots = np.unique(np.append(np.arange(0, n, _STRIDE), n - 1))
        q[knots] = _gauss_newton(chains, target[knots], q[knots])[0]
        guess = CubicSpline(knots, q[knots])(np.arange(n))
        off = np.linalg.norm(foot_positions(chains, guess) - target, axis=-1)
        near = (off < _NEAR * chains.reach) | (directions(chains) < 3)
        q = np.where(near[..., None], guess, q)
    q, left = _gauss_newton(chains, target, q)
    return q, np.where(directions(chains) < 3, 0.0, left)


def _gauss_newton(chains: LegChains, target: Array, q: Array) -> tuple[Array, Array]:
    """Postures (N, L, K) from those in `q`, and what is left to the targets [m], (N, L)."""
    left = np.empty(target.shape[:2])
    busy = np.arange(len(target))  # samples that are not there yet
    for iteration in range(_ITERATIONS + 1):
        legs = leg_posture(chains, q[busy])
        error = target[busy] - legs.feet
        left[busy] = np.linalg.norm(error, axis=-1)
        going = (left[busy] > _REACHED).any(axis=1)
        if iteration == _ITERATIONS or not going.any():
            break
        busy, transposed = busy[going], np.ascontiguousarray(legs.columns[going])
        damping = np.clip(0.1 * left[busy], _LEAST_DAMPING, _DAMPING)[..., None, None]
        normal = transposed.swapaxes(-1, -2) @ transposed + damping**2 * np.eye(3)
        step = (transposed @ np.linalg.solve(normal, error[going][..., None]))[..., 0]
        largest = np.abs(step).max(axis=-1, keepdims=True)
        q[busy] += step * np.minimum(1.0, _MAX_STEP / np.maximum(largest, 1e-300))
        busy = busy[largest.max(axis=(1, 2)) > _STILL]
    return q, left


def solve_positions(chains: LegChains, target: Array, start: Array, time: Array) -> Array:
    """Joint positions [rad, m], (N, L, K), that bring the feet to their targets; see `reach`.

    `time`: for messages [s], shape (N,).

    Raises:
        LegwattError: A target is not reached; names leg, instant and how far it is off.
    """
    q, miss = reach(chains, target, start)
    if miss.max() > ACCEPTED:
        sample, leg = np.unravel_index(int(miss.argmax()), miss.shape)
        x, y, z = target[sample, leg]
        words = f"leg '{chains.names[leg]}' at t = {time[sample]:.4g} s: the foot target"
        away = f"lies {1e3 * miss.max():.1f} mm beyond its reach; shorten the stroke"
        raise LegwattError(f"{words} ({x:.3f}, {y:.3f}, {z:.3f}) m in the base frame {away}")
    return q


def solve_rates(
    chains: LegChains, q: Array, foot_velocity: Array, foot_acceleration: Array, time: Array
) -> tuple[Array, Array]:
    """Joint velocities and accelerations that move the feet as prescribed, each (N, L, K).

    `q`: joint positions from `solve_positions` [rad, m], shape (N, L, K). `foot_velocity`,
    `foot_acceleration`: in the base frame, relative to the base [m/s, m/s^2], shape (N, L, 3).
    `time`: increasing [s], shape (N,).

    Raises:
        LegwattError: The leg is stretched (singular) at a sample, or changes its branch.

    Note:
        Of legs that are not of three joints the spline's error falls with the fifth and fourth
        power of the time between samples: 1e-5 of the largest at 400 samples, 1e-3 with joints to
        spare.
    """
    legs = leg_posture(chains, q)
    velocity, acceleration = np.zeros((2, *q.shape))
    exact = (chains.counts == 3) & (directions(chains) == 3)
    if exact.any():
        jacobian = legs.columns[:, exact, :3].swapaxes(-1, -2)
        _refuse_singular([n for n, e in zip(chains.names, exact, strict=True) if e], jacobian, time)
        velocity[:, exact, :3] = _solved(jacobian, foot_velocity[:, exact])
        bias = (column_rates(legs, velocity) * velocity[..., None]).sum(axis=2)
        acceleration[:, exact, :3] = _solved(jacobian, (foot_acceleration - bias)[:, exact])
    if not exact.all():
        columns = legs.columns[:, ~exact]
        inverse = np.linalg.pinv(columns, rcond=_RANK).swapaxes(-1, -2)
        velocity[:, ~exact] = (inverse @ foot_velocity[:, ~exact, :, None])[..., 0]
    if time.size >= _PATH:
        _refuse_jumps(chains, q, velocity, time)
    if not exact.all() and time.size > 1:
        from scipy.interpolate import make_interp_spline

        path = make_interp_spline(time, q[:, ~exact], k=min(_DEGREE, (time.size - 1) // 2 * 2 - 1))
        velocity[:, ~exact], acceleration[:, ~exact] = path(time, 1), path(time, 2)
    return velocity, acceleration


def _solved(matrix: Array, right: Array) -> Array:
    return np.asarray(np.linalg.solve(matrix, right[..., None])[..., 0])


def _refuse_singular(names: Sequence[str], jacobian: Array, time: Array) -> None:
    """Refuse legs that stretch or fold; `jacobian`: square ones, shape (N, L, 3, 3)."""
    size = np.linalg.norm(jacobian, axis=(-1, -2))
    singular = ~(np.abs(np.linalg.det(jacobian)) > _SINGULAR * size**3)
    if singular.any():
        leg, sample = np.unravel_index(int(singular.T.argmax()), singular.T.shape)
        words = f"leg '{names[int(leg)]}' is stretched or folded at t = {time[sample]:.4g} s"
        raise LegwattError(f"{words}; shorten the stroke or move the neutral foot")


def _refuse_jumps(chains: LegChains, q: Array, velocity: Array, time: Array) -> None:
    """Refuse a change of branch: a joint goes further between samples than its velocities say."""
    step, gone = np.diff(time)[:, None, None], np.diff(q, axis=0)
    jump = np.abs(gone - 0.5 * step * (velocity[1:] + velocity[:-1]))
    jump -= 0.5 * step * np.abs(np.diff(velocity, axis=0))
    if jump.max() > _JUMP:
        sample, leg, joint = np.unravel_index(int(jump.argmax()), jump.shape)
        by, when = gone[sample, leg, joint], time[sample]
        words = f"its position jumps by {by:.3g} rad at t = {when:.4g} s"
        remedy = "to another branch; keep the leg bent, or state another start_posture"
        raise LegwattError(f"leg '{chains.names[leg]}', joint {joint + 1}: {words}, {remedy}")


def start_postures(robot: Robot, target: Array | None = None) -> Array:
    """Joint positions with every foot at mid-support, each leg on its branch [rad, m], (L, K).

    `target`: feet at mid-support in the base frame [m], shape (L, 3); the neutral feet by default.

    Raises:
        LegwattError: A leg does not reach its foot from ``start_posture`` within its limits.
    """
    time, neutral = np.zeros(1), np.array([leg.neutral_foot for leg in robot.spec.legs])
    remedy = "state another start_posture, or move the neutral foot; `init` guesses both"
    try:
        start = solve_positions(robot.chains, neutral[None], robot.start_posture, time)
        refuse_beyond_limits(robot, robot.joint_positions(start), time, remedy)
    except LegwattError as error:
        raise LegwattError(f"{robot.spec.path}: from start_posture, {error}") from None
    if target is None or np.array_equal(target, neutral):
        return np.asarray(start[0])
    return np.asarray(solve_positions(robot.chains, target[None], start[0], time)[0])


def refuse_beyond_limits(
    robot: Robot,
    q: Array,
    time: Array,
    remedy: str = "change the stroke, the neutral foot or the limits",
) -> None:
    """Refuse joint positions (N, J) [rad, m] outside the URDF's limits; `time` (N,) [s] is told.

    Raises:
        LegwattError: One lies beyond; names joint, instant and limits.
    """
    lower, upper = robot.limits
    beyond = np.maximum(q - upper, lower - q)
    if beyond.max() <= ACCEPTED:
        return
    sample, joint = np.unravel_index(int(beyond.argmax()), beyond.shape)
    scale, digits, unit = (1.0, 4, "m") if robot.sliding[joint] else (180 / np.pi, 1, "deg")
    numbers = (q[sample, joint], lower[joint], upper[joint])
    reached, low, high = (f"{scale * float(x):.{digits}f}" for x in numbers)
    raise LegwattError(
        f"joint '{robot.joints[joint]}' would have to reach {reached} {unit} at "
        f"t = {time[sample]:.4g} s, its limits are {low} to {high} {unit}; {remedy}"
    )
