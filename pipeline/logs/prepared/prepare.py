"""From a log to one uniform grid and one stated bandwidth: motion, effort, masks, noise floor."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array, Mask
from pipeline.logs.log_format import EFFORTS
from pipeline.logs.prepared.measurement import Contact, changes_of_stance, log_contact, narrowed
from pipeline.logs.reading.log import Log
from pipeline.logs.signals.derivatives import LowPass, Settings, choose_settings, smoother_noise
from pipeline.logs.signals.fusion import Fusion, fuse_by_noise, position_alone
from pipeline.logs.signals.grid import (
    GAP,
    Grid,
    busiest,
    fill_gaps,
    long_runs,
    stamp_error,
    uniform_grid,
)

#: Share of the kernel's weight that may fall on missing samples before the output is masked.
TOLERATED_SHARE: Final = 0.05
#: Rows from which the error of time stamps is estimated.
_STAMPS: Final = slice(0, 50_000)
#: Attributes of a log that act on the prediction.
OUTSIDE: Final = ("foot_force", "base_roll", "base_pitch")
#: Attributes of a log that are kept on the grid, where they are not compared.
OTHER: Final = ("velocity", "motor_position", *EFFORTS, "goal_position", "temperature", "supply")


@dataclass(frozen=True)
class Prepared:
    """A log at one stated bandwidth.

    All series are filtered by the same zero-phase low-pass, the effort too; a prediction made from
    `q`, `v`, `a` may have content above the cut-off (friction at a reversal) and is brought to the
    same bandwidth with `lowpass`.
    """

    log: Log  #: What was read.
    q: Array  #: Position, shape (N, J) [rad].
    v: Array  #: Velocity, shape (N, J) [rad/s].
    a: Array  #: Acceleration, shape (N, J) [rad/s^2].
    effort: Array  #: Shape (N, J), NaN where it was not measured.
    mask: Mask  #: Where the effort of a joint and the motion of all joints are good, shape (N, J).
    motion_ok: Mask  #: Where the motion of a joint is good, shape (N, J).
    noise: Array  #: Standard deviation of the effort's noise within the bandwidth, shape (J,).
    noise_basis: str  #: ``"repeats"`` or ``"smoother"``.
    settings: Settings  #: Grid and cut-off.
    contact: Contact | None  #: Which feet stand, or None.
    foot_force: Array | None  #: Filtered, shape (N, F, 3) [N], or None.
    base_roll: Array | None  #: Filtered, shape (N,) [rad], or None.
    base_pitch: Array | None  #: Filtered, shape (N,) [rad], or None.
    #: Further series interpolated on the grid and not filtered: ``velocity``, ``motor_position``,
    #: ``goal_position``, ``temperature`` and the efforts that are not compared, each (N, J);
    #: ``supply``, (N,).
    other: dict[str, Array]
    #: How velocity columns entered `v` and `a`, and the noise of both in the bandwidth.
    fusion: Fusion
    stamp_error: float  #: Standard deviation of the time stamps' errors [s].
    grid: Grid  #: How the log's rows lie on this grid.
    #: Positions and efforts of the log that are good, each (rows of the log, J).
    usable: tuple[Mask, Mask]
    log_contact: Contact | None  #: Which feet stand, at the log's rows; or None.
    core: slice  #: Rows that count; less than all only for a chunk of a longer log.

    def __len__(self) -> int:
        return self.time.size

    @property
    def time(self) -> Array:
        """Uniform within every piece, shape (N,) [s]."""
        return self.grid.time

    @property
    def pieces(self) -> tuple[slice, ...]:
        """Stretches without a gap, as slices of rows."""
        return self.grid.pieces

    @property
    def row(self) -> NDArray[np.intp]:
        """Nearest row of the log, shape (N,)."""
        return self.grid.nearest

    @property
    def channel(self) -> str:
        """``"torque"``, ``"current"``, ``"voltage"`` or ``"power"``."""
        return self.log.effort.channel

    @property
    def unit(self) -> str:
        """Of the effort."""
        return self.log.effort.unit

    @property
    def torque_off(self) -> Mask | None:
        """Where the drive was switched off, shape (N, J), or None."""
        return None if self.log.torque_off is None else self.log.torque_off[self.row]

    @property
    def events(self) -> NDArray[np.intp]:
        """Rows at which other feet stand than before, no gap between, shape (E,)."""
        return changes_of_stance(self.contact, self.pieces)

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
        return self.settings.lowpass.smooth(x, self.pieces)

    def near_event(self) -> Mask:
        """Rows whose filter reaches across a change of stance, shape (N,)."""
        event = np.zeros((len(self), 1), dtype=np.bool_)
        event[self.events] = event[self.events - 1] = True
        wanted, reach = np.ones_like(event), self.settings.lowpass.half - 1
        return narrowed(event, wanted, self.pieces, reach)[:, 0]

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
    known: Prepared | None = None,
) -> Prepared:
    """Bring a log to one grid and bandwidth; a LegwattError for one that does not move.

    Args:
        log: From `read_log`.
        settings: From `choose_settings`; chosen from this log alone by default.
        usable: Which positions and which efforts are good, each (N, J); finite ones by default.
        contact: Which feet stand at the log's rows; by the log itself by default.
        core: Of a chunk the log's rows that count.
        origin: Of a chunk a time on the uniform grid [s].
        known: Of a chunk what stands for the whole log: noises and fusion are taken over.
    """
    usable = usable or log.finite
    settings = settings or choose_settings([log], [usable])
    lowpass, contact = settings.lowpass, contact or log_contact(log)
    grid = uniform_grid(log.time, settings.dt, origin, bridge=settings.bridged)
    q_raw, motion_ok = _on_grid(log, log.position, usable[0], grid, settings)
    effort_raw, effort_ok = _on_grid(log, log.effort.values, usable[1], grid, settings)
    q, v, a = lowpass.derivatives(q_raw, grid.pieces)
    effort = lowpass.smooth(effort_raw, grid.pieces)
    effort[grid.flags(long_runs(log.time, ~usable[1], settings.bridged))] = np.nan
    # Series that are not compared, on the grid and not filtered.
    other = {}
    for name in OTHER:
        values = getattr(log, name)
        if values is not None and name != log.effort.channel:
            flat = values.reshape(len(log), -1)
            other[name] = grid.resample(flat).reshape(-1, *values.shape[1:])
    if known is None:
        raw, ok = (q_raw, effort_raw), (motion_ok, effort_ok)
        noise, fusion = _noises(grid, raw, (v, a), ok, other.get("velocity"), lowpass)
        # The stamps' error, where it stands out.
        late, error = stamp_error(log.time[_STAMPS], log.position[_STAMPS], GAP * settings.dt)
        stamps = late if late > 4 * error else 0.0
    else:
        noise, fusion, stamps = known.noise, known.fusion, known.stamp_error
    if "velocity" in other:
        _fuse(v, a, grid, other["velocity"], fusion, settings)
    return Prepared(
        log=log,
        q=q,
        v=v,
        a=a,
        effort=effort,
        mask=effort_ok & motion_ok.all(axis=1, keepdims=True),
        motion_ok=motion_ok,
        noise=noise,
        noise_basis="smoother",
        settings=settings,
        contact=contact.rows(grid.nearest) if contact is not None else None,
        **{name: _smoothed(log, name, grid, lowpass) for name in OUTSIDE},
        other=other,
        fusion=fusion,
        stamp_error=stamps,
        grid=grid,
        usable=usable,
        log_contact=contact,
        core=_core(grid, core),
    )


def _on_grid(
    log: Log, values: Array, ok: Mask, grid: Grid, settings: Settings
) -> tuple[Array, Mask]:
    """Values on the grid, short holes bridged, and where the filter sees enough of them, (N, J)."""
    missing = grid.flags(long_runs(log.time, ~ok, settings.bridged))
    seen = settings.lowpass.share(missing, grid.pieces) <= TOLERATED_SHARE
    return grid.resample(fill_gaps(log.time, values, ok)), seen


def _smoothed(log: Log, name: str, grid: Grid, lowpass: LowPass) -> Array | None:
    """What acts on the prediction and shares its bandwidth."""
    values: Array | None = getattr(log, name)
    if values is None:
        return None
    flat = values.reshape(len(log), -1)
    raw = grid.resample(fill_gaps(log.time, flat, np.isfinite(flat)))
    return lowpass.smooth(raw, grid.pieces).reshape(-1, *values.shape[1:])


def _core(grid: Grid, core: slice | None) -> slice:
    """Rows of the grid that lie in rows of the log."""
    n = grid.time.size
    if core is None:
        return slice(0, n)
    inside = (grid.nearest >= core.start) & (grid.nearest < core.stop)
    return slice(int(np.argmax(inside)), n - int(np.argmax(inside[::-1])))


def _noises(
    grid: Grid,
    raw: tuple[Array, Array],
    rates: tuple[Array, Array],
    ok: tuple[Mask, Mask],
    column: Array | None,
    lowpass: LowPass,
) -> tuple[Array, Fusion]:
    """Noise of the effort in the bandwidth, (J,), and how velocity columns are to be weighed."""
    stretches = busiest(raw[0], grid.pieces)
    effort = smoother_noise(raw[1], ok[1], stretches, lowpass, in_band=True)
    position = smoother_noise(raw[0], ok[0], stretches, lowpass, in_band=False)
    if column is None:
        return effort, position_alone(position, lowpass)
    good = np.isfinite(column)
    filled = np.where(good, column, 0.0)
    noise = smoother_noise(filled, good, busiest(filled, grid.pieces), lowpass, in_band=False)
    noises = (position, noise)
    return effort, fuse_by_noise(grid.time, column, ok[0], rates, noises, grid.pieces, lowpass)


def _fuse(
    v: Array, a: Array, grid: Grid, column: Array, fusion: Fusion, settings: Settings
) -> None:
    """Average speeds and accelerations, in place, with what the velocity columns say."""
    lowpass = settings.lowpass
    missing = long_runs(grid.time, ~np.isfinite(column), settings.bridged)
    for j in np.flatnonzero(fusion.weight.any(axis=0) & np.isfinite(column).any(axis=0)):
        straight = fusion.aligned(grid.time, column[:, j], int(j))[:, None]
        seen = lowpass.share(missing[:, [j]], grid.pieces)[:, 0] <= TOLERATED_SHARE
        readings = lowpass.derivatives(straight, grid.pieces)[:2]
        for into, reading, weight in zip((v, a), readings, fusion.weight[:, j], strict=True):
            into[:, j] += np.where(seen, weight, 0.0) * (reading[:, 0] - into[:, j])
