"""From rows as read to one grid and one bandwidth, column by column.

Several logs share one grid and one cut-off, chosen by what their channels hold. All series pass the
same zero-phase low-pass; then rows that say nothing more are dropped.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Final, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from actuators.arrays import Array, Mask
from actuators.errors import LegwattError
from pipeline.logs.checks import own_spacing, quantum
from pipeline.logs.filters import (
    EVERY,
    FLAT,
    LARGEST_SHARE,
    SEEN,
    Grid,
    LowPass,
    Rows,
    busiest,
    choose_cutoff,
    fill_gaps,
    long_runs,
    reach_of_motion,
    smoother_noise,
    uniform_grid,
)
from pipeline.logs.log import UNUSED, Log, Recording
from pipeline.logs.speeds import friction_sign, weigh, within
from pipeline.robot.kinematics import foot_positions
from pipeline.robot.robot import Robot

#: A foot stands above this share of the largest vertical force any foot carries ...
TOUCH: Final = 0.05
#: ... and lifts off below this one, so that noise does not make it chatter.
LIFT: Final = 0.02
#: A foot this near to the lowest foot stands [m].
LOWEST: Final = 0.005
#: Share of a log's rows by which its noise can be told.
_CALM: Final = 0.1


class Contact(NamedTuple):
    """Which feet stand."""

    standing: Mask  #: Shape (N, F), legs as the robot has them.
    source: str  #: ``"forces"``, ``"columns"`` or ``"lowest feet"``.


def find_contact(log: Recording, robot: Robot | None = None) -> Contact | None:
    """Contact from forces, else contact columns, else the lowest feet.

    Args:
        log: As read.
        robot: With legs; None for one whose feet nothing but its log tells of.
    """
    force, touching = log.foot_force, log.contact
    if force is not None:
        return Contact(_standing_by_force(force[..., 2]), "forces")
    if touching is not None:
        return Contact(touching, "columns")
    return None if robot is None else Contact(_lowest(robot, log), "lowest feet")


def changes(standing: Mask, pieces: Sequence[slice]) -> Mask:
    """Rows to either side of a change of each foot's stance, (N, F), none across gaps."""
    out = np.zeros_like(standing)
    for piece in pieces:
        own, changed = standing[piece], out[piece]
        changed[1:] = own[1:] != own[:-1]
        changed[:-1] |= changed[1:]
    return out


def _standing_by_force(normal: Array) -> Mask:
    """Schmitt trigger on the vertical force, shape (N, F)."""
    full = max(float(np.nanmax(normal, initial=0.0)), 1e-9)
    decided = np.where(normal > TOUCH * full, 1.0, np.where(normal < LIFT * full, 0.0, np.nan))
    # Undecided samples keep the last decision.
    return np.asarray(pd.DataFrame(decided).ffill().to_numpy() > 0.5)


def _lowest(robot: Robot, log: Recording) -> Mask:
    """Feet (N, F) within `LOWEST` of the lowest one along the vertical."""
    n, shaped = len(log), robot.chains.by_leg(log.position)
    feet = np.concatenate(
        [foot_positions(robot.chains, shaped[i : i + 4096]) for i in range(0, n, 4096)]
    )
    angles = (log.of("base_roll"), log.of("base_pitch"))
    r, p = (np.zeros(n) if angle is None else angle for angle in angles)
    # Third row of R_y(pitch) R_x(roll): the vertical in the base frame.
    up = np.stack([-np.sin(p), np.sin(r) * np.cos(p), np.cos(r) * np.cos(p)], axis=-1)
    height = np.einsum("nfi,ni->nf", feet, up)
    return np.asarray(height <= height.min(axis=1, keepdims=True) + LOWEST)


def calm_rows(contact: Contact | None, grid: Grid, lowpass: LowPass) -> Mask:
    """Rows (N,) of a grid by which noise is told: no filter there sees a change of stance.

    The ground's forces jump at one, and legs change stance so often that such rows may be half of
    all: a median takes their jumps for noise. All rows where hardly any other is left.
    """
    if contact is None:
        return np.ones(grid.time.size, dtype=np.bool_)
    change = changes(contact.standing[grid.nearest], grid.pieces)
    calm = np.asarray(~within(change, grid.pieces, 2 * lowpass.half).any(axis=1))
    return calm if calm.mean() > _CALM else np.ones_like(calm)


def feet_on_rows(
    log: Recording,
    contact: Contact,
    grid: Grid,
    rows: Rows,
    force: Array | None,
    quiet: tuple[Mask, LowPass],
) -> dict[str, Any]:
    """Which feet stand, their forces [N] as filtered, and the noise of a sample of one's component.

    Sensors of feet in the air show noise alone, or nothing at all.
    """
    stands = contact.standing[grid.nearest]
    standing, measured = stands[rows], log.foot_force
    if force is None or measured is None:
        return {"standing": standing}
    # A component that no column gives is NaN from end to end.
    absent = np.isnan(measured).all(axis=0)
    force = np.where(standing[..., None], np.where(absent, np.nan, force), 0.0)
    flat = grid.resample(np.nan_to_num(measured.reshape(len(log), -1)))
    good = np.repeat(stands & quiet[0][:, None], 3, axis=1)
    shaking = smoother_noise(flat, good, grid.pieces, quiet[1])
    shaking = shaking[np.isfinite(shaking) & (shaking > 0.0)]
    floor = float(np.median(shaking)) if shaking.size else None
    return {"standing": standing, "foot_force": force, "foot_noise": floor}


#: The kernel may not be longer than this share of the log.
LONGEST_KERNEL: Final = 0.1
#: Cut-off per own rate of a channel: bridging by straight lines takes 5 % at that frequency.
OWN_SHARE: Final = 0.125
#: Share of the kernel's weight that may fall on missing samples before the output is masked.
TOLERATED_SHARE: Final = 0.05
#: Rows kept per period of the cut-off; predictions are made and filtered at this rate.
ROWS_PER_PERIOD: Final = 10.0
#: Cut-off at which the sign of a speed is seen, in that of what is compared.
WIDER: Final = 4.0
#: What takes rows from the comparison ...
NO_MOTION: Final = "no motion, or within the filter's reach of none"
NO_EFFORT: Final = "no effort, or within the filter's reach of none"
DRIVE_OFF: Final = "the drive is off"
AT_REST: Final = "within the filter's reach of standstill or reversal"
STANCE: Final = "within the filter's reach of a change of stance"
#: ... and what to log instead.
INSTEAD: Final = {
    AT_REST: "let it move further, or for longer between reversals",
    STANCE: "log a slower gait, or foot forces and contacts",
    NO_MOTION: "log positions without gaps, or for longer",
    NO_EFFORT: "log its effort in every row, without gaps",
    DRIVE_OFF: "log with the drive on, or state [controller] torque_off_bridge in a mapping file",
}


@dataclass(frozen=True)
class Settings:
    """How logs are brought to one grid and bandwidth; the same for all logs that are compared."""

    dt: float  #: Step of the uniform grid [s].
    cutoff: float  #: Of the low-pass [Hz].
    reason: str  #: How the cut-off was chosen, in words.
    #: Least cut-off that passes the joints' motion as it is, above which there is noise [Hz].
    least: float = 0.0
    thinned: bool = True  #: Whether rows that say nothing more are dropped.

    @property
    def lowpass(self) -> LowPass:
        """The filter on the grid."""
        return LowPass(1.0 / self.dt, self.cutoff)

    @property
    def bridged(self) -> float:
        """Time between good samples up to which values are interpolated [s]."""
        return 1.0 / (4.0 * self.cutoff)

    @property
    def step(self) -> int:
        """Rows of the grid per row that is kept."""
        most = 1.0 / self.dt / (ROWS_PER_PERIOD * self.cutoff)
        return max(1, int(most + 1e-9)) if self.thinned else 1


def choose_settings(
    logs: Sequence[Recording],
    *,
    cutoff: float | None = None,
    thinned: bool = True,
) -> Settings:
    """Choose one grid and one cut-off for several logs, by their good positions and efforts.

    The cut-off [Hz] is the user's, or the lowest any moving joint asks for (`choose_cutoff`), so
    that no joint's accelerations are mostly noise; the torque of every joint depends on those of
    the others. It is at most `OWN_SHARE` of the slowest channel's own rate, whatever the rows'.

    Raises:
        LegwattError: The user's cut-off does not fit the rate or the length; no joint moves.
    """
    # The slowest log decides: its band holds nothing above.
    dt = max(float(np.median(np.diff(log.clock))) for log in logs)
    rate, longest = 1.0 / dt, max(float(np.ptp(log.time)) for log in logs)
    smallest, most = 4.0 / (LONGEST_KERNEL * longest), LARGEST_SHARE * rate
    if smallest > most:
        raise LegwattError(
            f"{logs[0].name}: {longest:.3g} s at {rate:.4g} Hz are too short to be filtered; "
            "log longer or faster"
        )
    if cutoff is not None and not smallest <= cutoff <= most:
        raise LegwattError(
            f"cut-off {cutoff:g} Hz; logs of {longest:.3g} s at {rate:.4g} Hz allow "
            f"{smallest:.3g} to {most:.4g} Hz"
        )
    held = max(min(map(_held, logs)), smallest)
    asked, moved = [], []
    for log in logs:
        grid = uniform_grid(log.time, dt, bridge=1.0 / (4.0 * held))
        parts = [p for p in _busy(log, grid) if p.stop - p.start >= 64]
        raw = [_position(log, j, grid) for j in range(len(log.joints))] if parts else []
        stretches = [np.stack([q[part] for q in raw], axis=1) for part in parts]
        if stretches:
            step = np.array([quantum(log.position_of(joint))[0] for joint in log.joints])
            asked.append(choose_cutoff(stretches, rate, smallest=smallest, step=step))
            moved.append(reach_of_motion(stretches, rate, step) / FLAT)
    least = min(max(moved, default=0.0), most, held)
    if cutoff is not None:
        return Settings(dt, float(cutoff), "set by the user", least, thinned)
    per_joint = np.fmin.reduce(asked) if asked else np.full(1, np.nan)
    if np.isnan(per_joint).all():
        every = (
            log.position_of(joint)[ok]
            for log in logs
            for joint, ok in zip(log.joints, log.good[0].T, strict=True)
        )
        long = (x for x in every if x.size >= 10)
        # Further than positions scatter from row to row.
        if not any(np.ptp(x) > SEEN * np.median(np.abs(np.diff(x, n=2))) for x in long):
            raise LegwattError(f"{logs[0].name}: no joint moves; nothing can be compared")
        # Turned at a steady speed: such a motion has no spectrum, and any bandwidth holds it.
        reason = "joints turn at steady speeds: as much as the rate holds"
        return Settings(dt, min(most, held), reason, thinned=thinned)
    slowest = int(np.nanargmin(per_joint))
    value = float(per_joint[slowest])
    reason = f"position spectrum of {logs[0].joints[slowest]} meets its noise"
    if value < least:
        value, reason = least, "the motion reaches as far, whatever the noise"
    if value > held:
        value = held
        reason = f"the slowest channel holds no more: one sample in {1e3 * OWN_SHARE / held:.3g} ms"
    return Settings(dt, value, reason, least, thinned)


def _held(log: Recording) -> float:
    """Highest frequency that the slowest channel of a log holds [Hz]."""
    own = log.clock
    steps = [own_spacing(own, np.ones(own.size, dtype=np.bool_))]
    for good in log.good:
        sparse = np.flatnonzero(good.any(axis=0) & ~good.all(axis=0))
        steps += [own_spacing(log.time, good[:, j]) for j in sparse]
    slowest = max(step for step in steps if np.isfinite(step))
    # A step or two more than usual is what interpolation bridges anyway.
    return OWN_SHARE / slowest if slowest > 1.9 * float(np.median(np.diff(own))) else np.inf


def _position(log: Recording, j: int, grid: Grid) -> Array:
    """Positions of joint `j` on the grid, bad ones bridged, shape (M,) [rad]."""
    return grid.resample(fill_gaps(log.time, log.position_of(log.joints[j]), log.good[0][:, j]))


def _busy(log: Recording, grid: Grid) -> list[slice]:
    """Stretches of the grid in which joints move most."""
    coarse = [_position(log, j, grid)[::EVERY] for j in range(len(log.joints))]
    return busiest(np.stack(coarse, axis=1), grid.pieces)


def reduced(log: Recording, settings: Settings, robot: Robot | None = None) -> Log:
    """Bring a log to its grid and bandwidth. Its rows have no part yet.

    Args:
        log: As read.
        settings: From `choose_settings`.
        robot: Whose feet stand; None for a fixed base.
    """
    lowpass, joints = settings.lowpass, len(log.joints)
    grid = uniform_grid(log.time, settings.dt, bridge=settings.bridged)
    rows, pieces = _thinned(grid, settings.step)
    busy, usable, contact = _busy(log, grid), log.good, find_contact(log, robot)
    above = LowPass(lowpass.rate, max(settings.cutoff, settings.least))
    calm = calm_rows(contact, grid, above)
    clear = lowpass.share(np.zeros(grid.time.size, dtype=np.bool_), grid.pieces)
    wide = LowPass(lowpass.rate, min(WIDER * lowpass.cutoff, LARGEST_SHARE * lowpass.rate))
    near = 2 * (settings.step // 2) + 1
    channels: tuple[str, ...] = (log.effort,)
    if log.effort == "current" and log.of("voltage") is not None:
        channels = ("current", "voltage")
    shape = rows.size, joints
    q, v, a, sign, unsure, plain, windup, a_noise = (np.full(shape, np.nan) for _ in range(8))
    moved, felt = (np.zeros(shape, dtype=np.bool_) for _ in range(2))
    effort = np.full((*shape, len(channels)), np.nan)
    noise = np.full((joints, len(channels)), np.nan)
    rate_noise = np.zeros((2, joints))

    def on_grid(x: Array, ok: Mask) -> tuple[Array, Mask, Mask]:
        """Values, short holes bridged; where they are missing; where the filter sees enough."""
        missing = grid.flags(long_runs(log.time, ~ok, settings.bridged))
        share = lowpass.share(missing, grid.pieces) if missing.any() else clear
        return grid.resample(fill_gaps(log.time, x, ok)), missing, share <= TOLERATED_SHARE

    def white(x: Array, ok: Mask) -> float:
        return float(smoother_noise(x[:, None], (ok & calm)[:, None], busy, above)[0])

    def bring(j: int, joint: str) -> None:
        """One joint; what it takes of memory is free before the next."""
        position = log.position_of(joint)
        raw, _, seen = on_grid(position, usable[0][:, j])
        value, speed, rate = lowpass.derivatives(raw, grid.pieces)
        other, scatter = lowpass.noises(raw, grid.pieces)[2], white(raw, seen)
        coarse = max(np.nan_to_num(scatter), quantum(position)[0] / np.sqrt(12.0))
        rate_noise[:, j] = lowpass.gains[1:] * np.nan_to_num(scatter)
        speed_noise, measured = coarse * lowpass.gains[1], log.column(joint, "velocity")
        if measured is not None and np.isfinite(measured).any():
            column, _, told = on_grid(measured, np.isfinite(measured))
            noises = scatter, white(column, told)
            longest = max(busy, key=lambda p: p.stop - p.start)
            column = np.where(told, column, np.nan)
            own = weigh(grid.time, column, (speed, rate), seen, noises, lowpass, longest)
            if own is not None:
                readings = lowpass.derivatives(own[0], grid.pieces)
                speed += np.where(told, own[1][0], 0.0) * (readings[0] - speed)
                rate += np.where(told, own[1][1], 0.0) * (readings[1] - rate)
                theirs = lowpass.noises(own[0], grid.pieces)[1]
                other += np.where(told, own[1][1], 0.0) * (theirs - other)
                rate_noise[:, j], speed_noise = own[2], own[2][0]
        # The sign of the speed: at a wider band rows that the filter mixes are told apart.
        mean, deviation = friction_sign(
            speed,
            speed_noise,
            wide.first(raw, grid.pieces),
            coarse * wide.gains[1],
            grid.pieces,
            lowpass.kernels[0],
            lowpass.rate / lowpass.cutoff,
        )
        # Rows that are left out have a say in those that stay.
        parts = [uniform_filter1d(mean[p], near, mode="nearest") for p in grid.pieces]
        mean = np.concatenate(parts)
        sign[:, j], unsure[:, j] = mean[rows], deviation[rows]
        a_noise[:, j] = other[rows]
        q[:, j], v[:, j], a[:, j], moved[:, j] = value[rows], speed[rows], rate[rows], seen[rows]
        motor = None if log.at_motor else log.column(joint, "motor_position")
        if motor is not None and np.isfinite(motor).mean() >= 0.5:
            ahead, _, told = on_grid(motor, np.isfinite(motor))
            windup[:, j] = np.where(told, lowpass.smooth(ahead, grid.pieces) - value, np.nan)[rows]
        for c, channel in enumerate(channels):
            x = log.column(joint, channel)
            if x is None:
                continue
            ok = usable[1][:, j] if c == 0 else np.isfinite(x)
            on, missing, enough = on_grid(x, ok)
            effort[:, j, c] = np.where(missing, np.nan, lowpass.smooth(on, grid.pieces))[rows]
            noise[j, c] = white(on, enough) * lowpass.gains[0]
            if c == 0:
                plain[:, j] = on[rows] if ok.any() else np.nan
                felt[:, j] = enough[rows]

    for j, joint in enumerate(log.joints):
        bring(j, joint)
    # A joint without enough good samples has no floor of its own; it is masked anyway.
    usual = [np.nanmedian(x) if np.isfinite(x).any() else 1.0 for x in noise.T]
    off, idle = log.torque_off, None
    if off is not None:
        off = off[grid.nearest]
        if log.torque_off_bridge == "open" and channels[0] != "torque" and len(channels) == 1:
            # No current flows: where the filter sees nothing else the effort is zero, and the
            # motion alone says what friction and inertia are.
            idle = np.stack([lowpass.share(~x, grid.pieces)[rows] <= 1e-9 for x in off.T], axis=1)
            effort[idle] = 0.0
            felt |= idle
        off = off[rows]
    felt &= np.isfinite(effort).all(axis=2)

    def smooth_rows(x: Array | None) -> Array | None:
        """What acts on the prediction and shares its bandwidth."""
        if x is None:
            return None
        filled = [fill_gaps(log.time, c, np.isfinite(c)) for c in x.reshape(len(log), -1).T]
        on = grid.resample(np.stack(filled, axis=1))
        return lowpass.smooth(on, grid.pieces)[rows].reshape(-1, *x.shape[1:])

    turning = [log.of(f"base_angular_velocity_{axis}") for axis in "xyz"]
    told = [x for x in turning if x is not None]
    angles = ("base_roll", "base_pitch", "base_yaw")
    standing: dict[str, Any] = {angle: smooth_rows(log.of(angle)) for angle in angles}
    standing["contact_source"] = "" if contact is None else contact.source
    if contact is not None and robot is not None:
        force = smooth_rows(log.foot_force)
        standing |= feet_on_rows(log, contact, grid, rows, force, (calm, above))
        if standing.get("foot_noise") is not None:
            standing["foot_noise"] *= lowpass.gains[0]
    warm = log.of("temperature")
    known = warm is not None and bool(np.isfinite(warm).all())
    out = Log(
        name=log.name,
        time=grid.time[rows],
        joints=log.joints,
        q=q,
        v=v,
        a=a,
        channels=channels,
        effort=np.nan_to_num(effort),
        noise=np.where(np.isfinite(noise), noise, usual),
        mask=np.ones(shape, dtype=np.bool_),
        part=np.full(rows.size, UNUSED, dtype=np.int8),
        pieces=pieces,
        filter=LowPass(1.0 / (settings.dt * settings.step), settings.cutoff),
        bandwidth=settings.cutoff,
        at_motor=log.at_motor,
        base_rate=smooth_rows(np.stack(told, axis=1)) if len(told) == 3 else None,
        open_winding=None if idle is None else off,
        temperature=grid.resample(warm)[rows] if warm is not None and known else None,
        sign=sign,
        unsure=unsure,
        sha256=log.sha256,
        moved=moved,
        off=off,
        raw=plain,
        windup=windup if np.isfinite(windup).any() else None,
        rate_noise=rate_noise,
        a_noise=a_noise,
        recording=log,
        **standing,
    )
    takers: dict[str, Mask] = {NO_MOTION: np.asarray(~moved.all(axis=1))[:, None], NO_EFFORT: ~felt}
    if off is not None:
        takers[DRIVE_OFF] = off if idle is None else off & ~idle
    out = out.without(takers)
    return replace(out, known=out.mask)


def _thinned(grid: Grid, step: int) -> tuple[NDArray[np.intp], tuple[slice, ...]]:
    """Rows that say all that the bandwidth holds, and their pieces.

    A series filtered to a bandwidth repeats itself beyond a few samples per period of the cut-off.
    """
    rows = [np.arange(piece.start, piece.stop, step) for piece in grid.pieces]
    ends = np.cumsum([0, *map(len, rows)]).tolist()
    return np.concatenate(rows), tuple(slice(a, b) for a, b in pairwise(ends))
