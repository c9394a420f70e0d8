"""From prepared logs to what naming works on: channels, masks, speeds at which friction turns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve1d

from actuators.arrays import Array, Mask
from pipeline.logs.friction_sign import friction_sign
from pipeline.logs.prepared.measurement import Measurement, near_rest
from pipeline.logs.prepared.parts import Parts
from pipeline.logs.prepared.prepare import Prepared
from pipeline.logs.signals.derivatives import LARGEST_SHARE, LowPass, smoother_noise
from pipeline.logs.signals.grid import busiest, fill_gaps
from pipeline.machine.machine import MachineModel

#: Speed over which friction changes sign, as a share of the joint's fast speed.
REST_SHARE: Final = 0.003
#: ... and at least this many standard deviations of the velocity's noise.
REST_SIGMAS: Final = 3.0
#: What takes rows from the comparison ...
NO_MOTION: Final = "no motion, or within the filter's reach of none"
NO_EFFORT: Final = "no effort, or within the filter's reach of none"
AT_REST: Final = "within the filter's reach of standstill or reversal"
DRIVE_OFF: Final = "the drive is off"
STANCE: Final = "within the filter's reach of a change of stance"
#: ... and what to log instead.
INSTEAD: Final = {
    NO_MOTION: "log positions without gaps, or for longer",
    NO_EFFORT: "log its effort in every row, without gaps",
    AT_REST: "let it move further, or for longer between reversals",
    DRIVE_OFF: "log with the drive on, or state [controller] torque_off_bridge in a mapping file",
    STANCE: "log a slower gait, or foot forces and contacts",
}
#: Rows kept per period of the cut-off; predictions are made and filtered at this rate.
ROWS_PER_PERIOD: Final = 10.0
#: Shortest piece over which scatter is taken, in reaches of the filter to one side.
PIECE: Final = 3.0
#: Cut-off at which the sign of a speed is seen, in that of what is compared.
WIDER: Final = 4.0


def observe(
    model: MachineModel, prepared: Sequence[Prepared], parts: Parts
) -> tuple[Measurement, ...]:
    """Measurements of several logs, in their order.

    Args:
        model: Whose joints and legs the columns are.
        prepared: Logs at one bandwidth.
        parts: Of the same logs.
    """
    rest = _rest_speed(prepared)
    return tuple(
        _observe(model, one, parts.part[k], parts.block[k].astype(np.intp), rest)
        for k, one in enumerate(prepared)
    )


def observe_all(model: MachineModel, prepared: Sequence[Prepared]) -> tuple[Measurement, ...]:
    """Measurements with training rows alone, in one block: to look, not to judge."""
    rest = _rest_speed(prepared)
    return tuple(
        _observe(model, one, np.zeros(len(one), np.int8), np.zeros(len(one), np.intp), rest)
        for one in prepared
    )


def observe_chunk(
    model: MachineModel, one: Prepared, part: NDArray[np.int8], like: Measurement
) -> Measurement:
    """Measurement of a chunk of a longer log.

    Args:
        model: Whose joints and legs the columns are.
        one: The chunk; rows outside of its core do not count.
        part: Of its rows, shape (N,).
        like: Of the log as a whole: noise and rest speed.
    """
    block = np.full(len(one), -1, dtype=np.intp)
    core = np.zeros(len(one), dtype=np.bool_)
    core[one.core] = True
    counted = replace(one, mask=one.mask & core[:, None])
    m = _observe(model, counted, part, block, like.rest_speed)
    return replace(m, noise=like.noise)


def _subdivided(block: NDArray[np.intp], one: Prepared) -> NDArray[np.intp]:
    """Blocks cut into pieces of a few reaches of the filter: enough of them to see scatter."""
    length = max(2, int(np.ceil(PIECE * one.memory * one.rate)))
    out = np.full_like(block, -1)
    number = 0
    for b in np.unique(block[block >= 0]):
        rows = np.flatnonzero(block == b)
        pieces = max(1, rows.size // length)
        out[rows] = number + (np.arange(rows.size) * pieces) // rows.size
        number += pieces
    return out


def _observe(
    model: MachineModel,
    one: Prepared,
    part: NDArray[np.int8],
    block: NDArray[np.intp],
    rest: Array,
) -> Measurement:
    channels, effort, noise = _channels(model, one)
    known = one.mask
    idle = _idle(one, channels)
    if idle is not None:
        effort[idle] = 0.0
        within = np.zeros(len(one), dtype=np.bool_)
        within[one.core] = np.asarray(one.motion_ok[one.core]).all(axis=1)
        known = known | (idle & within[:, None])
    standing, force = _contact(model, one)
    known = known & np.isfinite(effort).all(axis=2)
    mask, clear, removed = _counted(one, known, rest, idle, stepping=standing is not None)
    rows, pieces, step = _thinned(one)
    sign, unsure = _signs(one, step)
    lowpass = LowPass(one.rate / step, one.cutoff)

    def smooth(x: Array) -> Array:
        out = np.empty_like(x)
        for piece in pieces:
            out[piece] = lowpass.smooth(x[piece])
        return out

    def kept(x: Array | None) -> Array | None:
        return None if x is None else x[rows]

    open_winding = None
    if one.torque_off is not None and idle is not None and one.log.torque_off_bridge == "open":
        open_winding = one.torque_off[rows]
    return Measurement(
        name=one.log.name,
        time=one.time[rows],
        joints=one.joints,
        q=one.q[rows],
        v=one.v[rows],
        a=one.a[rows],
        channels=channels,
        effort=np.nan_to_num(effort[rows]),
        noise=noise,
        mask=mask[rows],
        part=part[rows],
        block=_subdivided(block, one)[rows],
        pieces=pieces,
        lowpass=smooth,
        kernel=lowpass.kernels[0],
        bandwidth=one.cutoff,
        at_motor=one.log.position_source == "motor",
        rest_speed=rest,
        base_roll=kept(one.base_roll),
        base_pitch=kept(one.base_pitch),
        standing=None if standing is None else standing[rows],
        foot_force=kept(force),
        open_winding=open_winding,
        temperature=kept(_temperature(one)),
        sign=sign[rows],
        unsure=unsure[rows],
        known=clear[rows],
        rate_noise=one.fusion.noise,
        foot_noise=_foot_noise(one),
        removed=removed,
        sha256=one.log.sha256,
    )


def _signs(one: Prepared, step: int) -> tuple[Array, Array]:
    """Expected sign of friction and how unsure it is, each (N, J), as means of `step` rows."""
    lowpass = one.settings.lowpass
    wide = LowPass(one.rate, min(WIDER * one.cutoff, LARGEST_SHARE * one.rate))
    values, good = one.log.position, one.usable[0]
    q = one.grid.resample(fill_gaps(one.log.time, values, good))
    quantum = _quantum(values)
    white = smoother_noise(q, one.motion_ok, busiest(q, one.pieces), lowpass, in_band=False)
    white = np.maximum(np.nan_to_num(white), quantum / np.sqrt(12.0))
    noises = [white * np.sqrt((band.kernels[1] ** 2).sum()) for band in (lowpass, wide)]
    noise = np.where(one.fusion.weight[0] > 0.0, one.fusion.noise[0], noises[0])
    speed = wide.derivatives(q, one.pieces)[1]
    sign, unsure = friction_sign(
        one.v, noise, speed, noises[1], one.pieces, lowpass.kernels[0], one.rate / one.cutoff
    )
    # Rows that are left out have a say in those that stay.
    weight = np.ones(2 * (step // 2) + 1)
    for piece in one.pieces if step > 1 else ():
        sign[piece] = convolve1d(sign[piece], weight / weight.size, axis=0, mode="nearest")
    return sign, unsure


def _quantum(x: Array) -> Array:
    """Least step of columns (N, J), shape (J,); zero of one that has none, or steps of any size."""
    out = np.zeros(x.shape[1])
    for j, column in enumerate(x.T):
        steps = np.abs(np.diff(column[np.isfinite(column)]))
        steps = steps[steps > 0.0]
        if steps.size and (np.abs(steps / steps.min() % 1.0 - 0.5) > 0.4).mean() > 0.9:
            out[j] = steps.min()
    return out


def _counted(
    one: Prepared, known: Mask, rest: Array, idle: Mask | None, *, stepping: bool
) -> tuple[Mask, Mask, tuple[tuple[str, Array], ...]]:
    """Rows that count, those of a known effort and motion, (N, J), and what took the others.

    Args:
        one: The log.
        known: Where the effort is known, shape (N, J).
        rest: Rest speed, shape (J,) [rad/s].
        idle: Rows in which a drive that is off shows what flows, shape (N, J), or None.
        stepping: Whether the robot walks.
    """
    moved = np.asarray(one.motion_ok.all(axis=1, keepdims=True))
    takers = {
        NO_MOTION: ~moved,
        NO_EFFORT: ~known,
        AT_REST: near_rest(one.v, rest, one.pieces, one.rate, one.cutoff),
    }
    if one.torque_off is not None:
        takers[DRIVE_OFF] = one.torque_off if idle is None else one.torque_off & ~idle
    if stepping:
        takers[STANCE] = one.near_event()[:, None]
    left, removed = np.ones((len(one), len(one.joints)), dtype=np.bool_), []
    for why, taken in takers.items():
        lost = left & taken
        if lost.any():
            removed.append((why, np.asarray(lost.mean(axis=0))))
            left &= ~lost
    clear = np.ones_like(left)
    for why, taken in takers.items():
        clear &= ~taken if why not in (AT_REST, STANCE) else True
    return left, clear, tuple(removed)


def _idle(one: Prepared, channels: tuple[str, ...]) -> Mask | None:
    """Rows whose filter sees nothing but a drive that is off and tells what flows, (N, J), or None.

    With an open winding no current flows, with a shorted one no voltage is applied; either way the
    compared effort is zero, and the motion alone says what friction and inertia are.
    """
    off, bridge = one.torque_off, one.log.torque_off_bridge
    told = {"open": ("voltage", "current", "power"), "shorted": ("voltage",)}
    if off is None or bridge is None or len(channels) > 1 or channels[0] not in told[bridge]:
        return None
    out = np.zeros(off.shape, dtype=np.bool_)
    for piece in one.pieces:
        out[piece] = one.settings.lowpass.share(~off[piece]) <= 1e-9
    return out


def _temperature(one: Prepared) -> Array | None:
    """Of the motors, shape (N, J) [degC]; None where some joint's sensor is silent somewhere."""
    temperature = one.other.get("temperature")
    return None if temperature is None or not np.isfinite(temperature).all() else temperature


def _thinned(one: Prepared) -> tuple[NDArray[np.intp], tuple[slice, ...], int]:
    """Rows that say all that the bandwidth holds, their pieces, and the step between them.

    A series filtered to a bandwidth repeats itself beyond a few samples per period of the cut-off.
    """
    step = max(1, int(one.rate / (ROWS_PER_PERIOD * one.cutoff)))
    rows, pieces, at = [], [], 0
    for piece in one.pieces:
        part = np.arange(piece.start, piece.stop, step)
        rows.append(part)
        pieces.append(slice(at, at + part.size))
        at += part.size
    return np.concatenate(rows), tuple(pieces), step


def _channels(model: MachineModel, one: Prepared) -> tuple[tuple[str, ...], Array, Array]:
    """Compared channel, and voltage beside a current: it separates speed from resistance."""
    efforts, noise, names = [one.effort], [one.noise], [one.channel]
    motors = all(a.motor is not None for a in model.actuators)
    if one.channel == "current" and "voltage" in one.other and motors:
        raw = one.other["voltage"]  # at the log's own bandwidth or above this one
        good = np.isfinite(raw)
        filled = np.where(good, raw, 0.0)
        names.append("voltage")
        efforts.append(np.where(good, one.lowpass(filled), np.nan))
        noise.append(smoother_noise(filled, good, one.pieces, one.settings.lowpass, in_band=True))
    floor = np.stack(noise, axis=1)
    # A joint without enough good samples has no floor of its own; it is masked anyway.
    usual = np.nanmedian(floor, axis=0) if np.isfinite(floor).any() else np.ones(floor.shape[1])
    return tuple(names), np.stack(efforts, axis=2), np.where(np.isfinite(floor), floor, usual)


def _foot_noise(one: Prepared) -> float | None:
    """Of a component of a foot's force within the bandwidth [N], or None."""
    if one.log.foot_force is None:
        return None
    flat = one.log.foot_force.reshape(len(one.log), -1)
    raw = one.grid.resample(fill_gaps(one.log.time, flat, np.isfinite(flat)))
    good = np.ones_like(raw, dtype=np.bool_)
    if one.contact is not None:
        # Sensors of feet in the air may show nothing at all.
        good &= np.repeat(one.contact.standing, 3, axis=1)
    found = smoother_noise(raw, good, one.pieces, one.settings.lowpass, in_band=True)
    found = found[np.isfinite(found) & (found > 0.0)]
    return float(np.median(found)) if found.size else None


def _rest_speed(prepared: Sequence[Prepared]) -> Array:
    """Shape (J,) [rad/s]."""
    fast = np.max([np.quantile(np.abs(one.v), 0.95, axis=0) for one in prepared], axis=0)
    noise = np.max([one.fusion.noise[0] for one in prepared], axis=0)
    return np.maximum(np.maximum(REST_SHARE * fast, REST_SIGMAS * noise), 1e-6)


def _contact(model: MachineModel, one: Prepared) -> tuple[Mask | None, Array | None]:
    """Which feet stand, and forces; in the model's order of legs."""
    if not model.floating or model.legs is None or one.contact is None:
        return None, None
    order = [one.contact.feet.index(leg) for leg in model.legs.names]
    standing = one.contact.standing[:, order]
    if one.foot_force is None:
        return standing, None
    feet = [one.log.feet.index(leg) for leg in model.legs.names]
    force = one.foot_force[:, feet]
    raw = one.log.foot_force
    assert raw is not None
    # A component that no column gives is NaN from end to end.
    absent = np.asarray(np.isnan(raw).all(axis=0))[feet]
    force = np.where(absent[None], np.nan, np.nan_to_num(force))
    # Sensors of feet in the air show noise alone.
    force = np.where(standing[..., None] | absent[None], force, 0.0)
    return standing, np.where(standing[..., None], force, 0.0)
