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
import shutil
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial
from pathlib import Path
from typing import Any

import emcee
import numpy as np
import tomlkit
from arviz_stats.base import array_stats
from numpy.typing import NDArray
from scipy import optimize
from scipy.linalg import solve_triangular
from scipy.optimize.elementwise import find_root
from scipy.stats import truncnorm

from actuators.arrays import Array
from actuators.chain import Chain
from actuators.errors import LegwattError
from actuators.loading.build import CATALOG, Catalog, load_catalog
from actuators.units import from_si
from pipeline.atomic import replacing
from pipeline.paper.hexapod import (
    MIDDLE_LEGS,
    POSTURE,
    PUBLISHED_LEG,
    ROBOT,
    SPLITS,
    Demand,
    RobotPart,
    chain_at,
    drawn,
    joined,
    outcome,
    outcomes,
    printed_leg,
    robot_part,
    solve_posture,
    with_splits,
)
from pipeline.paper.motor_constants import (
    KEYS,
    UNMET,
    FeasibleSet,
    feasible_set,
)
from pipeline.paper.prior import Free, Prior, load_prior
from pipeline.paper.published import EVEN, EXTRA, HELD, PAIR, Published, load_published
from pipeline.paper.quantities import computed
from pipeline.robot.robot_file import RobotSpec, load_robot_file

#: Rows met exactly by solving the posture.
EXACT = ("standing_reaction_rm", "standing_torque_2", "standing_torque_3")
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
ROBOT_FILE = Path(__file__).parents[2] / "urdf" / "hexapod.toml"
_RATIO = "walking_ratio_"
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
_EVALUATIONS = (40, 30)  # of the full problem per search: actuators alone, then everything
_REMEMBERED = 64  # robots: derivatives of actuators share them
_AT_BOUND = 0.02  # coordinates this close to a bound count as lying at it
_AT_LEAST = 0.05  # share of the posterior at a bound that is worth a word
_SPAN = (0.025, 0.975)  # quantiles
_POSTURES = 250  # sets of the posterior whose posture is computed
_DETERMINED_BELOW, _FREE_ABOVE = 0.3, 0.85  # the posterior's spread over the prior's
_MOVED_ABOVE, _BELIEF = 0.5, 1.96  # of its mean, in the prior's standard deviations
#: A set of numbers: foot's path, coordinates `z`, motor's constants, and what follows from them.
Point = dict[str, Any]


@dataclass(frozen=True)
class Target:
    """A fitted number: centre and half width in SI units."""

    name: str
    centre: float
    half_width: float


@dataclass
class Problem:
    """What is fitted, to what, starting from which files."""

    spec: RobotSpec  #: Robot file, its transfer path included.
    catalog: Catalog
    prior: Prior  #: Free numbers; they overrule the files'.
    published: Mapping[str, Published]  #: All printed values.
    #: The motor's three constants, by reference; the mean of all allowed where None.
    constants: Mapping[str, float] | None = None
    _robots: dict[bytes, RobotPart] = field(default_factory=dict, repr=False)

    @property
    def robot_columns(self) -> NDArray[np.intp]:
        """Coordinates that belong to the robot."""
        return np.flatnonzero([key.startswith(f"{ROBOT}.") for key in self.prior.keys])

    @property
    def actuator_columns(self) -> NDArray[np.intp]:
        """Coordinates that belong to the actuators."""
        return np.setdiff1d(np.arange(len(self.prior.free)), self.robot_columns)

    @property
    def ratio(self) -> float:
        """Total ratio of every alternative."""
        return self.catalog.parameter("requirement.ratio").value

    @cached_property
    def targets(self) -> tuple[Target, ...]:
        """What is fitted, the difference that the break-even asks for last."""
        rows = [
            Target(p.id, p.si, p.half_width_si)
            for p in self.published.values()
            if p.role == "target" and p.id not in (*EXACT, *CHOSEN, EVEN)
        ]
        even, held = self.published[EVEN], self.published["reversible_leg_energy_3s"].value  # [J]
        ends = (even.value - even.half_width, even.value + even.half_width)
        low, high = (share / (1 - share) * held / 2 for share in ends)  # per middle leg
        return (*rows, Target(EXTRA, (low + high) / 2, (high - low) / 2))

    @cached_property
    def feasible(self) -> FeasibleSet:
        """Motor constants that the tables allow."""
        return feasible_set(self.published)

    def along(self, path: str) -> Problem:
        """With another path of the foot."""
        return replace(self, spec=self.spec.with_gait(transfer_path=path), _robots={})

    def robot(self, z: Array) -> RobotPart:
        """The robot's part at coordinates (D,), remembered.

        Raises:
            LegwattError: Out of reach, tipping, or no posture meets the targets.
        """
        key = z[self.robot_columns].tobytes()
        if key not in self._robots:
            if len(self._robots) > _REMEMBERED:
                self._robots.clear()
            values = self.prior.values(z).items()
            own = {k.split(".")[1]: v for k, v in values if k.startswith(f"{ROBOT}.")}
            goal = np.array([self.published[name].value for name in EXACT])
            self._robots[key] = robot_part(solve_posture(self.spec.with_parameters(own), goal))
        return self._robots[key]

    def evaluate(self, z: Array) -> tuple[Mapping[str, float], Array]:
        """What `computed` gives at coordinates (D,), SI, and every motor quantity over its limit.

        Of the latter the largest over the cycle, less one: negative is inside.

        Raises:
            LegwattError: The robot cannot take this shape.
        """
        robot = self.robot(z)
        constants = self.feasible.middle if self.constants is None else self.constants
        values = self.prior.values(z).items()
        own = {k: v for k, v in values if not k.startswith(f"{ROBOT}.")} | dict(constants)
        found = outcomes(robot.demand, self.catalog, with_splits(own, self.ratio))
        excess = [float(peak[0]) for o in found.values() for peak in o.excess.values()]
        return computed(robot, found), np.array(excess)

    def admissible(self, values: Mapping[str, float], excess: Array) -> bool:
        """Whether a set gives every printed value and every motor stays inside its limits.

        Values that contradict those by which the motor's constants were chosen are left out, and so
        are predictions, which would be none if they were asked for.
        """
        asked = [p for p in self.published.values() if p.role != "prediction" and p.id not in UNMET]
        extra = self.targets[-1]
        return (
            excess.max() <= 0
            and abs(values[EXTRA] - extra.centre) <= extra.half_width
            and all(p.reproduced(from_si(values[p.id], p.unit)) for p in asked)
        )

    def nearest(self, start: Array) -> Array:
        """The set nearest to the prior's centre that meets the targets, (D,), from another.

        First the actuators' coordinates alone, then all.
        """
        z = start.copy()
        every = np.arange(z.size)
        for columns, most in zip((self.actuator_columns, every), _EVALUATIONS, strict=True):
            lower, upper = self.prior.ends[:, columns]
            residuals = partial(self._residuals, z.copy(), columns)
            found = optimize.least_squares(
                residuals,
                np.clip(z[columns], lower + 1e-9, upper - 1e-9),
                jac=partial(_differences, residuals, upper),
                bounds=(lower, upper),
                x_scale=1.0,
                ftol=1e-8,
                xtol=1e-8,
                max_nfev=most,
            )
            z[columns] = found.x
        return z

    def _residuals(self, z: Array, columns: NDArray[np.intp], x: Array) -> Array:
        """Distance from the prior's centre, from every target, and a hinge at the motor's limits.

        `x` (C,) are the coordinates in some columns of `z` (D,).
        """
        z[columns] = x
        try:
            values, excess = self.evaluate(z)
        except LegwattError:
            # Out of reach or tipping: a wall, a large but finite residual.
            size = z.size + len(self.targets) + 4 * len(self.catalog.alternatives)
            return np.full(size, 30.0)
        error = [(values[t.name] - t.centre) / t.half_width for t in self.targets]
        limits = np.maximum(excess + 0.005, 0.0)
        return np.concatenate([z, _PULL * np.array(error), _STEEP * limits])


def _differences(function: Callable[[Array], Array], upper: Array, x: Array) -> Array:
    """Jacobian (R, D) by one-sided differences, backwards where a step would leave the bounds."""
    base = function(x)
    steps = np.where(x + _DIFFERENCE <= upper, _DIFFERENCE, -_DIFFERENCE)
    return np.stack(
        [(function(x + row) - base) / row[i] for i, row in enumerate(np.diag(steps))], 1
    )


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
        task: Prior and catalogue.
        robots: The bank; each is a set of the demand.
        targets: What has to come out; the task's by default.
    """

    def __init__(
        self, task: Problem, robots: Demand, targets: Sequence[Target] | None = None
    ) -> None:
        self.task, self.robots = task, robots
        self.targets = {t.name: t for t in (task.targets if targets is None else targets)}
        own = {f.key: f for f in (task.prior.free[i] for i in task.actuator_columns)}
        self.solved = {name: own[key] for name, key in SOLVED.items() if name in self.targets}
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
        ideal = drawn(demand, self.chain("ideal", values))[PUBLISHED_LEG]
        return _Sets(demand, ideal, values)

    def _goal(self, name: str, x: Array) -> Array:
        """The value of a solved target that walkers ask for, (W,)."""
        target = self.targets[name]
        if name == HELD:  # its place in the printed range is the constants'
            printed = next(t for t in self.task.targets if t.name == HELD)
            return target.centre - printed.centre - x[:, self.constants.stop - 1]
        aim = x[:, self.aims.start + self.aimed.index(name)]
        return target.centre + target.half_width * aim

    def chain(self, name: str, values: dict[str, Array]) -> Chain:
        """An alternative with one number per set."""
        return chain_at(self.task.catalog, name, with_splits(values, self.task.ratio))

    def target(self, name: str, sets: _Sets) -> Array:
        """A solved target of each set, (W,)."""
        if name == HELD:
            chain = self.chain("reversible", sets.values)
            # The torque of joint 2 is negative: the upper end of what holds is the least.
            return printed_leg(chain.holding(sets.demand.standing).high)[:, 1]
        chain = self.chain(name.removeprefix(_RATIO), sets.values)
        return drawn(sets.demand, chain)[PUBLISHED_LEG] / sets.ideal

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
            name: outcome(sets.demand, self.chain(name, sets.values))
            for name in self.task.catalog.alternatives
        }
        held = printed_leg(found["irreversible"].holding.motor_torque)
        good: NDArray[np.bool_] = (held == 0).all(axis=1)
        for o in found.values():
            good &= np.max([*o.excess.values()], axis=0) <= 0
        less, more = (found[a].drawn for a in PAIR)
        for name in self.targets.keys() - self.solved.keys():
            if name == EXTRA:
                value = np.mean([more[leg] - less[leg] for leg in MIDDLE_LEGS], axis=0)
            else:
                value = found[name.removeprefix(_RATIO)].drawn[PUBLISHED_LEG] / sets.ideal
            target = self.targets[name]
            good &= np.abs(value - target.centre) <= target.half_width
        return good


def moves(
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
        LegwattError: No draw of the prior can be solved for the targets.
    """
    rng = np.random.default_rng(seed)
    x = np.empty((0, posterior.size))
    for _ in range(_PRIOR_STARTS):
        if len(x) < walkers:
            drawn = posterior.start(rng, 4 * walkers)
            x = np.concatenate([x, drawn[np.isfinite(posterior(drawn))]])
    if len(x) == 0:
        raise LegwattError(
            f"none of {_PRIOR_STARTS * 4 * walkers} draws of the prior meets the targets inside "
            "the motor's limits; widen prior.toml"
        )
    x = x[np.arange(walkers) % len(x)]
    own = posterior.continuous
    centre, factor = np.zeros(own.size), np.eye(own.size)
    chain = np.empty(0)
    settling = max(int(_SETTLING * steps), 2)
    for length in (settling, settling, steps - 2 * settling):
        sampler = emcee.EnsembleSampler(
            walkers,
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


@cache
def base_problem() -> Problem:
    """The problem of the shipped files."""
    return Problem(load_robot_file(ROBOT_FILE), load_catalog(), load_prior(), load_published())


@dataclass(frozen=True)
class Robots:
    """R robots drawn from the prior, in order of what the ideal actuator's printed leg draws."""

    demand: Demand  #: What they ask of their joints; a robot is a set.
    paths: tuple[str, ...]  #: The foot's path of each.
    coordinates: Array  #: Of each robot's numbers, (R, D).


@cache
def robots(seed: int, count: int) -> Robots:
    """Draw robots, each with a path, that stand and walk as printed.

    Those that turn the motor faster than it may turn are left out: no actuator mends that.
    """
    rng = np.random.default_rng([seed, 4000])
    tasks = {path: base_problem().along(path) for path in PATHS}
    ideal = base_problem().catalog.chain("ideal")
    fastest = ideal.motor.max_speed / np.asarray(ideal.ratio)  # of a joint [rad/s]
    found: list[tuple[Demand, str, Array]] = []
    while len(found) < count:
        path = PATHS[int(rng.integers(len(PATHS)))]
        task = tasks[path]
        z = task.prior.draw(rng)
        try:
            demand = task.robot(z).demand
        except LegwattError:
            continue
        if np.abs(demand.series.velocity).max() <= fastest:
            found.append((demand, path, z[task.robot_columns]))
    demands, paths, coordinates = zip(*found, strict=True)
    demand = joined(demands)
    order = np.argsort(drawn(demand, ideal)[PUBLISHED_LEG])
    return Robots(demand.taken(order), tuple(paths[i] for i in order), np.array(coordinates)[order])


def sets_of(density: Posterior, own: Robots, x: Array) -> list[Point]:
    """Walkers (N, D) as sets of numbers: path, coordinates and constants."""
    _, values = density.evaluate(x)
    prior, chosen = density.task.prior, x[:, 0].astype(np.intp)
    z = np.empty((len(x), len(prior.free)))
    z[:, density.task.robot_columns] = own.coordinates[chosen]
    for i in density.task.actuator_columns:
        free = prior.free[i]
        z[:, i] = [free.coordinate(value) for value in values[free.key]]
    return [
        {
            "path": own.paths[robot],
            "z": row.tolist(),
            "constants": {key: float(values[key][k]) for key in KEYS},
        }
        for k, (robot, row) in enumerate(zip(chosen, z, strict=True))
    ]


def ensemble(bank: int, steps: int, number: int) -> list[list[Point]]:
    """Per walker of an ensemble its sets over the steps that are kept."""
    own = robots(_SEED, bank)
    density = Posterior(base_problem(), own.demand)
    chain = sample(density, [_SEED, 5000, number], steps)[::_THIN]
    return [sets_of(density, own, chain[:, w]) for w in range(chain.shape[1])]


def posture_of(one: Point) -> dict[str, float] | None:
    """What the posture of a set is; None where it cannot be taken."""
    try:
        part = base_problem().along(one["path"]).robot(np.array(one["z"]))
    except LegwattError:
        return None
    return {name: part.robot.spec.parameters[name] for name in POSTURE}


def nearest_point(one: Point) -> Point | None:
    """The admissible set nearest to the prior's centre, from one set; None where none is found."""
    task = base_problem().along(one["path"])
    try:
        z = task.nearest(np.array(one["z"]))
        if not task.admissible(*task.evaluate(z)):
            return None
    except LegwattError:
        return None
    return {"path": one["path"], "z": z.tolist(), "constants": dict(task.feasible.middle)}


def agreement(values: Array) -> float:
    """Nested R-hat of eight groups of walkers, of a number (walkers, steps); 1 where they agree.

    It is made for many short chains (Margossian et al., Bayesian Analysis 2024).
    """
    groups = np.arange(len(values)) * _GROUPS // len(values)
    axes = {"chain_axis": 0, "draw_axis": 1}
    return float(array_stats.rhat_nested(values, superchain_ids=groups, **axes))


def verdict(shift: float, spread: float, prior_spread: float) -> str:
    """What the targets did to a number, as the reason of its value.

    Args:
        shift: Mean of the posterior, in prior standard deviations from the prior's centre.
        spread: Standard deviation of the posterior, in the same.
        prior_spread: Standard deviation of the prior itself, cut off at the bounds, in the same.
    """
    if abs(shift) > _BELIEF:
        return "driven out of the prior's 95 % by them"
    if spread < _DETERMINED_BELOW:
        return "determined by them"
    if abs(shift) > _MOVED_ABOVE:
        return "moved by them"
    return f"{'not determined' if spread >= _FREE_ABOVE * prior_spread else 'narrowed'} by them"


def calibrate(steps: int, draws: int, starts: int) -> tuple[Point, Array, list[dict[str, float]]]:
    """The nearest set, the posterior's numbers, and postures of some of its sets.

    Args:
        steps: Of every walker; the first three tenths are left out.
        draws: At most so many robots in the bank, and sets whose posture is computed.
        starts: Of the search for the nearest set, per path of the foot: draws of the posterior.

    Returns:
        Of the numbers the coordinates, and the motor's constants in SI (walkers, steps, numbers).

    Raises:
        LegwattError: No admissible set at all.
    """
    with ProcessPoolExecutor(ENSEMBLES) as pool:
        ensembles = pool.map(partial(ensemble, draws, steps), range(ENSEMBLES))
        walkers = [walker for found in ensembles for walker in found]
        every = [one for at_step in zip(*walkers, strict=True) for one in at_step]
        print(f"posterior: {len(every)} sets of {len(walkers)} walkers")
        near = sorted(every, key=_distance)
        first = [p for path in PATHS for p in [q for q in near if q["path"] == path][:starts]]
        good = [p for p in pool.map(nearest_point, first) if p is not None]
        if not good:
            raise LegwattError("no start reaches a set that meets every target and limit")
        print(f"nearest set: reached from {len(good)} of {len(first)} starts")
        spread = np.linspace(0, len(every) - 1, min(draws, _POSTURES, len(every))).astype(int)
        postures = [p for p in pool.map(posture_of, [every[i] for i in spread]) if p is not None]
    sets = np.array(
        [[[*p["z"], *(p["constants"][key] for key in KEYS)] for p in own] for own in walkers]
    )
    return min(good, key=_distance), sets, postures


def _distance(one: Point) -> float:
    return float(np.dot(one["z"], one["z"]))


def fill_in(
    parameters: Mapping[str, Any], best: Point, sets: Array, postures: Sequence[dict[str, float]]
) -> None:
    """Put every calibrated number into its file, with what 95 % of the posterior spans.

    Args:
        parameters: Of the robot and of every component, as their files have them.
        best: The nearest set; for the others see `calibrate`.
    """
    source = "nearest to the prior among all sets that meet the paper's figures"
    columns = np.moveaxis(sets, 2, 0)
    for free, value, values in zip(load_prior().free, best["z"], columns, strict=False):
        lower, upper = free.ends
        at = (np.mean(values - lower < _AT_BOUND), np.mean(upper - values < _AT_BOUND))
        reason = verdict(values.mean(), values.std(), truncnorm(lower, upper).std())
        if sum(at) >= _AT_LEAST:
            bound = "lower" if at[0] > at[1] else "upper"
            reason += f"; at its {bound} bound in {100 * sum(at):.0f} % of the posterior"
        ends = [free.value(z) for z in (value, *np.quantile(values, _SPAN))]
        _replace(parameters, free.key, ends, source, reason)
    for key, values in zip(KEYS, columns[-len(KEYS) :], strict=True):
        ends = [best["constants"][key], *np.quantile(values, _SPAN)]
        fixed = "middle of all motor constants that give Tables IV to VI as printed"
        _replace(parameters, key, ends, fixed, "no data sheet resolves what these tables leave")
    ours = posture_of(best)
    assert ours is not None  # it is admissible
    rows = ("the reaction of 192.6 N", "joint 2 in Table III", "joint 3 in Table III")
    for name, row in zip(POSTURE, rows, strict=True):
        ends = [ours[name], *np.quantile([posture[name] for posture in postures], _SPAN)]
        _replace(parameters, f"{ROBOT}.{name}", ends, source, f"solved from {row}")
    total = float(parameters["requirement"]["ratio"]["value"])
    for free_ratio, following in SPLITS.items():
        names = [reference.split(".")[0] for reference in (free_ratio, following)]
        first, second = (parameters[name]["ratio"] for name in names)
        low, high = first["interval"]
        second["value"] = total / float(first["value"])
        second["interval"] = [float(f"{total / float(end):.8g}") for end in (high, low)]
        second["basis"] = "derived"
        second["source"] = f"{total:g} over the ratio of {names[0]}"
        second["reason"] = ""


def _replace(
    parameters: Mapping[str, Any], key: str, ends: Sequence[float], source: str, reason: str
) -> None:
    """Put a calibrated number into its table: value first, then ends of its interval, SI."""
    component, name = key.split(".")
    entry = parameters[component][name]
    unit = str(entry["unit"])
    written = [float(f"{from_si(float(x), unit):.8g}") for x in ends]
    entry["value"] = written[0]
    entry["basis"] = "calibrated"
    entry["source"] = source
    entry["reason"] = reason
    entry["interval"] = [min(written), max(written)]


def main(arguments: Sequence[str] | None = None) -> None:
    """Calibrate, and write the values into the shipped files or into copies of them."""
    parser = argparse.ArgumentParser(prog="python -m pipeline.paper.calibration")
    parser.add_argument("--steps", type=int, default=3000, help="of every walker")
    parser.add_argument("--draws", type=int, default=300, help="robots and postures, at most")
    parser.add_argument("--starts", type=int, default=4, help="of the search, per path of the foot")
    parser.add_argument("--into", type=Path, help="folder for copies in place of the shipped files")
    given = parser.parse_args(arguments)
    if given.steps < 20 or given.draws < 1 or given.starts < 1:
        parser.error("at least 20 steps, one draw and one start are needed")
    try:
        found = calibrate(given.steps, given.draws, given.starts)
    except LegwattError as error:
        parser.error(str(error))
    robot, catalog = ROBOT_FILE, CATALOG
    if given.into:
        catalog = Path(shutil.copytree(CATALOG, given.into / "actuators", dirs_exist_ok=True))
        robot = Path(shutil.copy(ROBOT_FILE, given.into))
    files = [robot, *(path for path in catalog.glob("*.toml") if path.stem != "alternatives")]
    documents = {path: tomlkit.parse(path.read_text(encoding="utf-8")) for path in files}
    names = {path: ROBOT if path == robot else path.stem for path in files}
    fill_in({names[path]: d.get("parameters") for path, d in documents.items()}, *found)
    documents[robot]["gait"]["transfer_path"] = found[0]["path"]
    with ExitStack() as every:  # all or nothing
        for path, document in documents.items():
            temporary = every.enter_context(replacing(path))
            temporary.write_text(tomlkit.dumps(document), encoding="utf-8")
    worst = max(agreement(values) for values in np.moveaxis(found[1], 2, 0))
    print(f"written: {', '.join(path.name for path in files)}; greatest R-hat {worst:.3f}")
    print("run `make urdf` to build the URDFs from the calibrated robot file")


if __name__ == "__main__":
    main()
