"""Columns that are not what their names say: what a motion asks of a machine, column by column.

Along a motion, joint j of a machine can ask for any torque of

    X_j c, c >= 0:  masses at points in and around each link that it carries (every set of masses is
                    a body, and every body nearly such a set), dry, load-dependent, viscous friction
                    and drag, which take energy, and the rotor's inertia.

What such a combination leaves of the effort in column i, least squares with c >= 0 (Lawson and
Hanson 1974), is the entry (i, j) of a matrix: measured against predicted. Its diagonal says whether
columns are what their names say. Columns are accused last: another entry, sign, delay or reading of
a position counts only where it leaves little, and less than half of what the log as it is leaves
with everything that bodies, friction and drag may do. What is left after that is size: a unit or
the ratio of a gear, which no body can be. Gains that are no unit and delays of milliseconds are the
machine's or the log's, and the estimate names them.

Of a floating base the legs in the air are judged: on the others the ground pushes as it likes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
import pinocchio as pin
from scipy.optimize import nnls
from scipy.signal import butter, sosfiltfilt

from actuators.arrays import Array, Index, Mask
from pipeline.dynamics.residual import EquationsOfMotion
from pipeline.dynamics.residual_columns import body_columns
from pipeline.logs.log import Log
from pipeline.machine.machine import MachineModel
from pipeline.simulation.equations import Moved, motion_of
from pipeline.simulation.on_legs import is_on_legs
from pipeline.simulation.predict import Simulator

DEG: Final = 180.0 / np.pi
#: Rows that are compared, of all logs together: a motion of a minute has a few hundred that differ.
ROWS: Final = 600
#: Noise of the accelerations in all of them, root mean square, up to which a motion is told.
QUIET: Final = 0.3
#: Share of an effort, root mean square, that honest machines leave: nothing more is asked.
FLOOR: Final = 0.1
#: ... and that makes one look for another reading at all.
ODD: Final = 0.2
#: Share that may be left where a reading is to explain an effort ...
WELL: Final = 0.5
#: ... and share of what was left before: 22 in place of 24 % is no reason to accuse a column.
HALVED: Final = 0.5
#: Where as much is left in the middle of the joints by any reading, nothing follows the motion.
LOST: Final = 0.75
#: Share of the largest gain within which readings count as alike: the simplest is taken.
ALIKE: Final = 0.8
#: Share of what friction alone leaves that bodies as given, of any size, have to bring it below.
TOLD: Final = 0.7
#: Factor on an effort that bodies may be wrong by: a URDF's masses are guesses at times.
BODIES: Final = 2.5
#: ... and from which none of a robot's files is that wrong, unit or not.
FAR: Final = 5.0
#: Distance from a unit or a ratio within which an odd factor is taken for it.
NEAR: Final = 1.4
#: ... and for factors so small that bodies may be them: only where all joints agree within this.
EXACT: Final = 0.01
#: Delays that are tried [s]: shorter ones are the machine's, and the estimate has them.
DELAYS: Final = (0.04, 0.07, 0.12, 0.2)
#: Units in which efforts come by mistake, and what they then are.
UNITS: Final = {
    "torque": {1e3: "mN*m", 1e2: "N*cm", 1e-3: "kN*m"},
    "current": {1e3: "mA", 1e-3: "kA"},
    "voltage": {1e3: "mV", 1e-3: "kV"},
    "power": {1e3: "mW", 1e-3: "kW"},
}
#: Amplitudes for effective values of three phases.
ROOTS: Final = {2**0.5: "sqrt 2", 1.5**0.5: "sqrt 3/2", 2**-0.5: "1/sqrt 2", 1.5**-0.5: "sqrt 2/3"}
#: Positions of a motor whose gear is not known, and zeros.
RATIOS: Final = tuple(np.geomspace(3.0, 300.0, 11))
ZEROS: Final = tuple(k * np.pi / 6 for k in range(-5, 7) if k)
#: The simplest first.
CAUSES: Final = (
    *("sign", "exchanged", "late", "both_exchanged"),
    *("position_sign", "position_scale", "position_zero", "scale"),
)
_STEPS: Final = 8
_FEWEST: Final = 60
_TINY: Final = 1e-300


@dataclass(frozen=True, eq=False)
class Reading:
    """What each joint's effort and position are read from."""

    effort_of: Index  #: Column of the effort, shape (J,).
    effort_factor: Array  #: On it, shape (J,).
    late: Array  #: By which it comes late, shape (J,) [s].
    position_of: Index  #: Column of the position, shape (J,).
    position_factor: Array  #: On it, shape (J,).
    zero: Array  #: Added to it, shape (J,) [rad].

    def changed(self, cause: str, joints: Sequence[int], size: float) -> Reading:
        """The same without one thing that is wrong at some joints."""
        which, other = list(joints), list(joints[::-1])
        new = {
            name: getattr(self, name).copy() for name in ("effort_of", "effort_factor", "late")
        } | {
            name: getattr(self, name).copy() for name in ("position_of", "position_factor", "zero")
        }
        if cause in ("exchanged", "both_exchanged"):
            new["effort_of"][which] = self.effort_of[other]
        if cause == "both_exchanged":
            new["position_of"][which] = self.position_of[other]
        if cause in ("sign", "scale"):
            new["effort_factor"][which] /= -1.0 if cause == "sign" else size
        if cause in ("position_sign", "position_scale"):
            new["position_factor"][which] /= -1.0 if cause == "position_sign" else size
        if cause == "late":
            new["late"][which] += size
        if cause == "position_zero":
            new["zero"][which] -= size
        return replace(self, **new)

    @property
    def motion(self) -> bytes:
        """Equal for readings with equal positions."""
        parts = (self.position_of, self.position_factor, self.zero)
        return b"".join(x.tobytes() for x in parts)


def as_named(joints: int) -> Reading:
    """Every column is what its name says."""
    own, one, none = np.arange(joints), np.ones(joints), np.zeros(joints)
    return Reading(own, one, none, own, one, none)


@dataclass(frozen=True, eq=False)
class Step:
    """One thing that is wrong, and the evidence."""

    cause: (
        str  #: One of `CAUSES`, ``"pushed"`` (by the ground) or ``"lost"`` (no reading explains).
    )
    joints: tuple[int, ...]  #: Whose columns.
    size: float = 1.0  #: Factor, delay [s] or zero [rad].
    what: str = ""  #: What a factor is.
    before: float = np.nan  #: Share of their efforts left as logged, root mean square.
    after: float = np.nan  #: ... and mended.


@dataclass(frozen=True, eq=False)
class _Asked:
    """What a machine can ask for along one motion."""

    torque: Array  #: By the model as given, shape (N, J) [N*m].
    columns: list[Array]  #: Of each joint, all with coefficients of at least zero, (N, K_j).
    pushes: list[Array]  #: Likewise of its ends pushed up from outside.
    own: Array  #: Effort that its drives take beside it, shape (N, J) in the channel's unit.
    slope: Array  #: Effort per torque, shape (J,).
    velocity: Array  #: Shape (N, J) [rad/s].


@dataclass(eq=False)
class Gate:
    """Measured efforts against what a machine can ask for, over all its logs."""

    model: MachineModel
    logs: Sequence[Log]
    ratio: Array | None = None  #: Of gears, shape (J,), where they are known.
    by_law: bool = False  #: Whether the torque was computed from targets and servo gains.
    _rows: list[Index] = field(init=False)
    _asked: dict[bytes, _Asked] = field(default_factory=dict, init=False)
    _left: dict[tuple[object, ...], float] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        self.logs = [_calm(m) for m in self.logs]
        every = max(1, sum(len(m) for m in self.logs) // ROWS)
        self._rows = [np.arange(0, len(m), every) for m in self.logs]
        self.moved = [motion_of(self.model, m) for m in self.logs]
        parts = [
            _counted(self.model, m, own)[rows]
            for m, own, rows in zip(self.logs, self.moved, self._rows, strict=True)
        ]
        self.mask = np.concatenate(parts)

    @property
    def channel(self) -> str:
        """That is compared."""
        return self.logs[0].channels[0]

    def steps(self) -> list[Step]:
        """What is wrong with the columns, each with its evidence; nothing where nothing is."""
        count = len(self.model.joints)
        reading = as_named(count)
        copied = self._copied()
        if copied:
            return copied
        shares = self._shares(reading)
        out: list[Step] = []
        while len(out) < _STEPS and (np.nan_to_num(shares) > ODD).any():
            step = self._best(reading, shares)
            if step is None:
                break
            out.append(step)
            if step.cause == "pushed":
                return out
            reading = reading.changed(step.cause, step.joints, step.size)
            shares = self._shares(reading)
        judged = np.isfinite(shares)
        if judged.any() and not out and float(np.median(shares[judged])) > LOST:
            return [Step("lost", (), before=_rms(shares[judged]))]
        return [*out, *self._sizes(reading, shares)]

    @property
    def judged(self) -> list[int]:
        """Joints with rows enough."""
        return np.flatnonzero(self.mask.sum(axis=0) >= _FEWEST).tolist()

    # What is left.

    def asked(self, reading: Reading) -> _Asked:
        """What the machine can ask for where positions are read so."""
        key = reading.motion
        if key not in self._asked:
            parts = [
                self._along(m, own, rows, reading)
                for m, own, rows in zip(self.logs, self.moved, self._rows, strict=True)
            ]
            self._asked[key] = _joined(parts)
        return self._asked[key]

    def _along(self, m: Log, own: Moved, rows: Index, r: Reading) -> _Asked:
        sign = np.tanh(m.v / m.rest_speed) if m.sign is None else m.sign
        if (r.motion == as_named(len(self.model.joints)).motion) or self.model.floating:
            moved, thin = own, m.at(rows)
            q, v, a = own.motion
            motion = (q[rows], v[rows], a[rows])
            sign = sign[rows]
        else:
            thin, of, factor = m.at(rows), r.position_of, r.position_factor
            q, v, a = (x[:, of] * factor for x in (thin.q, thin.v, thin.a))
            sign = sign[rows][:, of] * np.sign(factor)
            thin = replace(thin, q=q + r.zero, v=v, a=a, sign=sign)
            moved = motion_of(self.model, thin)
            motion = moved.motion
        equations = EquationsOfMotion(moved.rigid, motion, np.zeros((0, 0)), np.zeros((0, 0)))
        torque = equations.rigid[:, moved.joints]
        points, ends = _points(moved.rigid)
        regressor = body_columns(replace(equations, torque=torque))[:, moved.joints]
        still = np.zeros_like(motion[1])
        weight = replace(equations, motion=(motion[0], still, still), torque=torque)
        pushes = -body_columns(weight)[:, moved.joints] @ ends
        masses = regressor @ points
        simulator = Simulator(thin)
        drives, slope = self._of_drives(simulator)
        columns, pushed = [], []
        for j in range(torque.shape[1]):
            v, s = thin.v[:, j], sign[:, j]
            laws = (s, v, np.abs(torque[:, j]) * s, v * np.abs(v), thin.a[:, j])
            every = np.column_stack([masses[:, j], *laws])
            columns.append(every)
            pushed.append(pushes[:, j])
        return _Asked(torque, columns, pushed, drives, slope, thin.v)

    def _of_drives(self, simulator: Simulator) -> tuple[Array, Array]:
        """Effort that drives take beside bodies (N, J), and effort per torque (J,)."""
        m = simulator.measurement
        if is_on_legs(self.model, m):
            return np.nan_to_num(m.effort[..., 0]) - simulator.load(self.model), np.ones(
                m.q.shape[1]
            )
        predicted = simulator.predict(self.model)
        load, effort = predicted.torque, predicted.effort[..., 0]
        more = simulator.predict(_heavier(self.model), predicted)
        change, seen = more.torque - load, more.effort[..., 0] - effort
        slope = (change * seen).sum(axis=0) / np.maximum((change**2).sum(axis=0), _TINY)
        # A joint that carries nothing says nothing of its drive.
        slope = np.where(np.abs(slope) > 1e-9, slope, 1.0)
        return effort - slope * load, slope

    def effort(self, late: float) -> Array:
        """Efforts as logged, of columns taken to be late by some time [s], shape (N, J)."""
        parts = []
        for m, rows in zip(self.logs, self._rows, strict=True):
            y = m.effort[..., 0]
            if late:
                y = np.stack([np.interp(m.time + late, m.time, own) for own in y.T], axis=1)
            parts.append(y[rows])
        return np.concatenate(parts)

    def _share(self, r: Reading, j: int, *, pushed: bool = False) -> float:
        """What is left of joint j's effort by a reading, over the effort; NaN with too few rows."""
        key = (
            r.motion,
            j,
            int(r.effort_of[j]),
            float(r.effort_factor[j]),
            float(r.late[j]),
            pushed,
        )
        if key not in self._left:
            self._left[key] = self._solved(r, j, pushed=pushed)
        return self._left[key]

    def _solved(self, r: Reading, j: int, *, pushed: bool) -> float:
        i, asked = int(r.effort_of[j]), self.asked(r)
        rows = np.flatnonzero(self.mask[:, i] & self.mask[:, j] & self.mask[:, r.position_of[j]])
        X = asked.columns[j][rows]
        if pushed:
            X = np.hstack([X, asked.pushes[j][rows]])
        if rows.size < max(_FEWEST, X.shape[1] // 2):
            return np.nan
        t = self._torque(r, j, asked)[rows]
        size = np.sqrt((X**2).sum(axis=0))
        seen = size > 1e-9 * size.max()
        whole = np.linalg.norm(self.effort(0.0)[rows, i] * r.effort_factor[j] / asked.slope[j])
        both = np.column_stack([X[:, seen] / size[seen], t / (whole + _TINY)])
        # The root of the normal equations says as much as all rows do.
        R = np.linalg.cholesky(both.T @ both + 1e-10 * np.eye(both.shape[1])).T
        left = float(nnls(R[:, :-1], R[:, -1], maxiter=20 * R.shape[1])[1])
        # What is noise accuses nobody.
        noise = np.sqrt(np.mean([m.noise[i, 0] ** 2 for m in self.logs])) / asked.slope[j]
        noise *= r.effort_factor[j] * np.sqrt(rows.size) / (whole + _TINY)
        return float(np.sqrt(max(left**2 - noise**2, 0.0)))

    def _torque(self, r: Reading, j: int, asked: _Asked) -> Array:
        """Torque that a joint's effort stands for by a reading, shape (N,) [N*m]."""
        y = self.effort(float(r.late[j]))[:, r.effort_of[j]] * r.effort_factor[j]
        return np.asarray((y - asked.own[:, j]) / asked.slope[j])

    def _shares(self, r: Reading) -> Array:
        return np.array([self._share(r, j) for j in range(len(self.model.joints))])

    # What may be wrong.

    def _best(self, start: Reading, before: Array) -> Step | None:
        """The simplest reading that explains about as much as the best, its size refined."""
        gains: dict[str, tuple[float, Step]] = {}
        count = int((np.nan_to_num(before) > ODD).sum())
        for cause, joints, size in self._tries(start, before):
            done = (s for _, s in gains.values() if s.after < FLOOR and len(s.joints) == count)
            if cause.startswith("position") and any(done):
                break  # what efforts alone explain is no matter of positions
            tried = self._gain(start, before, cause, joints, size)
            if tried is not None and tried[0] > gains.get(cause, (0.0, None))[0]:
                gains[cause] = tried
        for cause, (_, step) in list(gains.items()):
            gains[cause] = self._refined(start, before, step)
        pushed = self._pushed(start, before)
        if not gains:
            return None if pushed is None else pushed[1]
        if pushed is not None and pushed[1].after <= min(step.after for _, step in gains.values()):
            return pushed[1]
        most = max(gain for gain, _ in gains.values())
        return next(gains[c][1] for c in CAUSES if c in gains and gains[c][0] >= ALIKE * most)

    def _tries(self, r: Reading, shares: Array) -> Iterator[tuple[str, tuple[int, ...], float]]:
        live = [j for j in range(shares.size) if np.isfinite(shares[j])]
        odd = [j for j in live if shares[j] > ODD]
        every = tuple(live)
        groups = [*((j,) for j in odd), *((every,) if len(live) > 1 else ())]
        for group in groups:
            yield "sign", group, 1.0
            yield from (("late", group, late) for late in DELAYS)
        pairs = [(i, j) for i in odd for j in live if i < j or j not in odd]
        for pair in pairs:
            yield "exchanged", pair, 1.0
        if self.model.floating:
            return
        # Which joint's position is wrong shows in its neighbours' efforts, too.
        near = [j for j in live if any(abs(j - k) <= 1 for k in odd)]
        for group in (*((j,) for j in near), *((every,) if len(live) > 1 else ())):
            yield "position_sign", group, 1.0
            for factor in (DEG, *(RATIOS if self.ratio is None else self._known_ratios(group))):
                yield "position_scale", group, factor
            if len(group) == 1:
                yield from (("position_zero", group, zero) for zero in ZEROS)
        for pair in pairs:
            yield "both_exchanged", pair, 1.0

    def _gain(
        self, start: Reading, before: Array, cause: str, joints: tuple[int, ...], size: float
    ) -> tuple[float, Step] | None:
        """By how much the logarithms of all shares fall; None where a reading does not explain."""
        r = start.changed(cause, joints, size)
        which = list(joints)
        if cause.startswith(("position", "both")):
            touched = [j for j in range(before.size) if np.isfinite(before[j])]
        else:
            touched = which
        after = before.copy()
        after[touched] = [self._share(r, j) for j in touched]
        if not np.isfinite(after[which]).all():
            return None
        # A position acts on its neighbours' efforts, too: those that were odd have to heal.
        told = [j for j in touched if before[j] > ODD] if touched is not which else which
        if not told:
            return None
        b, a = _rms(before[told]), _rms(after[told])
        if a >= min(WELL, HALVED * b):
            return None
        falls = np.log(np.maximum(before, FLOOR) / np.maximum(after, FLOOR))
        what = ""
        if cause == "position_scale":
            motors = dict.fromkeys(self._known_ratios(joints), "it is that of the motor")
            what = ({DEG: "it is in degrees"} | motors).get(size, "")
        return float(np.nansum(falls)), Step(cause, joints, size, what, b, a)

    def _refined(self, start: Reading, before: Array, step: Step) -> tuple[float, Step]:
        """With the size that explains most; a unit and a known ratio stay."""
        first = self._gain(start, before, step.cause, step.joints, step.size)
        assert first is not None
        known = {DEG, *self._known_ratios(step.joints)}
        grid = {"late": 0.02, "position_zero": 0.25, "position_scale": 0.25}
        if step.cause not in grid or (step.cause == "position_scale" and step.size in known):
            return first
        width, best = grid[step.cause], first
        relative = step.cause == "position_scale"
        for _ in range(5):
            at = best[1].size
            ends = (at * (1 + width), at / (1 + width)) if relative else (at + width, at - width)
            tried = (self._gain(start, before, step.cause, step.joints, s) for s in ends)
            best = max((best, *(t for t in tried if t)), key=lambda t: (-t[1].after, t[0]))
            width /= 2
        return best

    def _pushed(self, r: Reading, before: Array) -> tuple[float, Step] | None:
        """Whether ends of a machine on a fixed base are pushed up, as by the ground."""
        if self.model.floating:
            return None
        odd = [j for j in range(before.size) if before[j] > ODD]
        after = np.array([self._share(r, j, pushed=True) for j in odd])
        b, a = _rms(before[odd]), _rms(after)
        if not a < min(WELL, HALVED * b):
            return None
        falls = np.log(np.maximum(before[odd], FLOOR) / np.maximum(after, FLOOR))
        return float(falls.sum()), Step("pushed", tuple(odd), before=b, after=a)

    # Sizes.

    def _sizes(self, r: Reading, shares: Array) -> list[Step]:
        """Efforts that are explained, in another unit or on the other side of a gear."""
        asked = self.asked(r)
        gains = np.full(shares.size, np.nan)
        for j in map(int, np.flatnonzero(np.nan_to_num(shares, nan=1.0) < WELL)):
            rows = np.flatnonzero(self.mask[:, j])
            model, t = asked.torque[rows, j], self._torque(r, j, asked)[rows]
            laws = asked.columns[j][rows, -5:]
            size = np.sqrt((np.column_stack([model, laws]) ** 2).sum(axis=0))
            X = np.column_stack([model, laws]) / np.maximum(size, _TINY)
            c, left = nnls(X, t)
            # Where friction alone leaves as little, a size says nothing of bodies.
            if size[0] > 0.0 and left < TOLD * nnls(X[:, 1:], t)[1]:
                gains[j] = float(c[0] / size[0])
        live = np.flatnonzero(gains > 0.0)
        if live.size == 0:
            return []
        logs = np.log(gains[live])
        middle = float(np.median(logs))
        alike = bool((np.abs(logs - middle) < np.log(NEAR)).all())
        if self.channel == "current" and live.size > 1:
            for factor, what in ROOTS.items():
                if (np.abs(logs - np.log(factor)) < EXACT).all():
                    return [
                        Step("scale", tuple(live.tolist()), factor, f"effective values, {what}")
                    ]
        if alike and abs(middle) > np.log(BODIES):
            found = self._named(live.tolist(), float(np.exp(middle)))
            if found is not None or abs(middle) > np.log(FAR):
                size, what = found or (float(f"{np.exp(middle):.3g}"), "")
                return [Step("scale", tuple(live.tolist()), size, what)]
        if self.by_law and live.size > 1 and (np.abs(logs - middle) < 0.1 < abs(middle)).all():
            return [Step("servo", tuple(live.tolist()), float(f"{np.exp(middle):.3g}"))]
        out = []
        for k, own in enumerate(logs.tolist()):
            j, others = int(live[k]), np.delete(logs, k)
            if others.size == 0 or np.abs(np.median(others)) > np.log(BODIES):
                continue
            found = self._named([j], float(np.exp(own)))
            if abs(own) > np.log(FAR) or (abs(own) > np.log(BODIES) and found is not None):
                out.append(Step("scale", (j,), *(found or (float(f"{np.exp(own):.3g}"), ""))))
        return out

    def _named(self, joints: list[int], size: float) -> tuple[float, str] | None:
        known = {f: f"it is in {unit}" for f, unit in UNITS[self.channel].items()}
        for ratio in self._known_ratios(joints):
            known |= {1.0 / ratio: "it is that of the motor", ratio: "it is at the joint already"}
        near = [f for f in known if abs(np.log(size / f)) < np.log(NEAR)]
        if not near:
            return None
        best = min(near, key=lambda f: float(abs(np.log(size / f))))
        return best, known[best]

    def _known_ratios(self, joints: Sequence[int]) -> tuple[float, ...]:
        """The ratio of these joints' gears where it is known and one, without those that are 1."""
        of = set() if self.ratio is None else {abs(float(self.ratio[j])) for j in joints}
        return tuple(of - {1.0}) if len(of) == 1 else ()

    def _copied(self) -> list[Step]:
        """Efforts that are velocities under a wrong name, though bodies ask for an effort."""
        asked, y, out = self.asked(as_named(len(self.model.joints))), self.effort(0.0), []
        for j in range(len(self.model.joints)):
            rows = np.flatnonzero(self.mask[:, j])
            if rows.size < _FEWEST:
                continue
            v, t, own = asked.velocity[rows, j], y[rows, j], asked.torque[rows, j]
            factor = float(v @ t) / max(float(v @ v), _TINY)
            rest, bodies = (
                np.linalg.norm(x - float(v @ x) / max(float(v @ v), _TINY) * v)
                / (np.linalg.norm(x) + _TINY)
                for x in (t, own)
            )
            units = (1.0, DEG, 30.0 / np.pi, 1e3)
            if rest < FLOOR < bodies and any(abs(abs(factor) / u - 1.0) < 0.05 for u in units):
                out.append(Step("velocity", (j,), factor))
        return out


def _heavier(model: MachineModel) -> MachineModel:
    """The same with all bodies a tenth heavier."""
    bodies = model.bodies
    for joint in model.links.values():
        own = bodies.body(joint)
        bodies = bodies.with_body(joint, replace(own, scale=1.1 * own.scale))
    return model.with_bodies(bodies)


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(np.square(x)))) if np.size(x) else np.nan


def _calm(m: Log) -> Log:
    """A log at the band in which the accelerations of most joints are more than noise."""
    if m.rate_noise is None or not np.isfinite(m.bandwidth):
        return m
    cutoff, out = m.bandwidth, m
    for _ in range(10):
        noise = m.rate_noise[1] * (cutoff / m.bandwidth) ** 2.5
        if np.median(noise / np.maximum(out.a.std(axis=0), _TINY)) < QUIET:
            return out
        cutoff /= 2.0
        sos = butter(2, min(2.0 * cutoff / m.rate, 0.9), output="sos")
        series = {}
        for name in ("q", "v", "a", "effort", "sign"):
            x = getattr(m, name)
            parts = [] if x is None else [x[piece] for piece in m.pieces]
            series[name] = x if x is None else np.concatenate([_smoothed(sos, y) for y in parts])
        out = m.with_changes(**series)
    return m


def _smoothed(sos: Array, x: Array) -> Array:
    return np.asarray(sosfiltfilt(sos, x, axis=0)) if len(x) > 20 else x


def _counted(model: MachineModel, m: Log, moved: Moved) -> Mask:
    """Rows that count, (N, J): of legs on the ground none, since it pushes as it likes."""
    mask = m.mask if m.known is None else m.known
    stance = moved.stance
    if stance is None or model.legs is None:
        return mask
    free = np.ones_like(mask)
    for leg in range(stance.standing.shape[1]):
        touches = stance.standing[:, leg] | stance.near[:, leg]
        free[:, model.legs.of(leg)] = ~touches[:, None]
    return mask & free & stance.carried.determined[:, None]


def _points(model: pin.Model) -> tuple[Array, Array]:
    """Unit masses as inertial parameters: around every body's, and at ends, (10 B, K), (10 B, E).

    Corners of a cube of half an edge of the body's radius of gyration, or half the way to its
    centre of mass, about that centre; for a body that ends a chain also twice as far out.
    """
    parents = set(list(model.parents)[1:])
    places: list[tuple[int, Array]] = []
    ends: list[tuple[int, Array]] = []
    for b in range(1, model.njoints):
        body = model.inertias[b]
        if body.mass <= 0.0:
            continue
        c = np.asarray(body.lever)
        radius = float(np.sqrt(max(np.trace(body.inertia), 0.0) / 2.0 / body.mass))
        half = max(radius, 0.5 * float(np.linalg.norm(c)), 1e-3)
        corners = np.array(np.meshgrid(*3 * [(-half, half)])).reshape(3, -1).T
        places += [(b, c + corner) for corner in (np.zeros(3), *corners)]
        if b not in parents:
            places.append((b, 2.0 * c))
            ends.append((b, 2.0 * c))
    return tuple(_parameters(model, some) for some in (places, ends))  # type: ignore[return-value]


def _parameters(model: pin.Model, places: Sequence[tuple[int, Array]]) -> Array:
    out = np.zeros((10 * (model.njoints - 1), len(places)))
    for k, (b, place) in enumerate(places):
        point = pin.Inertia(1.0, place, np.zeros((3, 3)))
        out[10 * (b - 1) : 10 * b, k] = point.toDynamicParameters()
    return out


def _joined(parts: Sequence[_Asked]) -> _Asked:
    def joined(of: Callable[[_Asked], Array]) -> Array:
        return np.concatenate([of(part) for part in parts])

    joints = range(parts[0].torque.shape[1])
    return _Asked(
        joined(lambda x: x.torque),
        [joined(lambda x, j=j: x.columns[j]) for j in joints],  # type: ignore[misc]
        [joined(lambda x, j=j: x.pushes[j]) for j in joints],  # type: ignore[misc]
        joined(lambda x: x.own),
        np.median([part.slope for part in parts], axis=0),
        joined(lambda x: x.velocity),
    )
