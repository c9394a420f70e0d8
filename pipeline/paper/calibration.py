"""Fits what the paper does not print: `make calibrate`.

The posterior is the prior where every target comes out as printed. A printed number says that the
true one lies within half its last digit, all of that range alike, so the likelihood is one where
every target is inside and no motor beyond its limits, else zero:

    p(z, c | targets)  ~  N(z; 0, 1) [z inside its bounds] [targets met] [limits kept]

with z the prior's coordinates and c the motor's constants, uniform over all that give Tables IV to
VI. Targets met to a ten-thousandth are thin slabs, which random steps leave at once. Some targets t
therefore take the place of one coordinate z_s of which they are a monotone function: a walker holds
t, which is uniform inside what is printed, z_s is solved for, and the density becomes
N(z_s) |dz_s / dt|.

The foot's path through the air is a discrete unknown, uniform before. Robots, each with a path,
come from a bank of draws of their own prior, in which each is as likely as another; a walker names
one by its number. Sampled by emcee (Foreman-Mackey et al., PASP 125, 306, 2013): its moves need no
gradient, which a likelihood with edges does not have, and it asks for many walkers at once.

The calibrated values are the set nearest to the prior's centre that meets the targets: least
squares from draws of the posterior. The break-even is stiff near 1, so the energy difference it
asks for is fitted in its place.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial
from pathlib import Path
from typing import Any, Final, NamedTuple

import emcee
import numpy as np
from arviz_stats.base import array_stats
from numpy.typing import NDArray
from pandas import DataFrame
from scipy import optimize
from scipy.linalg import solve_triangular
from scipy.optimize.elementwise import find_root
from scipy.stats import truncnorm

from actuators.arrays import Array
from actuators.checked import read_toml, write_text
from actuators.errors import LegwattError
from actuators.loading.build import Catalog, load_catalog
from actuators.parameters import from_si, to_si
from pipeline.paper import hexapod
from pipeline.paper.hexapod import PRINTED, Demand, Outcome, RobotPart, printed_leg
from pipeline.paper.published import (
    EVEN,
    EXTRA,
    HELD,
    KEYS,
    Published,
    draws,
    load_published,
    middle,
)
from pipeline.robot.robot_file import RobotSpec, load_robot_file

PRIOR_FILE = Path(__file__).with_name("prior.toml")
ROBOT_FILE = Path(__file__).parents[2] / "urdf" / "hexapod.toml"
OUT: Final = Path("reports/out/calibration.csv")
ROBOT = "robot"
#: Rows met exactly by solving the posture, and the robot's numbers solved from them.
EXACT = ("standing_reaction_rm", "standing_torque_2", "standing_torque_3")
POSTURE = ("trunk_com_left", "joint_2_lateral", "body_height")
#: Met by the choice of the motor's constants.
CHOSEN = ("ideal_current_2", "ideal_voltage_2", "rotor_current_2")
#: Targets that take the place of a coordinate, in the order in which they are solved for: each
#: rises or falls with it throughout.
SOLVED = {
    HELD: "harmonic_drive.coulomb",
    "walking_ratio_reversible": "harmonic_drive.viscous",
    "walking_ratio_irreversible": "planetary.coulomb",
}
PATHS = ("cubic", "harmonic", "quintic", "cycloid")  # of the foot
WALKERS, ENSEMBLES = 32, 2
_SEED = 1
_GROUPS = 8  # of walkers, which have to agree
_PRIOR_STARTS = 100  # times four draws per walker, before none is said to fit
_STEP = 1e-3  # of a prior standard deviation, for the slope of a target
_CLOSE = 1e-4  # of a prior standard deviation, to which a coordinate is solved for
_REACH = 0.2  # how far a step goes to another robot, as a share of the bank
_MOVES = (0.65, 0.05, 0.3)  # shares of the three kinds of steps
_SETTLING = 0.15  # of the steps, twice, before any is kept
_THIN = 10  # every so many steps of a walker are kept
_PULL = 3.0  # the nearest set: a third of a half width counts like one prior sigma
_STEEP = 200.0  # residual per relative excess over a motor limit
_DIFFERENCE = 1e-4  # of a prior standard deviation, for derivatives
_EVALUATIONS = 60  # of the problem per search, derivatives not counted
_STARTS = 4  # of searches per path of the foot: draws of the posterior
_REMEMBERED = 64  # robots: derivatives of actuators share them
_AT_BOUND = 0.02  # coordinates this close to a bound count as lying at it
_SPAN = (0.025, 0.975)  # quantiles


@dataclass(frozen=True)
class Prior:
    """Beliefs about D numbers: of each a coordinate is a unit Gaussian, cut off at bounds."""

    keys: tuple[str, ...]  #: ``robot.<name>`` or ``<component>.<name>``.
    centre: Array  #: SI, (D,).
    deviation: Array  #: One standard deviation, SI or of the natural logarithm, (D,).
    bounds: Array  #: SI, (2, D).
    logarithmic: NDArray[np.bool_]  #: Whether the belief spreads over factors, (D,).

    @classmethod
    def load(cls) -> Prior:
        """Read `prior.toml`, whose head says what its entries mean."""
        entries = read_toml(PRIOR_FILE)
        logarithmic = np.array([e["scale"] == "log" for e in entries.values()])
        rows = [(e["value"], e["deviation"], *e["bounds"]) for e in entries.values()]
        units = [e["unit"] for e in entries.values()]
        si = [[to_si(x, unit) for x in row] for row, unit in zip(rows, units, strict=True)]
        centre, deviation, *bounds = np.transpose(si)
        deviation = np.where(logarithmic, np.log([row[1] for row in rows]), deviation)
        return cls(tuple(entries), centre, deviation, np.array(bounds), logarithmic)

    @cached_property
    def ends(self) -> Array:
        """Lower and upper bounds as coordinates, (2, D)."""
        ratio = np.where(self.logarithmic, self.bounds / self.centre, 1.0)
        away = np.where(self.logarithmic, np.log(ratio), self.bounds - self.centre)
        return np.asarray(away / self.deviation)

    def values(self, z: Array) -> Array:
        """SI values at coordinates (..., D), kept inside the bounds against rounding."""
        away = self.deviation * z
        raw = np.where(self.logarithmic, self.centre * np.exp(away), self.centre + away)
        return np.clip(raw, *self.bounds)

    def draw(self, rng: np.random.Generator, count: int) -> Array:
        """Random coordinates, (count, D)."""
        shape = (count, len(self.keys))
        return np.asarray(truncnorm.rvs(*self.ends, size=shape, random_state=rng))


class Point(NamedTuple):
    """One set of numbers."""

    path: str  #: Of the foot.
    z: Array  #: Coordinates, (D,).
    constants: Array  #: Of the motor, SI, as in `KEYS`.


@dataclass(frozen=True)
class Sets:
    """W sets of numbers at once, each with a robot of its own."""

    demand: Demand
    z: Array  #: Coordinates, (W, D).
    constants: Array  #: Of the motor, SI, (W, 3).
    ideal: Array  #: What the printed leg draws with the ideal actuator, (W,) [J].

    def taken(self, which: NDArray[np.intp]) -> Sets:
        """Some of the sets, by number."""
        own = (self.z[which], self.constants[which], self.ideal[which])
        return Sets(self.demand.taken(which), *own)

    def at(self, column: int, z: Array) -> Sets:
        """With other values (W,) of one coordinate."""
        changed = self.z.copy()
        changed[:, column] = z
        return replace(self, z=changed)


class Target(NamedTuple):
    """A fitted number, SI."""

    centre: float
    half_width: float


@dataclass(frozen=True)
class Problem:
    """What is fitted, to what, starting from which files."""

    spec: RobotSpec
    catalog: Catalog
    prior: Prior  #: Free numbers; they overrule the files'.
    published: Mapping[str, Published]  #: All printed values.
    _robots: dict[tuple[str, bytes], RobotPart] = field(default_factory=dict, repr=False)

    @cached_property
    def columns(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Coordinates that belong to the robot, and those of the actuators."""
        robots = np.array([key.startswith(f"{ROBOT}.") for key in self.prior.keys])
        return np.flatnonzero(robots), np.flatnonzero(~robots)

    @cached_property
    def targets(self) -> dict[str, Target]:
        """What is fitted, by id; the break-even as the difference that it asks for."""
        left_out = (*EXACT, *CHOSEN, EVEN)
        rows = [p for p in self.published.values() if p.role == "target" and p.id not in left_out]
        even, held = self.published[EVEN], self.published["reversible_leg_energy_3s"].value  # [J]
        ends = (even.value - even.half_width, even.value + even.half_width)
        low, high = (share / (1 - share) * held / 2 for share in ends)  # per middle leg
        extra = Target((low + high) / 2, (high - low) / 2)
        return {p.id: Target(p.si, p.half_width_si) for p in rows} | {EXTRA: extra}

    def robot(self, path: str, z: Array) -> RobotPart:
        """The robot's part at a path of the foot and coordinates (D,), remembered.

        Raises:
            LegwattError: Out of reach, tipping, or no posture meets the targets.
        """
        own = self.columns[0]
        key = (path, z[own].tobytes())
        if key not in self._robots:
            if len(self._robots) > _REMEMBERED:
                self._robots.clear()
            names = [self.prior.keys[i].split(".")[1] for i in own]
            values = dict(zip(names, self.prior.values(z)[own].tolist(), strict=True))
            spec = self.spec.with_gait(transfer_path=path).with_parameters(values)
            goal = np.array([self.published[name].value for name in EXACT])
            self._robots[key] = hexapod.robot_part(hexapod.solve_posture(spec, goal))
        return self._robots[key]

    def values(self, z: Array, constants: Array) -> dict[str, Array]:
        """Numbers of the catalogue at (W, D) and (W, 3), by reference, SI (W,)."""
        si = self.prior.values(z)
        own = {self.prior.keys[i]: si[:, i] for i in self.columns[1]}
        return own | dict(zip(KEYS, constants.T, strict=True))

    def evaluate(self, point: Point) -> tuple[dict[str, float], Array]:
        """What `computed` gives of a set, and every motor quantity over its limit.

        Of the latter the largest over the cycle, less one: negative is inside.

        Raises:
            LegwattError: The robot cannot take this shape.
        """
        robot = self.robot(point.path, point.z)
        values = self.values(point.z[None], point.constants[None])
        found = hexapod.outcomes(robot.demand, self.catalog, values)
        excess = [float(peak[0]) for o in found.values() for peak in o.excess.values()]
        return hexapod.computed(robot, found), np.array(excess)

    def admissible(self, values: Mapping[str, float], excess: Array) -> bool:
        """Whether a set gives every fitted number as printed and no motor leaves its limits."""
        missed = (abs(values[n] - t.centre) / t.half_width for n, t in self.targets.items())
        return bool(excess.max() <= 0 and max(missed) <= 1)

    def nearest(self, start: Point) -> Point | None:
        """The admissible set nearest to the prior's centre, from another; None where none is."""
        lower, upper = self.prior.ends
        upper = upper - 2 * _DIFFERENCE  # steps of derivatives stay inside
        residuals = partial(self._residuals, start)
        found = optimize.least_squares(
            residuals,
            np.clip(start.z, lower + 1e-9, upper - 1e-9),
            jac=partial(optimize.approx_fprime, f=residuals, epsilon=_DIFFERENCE),
            bounds=(lower, upper),
            max_nfev=_EVALUATIONS,
        )
        point = start._replace(z=found.x)
        try:
            return point if self.admissible(*self.evaluate(point)) else None
        except LegwattError:
            return None

    def _residuals(self, start: Point, z: Array) -> Array:
        """Distance from the prior's centre, from every target, and a hinge at the motor's limits.

        Of coordinates z (D,) in place of a point's own.
        """
        try:
            values, excess = self.evaluate(start._replace(z=z))
        except LegwattError:
            # Out of reach or tipping: a wall, a large but finite residual.
            return np.full(z.size + len(self.targets) + 4 * len(self.catalog.alternatives), 30.0)
        error = [(values[n] - t.centre) / t.half_width for n, t in self.targets.items()]
        limits = np.maximum(excess + 0.005, 0.0)
        return np.concatenate([z, _PULL * np.array(error), _STEEP * limits])


@cache
def shipped() -> Problem:
    """The problem of the shipped files."""
    spec = load_robot_file(ROBOT_FILE)
    return Problem(spec, load_catalog(), Prior.load(), load_published())


@dataclass(frozen=True)
class Bank:
    """R robots drawn from the prior, in order of what the ideal actuator's printed leg draws."""

    demand: Demand  #: What they ask of their joints; a robot is a set.
    paths: NDArray[np.str_]  #: The foot's path of each, (R,).
    z: Array  #: Coordinates of each robot's numbers, (R, robot's columns).
    posture: Array  #: Solved numbers of each, as in `POSTURE`, SI, (R, 3).


@cache
def bank(seed: int, count: int) -> Bank:
    """Draw robots, each with a path, that stand and walk as printed.

    Those that turn the motor faster than it may turn are left out: no actuator mends that.
    """
    rng = np.random.default_rng([seed, 4000])
    task = shipped()
    ideal = task.catalog.chain("ideal")
    fastest = ideal.driven.max_speed / np.asarray(ideal.ratio)  # of a joint [rad/s]
    found: list[tuple[RobotPart, str, Array]] = []
    while len(found) < count:
        path = str(rng.choice(PATHS))
        (z,) = task.prior.draw(rng, 1)
        try:
            part = task.robot(path, z)
        except LegwattError:
            continue
        if np.abs(part.demand.series.velocity).max() <= fastest:
            found.append((part, path, z[task.columns[0]]))
    parts, paths, z = zip(*found, strict=True)
    demand = hexapod.joined([part.demand for part in parts])
    posture = [[part.robot.spec.parameters[name] for name in POSTURE] for part in parts]
    order = np.argsort(Outcome(demand, ideal).drawn[:, PRINTED])
    own = (np.array(paths)[order], np.array(z)[order], np.array(posture)[order])
    return Bank(demand.taken(order), *own)


class Posterior:
    """The density, for many walkers at once.

    A walker holds the number of a robot, the sampled coordinates, where in its printed range (-1 to
    1) each solved target lies but the torque of Table VI, the motor's constants and that torque.

    Args:
        task: Prior and catalogue.
        robots: The bank.
        targets: What has to come out; the task's by default.
    """

    def __init__(
        self, task: Problem, robots: Bank, targets: Mapping[str, Target] | None = None
    ) -> None:
        self.task, self.robots = task, robots
        self.targets = task.targets if targets is None else targets
        keys = task.prior.keys
        self.solved = {n: keys.index(key) for n, key in SOLVED.items() if n in self.targets}
        self.free = np.setdiff1d(task.columns[1], [*self.solved.values()]).astype(np.intp)
        self.aimed = [name for name in self.solved if name != HELD]
        first = 1 + self.free.size
        self.numbers, self.aims = slice(1, first), slice(first, first + len(self.aimed))
        self.continuous = np.arange(1, self.aims.stop)
        self.constants = slice(self.aims.stop, self.aims.stop + len(KEYS) + 1)
        self.size = self.constants.stop

    def start(self, rng: np.random.Generator, count: int) -> Array:
        """Walkers drawn from the prior, aims uniform, (W, size); some may have no density."""
        robots = rng.integers(len(self.robots.z), size=count)
        z = self.task.prior.draw(rng, count)[:, self.free]
        aims = rng.uniform(-1, 1, (count, len(self.aimed)))
        constants = draws(self.task.published, rng, count)
        return np.column_stack([robots, z, aims, constants])

    def __call__(self, x: Array) -> Array:
        """Log density of walkers (W, size) up to a constant, (W,); minus infinity where none."""
        return self.evaluate(x)[0]

    def evaluate(self, x: Array) -> tuple[Array, Array]:
        """Log density of walkers (W, size), (W,), and all their coordinates, (W, D)."""
        z = x[:, self.numbers]
        lower, upper = self.task.prior.ends[:, self.free]
        good = ((z >= lower) & (z <= upper)).all(axis=1)
        good &= (np.abs(x[:, self.aims]) <= 1).all(axis=1)
        good &= (x[:, 0] >= 0) & (x[:, 0] < len(self.robots.z))
        log = np.where(good, -0.5 * (z**2).sum(axis=1), -np.inf)
        coordinates = np.full((len(x), len(self.task.prior.keys)), np.nan)
        rows = np.flatnonzero(good)
        if not rows.size:
            return log, coordinates
        sets = self.sets(x[rows])
        for name, column in self.solved.items():
            found, density = self._solved(name, column, sets, self._goal(name, x[rows]))
            log[rows] += density
            kept = np.flatnonzero(np.isfinite(density))
            if not kept.size:
                return log, coordinates
            rows, sets = rows[kept], sets.at(column, found).taken(kept)
        log[rows[~self._met(sets)]] = -np.inf
        coordinates[rows] = sets.z
        return log, coordinates

    def sets(self, x: Array) -> Sets:
        """Walkers (W, size) as sets of numbers, those that are solved for at their centres."""
        robots = x[:, 0].astype(np.intp)
        z = np.zeros((len(x), len(self.task.prior.keys)))
        z[:, self.task.columns[0]] = self.robots.z[robots]
        z[:, self.free] = x[:, self.numbers]
        constants = x[:, self.constants][:, : len(KEYS)]
        demand, values = self.robots.demand.taken(robots), self.task.values(z, constants)
        ideal = Outcome(demand, hexapod.chain_at(self.task.catalog, "ideal", values))
        return Sets(demand, z, constants, ideal.drawn[:, PRINTED])

    def target(self, name: str, sets: Sets) -> Array:
        """A solved target of each set, (W,)."""
        own = "reversible" if name == HELD else name.removeprefix("walking_ratio_")
        values = self.task.values(sets.z, sets.constants)
        outcome = Outcome(sets.demand, hexapod.chain_at(self.task.catalog, own, values))
        if name == HELD:
            # The torque of joint 2 is negative: the upper end of what holds is the least.
            return printed_leg(outcome.holding.high)[:, 1]
        return outcome.drawn[:, PRINTED] / sets.ideal

    def _goal(self, name: str, x: Array) -> Array:
        """The value of a solved target that walkers ask for, (W,)."""
        target = self.targets[name]
        if name == HELD:  # its place in the printed range is the constants'
            printed = self.task.targets[HELD].centre
            return target.centre - printed - x[:, self.constants.stop - 1]
        return target.centre + target.half_width * x[:, self.aims][:, self.aimed.index(name)]

    def _solved(self, name: str, column: int, sets: Sets, goal: Array) -> tuple[Array, Array]:
        """The coordinate that gives a target, and the log density it brings, (W,) each."""
        every = np.arange(goal.size, dtype=np.float64)

        def missed(z: Array, which: Array) -> Array:
            chosen = which.astype(np.intp)
            return self.target(name, sets.taken(chosen).at(column, z)) - goal[chosen]

        low, high = (np.full(goal.size, end) for end in self.task.prior.ends[:, column])
        root = find_root(missed, (low, high), args=(every,), tolerances={"xatol": _CLOSE})
        z = np.where(root.success, root.x, 0.0)
        step = np.where(z + _STEP > high, -_STEP, _STEP)  # towards the inside
        slope = (missed(z + step, every) - root.f_x) / step
        return z, np.where(root.success, -0.5 * z**2 - np.log(np.abs(slope)), -np.inf)

    def _met(self, sets: Sets) -> NDArray[np.bool_]:
        """Whether the other targets are met and every limit is kept, (W,)."""
        numbers = self.task.values(sets.z, sets.constants)
        found = hexapod.outcomes(sets.demand, self.task.catalog, numbers)
        values = hexapod.figures(found)
        held = printed_leg(found["irreversible"].holding.motor_torque)
        good: NDArray[np.bool_] = (held == 0).all(axis=1)
        for o in found.values():
            good &= np.max([*o.excess.values()], axis=0) <= 0
        for name in self.targets.keys() - self.solved.keys():
            target = self.targets[name]
            good &= np.abs(values[name] - target.centre) <= target.half_width
        return good


def moves(
    posterior: Posterior, rng: np.random.Generator, centre: Array, factor: Array
) -> list[tuple[emcee.moves.Move, float]]:
    """Steps in the continuous coordinates, to other constants and to robots near by.

    The continuous coordinates turn towards draws of a Gaussian with the mean `centre` (C,) and the
    lower triangular factor of its covariance (C, C).
    """
    own = posterior.continuous
    reach = max(int(_REACH * len(posterior.robots.z)), 1)

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
        q[:, posterior.constants] = draws(posterior.task.published, rng, len(x))
        return q, np.zeros(len(x))

    def robot(x: Array, random: object) -> tuple[Array, Array]:
        q = x.copy()
        q[:, 0] += rng.integers(-reach, reach + 1, len(x))
        return q, np.zeros(len(x))

    kinds = (emcee.moves.MHMove(step) for step in (turned, constants, robot))
    return list(zip(kinds, _MOVES, strict=True))


def sample(posterior: Posterior, seed: Sequence[int], steps: int) -> Array:
    """One ensemble of walkers, started from draws of the prior that have a density.

    Steps turn towards draws of the prior at first, then towards those of a Gaussian with the
    walkers' mean and covariance, found anew after a while; from then on they are kept.

    Returns:
        Walkers over the kept steps, (S, W, D).

    Raises:
        LegwattError: No draw of the prior can be solved for the targets.
    """
    rng = np.random.default_rng(seed)
    x = np.empty((0, posterior.size))
    for _ in range(_PRIOR_STARTS):
        if len(x) < WALKERS:
            drawn = posterior.start(rng, 4 * WALKERS)
            x = np.concatenate([x, drawn[np.isfinite(posterior(drawn))]])
    if len(x) == 0:
        raise LegwattError(
            f"none of {_PRIOR_STARTS * 4 * WALKERS} draws of the prior meets the targets inside "
            "the motor's limits; widen prior.toml"
        )
    x = x[np.arange(WALKERS) % len(x)]
    own = posterior.continuous
    centre, factor = np.zeros(own.size), np.eye(own.size)
    chain = np.empty(0)
    settling = max(int(_SETTLING * steps), 2)
    for length in (settling, settling, steps - 2 * settling):
        sampler = emcee.EnsembleSampler(
            WALKERS,
            posterior.size,
            posterior,
            moves=moves(posterior, rng, centre, factor),
            vectorize=True,
        )
        # emcee draws acceptances from a state of its own.
        sampler.random_state = np.random.RandomState(int(rng.integers(2**31))).get_state()
        x = sampler.run_mcmc(x, length, skip_initial_state_check=True).coords
        chain = sampler.get_chain()
        recent = chain[len(chain) // 2 :].reshape(-1, posterior.size)[:, own]
        centre, factor = recent.mean(axis=0), np.linalg.cholesky(np.cov(recent.T))
    return chain


def ensemble(robots: int, steps: int, number: int) -> Array:
    """Kept sets of an ensemble: coordinates, constants, number of the robot, (S, W, D + 3 + 1)."""
    density = Posterior(shipped(), bank(_SEED, robots))
    chain = sample(density, [_SEED, 5000, number], steps)[::_THIN]
    constants = chain[:, :, density.constants][:, :, : len(KEYS)]
    z = np.array([density.evaluate(x)[1] for x in chain])
    return np.concatenate([z, constants, chain[:, :, :1]], axis=2)


def nearest(start: Point) -> Point | None:
    """`Problem.nearest` of the shipped files, for processes of their own."""
    return shipped().nearest(start)


def agreement(values: Array) -> float:
    """Nested R-hat of eight groups of walkers, of a number (steps, walkers); 1 where they agree.

    It is made for many short chains (Margossian et al., Bayesian Analysis 2024).
    """
    groups = np.arange(values.shape[1]) * _GROUPS // values.shape[1]
    own: Any = array_stats
    return float(own.rhat_nested(values, superchain_ids=groups, chain_axis=1, draw_axis=0))


def calibrate(steps: int, robots: int) -> tuple[Point, Array]:
    """The nearest set, and the posterior as `ensemble` has it, the walkers of all ensembles.

    Args:
        steps: Of every walker; the first three tenths are left out.
        robots: In the bank.

    Raises:
        LegwattError: No admissible set at all.
    """
    paths = bank(_SEED, robots).paths  # drawn here, so that the processes inherit it
    constants = np.array([*middle(shipped().published).values()])
    size = len(shipped().prior.keys)
    with ProcessPoolExecutor(ENSEMBLES) as pool:
        found = pool.map(partial(ensemble, robots, steps), range(ENSEMBLES))
        sets = np.concatenate([*found], axis=1)
        every = sets.reshape(-1, sets.shape[2])
        print(f"posterior: {len(every)} sets of {sets.shape[1]} walkers")
        every = every[np.argsort((every[:, :size] ** 2).sum(axis=1))]
        own = paths[every[:, -1].astype(np.intp)]
        near = [(path, z) for path in PATHS for z in every[own == path][:_STARTS, :size]]
        good = [p for p in pool.map(nearest, [Point(*p, constants) for p in near]) if p]
    if not good:
        raise LegwattError("no start reaches a set that meets every target and limit")
    print(f"nearest set: reached from {len(good)} of {len(near)} starts")
    return min(good, key=lambda p: float(p.z @ p.z)), sets


def table(best: Point, sets: Array, robots: Bank) -> DataFrame:
    """Every calibrated number in its file's unit, with what 95 % of the posterior spans.

    Args:
        best: The nearest set.
        sets: The posterior, as `ensemble` has it.
        robots: Their bank.

    Returns:
        A row for each number: value, ends of its interval, and of the prior's coordinates where
        the posterior lies in its sigmas and how much of it lies at a bound.
    """
    task, every = shipped(), sets.reshape(-1, sets.shape[2])
    z, constants, own = np.split(every, [len(task.prior.keys), -1], axis=1)
    postures = robots.posture[own[:, 0].astype(np.intp)]
    here = task.robot(best.path, best.z).robot.spec.parameters
    values = [
        task.prior.values(np.vstack([best.z, np.quantile(z, _SPAN, axis=0)])),
        np.vstack([best.constants, np.quantile(constants, _SPAN, axis=0)]),
        np.vstack([[here[name] for name in POSTURE], np.quantile(postures, _SPAN, axis=0)]),
    ]
    rows = []
    keys = (*task.prior.keys, *KEYS, *(f"{ROBOT}.{name}" for name in POSTURE))
    for key, ends in zip(keys, np.hstack(values).T.tolist(), strict=True):
        owner, name = key.split(".")
        known = here.parameter(name) if owner == ROBOT else task.catalog.parameter(key)
        written = [from_si(x, known.unit) for x in ends]
        rows.append((key, known.unit, written[0], min(written), max(written)))
    out = DataFrame(rows, columns=["number", "unit", "value", "low", "high"]).set_index("number")
    at_bound = (np.abs(z[:, None] - task.prior.ends) < _AT_BOUND).any(axis=1).mean(axis=0)
    where = {"mean_in_sigmas": z.mean(axis=0), "deviation_in_sigmas": z.std(axis=0)}
    return out.join(DataFrame(where | {"share_at_bound": at_bound}, index=task.prior.keys))


def main(arguments: Sequence[str] | None = None) -> None:
    """Calibrate, and write the numbers with their intervals as one table."""
    parser = argparse.ArgumentParser(prog="python -m pipeline.paper.calibration")
    parser.add_argument("--steps", type=int, default=3000, help="of every walker")
    parser.add_argument("--draws", type=int, default=300, help="robots that are drawn")
    parser.add_argument("--out", type=Path, default=OUT, help=f"the table; {OUT}")
    given = parser.parse_args(arguments)
    if given.steps < 20 or given.draws < 1:
        parser.error("at least 20 steps and one draw are needed")
    try:
        best, sets = calibrate(given.steps, given.draws)
    except LegwattError as error:
        parser.error(str(error))
    write_text(given.out, table(best, sets, bank(_SEED, given.draws)).to_csv())
    worst = max(agreement(values) for values in np.moveaxis(sets[:, :, :-1], 2, 0))
    print(f"written: {given.out}; path of the foot {best.path}; greatest R-hat {worst:.3f}")


if __name__ == "__main__":
    main()
