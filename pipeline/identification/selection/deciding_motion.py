"""The motion that decides between effects between which a log cannot decide.

A few motions of the field (sweeps at several speeds, fast sines, slow turns through the travel,
holds in different postures) are tried in simulation, each inside the limits of position and
velocity. For each the rival is fitted to what the named effect would add; the motion on which the
best fit misses most, in units of the noise, is the one to log.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from pipeline.effects.base import Effect, Place, Values
from pipeline.effects.motor import TorqueRipple
from pipeline.logs.log_format import Expected
from pipeline.logs.prepared.measurement import TRAIN, Measurement
from pipeline.machine.machine import MachineModel
from pipeline.simulation.predict import Prediction, Simulator

RATE: Final = 100.0  # [Hz]
DURATION: Final = 16.0  # [s]
REST: Final = 1.0  # at both ends [s]
#: Part of the room to a limit that a motion uses.
SHARE_OF_ROOM: Final = 0.8
SHARE_OF_SPEED: Final = 0.5
#: Where a joint has no limit.
FREE_TRAVEL: Final = 1.0  # [rad]
FREE_SPEED: Final = 2.0  # [rad/s]


_ORDERS = 5  # of a ripple that imitates, the strongest ones
_SHRINKINGS: Final = 12


@dataclass(frozen=True)
class Rival:
    """An effect at a place, at the parameters that explain the log."""

    effect: Effect  #: The effect.
    place: Place  #: Where.
    values: Values | None = None  #: Its parameters; None where only its kind is known.


@dataclass(frozen=True, eq=False)
class Deciding:
    """A motion and how well it decides."""

    name: str  #: Of the motion, in words.
    time: Array  #: Shape (N,) [s].
    position: Array  #: Shape (N, J) [rad].
    misfit: float  #: What the best-fitting rival misses, in noise floors.


def deciding_motion(
    model: MachineModel,
    m: Measurement,
    expected: Expected,
    named: Rival,
    others: Sequence[Rival],
    *,
    posture: Array | None = None,
    movable: Sequence[int] | None = None,
    stance: Sequence[str] | None = None,
    allowed: Callable[[Array], bool] | None = None,
) -> Deciding | None:
    """The motion on which the named effect and its rivals differ most.

    Args:
        model: Without any of them.
        m: A log, for channels, noise and bandwidth.
        expected: Limits of the joints.
        named: With its values.
        others: Its rivals.
        posture: About which to move, shape (J,) [rad]; the log's middle by default.
        movable: Columns that may move; all by default.
        stance: Legs that stand meanwhile; those that stand most often in the log by default.
        allowed: Whether positions (N, J) keep clear of ground and neighbours; strokes shrink until
            they do.

    Returns:
        None where no motion separates them by as much as the noise.
    """
    assert named.values is not None
    middle = 0.5 * (m.q.min(axis=0) + m.q.max(axis=0)) if posture is None else posture
    columns = list(range(len(m.joints))) if movable is None else list(movable)
    best: Deciding | None = None
    for name, shape in MOTIONS.items():
        time, q = _motion(shape, middle, columns, expected)
        for _ in range(_SHRINKINGS):
            if allowed is None or allowed(q):
                break
            q = middle + 0.75 * (q - middle)
        else:
            continue
        trial = _measurement(m, time, q, _stance(model, m, stance))
        misfit = min(_misfit(model, trial, named, other) for other in others)
        if misfit > 1.0 and (best is None or misfit > best.misfit):
            best = Deciding(name, time, q, misfit)
    return best


def _misfit(model: MachineModel, m: Measurement, named: Rival, other: Rival) -> float:
    """RMS over the joints they touch of what the rival cannot imitate, in noise floors."""
    simulator = Simulator(m)
    base = simulator.predict(model)
    assert named.values is not None
    target = _whitened(simulator, base, named.effect.apply(model, named.place, named.values))
    shapes = _shapes(model, m, other, target)
    left = [target - _imitated(simulator, base, other, shape, target) for shape in shapes]
    # A rival that this motion leaves without any shape imitates nothing.
    smallest = min((float((rest**2).sum()) for rest in left), default=float((target**2).sum()))
    touched = int((np.abs(target).max(axis=0) > 0).any(axis=-1).sum())
    return float(np.sqrt(smallest / max(touched * len(m), 1)))


def _shapes(
    model: MachineModel, m: Measurement, other: Rival, target: Array
) -> list[dict[str, float]]:
    """Nonlinear parameters with which a rival may imitate; of a ripple the strongest orders."""
    if not isinstance(other.effect, TorqueRipple):
        return other.effect.shapes(model, m, other.place)
    j = model.index(other.place[0])
    return other.effect.strongest(m, j, slice(None), target[:, j, 0], _ORDERS)


def _imitated(
    simulator: Simulator, base: Prediction, other: Rival, shape: Values, target: Array
) -> Array:
    """The rival's best fit to the target, linear in its coordinates."""
    zero = {c.name: 0.0 for c in other.effect.coordinates}
    columns = []
    for c in other.effect.coordinates:
        moved = other.effect.edit(base.model, other.place, zero | {c.name: c.step}, shape)
        columns.append(_whitened(simulator, base, moved).ravel() / c.step)
    X = np.stack(columns, axis=1)
    solution = np.linalg.lstsq(X, target.ravel(), rcond=None)[0]
    return np.asarray((X @ solution).reshape(target.shape))


def _whitened(simulator: Simulator, base: Prediction, model: MachineModel) -> Array:
    """Change of the prediction over the noise floor, (N, J, C)."""
    change = simulator.predict(model, base).effort - base.effort
    return np.asarray(change / simulator.measurement.noise)


def _measurement(
    like: Measurement, time: Array, q: Array, stance: NDArray[np.bool_] | None
) -> Measurement:
    """A motion as if it had been measured: the efforts are not used."""
    n, j = q.shape
    v = np.gradient(q, time, axis=0)
    return replace(
        like,
        name="motion",
        time=time,
        q=q,
        v=v,
        a=np.gradient(v, time, axis=0),
        effort=np.zeros((n, j, len(like.channels))),
        mask=np.ones((n, j), dtype=np.bool_),
        part=np.full(n, TRAIN, dtype=np.int8),
        block=np.zeros(n, dtype=np.intp),
        pieces=(slice(0, n),),
        lowpass=_same,
        base_roll=None,
        base_pitch=None,
        standing=None if stance is None else np.repeat(stance, n, axis=0),
        foot_force=None,
        open_winding=None,
        temperature=None if like.temperature is None else np.tile(like.temperature.mean(0), (n, 1)),
    )


def _same(x: Array) -> Array:
    return x


def _stance(
    model: MachineModel, m: Measurement, names: Sequence[str] | None
) -> NDArray[np.bool_] | None:
    """Which legs stand, shape (1, F); None on a stand."""
    if m.standing is None:
        return None
    if names is not None and model.legs is not None:
        return np.array([[leg in names for leg in model.legs.names]])
    patterns, count = np.unique(m.standing, axis=0, return_counts=True)
    return np.asarray(patterns[[int(np.argmax(count))]])


def _motion(
    shape: Callable[[Array, int], Array], middle: Array, columns: Sequence[int], expected: Expected
) -> tuple[Array, Array]:
    """A motion about a posture, scaled into the limits, at rest at both ends."""
    time = np.arange(round(DURATION * RATE) + 1) / RATE
    fade = np.clip(np.minimum(time, DURATION - time) / REST, 0.0, 1.0)
    fade = fade**3 * (10 - 15 * fade + 6 * fade**2)  # at rest, with continuous acceleration
    q = np.tile(middle, (time.size, 1))
    for number, j in enumerate(columns):
        wave = fade * shape(time, number)
        room = min(expected.upper[j] - middle[j], middle[j] - expected.lower[j])
        room = SHARE_OF_ROOM * max(float(room), 0.0) if np.isfinite(room) else FREE_TRAVEL
        speed = float(expected.velocity_limit[j])
        speed = SHARE_OF_SPEED * speed if np.isfinite(speed) else FREE_SPEED
        fastest = float(np.abs(np.gradient(wave, time)).max())
        q[:, j] += wave * min(room / max(float(np.abs(wave).max()), 1e-9), speed / fastest)
    return time, q


def _sweeps(t: Array, joint: int) -> Array:
    """Sines of one amplitude whose speed rises: friction against speed."""
    phase = 2 * np.pi * (0.08 * t + 0.5 * (0.9 - 0.08) / DURATION * t**2)
    return np.sin(phase + 0.7 * joint)


def _fast(t: Array, joint: int) -> Array:
    """Small fast sines: inertia, delay, elasticity."""
    base = 1.1 + 0.27 * joint
    return np.sin(2 * np.pi * base * t) + 0.5 * np.sin(2 * np.pi * 1.7 * base * t + 1.0)


def _slow(t: Array, joint: int) -> Array:
    """Slow and even through the travel, back and forth: ripple, springs, weight."""
    cycles = 1.0 + 0.5 * joint
    triangle = 2 / np.pi * np.arcsin(np.sin(2 * np.pi * cycles * t / DURATION))
    return np.asarray(triangle)


def _postures(t: Array, joint: int) -> Array:
    """Short strokes in clearly different postures: load against speed."""
    slow = np.sin(2 * np.pi * t / DURATION * (1 + 0.5 * joint))
    return np.asarray(slow + 0.25 * np.sin(2 * np.pi * 0.8 * t + 0.9 * joint))


def _singles(t: Array, joint: int) -> Array:
    """One joint after another: what belongs to which."""
    window = DURATION / 3
    inside = (t >= (joint % 3) * window) & (t < (joint % 3 + 1) * window)
    envelope = np.sin(np.pi * ((t - (joint % 3) * window) / window)) ** 2
    return np.where(inside, envelope * np.sin(2 * np.pi * 0.5 * t), 0.0)


MOTIONS: Final = {
    "sweeps of rising speed": _sweeps,
    "fast sines": _fast,
    "slow turns through the travel": _slow,
    "strokes in different postures": _postures,
    "one joint after another": _singles,
}
