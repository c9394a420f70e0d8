"""The posterior of the unpublished numbers: the prior where every target comes out as printed.

A printed number says that the true one lies within half its last digit, all of that range alike,
so the likelihood is one where every target is inside and no motor beyond its limits, else zero:

    p(z, c | targets)  ~  N(z; 0, 1) [z inside its bounds] [targets met] [limits kept]

with z the prior's coordinates and c the motor's constants, uniform over all that give Tables IV to
VI. Targets met to a ten-thousandth are thin slabs, which random steps leave at once. Each target t
therefore takes the place of one coordinate z_s of which it is a monotone function: a walker holds
t, which is uniform inside what is printed, z_s is solved for, and the density becomes
N(z_s) |dz_s / dt|.

The foot's path through the air is a discrete unknown, uniform before. Robots, each with a path,
come from a bank of draws of their own prior, in which each is as likely as another; a walker names
one by its number.

Sampled by emcee (Foreman-Mackey et al., PASP 125, 306, 2013): its moves need no gradient, which a
likelihood with edges does not have, and it asks for many walkers at once.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import emcee
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.optimize.elementwise import find_root

from actuators.arrays import Array
from actuators.chain import Chain
from pipeline.errors import CalibrationError
from pipeline.paper.calibration.prior import Free
from pipeline.paper.calibration.problem import Problem, Target
from pipeline.paper.hexapod import (
    MIDDLE_LEGS,
    PUBLISHED_LEG,
    Demand,
    chain_at,
    drawn,
    outcome,
    printed_leg,
    with_splits,
)
from pipeline.paper.motor_constants import KEYS
from pipeline.paper.published import EXTRA, HELD, PAIR

#: Targets that take the place of a coordinate, in the order in which they are solved for: each
#: rises or falls with it throughout. Where two want the same one, the first takes it.
SOLVED = {
    HELD: "harmonic_drive.coulomb",
    "walking_ratio_reversible": "harmonic_drive.viscous",
    "walking_ratio_irreversible": "planetary.coulomb",
    EXTRA: "planetary.coulomb",
}
_RATIO = "walking_ratio_"
WALKERS = 32
_STARTS = 100  # times four draws per walker, before none is said to fit
_STEP = 1e-3  # of a prior standard deviation, for the slope of a target
_CLOSE = 1e-4  # of a prior standard deviation, to which a coordinate is solved for
_REACH = 0.2  # how far a step goes to another robot, as a share of the bank
_MOVES = (0.65, 0.05, 0.3)  # shares of the three kinds of steps
_SETTLING = 0.15  # of the steps, twice, before any is kept


@dataclass(frozen=True)
class _Sets:
    """Walkers as sets of numbers."""

    demand: Demand  #: Of their robots.
    ideal: Array  #: What the printed leg draws with the ideal actuator, (W,) [J].
    values: dict[str, Array]  #: Numbers in SI, by reference, (W,).

    def taken(self, which: NDArray[np.intp]) -> _Sets:
        values = {k: v[which] for k, v in self.values.items()}
        return _Sets(self.demand.taken(which), self.ideal[which], values)

    def with_number(self, key: str, value: Array) -> _Sets:
        return replace(self, values={**self.values, key: value})


class Posterior:
    """The density, for many walkers at once.

    A walker holds the number of a robot, the sampled coordinates, the motor's constants with the
    torque of Table VI, and where in its printed range (-1 to 1) each other solved target lies.

    Args:
        task: Prior, catalogue, targets; its `without` names the targets left out.
        robots: The bank; each is a set of the demand.
        targets: What has to come out; the task's by default.
    """

    def __init__(self, task: Problem, robots: Demand, targets: Sequence[Target] = ()) -> None:
        self.task, self.robots = task, robots
        self.targets = {t.name: t for t in (targets or task.targets)}
        own = {f.key: f for f in (task.prior.free[i] for i in task.actuator_columns)}
        self.solved: dict[str, Free] = {}
        for name, key in SOLVED.items():
            if name in self.targets and own[key] not in self.solved.values():
                self.solved[name] = own[key]
        self.free = tuple(f for f in own.values() if f not in self.solved.values())
        self.aimed = tuple(name for name in self.solved if name != HELD)
        self.numbers = slice(1, 1 + len(self.free))
        self.constants = slice(self.numbers.stop, self.numbers.stop + len(KEYS) + 1)
        self.aims = slice(self.constants.stop, self.constants.stop + len(self.aimed))
        self.size = self.aims.stop
        self.continuous = np.r_[self.numbers, self.aims]

    def start(self, rng: np.random.Generator, count: int) -> Array:
        """Walkers drawn from the prior, aims uniform, (W, D); some may have no density."""
        out = np.empty((count, self.size))
        out[:, 0] = rng.integers(self.robots.count, size=count)
        columns = [self.task.prior.free.index(f) for f in self.free]
        out[:, self.numbers] = [self.task.prior.draw(rng)[columns] for _ in range(count)]
        out[:, self.constants] = self.task.feasible.draws(rng, count)
        out[:, self.aims] = rng.uniform(-1, 1, (count, len(self.aimed)))
        return out

    def __call__(self, x: Array) -> Array:
        """Log density of walkers (W, D) up to a constant, (W,); minus infinity where none."""
        return self.evaluate(x)[0]

    def evaluate(self, x: Array) -> tuple[Array, dict[str, Array]]:
        """Log density of walkers (W, D), (W,), and their numbers in SI by reference, (W,)."""
        z = x[:, self.numbers]
        lower, upper = np.transpose([f.ends for f in self.free])
        good = ((z >= lower) & (z <= upper)).all(axis=1)
        good &= (np.abs(x[:, self.aims]) <= 1).all(axis=1)
        good &= (x[:, 0] >= 0) & (x[:, 0] < self.robots.count)
        log = np.where(good, -0.5 * (z**2).sum(axis=1), -np.inf)
        sets = self.as_sets(x)
        for name, free in self.solved.items():
            kept = np.flatnonzero(np.isfinite(log))
            if kept.size:
                goal = self._goal(name, x[kept])
                found, density = self._solved(name, free, sets.taken(kept), goal)
                log[kept] += density
                sets.values[free.key][kept] = found
        kept = np.flatnonzero(np.isfinite(log))
        if kept.size:
            log[kept[~self._met(sets.taken(kept))]] = -np.inf
        return log, sets.values

    def as_sets(self, x: Array) -> _Sets:
        """Walkers (W, D) as sets of numbers, those that are solved for at their centres."""
        columns = zip(self.free, x[:, self.numbers].T, strict=True)
        values = {f.key: f.at(column) for f, column in columns}
        values |= dict(zip(KEYS, x[:, self.constants].T, strict=False))
        values |= {f.key: np.full(len(x), f.centre) for f in self.solved.values()}
        robots = np.clip(x[:, 0], 0, self.robots.count - 1).astype(np.intp)
        demand = self.robots.taken(robots)
        ideal = drawn(demand, self._chain("ideal", values))[PUBLISHED_LEG]
        return _Sets(demand, ideal, values)

    def _goal(self, name: str, x: Array) -> Array:
        """The value of a solved target that walkers ask for, (W,)."""
        target = self.targets[name]
        if name == HELD:  # its place in the printed range is the constants'
            printed = next(t for t in self.task.targets if t.name == HELD)
            return target.centre - printed.centre - x[:, self.constants.stop - 1]
        aim = x[:, self.aims.start + self.aimed.index(name)]
        return target.centre + target.half_width * aim

    def _chain(self, name: str, values: dict[str, Array]) -> Chain:
        """An alternative with one number per set."""
        return chain_at(self.task.catalog, name, with_splits(values, self.task.ratio))

    def target(self, name: str, sets: _Sets) -> Array:
        """A solved target of each set, (W,)."""
        if name == HELD:
            chain = self._chain("reversible", sets.values)
            # The torque of joint 2 is negative: the upper end of what holds is the least.
            return printed_leg(chain.holding(sets.demand.standing).high)[:, 1]
        alternatives = PAIR if name == EXTRA else [name.removeprefix(_RATIO)]
        chains = {a: self._chain(a, sets.values) for a in alternatives}
        energy = {a: drawn(sets.demand, chain) for a, chain in chains.items()}
        return _energy_target(name, energy, sets)

    def _solved(self, name: str, free: Free, sets: _Sets, goal: Array) -> tuple[Array, Array]:
        """The number that gives a target, and the log density it brings, (W,) each."""
        every = np.arange(goal.size, dtype=np.float64)

        def missed(z: Array, which: Array) -> Array:
            chosen = which.astype(np.intp)
            at = self.target(name, sets.taken(chosen).with_number(free.key, free.at(z)))
            return at - goal[chosen]

        low, high = (np.full(goal.size, end) for end in free.ends)
        root = find_root(missed, (low, high), args=(every,), tolerances={"xatol": _CLOSE})
        good = np.flatnonzero(root.success)
        log, value = np.full(goal.size, -np.inf), np.full(goal.size, free.centre)
        if good.size:
            z = root.x[good]
            step = np.where(z + _STEP > high[good], -_STEP, _STEP)  # towards the inside
            slope = (missed(z + step, every[good]) - root.f_x[good]) / step
            log[good] = -0.5 * z**2 - np.log(np.abs(slope))
            value[good] = free.at(z)
        return value, log

    def _met(self, sets: _Sets) -> NDArray[np.bool_]:
        """Whether the other targets are met and every limit is kept, (W,)."""
        found = {
            name: outcome(sets.demand, self._chain(name, sets.values))
            for name in self.task.catalog.alternatives
        }
        energy = {name: o.drawn for name, o in found.items()}
        held = printed_leg(found["irreversible"].holding.motor_torque)
        good: NDArray[np.bool_] = (held == 0).all(axis=1)
        for o in found.values():
            good &= np.max([*o.excess.values()], axis=0) <= 0
        for name in self.targets.keys() - self.solved.keys():
            target = self.targets[name]
            missed = _energy_target(name, energy, sets) - target.centre
            good &= np.abs(missed) <= target.half_width
        return good


def _energy_target(name: str, drawn: Mapping[str, Mapping[str, Array]], sets: _Sets) -> Array:
    """A target made of energies by alternative and leg [J], (W,).

    A walking ratio, or by how much the irreversible actuator draws more per middle leg and cycle.
    """
    if name != EXTRA:
        return drawn[name.removeprefix(_RATIO)][PUBLISHED_LEG] / sets.ideal
    reversible, irreversible = (drawn[a] for a in PAIR)
    extra: Array = np.mean([irreversible[leg] - reversible[leg] for leg in MIDDLE_LEGS], axis=0)
    return extra


def _moves(
    posterior: Posterior, rng: np.random.Generator, centre: Array, factor: Array
) -> list[tuple[emcee.moves.Move, float]]:
    """Steps in the continuous coordinates, to other constants and to robots near by.

    The continuous coordinates turn towards draws of a Gaussian with the mean `centre` (C,) and the
    lower triangular factor of its covariance (C, C).
    """
    own = posterior.continuous
    reach = max(int(_REACH * posterior.robots.count), 1)

    def turned(x: Array, random: object) -> tuple[Array, Array]:
        # A rotation towards a draw of a Gaussian leaves that Gaussian as it is.
        angle = rng.uniform(0, np.pi / 2, (len(x), 1))
        old = solve_triangular(factor, (x[:, own] - centre).T, lower=True).T
        new = np.cos(angle) * old + np.sin(angle) * rng.normal(size=old.shape)
        q = x.copy()
        q[:, own] = centre + new @ factor.T
        return q, 0.5 * ((new**2).sum(axis=1) - (old**2).sum(axis=1))

    def constants(x: Array, random: object) -> tuple[Array, Array]:
        q = x.copy()
        q[:, posterior.constants] = posterior.task.feasible.draws(rng, len(x))
        return q, np.zeros(len(x))

    def robot(x: Array, random: object) -> tuple[Array, Array]:
        q = x.copy()
        q[:, 0] += rng.integers(-reach, reach + 1, len(x))
        return q, np.zeros(len(x))

    kinds = (emcee.moves.MHMove(step) for step in (turned, constants, robot))
    return list(zip(kinds, _MOVES, strict=True))


def sample(posterior: Posterior, seed: Sequence[int], steps: int, walkers: int = WALKERS) -> Array:
    """One ensemble of walkers, started from draws of the prior that have a density.

    Steps turn towards draws of the prior at first, then towards those of a Gaussian with the
    walkers' mean and covariance, found anew after a while; from then on they are kept.

    Returns:
        Walkers over the kept steps, (S, W, D).

    Raises:
        CalibrationError: No draw of the prior can be solved for the targets.
    """
    rng = np.random.default_rng(seed)
    x = _starts(posterior, rng, walkers)
    own = posterior.continuous
    centre, factor = np.zeros(own.size), np.eye(own.size)
    chain = np.empty(0)
    settling = max(int(_SETTLING * steps), 2)
    for length in (settling, settling, steps - 2 * settling):
        sampler = emcee.EnsembleSampler(
            walkers,
            posterior.size,
            posterior,
            moves=_moves(posterior, rng, centre, factor),
            vectorize=True,
        )
        # emcee draws acceptances from a state of its own.
        sampler.random_state = np.random.RandomState(int(rng.integers(2**31))).get_state()
        x = sampler.run_mcmc(x, length, skip_initial_state_check=True).coords
        chain = sampler.get_chain()
        recent = chain[len(chain) // 2 :].reshape(-1, posterior.size)[:, own]
        centre, factor = recent.mean(axis=0), np.linalg.cholesky(np.cov(recent.T))
    return chain


def _starts(posterior: Posterior, rng: np.random.Generator, walkers: int) -> Array:
    """Draws of the prior that have a density, (W, D)."""
    found = np.empty((0, posterior.size))
    for _ in range(_STARTS):
        x = posterior.start(rng, 4 * walkers)
        found = np.concatenate([found, x[np.isfinite(posterior(x))]])
        if len(found) >= walkers:
            break
    if len(found) == 0:
        raise CalibrationError(
            f"none of {_STARTS * 4 * walkers} draws of the prior meets the targets inside the "
            "motor's limits; widen prior.toml"
        )
    return found[np.arange(walkers) % len(found)]
