"""Motions the twin's machines make: a leg in the air, and pieces they are put together from."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.blind.twin.controller import Plan
from pipeline.blind.twin.errors import TwinError
from pipeline.motion.gait import gait_table
from pipeline.motion.transfer_path import transfer_path
from pipeline.robot.inverse_kinematics import solve_positions
from pipeline.robot.robot import Robot

Array = NDArray[np.float64]
CONTROL_PERIOD = 1e-3  # [s]
#: Room kept to the joint limits [rad].
_MARGIN = 0.1


def smooth_step(s: NDArray[np.floating]) -> Array:
    """From 0 to 1 with vanishing first and second derivatives at both ends."""
    u = np.clip(s, 0.0, 1.0).astype(np.float64)
    result: Array = u**3 * (10 - 15 * u + 6 * u * u)
    return result


def move(start: Array, end: Array, speed: float, period: float) -> Array:
    """Joint path from rest to rest at a stated peak speed, shape (N, J) [rad]."""
    furthest = float(np.abs(end - start).max())
    duration = max(1.875 * furthest / speed, 0.2)
    s = smooth_step(np.arange(1, round(duration / period) + 1) * (period / duration))
    return start + s[:, None] * (end - start)


def multisine(
    rng: np.random.Generator,
    centre: Array,
    amplitude: Array,
    duration: float,
    peak_speed: float,
    period: float,
) -> Array:
    """Five sines per joint from 0.1 to 2 Hz around a centre, from rest to rest.

    Args:
        rng: For frequencies and phases.
        centre: [rad], shape (J,).
        amplitude: Largest deflection [rad], shape (J,).
        duration: [s].
        peak_speed: Largest speed of any joint [rad/s].
        period: Between samples [s].

    Returns:
        Shape (N, J) [rad].
    """
    t = np.arange(1, round(duration / period) + 1) * period
    frequency = np.array([0.12, 0.3, 0.65, 1.1, 1.9])  # [Hz]
    weight = np.array([1.0, 0.6, 0.3, 0.12, 0.05])
    path = np.empty((t.size, centre.size))
    ramp = smooth_step(t / 0.8) * smooth_step((duration - t) / 0.8)
    for j in range(centre.size):
        f = frequency * rng.uniform(0.85, 1.15, 5)
        wave = np.sin(2 * np.pi * f * t[:, None] + rng.uniform(0, 2 * np.pi, 5)) @ weight
        wave = ramp * wave
        speed = float(np.abs(np.gradient(wave, period)).max())
        path[:, j] = wave * min(float(amplitude[j]) / float(np.abs(wave).max()), peak_speed / speed)
    return centre + path


def slow_passages(
    rng: np.random.Generator, start: Array, centre: Array, reach: Array, period: float
) -> Array:
    """Trapezoids there and back at falling speeds, each joint in its own order."""
    path = [start[None]]
    here = start
    for speed, stretch in ((0.6, 0.4), (0.2, 0.2), (0.05, 0.06), (0.2, 0.2)):
        inward = np.where(here > centre, -1.0, 1.0)
        turn = np.where(
            np.abs(here - centre) > 0.4 * reach, inward, rng.choice([-1.0, 1.0], centre.size)
        )
        target = here + turn * stretch * rng.uniform(0.7, 1.0, centre.size)
        path.append(_trapezoid(here, target, speed, period))
        here = target
    path.append(_trapezoid(here, centre, 0.5, period))
    return np.concatenate(path)[1:]


def _trapezoid(start: Array, end: Array, speed: float, period: float) -> Array:
    # One common time; acceleration over a quarter of it, blended to keep the jerk finite.
    distance = float(np.abs(end - start).max())
    duration = max(distance / speed * 4 / 3, 0.1)
    s = (np.arange(1, round(duration / period) + 1)) * (period / duration)
    grid = np.linspace(0, 1, 2001)
    rate = smooth_step(grid / 0.25) * smooth_step((1 - grid) / 0.25)
    area = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]))])
    return start + np.interp(s, grid, area / area[-1])[:, None] * (end - start)


def phase_profile(cycles: float, period_of_cycle: float, period: float) -> Array:
    """Gait phase from 0 to `cycles` with smooth start and stop, shape (N,)."""
    ramp = 0.5 * period_of_cycle * 0.5
    total = cycles * period_of_cycle + ramp
    t = np.arange(1, round(total / period) + 1) * period
    rate = smooth_step(t / ramp) * smooth_step((total - t) / ramp)
    phase = np.cumsum(rate)
    result: Array = phase * (cycles / phase[-1])
    return result


def step_table(robot: Robot, samples: int = 751) -> Array:
    """One closed period of every leg stepping alike, support first, shape (N, J) [rad].

    For a leg on a stand, whose robot file names no sets of legs that take turns.
    """
    spec = robot.spec
    stroke, lift = spec.parameters["foot_stroke"], spec.parameters["foot_lift"]
    phase = np.linspace(0.0, 1.0, samples)
    path = transfer_path(gait_table(spec).transfer_path)
    along = np.concatenate([0.5 - phase, 2 * path.advance(phase)[0] - phase - 0.5])
    up = np.concatenate([np.zeros(samples), path.lift(phase)[0]])
    neutral = np.array([leg.neutral_foot for leg in spec.legs])
    foot = np.repeat(neutral[None], 2 * samples, axis=0)
    foot[..., 0] += stroke * along[:, None]
    foot[..., 2] += lift * up[:, None]
    start = robot.start_posture
    q = solve_positions(robot.chains, foot, start, np.arange(2.0 * samples))
    return np.delete(robot.joint_positions(q), samples, axis=0)


def at_phase(table: Array, phase: Array) -> Array:
    """Cubic interpolation of a closed table at phases of any size, shape (N, J)."""
    n = table.shape[0] - 1
    x = np.mod(phase, 1.0) * n
    i = np.minimum(x.astype(np.intp), n - 1)
    u = (x - i)[:, None]
    p0, p1, p2, p3 = (table[(i + d) % n] for d in (-1, 0, 1, 2))
    result: Array = p1 + 0.5 * u * (
        p2 - p0 + u * (2 * p0 - 5 * p1 + 4 * p2 - p3 + u * (3 * (p1 - p2) + p3 - p0))
    )
    return result


def leg_plan(
    robot: Robot,
    rng: np.random.Generator,
    *,
    speed: float = 1.0,
    sections: tuple[str, ...] = ("multisine", "slow", "steps"),
) -> Plan:
    """Exciting motion of a leg on a stand: sines, slow passages, reversals, several speeds.

    Args:
        robot: Fixed base.
        rng: Draws the motion.
        speed: Factor on the speeds [1].
        sections: In order, each ``"multisine"``, ``"fast"``, ``"slow"`` or ``"steps"``.

    Raises:
        TwinError: An unknown section.
    """
    dt = CONTROL_PERIOD
    lower = robot.model.lowerPositionLimit[robot.position_index] + _MARGIN
    upper = robot.model.upperPositionLimit[robot.position_index] - _MARGIN
    centre = 0.5 * (lower + upper) + 0.1 * (upper - lower) * rng.uniform(-1, 1, lower.size)
    reach = np.minimum(upper - centre, centre - lower)
    pieces = [np.repeat(centre[None], round(0.3 / dt), axis=0)]
    for section in sections:
        here = pieces[-1][-1]
        if section == "multisine":
            pieces.append(multisine(rng, centre, 0.95 * reach, 3.6, 1.2 * speed, dt))
        elif section == "fast":
            pieces.append(multisine(rng, centre, 0.5 * reach, 3.0, 1.5 * speed, dt))
        elif section == "slow":
            pieces.append(slow_passages(rng, here, centre, reach, dt))
        elif section == "steps":
            table = step_table(robot)
            pieces.append(move(here, table[0], 1.0 * speed, dt))
            pieces.append(at_phase(table, phase_profile(1.0, 3.0 / speed, dt)))
            pieces.append(move(table[0], centre, 1.0 * speed, dt))
        else:
            raise TwinError(
                f"motion section '{section}' is not known: multisine, fast, slow or steps"
            )
    position = np.concatenate(pieces)
    return Plan(
        period=dt,
        position=position,
        velocity=np.gradient(position, dt, axis=0),
        feedforward=np.zeros_like(position),
        log_from=0.2,
    )
