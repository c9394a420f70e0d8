"""How well a machine's model explains efforts, its bodies and friction being open within reason.

At joint j a model says (inverse dynamics b, linear in the bodies)

    y_j = b_j + B_j theta + F_j phi_j + e_j

with B the change of b with masses, centres and payloads, theta around zero within the spread that
models of machines have, and F friction and drag that take energy, the rotor's inertia and an
offset. A
hypothesis about columns is another y or another motion. Its score, minus twice the logarithm of
its density with the scatter of each joint profiled out, is

    S = sum_j n_j log max(RSS_j, floor_j^2) / TSS_j + sum theta^2 / spread^2,

floor_j what honest models leave, n_j independent samples. The sum of squares TSS makes efforts in
other units comparable.

A `Hypothesis` is a way in which columns are commonly not what their names say; a `Reading` says
which column, times what, shifted by what, is a joint's effort and position. What identification
names itself is left to it: factors, delays and zeros near none.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Final

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array, Index, Mask

#: Factors on an effort: nearer to one they are a gain or bodies that differ.
LEAST, MOST = 2.5, 3000.0
FACTORS: Final = tuple(s for f in np.geomspace(3.0, MOST, 10) for s in (f, 1.0 / f))
#: Factors on a position that is read at a motor, or in degrees.
RATIOS: Final = tuple(np.geomspace(3.0, 300.0, 11))
#: Delays of an effort [s]: shorter ones are a delay of the machine's own.
DELAYS: Final = (-0.2, -0.12, -0.07, -0.04, 0.04, 0.07, 0.12, 0.2)
#: Zeros of a position [rad].
ZEROS: Final = tuple(k * np.pi / 6 for k in range(-5, 7) if k)
#: Share of an effort, root mean square, that honest models leave: less says nothing about columns.
FLOOR: Final = 0.1
#: ... and of what laws of friction explain: no law of a few terms is nearer on every machine.
FRICTION_FLOOR: Final = 0.3
#: Offset of an effort sensor over the effort's root mean square, one standard deviation.
_OFFSET: Final = 0.1
#: Independent samples of a joint beyond which more of the same motion adds nothing ...
_MOST: Final = 100.0
#: ... and as many as are taken before any remainder was seen.
_USUAL: Final = 20.0
_OWN: Final = 6
_TURNS: Final = 6
_TINY: Final = 1e-300


#: What is left of an effort that is a velocity, over itself and over what bodies ask for, ...
_COPY: Final = 0.1
#: ... and its factor's distance from a unit's.
_SAME: Final = 0.05
_FEWEST: Final = 50


@dataclass(frozen=True, eq=False)
class Bodies:
    """What a model says along a motion."""

    base: Array  #: Effort by the model as given, shape (N, J).
    columns: Array  #: Its change per unit of each open parameter, shape (P, N, J).
    spread: Array  #: Of these parameters, one standard deviation, shape (P,).
    least: Array  #: Their lower bounds, shape (P,).
    #: Which are changes over a value that is known by its order: their spread is that of the
    #: logarithm, shape (P,).
    relative: Mask
    v: Array  #: Velocity, shape (N, J) [rad/s].
    a: Array  #: Acceleration, shape (N, J) [rad/s^2].
    rest: Array  #: Speed within which friction changes its sign, shape (J,) [rad/s].
    #: Which parameters are masses that ends carry; their three moments follow, shape (E,).
    ends: NDArray[np.intp]
    #: Share of an effort, root mean square, that honest models of this kind leave.
    floor: float = FLOOR


@dataclass(frozen=True, eq=False)
class Score:
    """How well one hypothesis explains the efforts."""

    share: Array  #: Left of each joint's effort, root mean square, shape (J,); NaN without rows.
    floor: Array  #: What honest models leave of it, shape (J,).
    penalty: float  #: Of the bodies.
    x: Array  #: Bodies' parameters, then those of each joint's own columns.
    held: Mask  #: Which of them are at their bounds.

    def gain(self, other: Score, independent: Array, *, sharp: bool = False) -> float:
        """By how much S falls with another hypothesis: both are judged above the higher floor.

        Args:
            other: Score of it.
            independent: Samples, shape (J,).
            sharp: Without a floor, to choose between sizes of one hypothesis.
        """
        live = np.flatnonzero(independent > 0.0)
        floor = np.maximum(self.floor, other.floor)[live] * (0.01 if sharp else 1.0)
        falls = np.log(np.maximum(self.share[live], floor) / np.maximum(other.share[live], floor))
        return float(2.0 * independent[live] @ falls) + self.penalty - other.penalty

    def room(self, independent: Array, floor: float) -> float:
        """By how much it could fall at most, where a share is left at least."""
        falls = np.log(np.maximum(np.nan_to_num(self.share), floor) / floor)
        return float(2.0 * independent @ falls) + self.penalty


class Explaining:
    """Scores of efforts along one motion by one model."""

    def __init__(self, bodies: Bodies, mask: Mask) -> None:
        """Begin with what a model says and the rows that count, shape (N, J)."""
        self.bodies, self.mask = bodies, mask
        self._rows = [np.flatnonzero(mask[:, j]) for j in range(mask.shape[1])]
        self.joints = [j for j, rows in enumerate(self._rows) if rows.size > _OWN]
        self.independent = np.where(mask.sum(axis=0) > _OWN, _USUAL, 0.0)
        p = bodies.spread.size
        self._design, self._gram = {}, {}
        for j in self.joints:
            x = np.hstack([bodies.columns[:, self._rows[j], j].T, self._own(j)])
            self._design[j], self._gram[j] = x, x.T @ x / x.shape[0]
        self._at = {j: slice(p + _OWN * k, p + _OWN * (k + 1)) for k, j in enumerate(self.joints)}
        own = np.tile([0.0] * (_OWN - 1) + [-np.inf], len(self.joints))
        self._least = np.concatenate([bodies.least, own])

    def _own(self, j: int) -> Array:
        """Friction, dry, viscous, of the load and drag, rotor and offset, each of size one."""
        b, rows = self.bodies, self._rows[j]
        way, v = np.tanh(b.v[rows, j] / b.rest[j]), b.v[rows, j]
        load = np.abs(b.base[rows, j]) * way
        own = np.stack([way, v, load, v * np.abs(v), b.a[rows, j], np.ones_like(v)], axis=1)
        return own / (np.sqrt((own**2).mean(axis=0)) + _TINY)

    def score(self, y: Array, near: Score | None = None) -> Score:
        """Score efforts.

        Args:
            y: Shape (N, J).
            near: Of a similar hypothesis, from which to start.
        """
        p = self.bodies.spread.size
        square, cross, total = {}, {}, {}
        for j in self.joints:
            rows = self._rows[j]
            t = y[rows, j] - self.bodies.base[rows, j]
            square[j], cross[j] = float(t @ t) / t.size, self._design[j].T @ t / t.size
            total[j] = float(y[rows, j] @ y[rows, j]) / t.size + _TINY
        prior = np.full(self._least.size, 1e-9)
        prior[:p] = self.bodies.spread**-2.0
        for j in self.joints:
            prior[self._at[j].stop - 1] = 1.0 / (_OFFSET**2 * total[j])
        share = np.full(len(self._rows), np.nan)
        share[self.joints] = 1.0
        held = np.zeros(prior.size, dtype=np.bool_) if near is None else near.held
        floor, last = np.full(len(self._rows), self.bodies.floor**2), None
        for _ in range(_TURNS):
            a, c = np.diag(prior), np.zeros(prior.size)
            for j in self.joints:
                weight = self.independent[j] / (total[j] * (share[j] + floor[j]))
                gram, at = weight * self._gram[j], self._at[j]
                a[:p, :p] += gram[:p, :p]
                a[:p, at] += gram[:p, p:]
                a[at, :p] += gram[p:, :p]
                a[at, at] += gram[p:, p:]
                c[:p] += weight * cross[j][:p]
                c[at] += weight * cross[j][p:]
            x, held = _bounded(a, c, self._least, held)
            grown = np.where(np.abs(x[:p]) > 1e-6, x[:p], 1e-6)
            stretch = np.log1p(np.maximum(grown, -0.99)) / grown
            prior[:p] = np.where(self.bodies.relative, stretch, 1.0) ** 2 / self.bodies.spread**2
            for j in self.joints:
                own = np.concatenate([x[:p], x[self._at[j]]])
                rest = square[j] - 2.0 * own @ cross[j] + own @ self._gram[j] @ own
                share[j] = max(float(rest), 0.0) / total[j]
                rubs = slice(p, p + _OWN - 2)
                lost, gram = own[rubs], self._gram[j][rubs, rubs]
                rubbed = float(lost @ gram @ lost) / total[j]
                floor[j] = self.bodies.floor**2 + FRICTION_FLOOR**2 * rubbed
            now = Score(np.sqrt(share), np.sqrt(floor), float(prior @ x**2), x, held)
            if last is not None and abs(last.gain(now, self.independent)) < 0.5:
                break
            last = now
        return now

    def count_independent(self, y: Array) -> None:
        """Count the independent samples in what the model leaves of efforts, shape (N, J).

        For a variance they are the rows over the sum of squares of the autocorrelation (Bayley and
        Hammersley 1946).
        """
        p, seen = self.bodies.spread.size, self.score(y)
        for j in self.joints:
            own = np.concatenate([seen.x[:p], seen.x[self._at[j]]])
            rest = y[self._rows[j], j] - self.bodies.base[self._rows[j], j] - self._design[j] @ own
            rest -= rest.mean()
            spectrum = np.abs(np.fft.rfft(rest, 2 * rest.size)) ** 2
            rho = np.fft.irfft(spectrum)[1 : rest.size // 2] / max(float(rest @ rest), _TINY)
            self.independent[j] = min(rest.size / (1.0 + 2.0 * float(rho @ rho)), _MOST)


def _bounded(a: Array, c: Array, least: Array, held: Mask) -> tuple[Array, Mask]:
    """Least squares by normal equations with lower bounds, by an active set. Returns it, too."""
    scale = 1.0 / np.sqrt(np.diag(a))
    x = np.zeros(c.size)
    for _ in range(20):
        free = ~held
        x = np.where(held, least, 0.0)
        s = scale[free]
        right = c[free] - a[np.ix_(free, held)] @ x[held]
        x[free] = s * np.linalg.solve(a[np.ix_(free, free)] * np.outer(s, s), s * right)
        below = free & (x < least)
        back = held & (scale * (a @ x - c) < -1e-9)
        if not below.any() and not back.any():
            break
        held = held | below if below.any() else held & ~back
    return np.maximum(x, least), held


@dataclass(frozen=True, eq=False)
class Reading:
    """What each joint's effort and position are read from."""

    effort_of: Index  #: Column of the effort, shape (J,).
    effort_factor: Array  #: On it, shape (J,).
    late: Array  #: By which it comes late, shape (J,) [s].
    position_of: Index  #: Column of the position, shape (J,).
    position_factor: Array  #: On it, shape (J,).
    zero: Array  #: Added to it, shape (J,) [rad].

    def at(self, which: Sequence[int], **values: object) -> Reading:
        """The same with other values at some joints."""
        changes = {}
        for name, value in values.items():
            changes[name] = getattr(self, name).copy()
            changes[name][list(which)] = value
        return replace(self, **changes)

    @property
    def motion(self) -> bytes:
        """Equal for readings with equal positions."""
        return b"".join(x.tobytes() for x in (self.position_of, self.position_factor, self.zero))


def as_named(joints: int) -> Reading:
    """Every column is what its name says."""
    own, one, none = np.arange(joints), np.ones(joints), np.zeros(joints)
    return Reading(own, one, none, own, one, none)


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """One way in which columns may be wrong."""

    cause: str  #: Key of `CAUSES`.
    joints: tuple[int, ...]  #: Whose columns.
    reading: Reading  #: That mends it.
    size: float = 1.0  #: Factor, delay or zero; one where there is none to choose.

    def resized(self, size: float, start: Reading) -> Hypothesis:
        """The same with another size, from the reading that is mended."""
        return _sized(self.cause, self.joints, size, start)


#: The simplest first: where several explain a log as well, the first of them is taken.
CAUSES: Final = (
    *("sign", "exchanged", "scale", "late"),
    *("both_exchanged", "position_sign", "position_scale", "position_zero"),
)


@dataclass(frozen=True)
class Causes:
    """What may be wrong with columns, and the sizes that are tried.

    A gain that is no unit's and no gear's is the machine's, and identification names it. A factor
    common to all efforts looks as bodies that are too light by it: any is tried.
    """

    units: tuple[float, ...] = ()  #: Factors of an effort in other units or on the motor's side.
    ratios: tuple[float, ...] = RATIOS  #: Factors of a position.
    #: Whether to ask for no more than signs and factors: what the ground does to a leg that stands
    #: is not known, and nothing finer can be told.
    coarse: bool = False

    def efforts(self, *, common: bool) -> dict[str, tuple[float, ...]]:
        """Cause to sizes, of efforts alone."""
        sizes: dict[str, tuple[float, ...]] = {"sign": (1.0,)}
        sizes["scale"] = (*self.units, *(FACTORS if common and not self.coarse else ()))
        return sizes if self.coarse else {**sizes, "late": DELAYS}

    def positions(self, *, common: bool) -> dict[str, tuple[float, ...]]:
        """Cause to sizes, of positions."""
        sizes = {"position_sign": (1.0,), "position_scale": self.ratios}
        return sizes if self.coarse or common else {**sizes, "position_zero": ZEROS}


def _sized(cause: str, joints: tuple[int, ...], size: float, r: Reading) -> Hypothesis:
    which, other = list(joints), list(joints[::-1])
    effort, position = r.effort_factor[which], r.position_factor[which]
    changes: dict[str, dict[str, Array | Index]] = {
        "sign": {"effort_factor": -effort},
        "scale": {"effort_factor": effort / size},
        "late": {"late": r.late[which] + size},
        "exchanged": {"effort_of": r.effort_of[other]},
        "both_exchanged": {"effort_of": r.effort_of[other], "position_of": r.position_of[other]},
        "position_sign": {"position_factor": -position},
        "position_scale": {"position_factor": position / size},
        "position_zero": {"zero": r.zero[which] - size},
    }
    return Hypothesis(cause, joints, r.at(which, **changes[cause]), size)


def of_efforts(
    r: Reading, live: Sequence[int], odd: Sequence[int], causes: Causes
) -> Iterator[Hypothesis]:
    """About efforts alone, of joints that are compared; pairs with one that is explained badly."""
    # Bodies that give way to a wrong column leave the misfit at another joint: each is tried.
    yield from _tries(r, live, live, causes.efforts)
    yield from () if causes.coarse else _exchanged("exchanged", r, live, odd)


def of_positions(
    r: Reading, live: Sequence[int], odd: Sequence[int], causes: Causes
) -> Iterator[Hypothesis]:
    """About positions, too; of single ones where efforts are explained badly."""
    yield from _tries(r, live, odd, causes.positions)
    yield from () if causes.coarse else _exchanged("both_exchanged", r, live, odd)


def _tries(
    r: Reading,
    live: Sequence[int],
    alone: Sequence[int],
    sizes: Callable[..., dict[str, tuple[float, ...]]],
) -> Iterator[Hypothesis]:
    if len(live) > 1:
        for cause, values in sizes(common=True).items():
            yield from (_sized(cause, tuple(live), float(size), r) for size in values)
    for cause, values in sizes(common=len(live) == 1).items():
        for j in alone:
            yield from (_sized(cause, (j,), float(size), r) for size in values)


def _exchanged(
    cause: str, r: Reading, live: Sequence[int], odd: Sequence[int]
) -> Iterator[Hypothesis]:
    pairs = combinations(live, 2)
    yield from (_sized(cause, pair, 1.0, r) for pair in pairs if set(pair) & set(odd))


def copied_velocities(
    y: Array, bodies: Bodies, mask: Mask, units: Sequence[float]
) -> dict[int, float]:
    """Columns of efforts (N, J) that are the velocity times a factor, and that factor.

    Viscous friction alone makes such an effort, too: it counts where bodies ask for more than what
    such friction leaves, and where the factor is one that a velocity's `units` may make. Rows that
    count are those of the `mask` (N, J).
    """
    out = {}
    for j in range(y.shape[1]):
        rows = mask[:, j]
        if rows.sum() < _FEWEST or not y[rows, j].any() or not bodies.v[rows, j].any():
            continue
        x, e = bodies.v[rows, j], y[rows, j]
        factor = float(x @ e) / float(x @ x)
        left = float(np.std(e - factor * x))
        near = min(abs(abs(factor) / unit - 1.0) for unit in units)
        least = min(float(np.std(e)), float(np.std(bodies.base[rows, j])))
        if near <= _SAME and left <= _COPY * least:
            out[j] = factor
    return out
