"""Columns that are not what their names say: what a motion asks of a machine, column by column.

Along a motion, joint j of a machine can ask for any torque of

    X_j c, c >= 0:  masses at points in and around each link that it carries (every set of masses is
                    a body, and every body nearly such a set), dry friction, at once or over a
                    travel, load-dependent and viscous friction and drag, which take energy, and
                    the rotor's inertia.

What such a combination leaves of the effort in column i, least squares with c >= 0 (Lawson and
Hanson 1974), is the entry (i, j) of a matrix: measured against predicted. Its diagonal says whether
columns are what their names say. Columns are accused last: another entry, sign, delay or reading of
a position counts only where it leaves little, and less than half of what the log as it is leaves
with everything that bodies, friction and drag may do; nor where a spring leaves less than half of
that. What is left after that is size: a unit or
the ratio of a gear, which no body can be. Gains that are no unit and delays of milliseconds are the
machine's or the log's, and the estimate names them.

Of a floating base the legs in the air are judged: on the others the ground pushes as it likes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar, nnls

from actuators.arrays import Array, Index, Mask
from actuators.elements.element import presliding
from pipeline.dynamics.residual import body_columns
from pipeline.identification.offered import TRAVELS
from pipeline.identification.settings import (
    ALIKE,
    BODIES,
    CHANCE,
    EXACT,
    FAR,
    FEWEST_COMPARED,
    FLOOR,
    HALVED,
    LEFT,
    LOST,
    NEAR,
    SHIFTS,
    TOLD,
    WELL,
)
from pipeline.logs.log import EFFORTS, Finding, Log, Recording, column_name
from pipeline.logs.read import AS_NAMED
from pipeline.logs.reduce import find_contact
from pipeline.machine.machine import MachineModel
from pipeline.simulation.equations import Moved, is_on_legs, motion_of
from pipeline.simulation.predict import Simulator

DEG: Final = 180.0 / np.pi
#: Rows that are compared, of all logs together: a motion of a minute has a few hundred that differ.
ROWS: Final = 600
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
#: Check under which a suspicion stands that no fit may explain away.
SUSPECTED: Final = "columns"
#: ... and under which a factor that is no unit does: bodies may be it, which a fit can show.
SIZE: Final = "size"
#: What is wrong with efforts or positions, the simplest first, in words.
CAUSES: Final = {
    "sign": "the sign of the {channel} is turned",
    "exchanged": "the {channel}s of {names} are exchanged",
    "late": "the {channel} is {ms:.3g} ms late",
    "both_exchanged": "{names} are exchanged, positions and {channel}s",
    "position_sign": "the sign of the position is turned",
    "position_scale": "the position is {size:.3g} times what it should be",
    "position_zero": "the zero of the position is {size:.2g} rad off",
    "scale": "the {channel} is {size:.3g} times what it should be",
}
#: What no line for a column mends.
OTHERS: Final = {
    "servo": "the {channel} by the servos' law is {size:.3g} times what the motion asks for at all "
    "joints: the servos' gains are suspected before nine effects are; in a mapping file, kp and kd "
    "times {inverse:.3g}",
    "pushed": "the {channel}s follow where the ends of the machine are pushed up, as by the "
    "ground: contact forces are missing in a machine on a fixed base; write a robot file with "
    'legs and base = "level"',
    "lost": "no reading of the columns explains the {channel}s, {left:.0f} % of them is left with "
    "everything that bodies, friction and drag may do: the log of another robot, efforts of "
    "another log, or times that are none",
}
#: Causes that lie with efforts alone.
_OF_EFFORTS: Final = ("sign", "exchanged", "scale", "late")
#: How far the best size may lie from one that was tried.
_SPACING: Final = {"late": 0.04, "position_zero": 0.4, "position_scale": 0.4}
#: What each joint's effort and position are read from: column, factor, delay [s], zero [rad].
_READING: Final = np.dtype(
    [("effort", int), ("factor", float), ("late", float)]
    + [("position", int), ("scale", float), ("zero", float)]
)
#: Columns of friction and the rotor's inertia.
_LAWS: Final = 5 + len(TRAVELS)
_STEPS: Final = 8
_TINY: Final = 1e-300
_ROUNDED: Final = 1e-9

Reading = NDArray[Any]


@dataclass(frozen=True)
class Step:
    """One thing that is wrong, and the evidence."""

    cause: str  #: One of `CAUSES` or `OTHERS`.
    joints: tuple[int, ...]  #: Whose columns.
    size: float = 1.0  #: Factor, delay [s] or zero [rad].
    what: str = ""  #: What a factor is.
    before: float = np.nan  #: Share of their efforts left as logged, root mean square.
    after: float = np.nan  #: ... and mended.
    gain: float = 0.0  #: By which the logarithms of what is left fall, of all joints together.


class Asked(NamedTuple):
    """What a machine can ask for along the motion, N rows of all logs."""

    torque: Array  #: By the model as given, shape (N, J) [N*m].
    columns: Array  #: All with coefficients of at least zero, shape (N, J, K).
    pushes: Array  #: Likewise of its ends pushed up from outside, shape (N, J, E).
    springs: Array  #: Likewise of springs at its joints, with any rest, shape (N, J, 3).
    own: Array  #: Effort that its drives take beside it, shape (N, J) in the channel's unit.
    slope: Array  #: Effort per torque, shape (N, J).


def as_named(joints: int) -> Reading:
    """Every column is what its name says, shape (J,)."""
    out = np.zeros(joints, _READING)
    out["effort"] = out["position"] = np.arange(joints)
    out["factor"] = out["scale"] = 1.0
    return out


def changed(reading: Reading, step: Step) -> Reading:
    """The same without one thing that is wrong."""
    out, cause, which = reading.copy(), step.cause, list(step.joints)
    if cause in ("exchanged", "both_exchanged"):
        out["effort"][which] = reading["effort"][which[::-1]]
    if cause == "both_exchanged":
        out["position"][which] = reading["position"][which[::-1]]
    if cause in ("sign", "scale"):
        out["factor"][which] /= -1.0 if cause == "sign" else step.size
    if cause in ("position_sign", "position_scale"):
        out["scale"][which] /= -1.0 if cause == "position_sign" else step.size
    if cause == "late":
        out["late"][which] += step.size
    if cause == "position_zero":
        out["zero"][which] -= step.size
    return out


class Gate:
    """Measured efforts against what a machine can ask for, over all its logs."""

    def __init__(
        self,
        model: MachineModel,
        logs: Sequence[Log],
        ratio: Array | None = None,
        *,
        by_law: bool = False,
        guessed: bool = False,
    ) -> None:
        """Begin.

        Args:
            model: As its files say.
            logs: All logs of it.
            ratio: Of gears, shape (J,), NaN where it is not known.
            by_law: Whether the torque was computed from targets and servo gains.
            guessed: Whether a leg that is taken to be in the air may touch the ground.
        """
        self.model, self.logs, self.by_law = model, logs, by_law
        self.floor = WELL if guessed else FLOOR
        unknown = np.full(len(model.joints), np.nan)
        self.ratio = unknown if ratio is None else np.abs(ratio)
        self.named = as_named(len(model.joints))
        every = max(1, sum(len(m) for m in logs) // ROWS)
        self.parts = [(m, motion_of(model, m), np.arange(0, len(m), every)) for m in logs]
        self.mask = np.concatenate([_counted(model, m, moved)[at] for m, moved, at in self.parts])
        # A leg in the air takes little: what is left is held against all that its joint gives.
        counts = np.concatenate([m.mask for m in logs])
        given = np.where(counts, np.concatenate([m.effort[..., 0] for m in logs]), 0.0)
        size = np.sqrt((given**2).sum(axis=0) / np.maximum(counts.sum(axis=0), 1))
        self.given = size * model.robot.floating
        self._asked: dict[bytes, Asked] = {}
        self._senses: dict[int, Array] = {}
        self._left: dict[tuple[bytes, bytes, int, str], float] = {}

    def steps(self) -> list[Step]:
        """What is wrong with the columns, each with its evidence; nothing where nothing is."""
        reading, out = self.named, list[Step]()
        shares = self.shares(reading)
        while len(out) < _STEPS and (np.nan_to_num(shares) > self.floor).any():
            step = self._best(reading, shares)
            if step is None:
                break
            out.append(step)
            if step.cause == "pushed":
                return out
            reading = changed(reading, step)
            shares = self.shares(reading)
        judged = shares[np.isfinite(shares)]
        middle = float(np.median(judged)) if judged.size else 0.0
        # Springs, which no reading is compared with, may be what the model lacks.
        left = np.flatnonzero(shares > WELL).tolist()
        sprung = [self._share(reading, j, "springs") for j in left]
        several = sum(share > WELL for share in sprung) > 1
        if middle > LOST or (middle > LEFT and (several or self._shifted() > CHANCE)):
            return [Step("lost", (), before=_rms(judged))]
        return [*out, *self._sizes(reading, shares)]

    # What is left.

    def shares(self, reading: Reading) -> Array:
        """What is left of every effort by a reading, over the effort, (J,); NaN: too few rows."""
        return np.array([self._share(reading, j) for j in range(reading.size)])

    def asked(self, reading: Reading) -> Asked:
        """What the machine can ask for where positions are read so."""
        key = _motion(reading)
        if key not in self._asked:
            parts = [self._along(*part, reading) for part in self.parts]
            self._asked[key] = Asked(*map(np.concatenate, zip(*parts, strict=True)))
        return self._asked[key]

    def _along(self, m: Log, moved: Moved, rows: Index, reading: Reading) -> Asked:
        dry = self._dry(m)[rows]
        thin = replace(m.at(rows), sign=dry[..., 0])
        q, v, a = (x[rows] for x in moved.motion)
        if _motion(reading) != _motion(self.named) and not self.model.robot.floating:
            of, scale = reading["position"], reading["scale"]
            read = (x[:, of] * scale for x in (thin.q, thin.v, thin.a))
            own = dict(zip(("q", "v", "a"), read, strict=True))
            dry = dry[:, of] * np.sign(scale)[:, None]
            thin = replace(thin, **(own | {"q": own["q"] + reading["zero"], "sign": dry[..., 0]}))
            moved = motion_of(self.model, thin)
            q, v, a = moved.motion
        regressor = body_columns(moved.rigid, (q, v, a))[:, moved.joints]
        weight = body_columns(moved.rigid, (q, 0.0 * v, 0.0 * a))[:, moved.joints]
        bodies = [x.toDynamicParameters() for x in moved.rigid.inertias[1:]]
        torque = regressor @ np.concatenate(bodies)
        points, ends = _points(moved.rigid)
        loaded = np.abs(torque) * dry[..., 0]
        laws = np.stack([dry[..., 0], thin.v, loaded, thin.v * np.abs(thin.v), thin.a], axis=2)
        columns = np.concatenate([regressor @ points, dry[..., 1:], laws], axis=2)
        one = np.ones_like(thin.q)
        springs = np.stack([thin.q, one, -one], axis=2)
        return Asked(torque, columns, -weight @ ends, springs, *self._of_drives(Simulator(thin)))

    def _dry(self, m: Log) -> Array:
        """Sense of dry friction, at once and over some travels, at the bandwidth, (N, J, T)."""
        if id(m) not in self._senses:
            sign = np.tanh(m.v / m.rest_speed) if m.sign is None else m.sign
            over = [
                np.stack(
                    [presliding(m.time, *c, travel) for c in zip(m.q.T, sign.T, strict=True)],
                    axis=1,
                )
                for travel in TRAVELS  # in which bearings, seals and teeth give
            ]
            self._senses[id(m)] = np.stack([m.smooth(x) for x in (sign, *over)], axis=2)
        return self._senses[id(m)]

    def _of_drives(self, simulator: Simulator) -> tuple[Array, Array]:
        """Effort that drives take beside bodies, and effort per torque, each (N, J)."""
        m, model = simulator.measurement, self.model
        if is_on_legs(model, m):
            return np.nan_to_num(m.effort[..., 0]) - simulator.load(model), np.ones_like(m.q)
        predicted, bodies = simulator.predict(model), model.bodies
        for joint in model.robot.links.values():  # all bodies a tenth heavier
            own = bodies.body(joint)
            bodies = bodies.with_body(joint, replace(own, scale=1.1 * own.scale))
        more = simulator.predict(model.with_bodies(bodies), predicted)
        change, effort = more.torque - predicted.torque, predicted.effort[..., 0]
        seen = (change * (more.effort[..., 0] - effort)).sum(axis=0)
        slope = seen / np.maximum((change**2).sum(axis=0), _TINY)
        # A joint that carries nothing says nothing of its drive.
        slope = np.where(np.abs(slope) > 1e-9, slope, 1.0)
        return effort - slope * predicted.torque, np.tile(slope, (len(m), 1))

    def torque(self, reading: Reading, j: int) -> Array:
        """Torque that a joint's effort stands for by a reading, shape (N,) [N*m]."""
        row, asked, parts = reading[j], self.asked(reading), []
        for m, _, rows in self.parts:
            y = m.effort[:, row["effort"], 0]
            late = np.interp(m.time + row["late"], m.time, y) if row["late"] else y
            parts.append(late[rows])
        effort = row["factor"] * np.concatenate(parts)
        return np.asarray((effort - asked.own[:, j]) / asked.slope[:, j])

    def _share(self, reading: Reading, j: int, more: str = "") -> float:
        """`more`: what the machine may have besides, ``pushes`` or ``springs``."""
        key = (_motion(reading), reading[j].tobytes(), j, more)
        if key not in self._left:
            self._left[key] = self._solved(reading, j, more)
        return self._left[key]

    def _shifted(self) -> float:
        """Share of shifts in time that explain all efforts as well as the motion beside them."""
        live = np.flatnonzero(np.isfinite(self.shares(self.named))).tolist()

        def left(by: float) -> float:
            every = [self._solved(self.named, j, "springs", by) for j in live]
            return float(np.log(np.maximum(every, _TINY)).sum())

        here = left(0.0)
        return float(np.mean([left(by) <= here for by in np.linspace(0.05, 0.95, SHIFTS)]))

    def _solved(self, reading: Reading, j: int, more: str, shifted: float = 0.0) -> float:
        i, asked = int(reading["effort"][j]), self.asked(reading)
        rows = np.flatnonzero(self.mask[:, [i, j, reading["position"][j]]].all(axis=1))
        # Of what its files say that drives take a machine may take less or more.
        own = asked.own[rows, j] / asked.slope[rows, j]
        X = np.column_stack([asked.columns[rows, j], own])
        if more:
            X = np.hstack([X, getattr(asked, more)[rows, j]])
        if rows.size < max(FEWEST_COMPARED, X.shape[1] // 2):
            return np.nan
        t = self.torque(reading, j)[rows] + own
        t = np.roll(t, round(shifted * t.size))
        size = np.sqrt((X**2).sum(axis=0))
        seen = size > 1e-9 * size.max()
        given = np.sqrt(rows.size) * self.given[i] * abs(reading["factor"][j] / asked.slope[0, j])
        whole = max(float(np.linalg.norm(t)), float(given)) + _TINY
        both = np.column_stack([X[:, seen] / size[seen], t / whole])
        # The root of the normal equations says as much as all rows do.
        R = np.linalg.cholesky(both.T @ both + 1e-10 * np.eye(both.shape[1])).T
        left = float(nnls(R[:, :-1], R[:, -1], maxiter=20 * R.shape[1])[1])
        # What is noise accuses nobody.
        noise = np.sqrt(np.mean([m.noise[i, 0] ** 2 for m in self.logs]) * rows.size)
        noise *= reading["factor"][j] / asked.slope[0, j] / whole
        return float(np.sqrt(max(left**2 - noise**2, 0.0)))

    # What may be wrong.

    def _best(self, start: Reading, before: Array) -> Step | None:
        """The simplest reading that explains about as much as the best, its size refined."""
        best: dict[str, Step] = {}
        count = int((np.nan_to_num(before) > self.floor).sum())
        for cause, joints, size in self._tries(before):
            position = cause.startswith("position")
            done = (s.after < self.floor and len(s.joints) == count for s in best.values())
            if position and cause not in best and any(done):
                break  # what efforts alone explain is no matter of positions
            step = self._tried(start, before, cause, joints, size)
            if step is not None:
                best[cause] = max(step, best.get(cause, step), key=lambda s: (s.gain, -s.after))
        steps = {cause: self._refined(start, before, step) for cause, step in best.items()}
        odd = np.flatnonzero(np.nan_to_num(before) > self.floor)
        pushed, sprung = (
            _rms(np.array([self._share(start, j, more) for j in odd.tolist()]))
            for more in ("pushes", "springs")
        )
        steps = {cause: step for cause, step in steps.items() if sprung >= HALVED * step.after}
        if not self.model.robot.floating:  # the ground may push the ends of what it is said to hold
            enough = min(WELL, HALVED * _rms(before[odd]), *(s.after for s in steps.values()))
            if pushed < enough and sprung >= HALVED * pushed:
                return Step("pushed", tuple(odd.tolist()), before=_rms(before[odd]), after=pushed)
        most = max((step.gain for step in steps.values()), default=0.0)
        return next((s for c in CAUSES if (s := steps.get(c)) and s.gain >= ALIKE * most), None)

    def _tries(self, shares: Array) -> Iterator[tuple[str, tuple[int, ...], float]]:
        live = np.flatnonzero(np.isfinite(shares)).tolist()
        odd = [j for j in live if shares[j] > self.floor]
        every = [tuple(live)] if len(live) > 1 else []
        for group in [*((j,) for j in odd), *every]:
            yield "sign", group, 1.0
            yield from (("late", group, late) for late in DELAYS)
        pairs = [(i, j) for i in odd for j in live if i < j or j not in odd]
        yield from (("exchanged", pair, 1.0) for pair in pairs)
        if self.model.robot.floating:
            return
        # Which joint's position is wrong shows in its neighbours' efforts, too.
        near = [j for j in live if any(abs(j - k) <= 1 for k in odd)]
        for group in [*((j,) for j in near), *every]:
            yield "position_sign", group, 1.0
            unknown = np.isnan(self.ratio[list(group)]).all()
            sides = [ratio**side for ratio in self._ratios(group) for side in (1, -1)]
            for factor in (DEG, *(RATIOS if unknown else sides)):
                yield "position_scale", group, factor
            if len(group) == 1:
                yield from (("position_zero", group, zero) for zero in ZEROS)
        yield from (("both_exchanged", pair, 1.0) for pair in pairs)

    def _tried(
        self, start: Reading, before: Array, cause: str, joints: tuple[int, ...], size: float
    ) -> Step | None:
        """A step with its evidence; None where its reading does not explain."""
        reading, after = changed(start, Step(cause, joints, size)), before.copy()
        # A position acts on its neighbours' efforts, too: those that were odd have to heal.
        wide = cause.startswith(("position", "both"))
        touched = np.flatnonzero(np.isfinite(before)) if wide else np.array(joints)
        after[touched] = [self._share(reading, j) for j in touched.tolist()]
        told = touched[before[touched] > self.floor] if wide else touched
        if not told.size or not np.isfinite(after[list(joints)]).all():
            return None
        b, a = _rms(before[told]), _rms(after[told])
        if a >= min(WELL, HALVED * b):
            return None
        falls = np.log(np.maximum(before, self.floor) / np.maximum(after, self.floor))
        what = ""
        if cause == "position_scale":
            known = {ratio: "it is that of the motor" for ratio in self._ratios(joints)}
            known |= {1.0 / ratio: "it is that of the joint" for ratio in known}
            what = ({DEG: "it is in degrees"} | known).get(size, "")
        return Step(cause, joints, size, what, b, a, float(np.nansum(falls)))

    def _refined(self, start: Reading, before: Array, step: Step) -> Step:
        """With the size that explains most; a unit and a known ratio stay."""
        if step.cause not in _SPACING or step.what:
            return step
        relative, far = step.cause == "position_scale", _SPACING[step.cause]

        def at(by: float) -> Step | None:
            size = step.size * float(np.exp(by)) if relative else step.size + by
            return self._tried(start, before, step.cause, step.joints, size)

        def left(by: float) -> float:
            tried = at(by)
            return 1.0 if tried is None else tried.after

        best = at(float(minimize_scalar(left, bounds=(-far, far), options={"maxiter": 12}).x))
        return best if best is not None and best.after < step.after else step

    # Sizes.

    def _sizes(self, reading: Reading, shares: Array) -> list[Step]:
        """Efforts that are explained, in another unit or on the other side of a gear."""
        asked, gains = self.asked(reading), np.zeros(shares.size)
        for j in np.flatnonzero(np.nan_to_num(shares, nan=1.0) < WELL).tolist():
            rows = np.flatnonzero(self.mask[:, j])
            X = np.column_stack([asked.torque[rows, j], asked.columns[rows, j, -_LAWS:]])
            size = np.maximum(np.linalg.norm(X, axis=0), _TINY)
            t = self.torque(reading, j)[rows]
            c, left = nnls(X / size, t)
            # Where friction alone leaves as little, a size says nothing of bodies.
            if size[0] > _TINY and left < TOLD * nnls(X[:, 1:] / size[1:], t)[1]:
                gains[j] = float(c[0] / size[0])
        live = np.flatnonzero(gains > 0.0)
        if live.size == 0:
            return []
        logs, every = np.log(gains[live]), tuple(live.tolist())
        middle = float(np.median(logs))
        if self.logs[0].channels[0] == "current" and live.size > 1:
            for factor, what in ROOTS.items():
                if (np.abs(logs - np.log(factor)) < EXACT).all():
                    return [Step("scale", every, factor, f"effective values, {what}")]
        if (np.abs(logs - middle) < np.log(NEAR)).all() and abs(middle) > np.log(BODIES):
            step = self._scale(every, middle)
            # A lone joint's gain that is no unit may be what pulls at it, as a cable does.
            if step is not None and (step.what or live.size > 1):
                return [step]
        far = float(np.median(np.abs(logs))) > np.log(BODIES)
        for side, what in ((-1.0, "it is that of the motor"), (1.0, "it is at the joint already")):
            factors = self.ratio[live] ** side
            off = np.abs(logs - np.log(factors))  # NaN where a ratio is not known
            if np.median(off) < np.log(BODIES) and (off < np.abs(logs)).all() and far:
                sizes = zip(every, factors.tolist(), strict=True)
                return [Step("scale", (j,), f, what) for j, f in sizes if f != 1.0]
        alike = live.size > 1 and bool((np.abs(logs - middle) < 0.1).all())
        if self.by_law and alike and abs(middle) > 0.1:
            return [Step("servo", every, float(f"{np.exp(middle):.3g}"))]
        out = []
        for k, (j, own) in enumerate(zip(every, logs.tolist(), strict=True)):
            others = np.delete(logs, k)
            if others.size and abs(np.median(others)) <= np.log(BODIES) < abs(own):
                out.append(self._scale((j,), own))
        return [step for step in out if step is not None]

    def _scale(self, joints: tuple[int, ...], log: float) -> Step | None:
        """A factor by its logarithm, a unit's or a gear's where one is near, else a far one."""
        known = {f: f"it is in {unit}" for f, unit in UNITS[self.logs[0].channels[0]].items()}
        for ratio in self._ratios(joints):
            known |= {1.0 / ratio: "it is that of the motor", ratio: "it is at the joint already"}
        best = min(known, key=lambda f: abs(log - np.log(f)))
        if abs(log - np.log(best)) < np.log(NEAR):
            return Step("scale", joints, best, known[best])
        far = abs(log) > np.log(FAR)
        return Step("scale", joints, float(f"{np.exp(log):.3g}")) if far else None

    def _ratios(self, joints: Sequence[int]) -> tuple[float, ...]:
        """The ratio of these joints' gears where it is known and one, without those that are 1."""
        of = {*self.ratio[list(joints)].tolist()} - {1.0}
        return tuple(of) if len(of) == 1 and np.isfinite(*of) else ()


def _motion(reading: Reading) -> bytes:
    """Equal for readings with equal positions."""
    return b"".join(reading[name].tobytes() for name in ("position", "scale", "zero"))


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(np.square(x)))) if np.size(x) else np.nan


def _counted(model: MachineModel, m: Log, moved: Moved) -> Mask:
    """Rows that count, (N, J): of legs on the ground none, since it pushes as it likes."""
    mask, stance = m.mask if m.known is None else m.known, moved.stance
    if stance is None:
        return mask
    free = np.ones_like(mask)
    for leg in range(stance.standing.shape[1]):
        touches = stance.standing[:, leg] | stance.near[:, leg]
        free[:, model.robot.chains.of(leg)] = ~touches[:, None]
    return mask & free & stance.carried.determined[:, None]


def _points(model: pin.Model) -> tuple[Array, Array]:
    """Unit masses as inertial parameters: around every body's, and at ends, (10 B, K), (10 B, E).

    Corners of a cube of half an edge of the body's radius of gyration, or half the way to its
    centre of mass, about that centre; for a body that ends a chain also twice as far out.
    """
    points: tuple[list[Array], list[Array]] = [], []
    for b, body in enumerate(model.inertias):
        if b == 0 or body.mass <= 0.0:
            continue
        c = np.asarray(body.lever)
        radius = float(np.sqrt(max(np.trace(body.inertia), 0.0) / 2.0 / body.mass))
        half = max(radius, 0.5 * float(np.linalg.norm(c)), 1e-3)
        corners = np.array(np.meshgrid(*3 * [(-half, half)])).reshape(3, -1).T
        own = [c, *(c + corners)]
        end = [] if b in list(model.parents)[1:] else [2.0 * c]
        for places, out in zip(([*own, *end], end), points, strict=True):
            for place in places:
                column = np.zeros((model.njoints - 1, 10))
                column[b - 1] = pin.Inertia(1.0, place, np.zeros((3, 3))).toDynamicParameters()
                out.append(column.ravel())
    around, ends = (np.reshape(x, (len(x), 10 * (model.njoints - 1))).T for x in points)
    return around, ends


def wrong_columns(model: MachineModel, logs: Sequence[Log], recording: Recording) -> list[Finding]:
    """Columns that are not what they say, one finding each, with the line that mends it.

    Args:
        model: As its files say.
        logs: All logs of it.
        recording: The first of them as read, for the names in its file and ratios of gears.
    """
    by_law = recording.effort in recording.derived
    guessed = model.robot.floating and find_contact(recording) is None
    gate = Gate(model, logs, recording.ratio, by_law=by_law, guessed=guessed)
    steps, last = gate.steps(), gate.named
    for step in steps:
        last = changed(last, step)
    judged = int(np.isfinite(gate.shares(gate.named)).sum())
    return [_finding(recording, step, last, judged) for step in steps]


def _finding(log: Recording, step: Step, last: Reading, judged: int) -> Finding:
    """One step; `last`: the reading that all steps make; `judged`: joints that were."""
    names, left = " and ".join(log.joints[j] for j in step.joints[:2]), 100.0 * step.before
    words = (CAUSES | OTHERS)[step.cause].format(
        channel=log.effort,
        names=names,
        size=step.size,
        inverse=1.0 / step.size,
        ms=1e3 * step.size,
        left=left,
    )
    if step.cause in OTHERS:
        return Finding(log.name, "", SUSPECTED, step.before, "1", "suspected", words)
    words += f", {step.what}" if step.what else ""
    if np.isfinite(step.after):
        words += f": the motion leaves {left:.0f} % of the {log.effort} unexplained as logged, "
        words += f"{100.0 * step.after:.0f} % so"
    elif step.cause == "scale":
        words += ": else bodies are as many times heavier or lighter than the robot's file says"
        words += "" if step.what else ", or it is on the other side of a gear"
    joint, efforts = log.joints[step.joints[0]], step.cause in _OF_EFFORTS
    own = column_name(joint, log.effort if efforts else log.position_quantity(joint))
    column = "" if len(step.joints) >= judged > 1 else own
    detail = f"{words}; in a mapping file: {'; '.join(_lines(log, last, step))}"
    check = SIZE if step.cause == "scale" and not step.what else SUSPECTED
    return Finding(log.name, column, check, step.size, "1", "suspected", detail)


def _lines(log: Recording, reading: Reading, step: Step) -> list[str]:
    """Rules of a mapping file for the columns that one step is about."""
    joints, efforts, out = log.joints, step.cause in _OF_EFFORTS, list[tuple[str, str]]()
    own = log.effort if efforts else log.position_quantity(joints[step.joints[0]])
    for j in sorted(step.joints):
        effort, factor, late, position, scale, zero = reading[j].tolist()
        if efforts or step.cause == "both_exchanged":
            out.append(_line(log, log.effort, joints[effort], joints[j], (factor, 0.0, late)))
        if not efforts:
            source, change = joints[position], (scale, zero, 0.0)
            out.append(_line(log, log.position_quantity(source), source, joints[j], change))
    ending, alike = column_name("", own), {keys for _, keys in out}
    if len(alike) == 1 and 1 < len(out) == len(joints) and all(c.endswith(ending) for c, _ in out):
        out = [(column_name("*", own), alike.pop())]
    return [f'columns."{column}" = {{{keys}}}' for column, keys in out]


def _line(
    log: Recording, quantity: str, source: str, target: str, change: tuple[float, float, float]
) -> tuple[str, str]:
    """Column of the file and the keys of its rule, after a further factor, zero and delay."""
    factor, zero, late = change
    wanted, as_read = (column_name(joint, quantity) for joint in (target, source))
    column, rule = log.rules.get(column_name(source, quantity), (as_read, AS_NAMED))
    slope = rule.affine("rad" if quantity.endswith("position") else EFFORTS[quantity])[0]
    zero, unit = rule.zero - zero / (factor * slope), rule.unit
    scale = factor * (-rule.scale if rule.flip else rule.scale)
    if unit is None and abs(abs(factor) * DEG - 1.0) < _ROUNDED and quantity.endswith("position"):
        scale, unit = scale * DEG, "deg"
    keys = {
        f'as = "{wanted}"': column != wanted,
        f'unit = "{unit}"': unit is not None,
        f"zero = {zero:.4g}": zero != 0.0,
        f"scale = {abs(scale):.4g}": abs(abs(scale) - 1.0) > _ROUNDED,
        "flip = true": scale < 0.0,
        f"late = {rule.late + late:.3g}": rule.late + late != 0.0,
    }
    return column, ", ".join(key for key, needed in keys.items() if needed)
