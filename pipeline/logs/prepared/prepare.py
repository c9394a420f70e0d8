"""From a log to one uniform grid and one stated bandwidth: motion, effort, masks, noise floor."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pipeline.logs.prepared.contact import Contact, Stance, log_contact, stances
from pipeline.logs.prepared.settings import Settings, choose_settings, finite
from pipeline.logs.reading.log import Log
from pipeline.logs.signals.derivatives import LowPass
from pipeline.logs.signals.fusion import Fusion, fuse_by_noise, position_alone
from pipeline.logs.signals.grid import GAP, Grid, busiest, fill_gaps, long_runs, uniform_grid
from pipeline.logs.signals.noise import smoother_noise
from pipeline.logs.signals.stamps import stamp_error

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Share of the kernel's weight that may fall on missing samples before the output is masked.
TOLERATED_SHARE: Final = 0.05
#: Rows from which the error of time stamps is told.
STAMP_ROWS: Final = 50_000


@dataclass(frozen=True, eq=False)
class Calibration:
    """What is estimated from a whole log and holds for its chunks.

    Attributes:
        noise: Standard deviation of the effort's noise within the bandwidth, shape (J,).
        position_noise: Standard deviation of a position's noise before filtering, (J,) [rad].
        fusion: How velocity columns enter.
        stamp_error: Standard deviation of the time stamps' errors [s].
    """

    noise: Array
    position_noise: Array
    fusion: Fusion
    stamp_error: float


@dataclass(frozen=True)
class Prepared:
    """A log at one stated bandwidth.

    All series are filtered by the same zero-phase low-pass, the effort too; a prediction made from
    `q`, `v`, `a` may have content above the cut-off (friction at a reversal) and is brought to the
    same bandwidth with `lowpass`.

    Attributes:
        log: What was read.
        time: Uniform within every piece, shape (N,) [s].
        q: Position, shape (N, J) [rad].
        v: Velocity, shape (N, J) [rad/s].
        a: Acceleration, shape (N, J) [rad/s^2].
        effort: Shape (N, J), NaN where it was not measured.
        channel: ``"torque"``, ``"current"``, ``"voltage"`` or ``"power"``.
        unit: Of the effort.
        mask: Where the effort of a joint and the motion of all joints are good, shape (N, J).
        motion_ok: Where the motion of a joint is good, shape (N, J).
        torque_off: Where the drive was switched off, shape (N, J), or None.
        noise: Standard deviation of the effort's noise within the bandwidth, shape (J,).
        noise_basis: ``"repeats"`` or ``"smoother"``.
        position_noise: Standard deviation of the position's noise before filtering, (J,) [rad].
        settings: Grid and cut-off.
        pieces: Stretches without a gap, as slices of rows.
        contact: Which feet stand, or None.
        stances: Stretches of one stance within one piece; one per piece without contacts.
        foot_force: Filtered, shape (N, F, 3) [N], or None.
        base_roll: Filtered, shape (N,) [rad], or None.
        base_pitch: Filtered, shape (N,) [rad], or None.
        other: Further series interpolated on the grid and not filtered: ``velocity``,
            ``motor_position``,
            ``goal_position``, ``temperature`` and the efforts that are not compared, each (N, J);
            ``supply``, (N,).
        fusion: How velocity columns entered `v` and `a`, and the noise of both in the bandwidth.
        stamp_error: Standard deviation of the time stamps' errors [s].
        grid: How the log's rows lie on this grid.
        usable: Positions and efforts of the log that are good, each (rows of the log, J).
        log_contact: Which feet stand, at the log's rows; or None.
        core: Rows that count; less than all only for a chunk of a longer log.
        row: Nearest row of the log, shape (N,).
    """

    log: Log
    time: Array
    q: Array
    v: Array
    a: Array
    effort: Array
    channel: str
    unit: str
    mask: Mask
    motion_ok: Mask
    torque_off: Mask | None
    noise: Array
    noise_basis: str
    position_noise: Array
    settings: Settings
    pieces: tuple[slice, ...]
    contact: Contact | None
    stances: tuple[Stance, ...]
    foot_force: Array | None
    base_roll: Array | None
    base_pitch: Array | None
    other: dict[str, Array]
    fusion: Fusion
    stamp_error: float
    grid: Grid
    usable: tuple[Mask, Mask]
    log_contact: Contact | None
    core: slice
    row: NDArray[np.intp]

    def __len__(self) -> int:
        return self.time.size

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the columns."""
        return self.log.joints

    @property
    def cutoff(self) -> float:
        """Frequency at which the low-pass halves the amplitude [Hz]."""
        return self.settings.cutoff

    @property
    def rate(self) -> float:
        """Samples per second [Hz]."""
        return 1.0 / self.settings.dt

    @property
    def memory(self) -> float:
        """Time the filter reaches to either side [s]."""
        return self.settings.lowpass.memory

    def lowpass(self, x: Array) -> Array:
        """Bring a series of this grid to the stated bandwidth, piece by piece; samples first."""
        out = np.empty_like(x)
        for piece in self.pieces:
            out[piece] = self.settings.lowpass.smooth(x[piece])
        return out

    def near_event(self) -> Mask:
        """Rows whose filter reaches across a change of stance, shape (N,)."""
        near = np.zeros(len(self), dtype=np.bool_)
        half = self.settings.lowpass.half
        for before, after in zip(self.stances[:-1], self.stances[1:], strict=True):
            if before.rows.stop == after.rows.start and before.piece == after.piece:
                near[max(0, after.rows.start - half) : after.rows.start + half] = True
        return near

    @property
    def calibration(self) -> Calibration:
        """What chunks of the same log take over."""
        return Calibration(self.noise, self.position_noise, self.fusion, self.stamp_error)

    def unfiltered_effort(self) -> Array:
        """The compared effort on the grid at the log's full bandwidth, shape (N, J)."""
        values = self.log.effort.values
        return self.grid.resample(fill_gaps(self.log.time, values, self.usable[1]))

    def at(self, settings: Settings) -> Prepared:
        """The same log on another grid or at another cut-off, from what was read."""
        return prepare(self.log, settings, usable=self.usable, contact=self.log_contact)

    def with_noise(self, noise: Array, basis: str) -> Prepared:
        """The same with another noise floor, e.g. from repeated logs."""
        return replace(self, noise=noise, noise_basis=basis)


def prepare(
    log: Log,
    settings: Settings | None = None,
    *,
    usable: tuple[Mask, Mask] | None = None,
    contact: Contact | None = None,
    core: slice | None = None,
    origin: float | None = None,
    known: Calibration | None = None,
) -> Prepared:
    """Bring a log to one grid and bandwidth.

    Args:
        log: From `read_log`.
        settings: From `choose_settings`; chosen from this log alone by default.
        usable: Which positions and which efforts are good, each shape (N, J); by default those
            that are finite and valid.
        contact: Which feet stand at the log's rows; from its forces or contact columns by default.
        core: Rows of the log that count, for a chunk.
        origin: A time on the uniform grid [s], for a chunk; the first by default.
        known: Noises and fusion of the whole log, for a chunk.

    Raises:
        PreparationError: No joint moves, or the log is too short for the filter.
    """
    position_ok, effort_ok = usable if usable is not None else finite(log)
    settings = settings or choose_settings([log], [(position_ok, effort_ok)])
    longest_gap = 1.0 / (4.0 * settings.cutoff)
    grid = uniform_grid(log.time, settings.dt, origin, bridge=longest_gap)
    lowpass = settings.lowpass
    chosen = log.effort
    series = _filtered(log, grid, settings, (position_ok, effort_ok))
    extras = _filtered_extras(log, grid, lowpass)
    other = _other(log, grid, chosen.channel)
    if known is None:
        known = _calibrated(log, grid, settings, series, other)
    _fuse(series.v, series.a, grid, other, known.fusion, lowpass, longest_gap)
    contact = contact or log_contact(log)
    on_grid = contact.rows(grid.nearest) if contact is not None else None
    return Prepared(
        log=log,
        time=grid.time,
        q=series.q,
        v=series.v,
        a=series.a,
        effort=series.effort,
        channel=chosen.channel,
        unit=chosen.unit,
        mask=series.effort_ok & series.motion_ok.all(axis=1, keepdims=True),
        motion_ok=series.motion_ok,
        torque_off=None if log.torque_off is None else log.torque_off[grid.nearest],
        noise=known.noise,
        noise_basis="smoother",
        position_noise=known.position_noise,
        settings=settings,
        pieces=grid.pieces,
        contact=on_grid,
        stances=stances(on_grid, grid.pieces),
        foot_force=extras.pop("foot_force", None),
        base_roll=extras.pop("base_roll", None),
        base_pitch=extras.pop("base_pitch", None),
        other=other,
        fusion=known.fusion,
        stamp_error=known.stamp_error,
        grid=grid,
        usable=(position_ok, effort_ok),
        log_contact=contact,
        core=_core(grid, core),
        row=grid.nearest,
    )


@dataclass(frozen=True, eq=False)
class _Series:
    """Positions and efforts on the grid, before and after the filter, each (N, J)."""

    q_raw: Array
    effort_raw: Array
    q: Array
    v: Array
    a: Array
    effort: Array
    motion_ok: Mask
    effort_ok: Mask


def _filtered(log: Log, grid: Grid, settings: Settings, usable: tuple[Mask, Mask]) -> _Series:
    """Bridge short holes, resample, filter, and mark what the filter sees too little of."""
    lowpass, longest = settings.lowpass, 1.0 / (4.0 * settings.cutoff)
    position_ok, effort_ok = usable
    q_raw = grid.resample(fill_gaps(log.time, log.position, position_ok))
    effort_raw = grid.resample(fill_gaps(log.time, log.effort.values, effort_ok))
    no_motion = grid.flags(long_runs(log.time, ~position_ok, longest))
    no_effort = grid.flags(long_runs(log.time, ~effort_ok, longest))
    q, v, a, effort = (np.empty_like(q_raw) for _ in range(4))
    motion_good, effort_good = np.empty_like(no_motion), np.empty_like(no_motion)
    for piece in grid.pieces:
        q[piece], v[piece], a[piece] = lowpass.derivatives(q_raw[piece])
        effort[piece] = lowpass.smooth(effort_raw[piece])
        motion_good[piece] = lowpass.share(no_motion[piece]) <= TOLERATED_SHARE
        effort_good[piece] = lowpass.share(no_effort[piece]) <= TOLERATED_SHARE
    effort[no_effort] = np.nan
    return _Series(q_raw, effort_raw, q, v, a, effort, motion_good, effort_good)


def _calibrated(
    log: Log, grid: Grid, settings: Settings, series: _Series, other: dict[str, Array]
) -> Calibration:
    """Noises, the say of velocity columns, and errors of time stamps."""
    lowpass, stretches = settings.lowpass, busiest(series.q_raw, grid.pieces)
    good = (series.effort_ok, series.motion_ok)
    floor = smoother_noise(series.effort_raw, good[0], stretches, lowpass, in_band=True)
    noise = smoother_noise(series.q_raw, good[1], stretches, lowpass, in_band=False)
    fusion = _fusion(grid, other, (series.v, series.a), good[1], noise, lowpass)
    rows = slice(0, STAMP_ROWS)
    stamps, error = stamp_error(log.time[rows], log.position[rows], GAP * settings.dt)
    return Calibration(floor, noise, fusion, stamps if stamps > 4 * error else 0.0)


def _core(grid: Grid, core: slice | None) -> slice:
    """Rows of the grid that lie in rows of the log."""
    n = grid.time.size
    if core is None:
        return slice(0, n)
    inside = (grid.nearest >= core.start) & (grid.nearest < core.stop)
    return slice(int(np.argmax(inside)), n - int(np.argmax(inside[::-1])))


def _fusion(
    grid: Grid,
    other: dict[str, Array],
    rates: tuple[Array, Array],
    ok: Mask,
    position_noise: Array,
    lowpass: LowPass,
) -> Fusion:
    """How the log's velocity columns are to be weighed, where it has some."""
    column = other.get("velocity")
    if column is None:
        return position_alone(position_noise, lowpass)
    good = np.isfinite(column)
    filled = np.where(good, column, 0.0)
    noise = smoother_noise(filled, good, busiest(filled, grid.pieces), lowpass, in_band=False)
    noises = (position_noise, noise)
    return fuse_by_noise(grid.time, column, ok, rates, noises, grid.pieces, lowpass)


def _fuse(
    v: Array,
    a: Array,
    grid: Grid,
    other: dict[str, Array],
    fusion: Fusion,
    lowpass: LowPass,
    longest_gap: float,
) -> None:
    """Average speeds and accelerations, in place, with what the velocity columns say."""
    column = other.get("velocity")
    if column is None:
        return
    missing = long_runs(grid.time, ~np.isfinite(column), longest_gap)
    for j in np.flatnonzero(fusion.weight.any(axis=0)):
        if not np.isfinite(column[:, j]).any():
            continue
        straight = fusion.aligned(grid.time, column[:, j], int(j))
        for piece in grid.pieces:
            speed, rate = lowpass.derivatives(straight[piece, None])[:2]
            seen = lowpass.share(missing[piece, j, None])[:, 0] <= TOLERATED_SHARE
            for into, reading, order in ((v, speed, 0), (a, rate, 1)):
                w = np.where(seen, fusion.weight[order, j], 0.0)
                into[piece, j] += w * (reading[:, 0] - into[piece, j])


def _filtered_extras(log: Log, grid: Grid, lowpass: LowPass) -> dict[str, Any]:
    """Foot forces and base angles: they act on the prediction and share its bandwidth."""
    out: dict[str, Any] = {}
    for name in ("foot_force", "base_roll", "base_pitch"):
        values = getattr(log, name)
        if values is None:
            continue
        flat = values.reshape(values.shape[0], -1)
        raw = grid.resample(fill_gaps(log.time, flat, np.isfinite(flat)))
        for piece in grid.pieces:
            raw[piece] = lowpass.smooth(raw[piece])
        out[name] = raw.reshape(raw.shape[0], *values.shape[1:])
    return out


def _other(log: Log, grid: Grid, channel: str) -> dict[str, Array]:
    wanted = (
        "velocity",
        "motor_position",
        "torque",
        "current",
        "voltage",
        "power",
        "goal_position",
        "temperature",
    )
    out = {}
    known = {f.name for f in fields(log)}
    for name in (*wanted, "supply"):
        values = getattr(log, name) if name in known else None
        if values is None or name == channel:
            continue
        flat = values.reshape(values.shape[0], -1)
        out[name] = grid.resample(flat).reshape(-1, *values.shape[1:])
    return out
