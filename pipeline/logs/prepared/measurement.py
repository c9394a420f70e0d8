"""What naming works on: motion and efforts of prepared logs, with their parts; which feet stand.

Feet stand by forces, else by contact columns, the gait's schedule, or as the lowest ones.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array, Mask
from actuators.errors import LegwattError
from pipeline.logs.reading.log import Log
from pipeline.motion.gait import gait_of
from pipeline.robot.kinematics import foot_positions
from pipeline.robot.robot import Robot

#: A foot stands above this share of the largest vertical force any foot carries ...
TOUCH: Final = 0.05
#: ... and lifts off below this one, so that noise does not make it chatter.
LIFT: Final = 0.02
#: A foot this near to the lowest foot stands [m].
LOWEST: Final = 0.005
_SHORT = 300  # samples of a kernel up to which summing is quicker than transforming
_PER_ROW: Final = (
    *("time", "q", "v", "a", "effort", "mask", "part", "block", "base_roll", "base_pitch"),
    *("standing", "foot_force", "open_winding", "temperature"),
    *("sign", "unsure", "known", "base_yaw", "base_rate"),
)
TRAIN, VALIDATION, TEST, UNUSED = 0, 1, 2, -1


#: Below this many rest speeds a joint counts as standing: friction may take any value there.
STANDING: Final = 2.5
#: How far to either side a filter sees with weight, in periods of its cut-off.
SEEN: Final = 1.0
#: A reach that takes more than this share of what moves is halved ...
MOST_TAKEN: Final = 0.5
#: ... this often, and then nothing but the event itself is left out.
HALVED: Final = 3


def near_rest(
    v: Array, rest: Array, pieces: Sequence[slice], rate: float, bandwidth: float
) -> Mask:
    """Rows (N, J) whose filter sees a shaft stop or turn back.

    There friction takes any value up to its level, and the filtered speed does not tell which: a
    law of friction says nothing about such rows, and no name may rest on them. A leg turns back
    several times a second: where most of a joint's motion lies within the filter's reach of a
    reversal, that reach is narrowed, see `narrowed`.

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
    return narrowed(still, np.abs(v) >= STANDING * rest, pieces, reach)


def narrowed(event: Mask, wanted: Mask, pieces: Sequence[slice], reach: int) -> Mask:
    """Rows (N, C) within a reach of an event, the reach halved where it takes most that is wanted.

    A prediction passes the filter that the measurement passed, so that a row near an event is less
    sure and not wrong: half of the rows are worth more than none.

    Args:
        event: Shape (N, C).
        wanted: Rows that would count but for the reach, shape (N, C).
        pieces: Stretches without a gap.
        reach: Rows to either side.
    """
    out = within(event, pieces, reach)
    for k in range(1, HALVED + 1):
        lost = (out & wanted).sum(axis=0) > MOST_TAKEN * wanted.sum(axis=0)
        if reach == 0 or not lost.any():
            break
        out[:, lost] = within(event[:, lost], pieces, reach >> k if k < HALVED else 0)
    return out


def within(event: Mask, pieces: Sequence[slice], reach: int) -> Mask:
    """Rows (N, C) at most `reach` rows from an event, not across gaps."""
    out = np.zeros_like(event)
    for piece in pieces:
        count = np.cumsum(np.pad(event[piece], ((reach + 1, reach), (0, 0))), axis=0)
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
    base_yaw: Array | None = None  #: Likewise.
    base_rate: Array | None = None  #: Angular velocity in the base's axes, (N, 3) [rad/s].
    standing: Mask | None = None  #: Which feet stand, shape (N, F), or None.
    #: World on robot, shape (N, F, 3) [N]; NaN components were not measured; None where the
    #: ground's forces are computed.
    foot_force: Array | None = None
    #: Rows in which a drive is off and its winding open, (N, J), or None: no current flows, and a
    #: voltage that is compared has no part from the speed.
    open_winding: Mask | None = None
    temperature: Array | None = None  #: Of the motors' sensors, shape (N, J) [degC], or None.
    #: Expected sign of friction as it acts, not filtered, and the standard deviation that is left
    #: of the filtered one, each (N, J); see `pipeline.logs.friction_sign`.
    sign: Array | None = None
    unsure: Array | None = None
    #: Rows of a known effort and motion, near standstill or not, (N, J): those that count where a
    #: row counts by its variance.
    known: Mask | None = None
    rate_noise: Array | None = None  #: Of v and a in the bandwidth, (2, J) [rad/s, rad/s^2].
    foot_noise: float | None = None  #: Of a component of a foot's force in the bandwidth [N].
    #: What took rows from the comparison, and the share of each joint's rows it took, shape (J,);
    #: a row counts with the first that took it.
    removed: tuple[tuple[str, Array], ...] = ()
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


@dataclass(frozen=True)
class Contact:
    """Which feet stand."""

    feet: tuple[str, ...]  #: Names of legs.
    standing: Mask  #: Shape (N, F).
    source: str  #: ``"forces"``, ``"columns"``, ``"schedule"`` or ``"lowest feet"``.

    def rows(self, index: NDArray[np.intp]) -> Contact:
        """At other rows."""
        return replace(self, standing=self.standing[index])


def log_contact(log: Log) -> Contact | None:
    """Contact as the log itself states it: from forces, else from contact columns, else None."""
    if log.foot_force is not None:
        return Contact(log.feet, _standing_by_force(log.foot_force[..., 2]), "forces")
    if log.contact is not None:
        return Contact(log.feet, log.contact, "columns")
    return None


def _standing_by_force(normal: Array) -> Mask:
    """Schmitt trigger on the vertical force, shape (N, F)."""
    full = max(float(np.nanmax(normal, initial=0.0)), 1e-9)
    with np.errstate(invalid="ignore"):
        decided = np.where(normal > TOUCH * full, 1, np.where(normal < LIFT * full, 0, -1))
    decided[0] = np.where(decided[0] < 0, 0, decided[0])
    # Undecided samples keep the last decision.
    index = np.where(decided >= 0, np.arange(decided.shape[0])[:, None], 0)
    last = np.maximum.accumulate(index, axis=0)
    return np.asarray(np.take_along_axis(decided, last, axis=0) == 1)


def scheduled_contact(robot: Robot, time: Array, *, start: float) -> Contact:
    """Contact by the robot file's gait, of which a period begins at `start` [s].

    Raises:
        LegwattError: The robot file has no gait.
    """
    try:
        gait = gait_of(robot.spec)
    except LegwattError as error:
        raise LegwattError(f"{error}; or log foot forces or contacts") from None
    share = ((time - start) / gait.period) % 1.0
    standing = np.zeros((time.size, len(robot.leg_names)), dtype=np.bool_)
    for begin, end, stance in gait.footfall.stances():
        rows = (share >= begin) & (share < end)
        standing[rows] = [leg in stance for leg in robot.leg_names]
    return Contact(robot.leg_names, standing, "schedule")


def lowest_feet(robot: Robot, position: Array, roll: Array | None, pitch: Array | None) -> Contact:
    """Contact by kinematics: feet within `LOWEST` of the lowest one, along the vertical.

    Args:
        robot: With legs.
        position: Joint positions, shape (N, J) [rad].
        roll: Of the base, shape (N,) [rad]; level where it is None.
        pitch: Likewise.
    """
    n = position.shape[0]
    shaped = robot.layout.by_leg(position)
    feet = np.concatenate(
        [foot_positions(robot.chains, shaped[i : i + 4096]) for i in range(0, n, 4096)]
    )
    r = np.zeros(n) if roll is None else roll
    p = np.zeros(n) if pitch is None else pitch
    # Third row of R_y(pitch) R_x(roll): the vertical in the base frame.
    up = np.stack([-np.sin(p), np.sin(r) * np.cos(p), np.cos(r) * np.cos(p)], axis=-1)
    height = np.einsum("nfi,ni->nf", feet, up)
    standing = height <= height.min(axis=1, keepdims=True) + LOWEST
    return Contact(robot.leg_names, standing, "lowest feet")


def find_contact(log: Log, robot: Robot, *, start: float | None = None) -> Contact:
    """Contact from forces, else contact columns, else the schedule, else the lowest feet.

    `start` is the time at which a gait period begins [s]; None where it is not known.

    Raises:
        LegwattError: A start is given for a robot without a gait.
    """
    own = log_contact(log)
    if own is not None:
        return own
    if start is not None:
        return scheduled_contact(robot, log.time, start=start)
    return lowest_feet(robot, log.position, log.base_roll, log.base_pitch)


def changes_of_stance(contact: Contact | None, pieces: Sequence[slice]) -> NDArray[np.intp]:
    """Rows at which other feet stand than in the row before, not across gaps, shape (E,)."""
    if contact is None:
        return np.empty(0, dtype=np.intp)
    changed = (contact.standing[1:] != contact.standing[:-1]).any(axis=1)
    changed[[piece.start - 1 for piece in pieces if piece.start > 0]] = False
    return np.flatnonzero(changed) + 1
