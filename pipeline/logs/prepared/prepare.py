"""From a log to one uniform grid and one stated bandwidth: motion, effort, masks, noise floor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pipeline.logs.errors import PreparationError
from pipeline.logs.prepared.contact import Contact, Stance, log_contact, stances
from pipeline.logs.reading.log import Log
from pipeline.logs.signals.derivatives import LARGEST_SHARE, LowPass, choose_cutoff
from pipeline.logs.signals.grid import Grid, busiest, fill_gaps, long_runs, uniform_grid
from pipeline.logs.signals.noise import smoother_noise

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Share of the kernel's weight that may fall on missing samples before the output is masked.
TOLERATED_SHARE: Final = 0.05
#: The kernel may not be longer than this share of the log.
LONGEST_KERNEL: Final = 0.1


@dataclass(frozen=True)
class Settings:
    """How logs are brought to one grid and bandwidth; the same for all logs that are compared.

    Attributes:
        dt: Step of the uniform grid [s].
        cutoff: Of the low-pass [Hz].
        reason: How the cut-off was chosen, in words.
        per_joint: Cut-off each joint alone would have asked for, shape (J,) [Hz].
    """

    dt: float
    cutoff: float
    reason: str
    per_joint: Array = field(default_factory=lambda: np.empty(0))

    @property
    def lowpass(self) -> LowPass:
        """The filter."""
        return LowPass(1.0 / self.dt, self.cutoff)


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
            ``goal_position``, ``temperature`` and the efforts that are not compared, each (N, J);
            ``supply``, (N,).
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

    def with_noise(self, noise: Array, basis: str) -> Prepared:
        """The same with another noise floor, e.g. from repeated logs."""
        return replace(self, noise=noise, noise_basis=basis)


def choose_settings(
    logs: Sequence[Log],
    usable: Sequence[tuple[Mask, Mask]] | None = None,
    *,
    cutoff: float | None = None,
) -> Settings:
    """Choose one grid and one cut-off for several logs.

    The cut-off is the lowest any moving joint asks for (`choose_cutoff`), so that no joint's
    accelerations are mostly noise; the torque of every joint depends on those of the others.

    Args:
        logs: One or several.
        usable: Per log which positions and efforts are good, each shape (N, J).
        cutoff: Set by the user instead [Hz].

    Raises:
        PreparationError: The user's cut-off does not fit the rate or the length.
    """
    steps = [float(np.median(np.diff(log.time))) for log in logs]
    # The slowest log decides: its band holds nothing above.
    dt = max(steps)
    rate = 1.0 / dt
    longest = max(float(log.time[-1] - log.time[0]) for log in logs)
    smallest = 2.0 * 2.0 / (LONGEST_KERNEL * longest)
    if smallest > LARGEST_SHARE * rate:
        raise PreparationError(
            f"{logs[0].name}: {longest:.3g} s at {rate:.4g} Hz are too short to be filtered; "
            "log longer or faster"
        )
    if cutoff is not None:
        if not smallest <= cutoff <= LARGEST_SHARE * rate:
            raise PreparationError(
                f"cut-off {cutoff:g} Hz; logs of {longest:.3g} s at {rate:.4g} Hz allow "
                f"{smallest:.3g} to {LARGEST_SHARE * rate:.4g} Hz"
            )
        return Settings(dt, float(cutoff), "set by the user")
    asked = []
    for k, log in enumerate(logs):
        position_ok = usable[k][0] if usable is not None else np.isfinite(log.position)
        grid = uniform_grid(log.time, dt)
        q = grid.resample(fill_gaps(log.time, log.position, position_ok))
        stretches = [q[part] for part in busiest(q, grid.pieces) if part.stop - part.start >= 64]
        if stretches:
            asked.append(choose_cutoff(stretches, rate, smallest=smallest))
    table = np.array(asked) if asked else np.full((1, len(logs[0].joints)), np.nan)
    if np.isnan(table).all():
        raise PreparationError(f"{logs[0].name}: no joint moves; nothing can be compared")
    with np.errstate(all="ignore"):
        per_joint = np.where(
            np.isnan(table).all(axis=0), np.nan, np.nanmin(np.nan_to_num(table, nan=np.inf), axis=0)
        )
    slowest = int(np.nanargmin(per_joint))
    value = float(per_joint[slowest])
    reason = f"position spectrum of {logs[0].joints[slowest]} meets its noise"
    return Settings(dt, value, reason, per_joint)


def prepare(
    log: Log,
    settings: Settings | None = None,
    *,
    usable: tuple[Mask, Mask] | None = None,
    contact: Contact | None = None,
    core: slice | None = None,
    origin: float | None = None,
    noise: tuple[Array, Array] | None = None,
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
        noise: Noise of effort and position from the whole log, for a chunk.

    Raises:
        PreparationError: No joint moves, or the log is too short for the filter.
    """
    position_ok, effort_ok = usable if usable is not None else _finite(log)
    settings = settings or choose_settings([log], [(position_ok, effort_ok)])
    grid = uniform_grid(log.time, settings.dt, origin)
    lowpass = settings.lowpass
    chosen = log.effort
    longest_gap = 1.0 / (4.0 * settings.cutoff)

    q_raw = grid.resample(fill_gaps(log.time, log.position, position_ok))
    effort_raw = grid.resample(fill_gaps(log.time, chosen.values, effort_ok))
    no_motion = grid.flags(long_runs(log.time, ~position_ok, longest_gap))
    no_effort = grid.flags(long_runs(log.time, ~effort_ok, longest_gap))

    n, j = q_raw.shape
    q, v, a, effort = (np.empty((n, j)) for _ in range(4))
    motion_ok, effort_good = np.empty((n, j), dtype=np.bool_), np.empty((n, j), dtype=np.bool_)
    extras = _filtered_extras(log, grid, lowpass)
    for piece in grid.pieces:
        q[piece], v[piece], a[piece] = lowpass.derivatives(q_raw[piece])
        effort[piece] = lowpass.smooth(effort_raw[piece])
        motion_ok[piece] = lowpass.share(no_motion[piece]) <= TOLERATED_SHARE
        effort_good[piece] = lowpass.share(no_effort[piece]) <= TOLERATED_SHARE
    effort[no_effort] = np.nan
    if noise is None:
        stretches = busiest(q_raw, grid.pieces)
        noise = (
            smoother_noise(effort_raw, effort_good, stretches, lowpass, in_band=True),
            smoother_noise(q_raw, motion_ok, stretches, lowpass, in_band=False),
        )
    floor, position_noise = noise
    contact = contact or log_contact(log)
    on_grid = contact.rows(grid.nearest) if contact is not None else None
    rows = slice(0, n)
    if core is not None:
        inside = (grid.nearest >= core.start) & (grid.nearest < core.stop)
        rows = slice(int(np.argmax(inside)), n - int(np.argmax(inside[::-1])))
    return Prepared(
        log=log,
        time=grid.time,
        q=q,
        v=v,
        a=a,
        effort=effort,
        channel=chosen.channel,
        unit=chosen.unit,
        mask=effort_good & motion_ok.all(axis=1, keepdims=True),
        motion_ok=motion_ok,
        torque_off=None if log.torque_off is None else log.torque_off[grid.nearest],
        noise=floor,
        noise_basis="smoother",
        position_noise=position_noise,
        settings=settings,
        pieces=grid.pieces,
        contact=on_grid,
        stances=stances(on_grid, grid.pieces),
        foot_force=extras.pop("foot_force", None),
        base_roll=extras.pop("base_roll", None),
        base_pitch=extras.pop("base_pitch", None),
        other=_other(log, grid, chosen.channel),
        core=rows,
        row=grid.nearest,
    )


def _finite(log: Log) -> tuple[Mask, Mask]:
    return np.isfinite(log.position), log.valid & np.isfinite(log.effort.values)


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
    wanted = ("velocity", "torque", "current", "voltage", "power", "goal_position", "temperature")
    out = {}
    known = {f.name for f in fields(log)}
    for name in (*wanted, "supply"):
        values = getattr(log, name) if name in known else None
        if values is None or name == channel:
            continue
        flat = values.reshape(values.shape[0], -1)
        out[name] = grid.resample(flat).reshape(-1, *values.shape[1:])
    return out
