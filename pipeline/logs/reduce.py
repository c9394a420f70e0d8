"""From rows as read to one grid and one bandwidth, column by column.

Several logs share one grid and one cut-off, chosen by what their channels hold. All series pass the
same zero-phase low-pass; then rows that say nothing more are dropped.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final

import numpy as np
import pandas as pd
from scipy.ndimage import uniform_filter1d

from actuators.arrays import Array, Mask
from actuators.errors import LegwattError
from pipeline.logs.checks import quantum
from pipeline.logs.filters import (
    FLAT,
    LARGEST_SHARE,
    SEEN,
    Grid,
    LowPass,
    by_piece,
    choose_cutoff,
    pieces_of,
    smoother_noise,
)
from pipeline.logs.log import UNUSED, Findings, Log, Recording, column_name
from pipeline.logs.speeds import FACTOR, changes, friction_sign, weigh, within
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


def find_contact(log: Recording, robot: Robot | None = None) -> tuple[Mask, str] | None:
    """Which feet stand, (N, F), and from what: forces, else contact columns, else the lowest feet.

    Args:
        log: As read.
        robot: With legs; None for one whose feet nothing but its log tells of.
    """
    if (force := log.foot_force) is not None:
        normal = force[..., 2]
        full = max(float(np.nanmax(normal, initial=0.0)), 1e-9)
        decided = np.where(normal > TOUCH * full, 1.0, np.where(normal < LIFT * full, 0.0, np.nan))
        # Undecided samples keep the last decision.
        return pd.DataFrame(decided).ffill().to_numpy() > 0.5, "forces"
    if (touching := log.contact) is not None:
        return touching, "columns"
    return None if robot is None else (_lowest(robot, log), "lowest feet")


def _lowest(robot: Robot, log: Recording) -> Mask:
    """Feet (N, F) within `LOWEST` of the lowest one along the vertical."""
    blocks = [slice(k, k + 4096) for k in range(0, len(log), 4096)]
    place = partial(foot_positions, robot.chains)
    q = pd.DataFrame(log.position).ffill().bfill().to_numpy()
    feet = by_piece(place, robot.chains.by_leg(q), blocks)
    angles = (log.of("base_roll"), log.of("base_pitch"))
    r, p = (np.zeros(len(log)) if angle is None else angle for angle in angles)
    # Third row of R_y(pitch) R_x(roll): the vertical in the base frame.
    up = np.stack([-np.sin(p), np.sin(r) * np.cos(p), np.cos(r) * np.cos(p)], axis=-1)
    height = np.einsum("nfi,ni->nf", feet, up)
    return np.asarray(height <= height.min(axis=1, keepdims=True) + LOWEST)


#: The kernel may not be longer than this share of the log.
LONGEST_KERNEL: Final = 0.1
#: Cut-off per own rate of a channel: bridging by straight lines takes 5 % at that frequency.
OWN_SHARE: Final = 0.125
#: Share of a log's time that may lie in longer steps: those are gaps, not the channel's rate ...
_IN_GAPS: Final = 0.02
#: ... as are steps this many times longer than the usual one.
_LONG: Final = 20.0
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
    logs: Sequence[Recording], *, cutoff: float | None = None, thinned: bool = True
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
    if not smallest <= (most if cutoff is None else cutoff) <= most:
        raise LegwattError(
            f"{logs[0].name}: {longest:.3g} s at {rate:.4g} Hz allow a cut-off of {smallest:.3g} "
            f"to {most:.4g} Hz; set one of these, or log longer or faster"
        )
    held = max(min(map(_held, logs)), smallest)
    asked, moved = [], []
    for log in logs:
        grid = Grid.under(log.time, dt, bridge=1.0 / (4.0 * held))
        raw = grid.bridged(log.time, log.position)
        stretches = [x for piece in grid.pieces if len(x := raw[piece]) >= 64]
        if stretches:
            step = np.array([quantum(q) for q in log.position.T])
            cutoffs, reach = choose_cutoff(stretches, rate, smallest=smallest, step=step)
            asked.append(cutoffs)
            moved.append(reach / FLAT)
    least = min(max(moved, default=0.0), most, held)
    if cutoff is not None:
        return Settings(dt, float(cutoff), "set by the user", least, thinned)
    per_joint = np.fmin.reduce(asked) if asked else np.full(1, np.nan)
    if np.isnan(per_joint).all():
        every = [x[np.isfinite(x)] for log in logs for x in log.position.T]
        # Further than positions scatter from row to row.
        if not any(
            np.ptp(x) > SEEN * np.median(np.abs(np.diff(x, n=2))) for x in every if x.size >= 10
        ):
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
    own, slowest = log.clock, 0.0
    flags = np.isfinite(np.hstack([log.position, log.efforts])).T
    for time in (own, *(log.time[ok] for ok in flags if ok.any() and not ok.all())):
        # The step that all but a little of the time keeps to, which lies in gaps.
        step = np.sort(np.diff(time))
        if step.size:
            passed = np.cumsum(step := step[step <= _LONG * step[step.size // 2]])
            slowest = max(slowest, step[np.searchsorted(passed, (1.0 - _IN_GAPS) * passed[-1])])
    # A step or two more than usual is what interpolation bridges anyway.
    return OWN_SHARE / slowest if slowest > 1.9 * float(np.median(np.diff(own))) else np.inf


class _OnGrid:
    """A log on a uniform grid, and the filter that it passes."""

    def __init__(self, log: Recording, settings: Settings, robot: Robot | None) -> None:
        self.log, self.settings, self.lowpass = log, settings, settings.lowpass
        self.grid = Grid.under(log.time, settings.dt, bridge=settings.bridged)
        self.pieces = self.grid.pieces
        self.contact = find_contact(log, robot)
        rate, cutoff = self.lowpass.rate, settings.cutoff
        self.above = LowPass(rate, max(settings.cutoff, settings.least))
        self.wide = LowPass(rate, min(WIDER * cutoff, LARGEST_SHARE * rate))
        self.calm = self._calm()

    def _calm(self) -> Mask:
        """Rows (N,) of the grid by which noise is told: no filter there sees a change of stance.

        The ground's forces jump at one, and legs change stance so often that such rows may be half
        of all: a median takes their jumps for noise. All rows where hardly any other is left.
        """
        calm: Mask = np.ones(self.grid.time.size, dtype=np.bool_)
        if self.contact is not None:
            change = changes(self.contact[0][self.grid.nearest], self.pieces)
            near = within(change, self.pieces, 2 * self.above.half)
            calm = ~np.asarray(near.any(axis=1))
        return calm if calm.mean() > _CALM else np.ones_like(calm)

    def values(self, x: Array) -> tuple[Array, Mask, Mask]:
        """Columns (N, C), short holes bridged; what is missing; where the filter sees enough."""
        longest = self.settings.bridged
        missing = [self.grid.missing(self.log.time, ok, longest) for ok in np.isfinite(x).T]
        none = np.stack(missing, axis=1)
        enough = self.lowpass.share(none, self.pieces) <= TOLERATED_SHARE
        return self.grid.bridged(self.log.time, x), none, enough

    def noise(self, x: Array, ok: Mask) -> Array:
        """Standard deviation of a sample of columns (N, C) on the grid, (C,); NaN: too few."""
        return smoother_noise(x, ok & self.calm[:, None], self.pieces, self.above)

    def smooth(self, x: Array | None) -> Array | None:
        """Columns (N, ...) of what acts on the prediction and shares its bandwidth."""
        if x is None:
            return None
        on = self.grid.bridged(self.log.time, x.reshape(len(self.log), -1))
        return self.lowpass.smooth(on, self.pieces).reshape(-1, *x.shape[1:])

    def motion(self, found: Findings) -> dict[str, Any]:
        """Series (N, J) of a `Log`'s motion, and its `rate_noise`."""
        log, lowpass, pieces = self.log, self.lowpass, self.pieces
        raw, _, seen = self.values(log.position)
        value, speed, rate = lowpass.derivatives(raw, pieces)
        scatter, other = self.noise(raw, seen), lowpass.noises(raw, pieces)[2]
        steps = np.array([quantum(q) for q in log.position.T])
        coarse = np.maximum(np.nan_to_num(scatter), steps / np.sqrt(12.0))
        rate_noise = np.outer(lowpass.gains[1:], np.nan_to_num(scatter))
        speed_noise = coarse * lowpass.gains[1]
        if (measured := log.of("velocity")) is not None:
            column, _, told = self.values(measured)
            noises = np.stack([scatter, self.noise(column, told)])
            column[~told] = np.nan
            for j in np.flatnonzero(told.any(axis=0)).tolist():
                rates = speed[:, j], rate[:, j]
                factor, own = weigh(
                    self.grid.time, column[:, j], rates, seen[:, j], noises[:, j], lowpass, pieces
                )
                if abs(factor - 1.0) > FACTOR:
                    detail = f"is {factor:.3g} times the rate of the position and has no say; if "
                    detail += "its unit or sign is another one, say so in the mapping"
                    name = column_name(log.joints[j], "velocity")
                    found.note(name, "rate", "warning", detail, factor)
                if own is not None:
                    straight, weights, rate_noise[:, j] = own
                    speed_noise[j] = rate_noise[0, j]
                    first, second, _ = lowpass.derivatives(straight, pieces)
                    theirs = first, second, lowpass.noises(straight, pieces)[1]
                    shares = [np.where(told[:, j], weights[k], 0.0) for k in (0, 1, 1)]
                    for x, y, share in zip((speed, rate, other), theirs, shares, strict=True):
                        x[:, j] += share * (y - x[:, j])
        # The sign of the speed: at a wider band rows that the filter mixes are told apart.
        fast, wider = self.wide.derivatives(raw, pieces)[1], coarse * self.wide.gains[1]
        signs = [
            friction_sign(v, s, w, sw, pieces, lowpass)
            for v, s, w, sw in zip(speed.T, speed_noise, fast.T, wider, strict=True)
        ]
        sign, unsure = (np.stack(x, axis=1) for x in zip(*signs, strict=True))
        # Rows that are left out have a say in those that stay.
        size = 2 * (self.settings.step // 2) + 1
        near = partial(uniform_filter1d, size=size, axis=0, mode="nearest")
        out = {"q": value, "v": speed, "a": rate, "a_noise": other, "moved": seen}
        out |= {"sign": by_piece(near, sign, pieces), "unsure": unsure}
        motor = None if log.at_motor else log.of("motor_position")
        if motor is not None:
            ahead, _, told = self.values(motor)
            known = told & (np.isfinite(motor).mean(axis=0) >= 0.5)
            out["windup"] = np.where(known, lowpass.smooth(ahead, pieces) - value, np.nan)
        return out | {"rate_noise": rate_noise}

    def feet(self, found: Findings) -> dict[str, Any]:
        """Which feet stand, their forces [N], and the noise of a component of one.

        Sensors of feet in the air show noise alone, or nothing at all.
        """
        if self.contact is None:
            return {}
        found.note("", "contact", "ok", f"which feet stand is known by {self.contact[1]}")
        stands = self.contact[0][self.grid.nearest]
        measured, force = self.log.foot_force, self.smooth(self.log.foot_force)
        if force is None or measured is None:
            return {"standing": stands}
        # A component that no column gives is NaN from end to end.
        force = np.where(np.isnan(measured).all(axis=0), np.nan, force)
        each = self.grid.bridged(self.log.time, measured.reshape(len(self.log), -1))
        noise = self.noise(each, np.repeat(stands, 3, axis=1))
        shaking = noise[noise > 0.0]
        own = float(np.median(shaking)) * self.lowpass.gains[0] if shaking.size else None
        force = np.where(stands[..., None], force, 0.0)
        return {"standing": stands, "foot_force": force, "foot_noise": own}


def reduced(log: Recording, settings: Settings, robot: Robot | None = None) -> Log:
    """Bring a log to its grid and bandwidth. Its rows have no part yet.

    Args:
        log: As read.
        settings: From `choose_settings`.
        robot: Whose feet stand; None for a fixed base.
    """
    on, found = _OnGrid(log, settings, robot), Findings(log.name)
    channels: tuple[str, ...] = (log.effort,)
    if log.effort == "current" and log.of("voltage") is not None:
        channels = ("current", "voltage")
    each = [log.efforts, *(x for c in channels[1:] if (x := log.of(c)) is not None)]
    values = [on.values(x) for x in each]
    smooth = [np.where(none, np.nan, on.lowpass.smooth(x, on.pieces)) for x, none, _ in values]
    effort, (raw, _, felt) = np.stack(smooth, axis=-1), values[0]
    noise = np.stack([on.noise(x, enough) for x, _, enough in values], axis=1)
    noise *= on.lowpass.gains[0]
    # A joint without enough good samples has no floor of its own; it is masked anyway.
    usual = [np.nanmedian(x) if np.isfinite(x).any() else 1.0 for x in noise.T]
    off, idle = log.torque_off, None
    if off is not None:
        off = off[on.grid.nearest]
        if log.torque_off_bridge == "open" and channels[0] != "torque" and len(channels) == 1:
            # No current flows: where the filter sees nothing else the effort is zero, and the
            # motion alone says what friction and inertia are.
            idle = on.lowpass.share(~off, on.pieces) <= 1e-9
            effort[idle] = 0.0
            felt |= idle
    felt &= np.isfinite(effort).all(axis=2)
    turning = [x for a in "xyz" if (x := log.of(f"base_angular_velocity_{a}")) is not None]
    warm = log.of("temperature")
    if warm is not None:  # known of every joint or of none
        warm = on.grid.bridged(log.time, warm) if np.isfinite(warm).all() else None
    series: dict[str, Any] = on.motion(found) | (on.feet(found) if robot is not None else {})
    series |= {x: on.smooth(log.of(x)) for x in ("base_roll", "base_pitch", "base_yaw")}
    series |= {
        "time": on.grid.time,
        "effort": np.nan_to_num(effort),
        "raw": np.where(np.isfinite(log.efforts).any(axis=0), raw, np.nan),
        "mask": np.ones(felt.shape, dtype=np.bool_),
        "part": np.full(felt.shape[0], UNUSED, dtype=np.int8),
        "base_rate": on.smooth(np.stack(turning, axis=1)) if len(turning) == 3 else None,
        "open_winding": None if idle is None else off,
        "temperature": warm,
        "off": off,
    }
    found.note("", "cutoff", "ok", settings.reason, settings.cutoff, "Hz")
    whole = Log(
        name=log.name,
        joints=log.joints,
        channels=channels,
        noise=np.where(np.isfinite(noise), noise, usual),
        pieces=on.pieces,
        bandwidth=settings.cutoff,
        at_motor=log.at_motor,
        sha256=log.sha256,
        findings=tuple(found),
        recording=log,
        **series,
    )
    takers: dict[str, Mask] = {NO_MOTION: ~series["moved"].all(axis=1)[:, None], NO_EFFORT: ~felt}
    if off is not None:
        takers[DRIVE_OFF] = off if idle is None else off & ~idle
    kept = [np.arange(p.start, p.stop, settings.step) for p in on.pieces]
    out = whole.without(takers).at(np.concatenate(kept))
    filtered = LowPass(1.0 / (settings.dt * settings.step), settings.cutoff)
    return replace(out, known=out.mask, pieces=pieces_of(map(len, kept)), filter=filtered)
