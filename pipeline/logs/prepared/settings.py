"""One grid and one cut-off for several logs, from what their channels hold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from actuators.arrays import Array, Mask
from pipeline.logs.errors import PreparationError
from pipeline.logs.reading.log import Log
from pipeline.logs.signals.derivatives import LARGEST_SHARE, LowPass, choose_cutoff
from pipeline.logs.signals.grid import busiest, fill_gaps, uniform_grid
from pipeline.logs.signals.spacing import own_spacing

#: The kernel may not be longer than this share of the log.
LONGEST_KERNEL: Final = 0.1
#: Cut-off per own rate of a channel: bridging by straight lines takes 5 % at that frequency.
OWN_SHARE: Final = 0.125


@dataclass(frozen=True)
class Settings:
    """How logs are brought to one grid and bandwidth; the same for all logs that are compared."""

    dt: float  #: Step of the uniform grid [s].
    cutoff: float  #: Of the low-pass [Hz].
    reason: str  #: How the cut-off was chosen, in words.
    #: Cut-off each joint alone would have asked for, shape (J,) [Hz].
    per_joint: Array = field(default_factory=lambda: np.empty(0))

    @property
    def lowpass(self) -> LowPass:
        """The filter."""
        return LowPass(1.0 / self.dt, self.cutoff)

    @property
    def bridged(self) -> float:
        """Time between good samples up to which values are interpolated [s]."""
        return 1.0 / (4.0 * self.cutoff)


def choose_settings(
    logs: Sequence[Log],
    usable: Sequence[tuple[Mask, Mask]] | None = None,
    *,
    cutoff: float | None = None,
) -> Settings:
    """Choose one grid and one cut-off for several logs, by their good positions and efforts (N, J).

    The cut-off [Hz] is the user's, or the lowest any moving joint asks for (`choose_cutoff`), so
    that no joint's accelerations are mostly noise; the torque of every joint depends on those of
    the others. It is at most `OWN_SHARE` of the slowest channel's own rate, whatever the rows'.

    Raises:
        PreparationError: The user's cut-off does not fit the rate or the length.
    """
    steps = [float(np.median(np.diff(log.clock))) for log in logs]
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
    usable = usable or [log.finite for log in logs]
    held = min(_held(log, good) for log, good in zip(logs, usable, strict=True))
    asked = []
    for log, (position_ok, _) in zip(logs, usable, strict=True):
        grid = uniform_grid(log.time, dt, bridge=1.0 / (4.0 * max(held, smallest)))
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
    value = min(float(per_joint[slowest]), max(held, smallest))
    reason = f"position spectrum of {logs[0].joints[slowest]} meets its noise"
    if value < per_joint[slowest]:
        reason = f"the slowest channel holds no more: one sample in {1e3 * OWN_SHARE / held:.3g} ms"
    return Settings(dt, value, reason, per_joint)


def _held(log: Log, usable: tuple[Mask, Mask]) -> float:
    """Highest frequency that the slowest channel of a log holds [Hz]."""
    steps = [own_spacing(log.clock, np.ones(log.clock.size, dtype=np.bool_))]
    for good in usable:
        sparse = np.flatnonzero(good.any(axis=0) & ~good.all(axis=0))
        steps += [own_spacing(log.time, good[:, j]) for j in sparse]
    usual = float(np.median(np.diff(log.clock)))
    slowest = max(step for step in steps if np.isfinite(step))
    # A step or two more than usual is what interpolation bridges anyway.
    return OWN_SHARE / slowest if slowest > 1.9 * usual else np.inf
