"""What naming works on: motion and efforts of one or several prepared logs, with their parts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array, Mask

_SHORT = 300  # samples of a kernel up to which summing is quicker than transforming
_PER_ROW: Final = (
    *("time", "q", "v", "a", "effort", "mask", "part", "block", "base_roll", "base_pitch"),
    *("standing", "foot_force", "open_winding", "temperature", "unsure"),
)
TRAIN, VALIDATION, TEST, UNUSED = 0, 1, 2, -1


#: Below this many rest speeds a joint counts as standing: friction may take any value there.
STANDING: Final = 2.5
#: How far to either side a filter sees with weight, in periods of its cut-off.
SEEN: Final = 1.0


def near_rest(
    v: Array, rest: Array, pieces: Sequence[slice], rate: float, bandwidth: float
) -> Mask:
    """Rows (N, J) whose filter sees a shaft stop or turn back.

    There friction takes any value up to its level, and the filtered speed does not tell which: a
    law of friction says nothing about such rows, and no name may rest on them.

    Args:
        v: Speed, shape (N, J) [rad/s].
        rest: Rest speed, shape (J,) [rad/s].
        pieces: Stretches without a gap.
        rate: [Hz].
        bandwidth: Of the filter [Hz].
    """
    still = np.abs(v) < STANDING * rest
    # A fast joint turns back between two samples, neither of which is slow.
    turned = np.signbit(v[1:]) != np.signbit(v[:-1])
    still[1:] |= turned
    still[:-1] |= turned
    reach = int(np.ceil(SEEN * rate / bandwidth)) if np.isfinite(bandwidth) else 0
    out = np.zeros_like(still)
    for piece in pieces:
        count = np.cumsum(np.pad(still[piece], ((reach + 1, reach), (0, 0))), axis=0)
        out[piece] = count[2 * reach + 1 :] > count[: -2 * reach - 1]
    return out


def unfiltered(x: Array) -> Array:
    """No filter: for series that are exact."""
    return x


@dataclass(frozen=True, eq=False)
class Measurement:
    """Samples of the machine's motion and of what it cost, at one bandwidth."""

    name: str  #: Of the log.
    time: Array  #: Shape (N,) [s].
    joints: tuple[str, ...]  #: Names of the columns.
    q: Array  #: Position as measured, shape (N, J) [rad].
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
    standing: Mask | None = None  #: Which feet stand, shape (N, F), or None.
    #: World on robot, shape (N, F, 3) [N]; NaN components were not measured; None where the
    #: ground's forces are computed.
    foot_force: Array | None = None
    #: Rows in which a drive is off and its winding open, (N, J), or None: no current flows, and a
    #: voltage that is compared has no part from the speed.
    open_winding: Mask | None = None
    temperature: Array | None = None  #: Of the motors' sensors, shape (N, J) [degC], or None.
    #: How unsure the sign of friction is, 0 to 1, shape (N, J); see `pipeline.logs.signals.noise`.
    unsure: Array | None = None
    #: What took rows from the comparison, and the share of all joints' rows it took; a row counts
    #: with the first that took it.
    removed: tuple[tuple[str, float], ...] = ()
    sha256: str = ""  #: Of the log.

    def __len__(self) -> int:
        return self.time.size

    def at(self, rows: NDArray[np.intp]) -> Measurement:
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
