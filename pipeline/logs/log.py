"""A measured log at one stated bandwidth: the machine's motion, what it cost, and its parts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array, Mask

if TYPE_CHECKING:
    from pipeline.logs.recording import Recording

#: Training estimates, validation selects, test judges; guards between them are not used.
TRAIN, VALIDATION, TEST, UNUSED = 0, 1, 2, -1
#: Samples of a kernel up to which summing is quicker than transforming.
_SHORT: Final = 300
_PER_ROW: Final = (
    *("time", "q", "v", "a", "effort", "mask", "part", "block", "base_roll", "base_pitch"),
    *("base_yaw", "base_rate", "standing", "foot_force", "open_winding"),
    *("temperature", "sign", "unsure", "known", "moved", "off", "raw", "windup"),
)


def unfiltered(x: Array) -> Array:
    """No filter: for series that are exact."""
    return x


@dataclass(frozen=True, eq=False)
class Log:
    """Samples of the machine's motion and of what it cost, at one bandwidth.

    Position, speed, acceleration and efforts passed one zero-phase low-pass. A prediction made from
    them may hold more (friction at a reversal): `smooth` brings it to the same bandwidth.
    """

    name: str  #: The file's stem.
    time: Array  #: Uniform within every piece, shape (N,) [s].
    joints: tuple[str, ...]  #: Names of the columns.
    q: Array  #: Position, shape (N, J) [rad].
    v: Array  #: Velocity, shape (N, J) [rad/s].
    a: Array  #: Acceleration, shape (N, J) [rad/s^2].
    #: Compared channels, the log's own effort first, e.g. ``("current", "voltage")``. With a
    #: measured current, voltage is predicted from that current and the speed.
    channels: tuple[str, ...]
    effort: Array  #: Shape (N, J, C) in the channels' units.
    noise: Array  #: Standard deviation of the noise in the bandwidth, shape (J, C).
    mask: Mask  #: Samples that count, shape (N, J).
    part: NDArray[np.int8]  #: TRAIN, VALIDATION, TEST or UNUSED, shape (N,).
    block: NDArray[np.intp]  #: Number of the block, shape (N,); blocks are what is resampled.
    pieces: tuple[slice, ...]  #: Stretches without a gap.
    #: Brings a series (N, ...) of this grid to the bandwidth.
    lowpass: Callable[[Array], Array] = unfiltered
    #: The same as weights of neighbouring samples, shape (odd,), or None.
    kernel: Array | None = None
    bandwidth: float = float("inf")  #: Cut-off of that low-pass [Hz].
    at_motor: bool = False  #: Whether the encoder sits on the motor's side of the gear.
    #: Speed within which friction passes from one sign to the other, (J,) [rad/s].
    rest_speed: Array = field(default_factory=lambda: np.zeros(0))
    base_roll: Array | None = None  #: Shape (N,) [rad], or None for level.
    base_pitch: Array | None = None  #: Likewise.
    base_yaw: Array | None = None  #: Likewise.
    base_rate: Array | None = None  #: Of the base link, in its axes, shape (N, 3) [rad/s].
    standing: Mask | None = None  #: Which feet stand, shape (N, F), or None.
    #: World on robot, shape (N, F, 3) [N]; NaN components were not measured; None where the
    #: ground's forces are computed.
    foot_force: Array | None = None
    #: Rows in which a drive is off and its winding open, (N, J), or None: no current flows, and a
    #: voltage that is compared has no part from the speed.
    open_winding: Mask | None = None
    temperature: Array | None = None  #: Of the motors' sensors, shape (N, J) [degC], or None.
    sign: Array | None = None  #: Expected sign of friction, -1 to 1, shape (N, J).
    unsure: Array | None = None  #: Its remaining standard deviation, shape (N, J).
    #: What took rows from the comparison, and the share of each joint's rows it took, shape (J,);
    #: a row counts with the first that took it.
    removed: tuple[tuple[str, Array], ...] = ()
    sha256: str = ""  #: Of the file.
    known: Mask | None = None  #: Where effort and all motion are known, shape (N, J).
    moved: Mask | None = None  #: Where the motion of a joint is known, shape (N, J).
    off: Mask | None = None  #: Where a drive was switched off, shape (N, J), or None.
    raw: Array | None = None  #: The compared effort, not filtered, shape (N, J).
    windup: Array | None = None  #: Motor over ratio less joint, (N, J) [rad]; NaN with one sensor.
    #: Noise of speed [rad/s] and acceleration [rad/s^2] in the bandwidth, shape (2, J).
    rate_noise: Array | None = None
    foot_noise: float | None = None  #: Of a component of a foot's force in the bandwidth [N].
    contact_source: str = ""  #: By what it is known which feet stand.
    recording: Recording | None = None  #: Rows as they were read.

    def __len__(self) -> int:
        return self.time.size

    def without(self, takers: Mapping[str, Mask]) -> Log:
        """The same log without rows (N, J) or (N, 1), each kind with what took it."""
        mask, removed = self.mask, list(self.removed)
        for why, taken in takers.items():
            lost = mask & taken
            if lost.any():
                removed.append((why, np.asarray(lost.mean(axis=0))))
                mask = mask & ~lost
        return replace(self, mask=mask, removed=tuple(removed))

    def at(self, rows: NDArray[np.intp]) -> Log:
        """Some of its rows, as one piece without a filter."""
        kept = {name: getattr(self, name) for name in _PER_ROW}
        kept = {name: None if x is None else x[rows] for name, x in kept.items()}
        piece = (slice(0, rows.size),)
        return replace(self, pieces=piece, lowpass=unfiltered, kernel=None, **kept)

    @property
    def rate(self) -> float:
        """Samples per second [Hz]."""
        return 1.0 / float(np.median(np.diff(self.time)))

    @property
    def has_say(self) -> Mask:
        """Rows that estimate and choose; all where none does (to look, not to judge), (N,)."""
        rows = np.isin(self.part, (TRAIN, VALIDATION))
        return rows if rows.any() else np.ones_like(rows)

    def smooth(self, x: Array) -> Array:
        """A series (N, ...) at the bandwidth; quick for short kernels, the same but at the ends."""
        if self.kernel is None or self.kernel.size > _SHORT:
            return self.lowpass(x)
        from scipy.ndimage import convolve1d

        out = np.empty_like(x)
        for piece in self.pieces:
            out[piece] = convolve1d(x[piece], self.kernel, axis=0, mode="nearest")
        return out

    def derivative(self, x: Array) -> Array:
        """Rate of change of a series (N, ...), piece by piece."""
        out = np.empty_like(x)
        for piece in self.pieces:
            out[piece] = np.gradient(x[piece], self.time[piece], axis=0)
        return out
