"""Feet of the legs, Jacobians, rates and joints for a path of the feet, by Pinocchio.

A leg is a chain of joints of one coordinate [rad, m] from the base to a foot point. Legs may differ
in their number of joints: arrays have K columns, as many as the longest leg, and what stands beyond
a leg's own joints is zero.

Joints for a path come from damped Gauss-Newton: the step ``J^T (J J^T + m^2 1)^-1 e`` with the
error e of the foot and a damping m that falls with it (Nakamura and Hanafusa 1986; Wampler 1986). A
leg with joints to spare stays near its start posture, which names the knee's branch; one that lacks
a direction puts its foot as near to the target as it gets. A path is followed from coarse to fine:
a few samples are solved from the start posture, those between start from a spline through them.

Rates of a leg of three joints that moves its foot in all directions are exact:
``q' = J^-1 x'`` and ``q'' = J^-1 (x'' - J' q')``. Those of any other leg are the derivatives of a
quintic spline through its positions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import LegwattError, known

if TYPE_CHECKING:
    from pipeline.robot.robot import Robot

_ON_EDGE = 1e-12  # [m]


@dataclass(frozen=True, eq=False)
class LegChains:
    """L legs of up to K joints of a Pinocchio model whose base stands at the origin.

    Among the J columns of a robot's joints those outside the legs belong to none.
    """

    model: pin.Model  #: The robot's joints; of its frames only the feet.
    names: tuple[str, ...]  #: Leg names.
    joints: tuple[tuple[int, ...], ...]  #: Indices in the model, from the base outward.
    frames: tuple[int, ...]  #: Of the feet.
    #: Of each leg's joints among the J, shape (L, K). Where a leg has fewer, its last joint's
    #: column stands once more: read with `by_leg`, write with `by_joint`.
    columns: NDArray[np.intp]
    size: int  #: J.

    @cached_property
    def counts(self) -> NDArray[np.intp]:
        """Joints of each leg, shape (L,)."""
        return np.array([len(path) for path in self.joints], dtype=np.intp)

    @cached_property
    def real(self) -> NDArray[np.bool_]:
        """Which joints exist, shape (L, K)."""
        real: NDArray[np.bool_] = np.arange(self.columns.shape[1]) < self.counts[:, None]
        return real

    @property
    def _each(self) -> list[pin.JointModel]:
        return [self.model.joints[k] for path in self.joints for k in path]

    @cached_property
    def hips(self) -> Array:
        """Origin of each leg's first joint in the base frame [m], shape (L, 3)."""
        return np.array([self.model.jointPlacements[path[0]].translation for path in self.joints])

    @cached_property
    def reach(self) -> Array:
        """Length of each leg stretched out, from its first joint [m], shape (L,)."""
        out = []
        for path, frame in zip(self.joints, self.frames, strict=True):
            ways = [self.model.jointPlacements[k] for k in path[1:]]
            ways.append(self.model.frames[frame].placement)
            out.append(float(sum(np.linalg.norm(way.translation) for way in ways)))
        return np.array(out)

    @cached_property
    def tangents(self) -> NDArray[np.intp]:
        """Columns of the joints in Pinocchio's velocities, shape (L, K); 0 where there is none."""
        out = np.zeros(self.real.shape, dtype=np.intp)
        out[self.real] = [joint.idx_v for joint in self._each]
        return out

    @cached_property
    def leg_of(self) -> NDArray[np.intp]:
        """Leg of every column, shape (J,); -1 outside the legs."""
        out = np.full(self.size, -1, dtype=np.intp)
        out[self.columns[self.real]] = np.nonzero(self.real)[0]
        return out

    def configurations(self, q: Array) -> Array:
        """Pinocchio's, all else neutral, at joint positions q [rad, m]: (N, L, K) to (N, nq)."""
        out = np.tile(pin.neutral(self.model), (len(q), 1))
        out[:, [joint.idx_q for joint in self._each]] = q[:, self.real]
        return out

    def of(self, leg: int) -> NDArray[np.intp]:
        """The columns of one leg, as many as it has joints."""
        return self.columns[leg, : self.counts[leg]]

    def by_leg(self, values: NDArray[Any]) -> NDArray[Any]:
        """Joints' values by leg, zero where a leg has no joint: (N, J) to (N, L, K)."""
        return np.where(self.real, values[:, self.columns], values.dtype.type(0))

    def of_legs(self, values: NDArray[Any]) -> NDArray[Any]:
        """A property of the joints by leg, zero where a leg has no joint: (J,) to (L, K)."""
        return self.by_leg(values[None])[0]

    def by_joint(self, values: Array, elsewhere: Array | float = 0.0) -> Array:
        """Legs' values by joint, `elsewhere` (J,) outside the legs: (N, L, K) to (N, J)."""
        out = np.empty((values.shape[0], self.size))
        out[:] = elsewhere
        out[:, self.columns[self.real]] = values[:, self.real]
        return out


def leg_chains(
    model: pin.Model,
    legs: Sequence[tuple[str, Sequence[str], str]],
    base_joint: int,
    joints: Sequence[str],
) -> LegChains:
    """Look the legs up in a model.

    `legs`: for each its name, its joints from the base outward and the foot frame. `base_joint`:
    index of the joint that carries the base (0 for a fixed one). `joints`: names of all columns.

    Raises:
        LegwattError: A joint or frame is missing, a joint is of several coordinates, or the joints
            are not those from the base to the foot.
    """
    paths, frames = [], []
    for leg, names, foot in legs:
        where, moving = f"leg '{leg}'", list(model.names)[1:]
        for name in names:
            known(f"{where}: the URDF has no joint that moves", name, moving)
        known(f"{where}: the URDF has no frame", foot, [f.name for f in model.frames])
        frames.append(model.frames[model.getFrameId(foot)])
        path = [k for k in model.supports[frames[-1].parentJoint] if k > base_joint]
        if (chain := [str(model.names[k]) for k in path]) != [*names]:
            words = f"list the joints outward from base to foot '{foot}': {', '.join(chain)}"
            raise LegwattError(f"{where}: {words}")
        if several := [name for name, k in zip(names, path, strict=True) if model.joints[k].nq > 1]:
            raise LegwattError(f"{where}: joint '{several[0]}' is of several coordinates")
        paths.append(tuple(path))
    lean = pin.Model()  # without the frames of sensors and shells, which would be placed each time
    for k in range(1, model.njoints):
        lean.addJoint(model.parents[k], model.joints[k], model.jointPlacements[k], model.names[k])
    feet = tuple(int(lean.addFrame(frame)) for frame in frames)
    at, depth = {name: k for k, name in enumerate(joints)}, max(map(len, paths), default=0)
    columns = [[at[n] for n in (*own, *[own[-1]] * (depth - len(own)))] for _, own, _ in legs]
    table = np.array(columns, dtype=np.intp).reshape(len(legs), depth)
    return LegChains(lean, tuple(leg for leg, *_ in legs), tuple(paths), feet, table, len(joints))


@dataclass(frozen=True)
class LegPosture:
    """Where the feet are and what the joints do to them, in the base frame."""

    feet: Array  #: Foot points [m], shape (N, L, 3).
    #: Velocity of the foot per unit of each joint's [m/rad, 1], shape (N, L, K, 3).
    columns: Array
    axes: Array  #: Unit axes of joints that turn, zero of those that slide, shape (N, L, K, 3).

    def force_torques(self, force: Array) -> Array:
        """Joint torques J^T f [N*m, N where a joint slides], shape (N, L, K).

        `force`: on the feet, in the base frame [N], shape (N, L, 3).
        """
        return np.asarray((self.columns @ force[..., None])[..., 0])

    @property
    def jacobians(self) -> Array:
        """Of the feet in the base frame [m/rad, 1], shape (N, L, 3 xyz, K)."""
        return self.columns.swapaxes(-1, -2)

    def drift(self, q_dot: Array) -> Array:
        """Acceleration of the feet while all joints keep their velocity [m/s^2], (N, L, 3).

        What a joint carries turns with all joints up to it, and its own turning moves with the
        motion of the foot that joints further out add. `q_dot`: [rad/s, m/s], shape (N, L, K).
        """
        spin, moved = self.axes * q_dot[..., None], self.columns * q_dot[..., None]
        further = moved.sum(axis=2, keepdims=True) - np.cumsum(moved, axis=2)
        rates = cross(np.cumsum(spin, axis=2), self.columns) + cross(self.axes, further)
        return np.asarray((rates * q_dot[..., None]).sum(axis=2))


def leg_posture(chains: LegChains, q: Array) -> LegPosture:
    """Work out the legs at joint positions q [rad, m], shape (N, L, K)."""
    model, data = chains.model, chains.model.createData()
    rows = chains.configurations(q)
    spatial = np.empty((len(rows), model.nv, 6))
    feet = np.empty((len(rows), len(chains.names), 3))
    # Views of what Pinocchio writes: asking for each anew would take most of the time.
    moved, places = data.J.T, [data.oMf[frame].translation for frame in chains.frames]
    for n, row in enumerate(rows):
        pin.computeJointJacobians(model, data, row)
        pin.updateFramePlacements(model, data)
        spatial[n] = moved
        feet[n] = places
    # Per unit of each joint's velocity: that of the point at the base's origin, and turning.
    # In memory components stand first and samples last, so that operations run over samples.
    by_leg = np.ascontiguousarray(spatial.transpose(2, 1, 0))[:, chains.tangents]
    by_leg *= chains.real[..., None]
    linear, axes = by_leg[:3].transpose(3, 1, 2, 0), by_leg[3:].transpose(3, 1, 2, 0)
    arm = np.ascontiguousarray(feet.transpose(2, 1, 0)).transpose(2, 1, 0)[:, :, None]
    return LegPosture(feet, linear + cross(axes, arm), axes)


def foot_positions(chains: LegChains, q: Array) -> Array:
    """Foot points in the base frame [m], (N, L, 3), at joint positions q [rad, m], (N, L, K)."""
    model, data = chains.model, chains.model.createData()
    feet = np.empty((len(q), len(chains.names), 3))
    places = [data.oMf[frame].translation for frame in chains.frames]
    for n, row in enumerate(chains.configurations(q)):
        pin.framesForwardKinematics(model, data, row)
        feet[n] = places
    return feet


def cross(a: Array, b: Array) -> Array:
    """Of vectors whose components stand along the last axis; several times as fast as NumPy's."""
    out = np.empty_like(a + b)
    for x, y, z in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        out[..., x] = a[..., y] * b[..., z] - a[..., z] * b[..., y]
    return out


def edge_distances(feet: Array, point: Array) -> tuple[Array, Array]:
    """How far points lie inside every edge of the feet's convex hull, seen from above.

    An edge is a line from one foot to another with all feet on it or to its left. `feet`: in any
    order [m], shape (N, F, 2 or more). `point`: shape (N, 2). Returns distances to the E lines
    between two feet [m], shape (N, E), infinite for lines that are no edge, and unit vectors to
    their left, shape (N, E, 2).
    """
    xy, n_feet = feet[..., :2], feet.shape[1]
    first, second = np.nonzero(~np.eye(n_feet, dtype=np.bool_))
    along = xy[:, second] - xy[:, first]
    inward = np.stack([-along[..., 1], along[..., 0]], axis=-1)
    with np.errstate(invalid="ignore"):  # of feet at one place no line is an edge
        inward /= np.linalg.norm(along, axis=-1, keepdims=True)
    others = np.concatenate([xy, point[:, None]], axis=1)
    left = np.einsum("nek,nepk->nep", inward, others[:, None] - xy[:, first, None])
    is_edge = (left[..., :-1] >= -_ON_EDGE).all(axis=-1)
    return np.where(is_edge, left[..., -1], np.inf), inward


def support_margin(feet: Array, point: Array) -> Array:
    """Distance of a point from the nearest edge of the feet's convex hull, seen from above.

    `feet`: [m], shape (N, F, 3). `point`: [m], shape (N, 2). Returns shape (N,); negative outside.
    """
    return np.asarray(edge_distances(feet, point)[0].min(axis=1))


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
        asked = (foot_acceleration - legs.drift(velocity))[:, exact]
        acceleration[:, exact, :3] = _solved(jacobian, asked)
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
