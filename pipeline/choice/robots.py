"""Robots: a design for each group of joints, each evaluated with its own actuators' mass.

Along a motion joint torques are affine in the masses of the actuators, so that one demand, and one
more for each group with a nudge of mass at its joints, give that of any robot exactly. `_scan` goes
through a grid of total actuator masses, where the groups' fronts are added. What it finds, and what
differs from the best of it in one group, is evaluated with its own mass: only such robots are
compared, so that every point of the front is consistent.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import product
from typing import Final, NamedTuple, Self

import numpy as np

from actuators.arrays import Array, Index
from pipeline.choice.evaluate import NOMINAL, PLACES, Demand, Evaluated, Held, ModeSeries, evaluate
from pipeline.choice.loads import cases_of, loads_of
from pipeline.choice.options import Problem
from pipeline.choice.shelf import Design, Designs, design_words

#: Ratio of one total actuator mass of the grid to the one before: a robot is searched with at most
#: this much more than its own mass, which costs it a few percent of power in the search alone.
_STEP: Final = 1.2
_POINTS: Final = 24  # of the grid, at most: 66 times the lightest
#: Designs of a group within limits up to this at the lightest robot are searched; demand grows with
#: mass, so that what exceeds a limit by more there exceeds it everywhere.
_NEARLY: Final = 1.1
#: Use of a limit up to which a robot may be within it with motions of its own mass, which differ.
_NEAR: Final = 1.03
#: Robots of a grid point, from the least power on, that are evaluated with their own mass.
_KEPT: Final = 12
_CHEAP: Final = 6  # designs of a group from which robots of known price are begun
NUDGE: Final = 0.1  # [kg]
Robot = tuple[Design, ...]  # a design for each group, in their order
#: Families of the envelope over the share of standing: which joints lock, by a gear or a brake.
FAMILIES: Final = ("none locks", "all lock", "any")
BUYABLE: Final = "buyable"  # what answers are of, see `Problem.buyable`
#: Shares of standing at which robots are chosen anew; closer where the curves cross.
STANDING: Final = np.array([0.0, 0.25, 0.5, 0.6, 0.7, 0.8, 0.85, 0.9, 0.95, 0.98, 1.0])


class Known(NamedTuple):
    """A robot with its own mass."""

    power: float  #: Mean over the mission [W].
    mass: float  #: Of all actuators [kg].
    use: float  #: Greatest share of any limit.
    price: float  #: Of all actuators; NaN where a part's is not at hand [EUR].
    modes: Array  #: Mean power of each mode, (M,) [W].


def demand_of(problem: Problem, mass: Mapping[str, float], *, slopes: bool = True) -> Demand:
    """What the mission and its load cases ask with masses of one actuator of each group [kg]."""
    added, common = problem.added(mass), (problem.machine, problem.modes)
    nudged = [added | {j: added[j] + NUDGE for j in joints} for joints in problem.groups.values()]
    masses = [added, *nudged] if slopes else [added]
    cases = cases_of(*common, masses)
    every = [[*x, *(c[k] for c in cases)] for k, x in enumerate(loads_of(*common, masses))]
    reference = np.array([mass[g] for g in problem.groups])
    return Demand.of(problem.groups, reference, *every, nudge=NUDGE)


@dataclass(frozen=True, eq=False)
class Robots:
    """Some robots, each evaluated with its own mass; arrays (R, ...)."""

    parts: Sequence[Designs]  #: Of each group, R designs.
    groups: Sequence[Evaluated]  #: Likewise.
    shares: Array  #: Of the modes in the mission, (M,).
    hotel: float  #: [W].

    @cached_property
    def modes(self) -> Array:
        """Mean power of the robot out of the supply, (R, M) [W]."""
        return np.asarray(sum(own.power for own in self.groups) + self.hotel)

    @cached_property
    def power(self) -> Array:
        """Mean over the mission, (R,) [W]."""
        return np.asarray(self.modes @ self.shares)

    @cached_property
    def use(self) -> Array:
        """Greatest share of any limit that is used, (R,)."""
        return np.asarray(np.max([own.most for own in self.groups], axis=0))

    def total(self, quantity: str, joints: Array) -> Array:
        """Sum over all actuators of ``mass`` [kg] or ``price`` [EUR], (R,)."""
        each = [n * getattr(own, quantity) for n, own in zip(joints, self.parts, strict=True)]
        return np.asarray(sum(each))


class Search:
    """Of the robots that parts can make, those worth keeping; `known` grows as it goes."""

    def __init__(self, problem: Problem, pairs: Sequence[Design], demand: Demand) -> None:
        self.problem, self.demand = problem, demand
        self.pairs = pairs  #: Motor and gear, without brake.
        self.most = 1.0  #: Of each limit that robots may use.
        self.shelf = problem.shelf
        self.known: dict[Robot, Known] = {}  #: Every robot that was evaluated.
        self.pool: dict[str, dict[Design, None]] = {}  #: Designs of each group worth a try.
        self.tracks = next(iter(demand.groups.values()))  #: Of one group: its modes are all's.
        self.shares = np.array([track.share for track in self.tracks])  #: In the mission, (M,).
        self.counts = np.array([len(own) for own in problem.groups.values()])  #: Joints, (G,).
        #: Where joints hold in the band of friction, its middle where that is drawn.
        self.held = Held(PLACES.get(problem.wanted.standing, NOMINAL.place))

    @cached_property
    def moving_standing(self) -> tuple[Array, Array] | None:
        """Weights (M,) of the modes that move, and of those that stand, locked; None without."""
        at = {t.mode.name: m for m, t in enumerate(self.tracks) if t.mode.hours and not t.share}
        moves, closed = np.zeros((2, len(self.tracks)))
        for m, track in enumerate(self.tracks):
            own = closed if track.mode.stands else moves
            own[at.get(track.mode.name, m)] += track.share
        if not moves.any() or not closed.any():
            return None
        return moves / moves.sum(), closed / closed.sum()

    @cached_property
    def designs(self) -> dict[str, Designs]:
        """Of each group, all that may be within limits in some robot, or come nearest to it."""
        out, lightest = {}, self.shelf.designs(self.pairs)
        light = np.full(len(self.problem.groups), lightest.mass.min()) - self.demand.mass
        for name, tracks in self.demand.groups.items():
            left = np.arange(len(lightest))
            for track in sorted(tracks, key=lambda track: track.torque.size):
                most = evaluate([track], lightest.taken(left), 0.0, light, self.held).most
                left = left[most <= max(_NEARLY, most.min())]
            out[name] = self.shelf.designs(self._braked(tracks, lightest.taken(left)))
            self.pool[name] = {}
        return out

    def _braked(self, tracks: Sequence[ModeSeries], pairs: Designs) -> list[Design]:
        """The pairs, and each with the brakes that hold what stands."""
        out, parts = list(pairs.parts), self.shelf.parts
        brakes = [("", "", name) for name, part in parts.items() if part.kind == "brake"]
        each = self.shelf.designs(brakes).brake_torque.tolist() if brakes else []
        torque = sorted((own, brake) for own, (*_, brake) in zip(each, brakes, strict=True))
        most = max((np.abs(t.torque).max() for t in tracks if t.mode.stands and t.share), default=0)
        for (motor, gear, _), need in zip(pairs.parts, most / pairs.ratio, strict=True):
            if gear and parts[gear].kind == "self_locking":
                continue
            holds = [(own, brake) for own, brake in torque if own >= need]
            # A heavier robot asks for more, but not for twice as much.
            more = next((own for own, _ in holds if own >= 2.0 * need), np.inf)
            out += [(motor, gear, brake) for own, brake in holds if own <= more]
        return out

    def evaluated(self, robots: Sequence[Robot], demand: Demand | None = None) -> Robots:
        """Robots with their own masses; with all details where the demand is theirs alone."""
        parts = [self.shelf.designs(column) for column in zip(*robots, strict=True)]
        return self.built_of(parts, [self.held] * len(parts), demand)

    def built_of(
        self, parts: Sequence[Designs], held: Sequence[Held], demand: Demand | None = None
    ) -> Robots:
        """The same by designs and what is `held` of each group."""
        own, recovered = demand or self.demand, self.problem.wanted.recovered
        more = np.stack([designs.mass for designs in parts], axis=1) - own.mass
        found = [
            evaluate(tracks, designs, recovered, more, known, detail=demand is not None)
            for tracks, designs, known in zip(own.groups.values(), parts, held, strict=True)
        ]
        return Robots(parts, found, self.shares, self.problem.wanted.value("hotel", 0.0))

    def learn(self, robots: Sequence[Robot]) -> None:
        """Evaluate those that are not known yet."""
        if not (new := [robot for robot in dict.fromkeys(robots) if robot not in self.known]):
            return
        found = self.evaluated(new)
        mass, price = (found.total(q, self.counts).tolist() for q in ("mass", "price"))
        columns = (found.power.tolist(), mass, found.use.tolist(), price, found.modes)
        self.known |= {robot: Known(*own) for robot, *own in zip(new, *columns, strict=True)}

    def run(self) -> Self:
        """Fill `known`; where no robot is within limits, the front is empty."""
        self._scan()
        self._polish(lambda: self.front() or [self.best])
        if not self.front():  # the closest of all that there are
            for pool in self.pool.values():
                pool |= dict.fromkeys(self.pairs)
            self._polish(lambda: self.front() or [self.best])
        self._price()
        if both := self.moving_standing:
            for lock, share in product((False, True), STANDING[-1:1:-3]):
                weights = (1.0 - share) * both[0] + share * both[1]
                self._polish(partial(self._family, lock, weights), lock)
        return self

    def _scan(self) -> None:
        """Evaluate robots worth a look at each total actuator mass, from the lightest on."""
        views = [(self.shares, BUYABLE)]
        if both := self.moving_standing:
            weights = np.outer(1.0 - STANDING, both[0]) + np.outer(STANDING, both[1])
            views += [(own, family) for family in FAMILIES for own in weights]
        split = np.array([own.mass.min() for own in self.designs.values()])
        total = float(split @ self.counts)
        searched = [*self.designs.values()]
        for _ in range(_POINTS):
            more = split * total / float(split @ self.counts) - self.demand.mass
            each = [
                evaluate(tracks, own, self.problem.wanted.recovered, more, self.held)
                for tracks, own in zip(self.demand.groups.values(), searched, strict=True)
            ]
            robots, enough = list[Robot](), False
            for k, view in enumerate(views):
                chosen, mass = self._best_under(total, *view, searched, each)
                for row in chosen[: 1 if k else _KEPT]:
                    each_part = zip(searched, row, strict=True)
                    robots.append(tuple(own.parts[i] for own, i in each_part))
                if k == 0 and len(chosen):
                    split = np.array([o.mass[i] for o, i in zip(searched, chosen[0], strict=True)])
                    enough = mass <= total  # more mass is of no use
            self.learn(robots)
            if enough:
                return
            # The next point is heavier: what exceeds limits clearly does so there, too.
            searched = [
                own.taken(np.flatnonzero(found.most <= max(_NEARLY, found.most.min())))
                for own, found in zip(searched, each, strict=True)
            ]
            total *= _STEP

    def _best_under(
        self,
        total: float,
        weights: Array,
        family: str,
        designs: Sequence[Designs],
        each: Sequence[Evaluated],
    ) -> tuple[Index, float]:
        """Robots of a family under a mass, from the least power by weights (M,) of the modes on.

        Also the mass of the best one, (R, G) and [kg]. Where a group has no design within limits,
        it is the one that exceeds them least; none at all where a family has no member.
        """
        few = 2 if family in FAMILIES[:2] else _KEPT
        fronts, index = [], []
        for group, own, found in zip(self.demand.groups, designs, each, strict=True):
            power = found.power @ weights
            member = np.ones(len(own), dtype=np.bool_)
            if family == BUYABLE:
                member = np.array([self.problem.buyable([design]) for design in own.parts])
            elif family in FAMILIES[:2]:
                member = own.locks(True) == (family == FAMILIES[1])
            if not member.any():
                return np.zeros((0, len(designs)), dtype=np.intp), np.inf
            fits = np.flatnonzero(member & (found.most <= 1.0))
            if not len(fits):
                fits = np.flatnonzero(member)
                fits = fits[[found.most[fits].argmin()]]
            kept = fits[front(power[fits], own.mass[fits])]
            best = fits[np.argsort(power[fits], kind="stable")]
            priced = fits[np.isfinite(own.price[fits])] if family == BUYABLE else fits[:0]
            cheap = priced[front(power[priced], own.price[priced])]
            near = np.flatnonzero(member & (found.most <= _NEAR))
            tried = [*best[:few], *kept, *cheap, *near[front(power[near], own.mass[near])]]
            self.pool[group] |= dict.fromkeys(own.parts[i] for i in tried)
            index.append(kept)
            fronts.append((power[kept], own.mass[kept] * len(self.problem.groups[group])))
        _, mass, taken = merged(fronts)
        inside = np.flatnonzero(mass <= total * (1.0 + 1e-9))
        shown = inside if len(inside) else np.array([len(mass) - 1])
        which = np.stack([own[taken[shown, g]] for g, own in enumerate(index)], axis=1)
        return which, float(mass[0])

    def _price(self) -> None:
        """Robots of which all prices are at hand, from the cheapest designs on."""
        groups = []
        for pool in self.pool.values():
            designs = self.shelf.designs([*pool])
            order = np.argsort(designs.price, kind="stable")[:_CHEAP]  # NaN last
            groups.append([designs.parts[i] for i in order if np.isfinite(designs.price[i])])
        if all(groups):
            self.learn([*product(*groups)])
            self._polish(lambda: self.front(price=True))

    def _polish(self, best: Callable[[], Sequence[Robot]], lock: bool | None = None) -> None:
        """Replace one group's design of the best robots, until they stay; by those that lock."""
        done: set[Robot] = set()
        pools = [[d for d in x if lock in (None, d in self.locking)] for x in self.pool.values()]
        while new := [robot for robot in best() if robot not in done]:
            done |= {*new}
            each = ((r, g, d) for r in new for g, pool in enumerate(pools) for d in pool)
            self.learn([(*r[:g], d, *r[g + 1 :]) for r, g, d in each])

    def _family(self, lock: bool, weights: Array) -> list[Robot]:
        """The robot of which all joints lock, or none, that takes least; none without any."""
        members = [r for r in self.known if all((design in self.locking) == lock for design in r)]
        key = {r: (max(self.known[r].use, 1.0), self.known[r].modes @ weights) for r in members}
        return [min(key, key=lambda robot: key[robot])] if key else []

    @cached_property
    def locking(self) -> set[Design]:
        """Designs whose gear or brake holds what pushes from outside."""
        every = self.designs.values()
        return {own.parts[i] for own in every for i in np.flatnonzero(own.locks(True))}

    @property
    def best(self) -> Robot:
        """The buyable robot that exceeds limits least; of those within, that of least power."""
        buyable = filter(self.problem.buyable, self.known)
        return min(buyable, key=lambda r: (max(self.known[r].use, 1.0), self.known[r].power))

    @property
    def within(self) -> list[Robot]:
        """Buyable robots within limits, from the least power on."""
        fits = (r for r, x in self.known.items() if x.use <= self.most and self.problem.buyable(r))
        return sorted(fits, key=lambda robot: self.known[robot].power)

    @property
    def near(self) -> list[Robot]:
        """Buyable robots beyond a limit by little that would be an end of the front, by use."""
        ends = np.min([self.known[r][:2] for r in self.within] or [(np.inf, np.inf)], axis=0)
        some = (r for r, x in self.known.items() if 1.0 < x.use <= _NEAR and (x[:2] < ends).any())
        return sorted(filter(self.problem.buyable, some), key=lambda robot: self.known[robot].use)

    def front(self, price: bool = False) -> list[Robot]:
        """Pareto front of `within`: power and mass (or price), lightest last."""
        axis = 3 if price else 1
        robots = [robot for robot in self.within if np.isfinite(self.known[robot][axis])]
        power, mass = (np.array([self.known[r][k] for r in robots]) for k in (0, axis))
        return [robots[i] for i in front(power, mass)] if robots else []

    def closest(self, found: Robots | None = None) -> str:
        """Why no robot is within limits: group, limit, mode and by how much of the closest."""
        found = found or self.evaluated([self.best])
        mass = float(found.total("mass", self.counts)[0])
        group, limit, mode, use = worst(self, found)
        design, *_ = found.parts[[*self.problem.groups].index(group)].parts
        return (
            "no robot found that stays within limits with its own actuators' mass; the closest has "
            f"{mass:.3g} kg of actuators, and group '{group}' ({design_words(design)}) takes "
            f"{use:.3g} of its {limit} in mode '{mode}', margins included; add lighter or stronger "
            "parts, lower a margin, or state `present`, since the bodies count as holding "
            f"{self.problem.present:.3g} kg of every actuator"
        )


def worst(search: Search, found: Robots, robot: int = 0) -> tuple[str, str, str, float]:
    """Group, limit and mode in which a robot uses most of a limit, and how much."""
    out = ("", "", "", -1.0)
    for (group, tracks), own in zip(search.demand.groups.items(), found.groups, strict=True):
        for limit, use in own.use.items():
            m = int(use[robot].argmax())
            if use[robot, m] > out[3]:
                out = (group, limit, tracks[m].mode.name, float(use[robot, m]))
    return out


def front(power: Array, mass: Array) -> Index:
    """Designs (D,) on the Pareto front of power and mass, from the least power on."""
    order = np.lexsort((mass, power))
    lightest = np.minimum.accumulate(mass[order])
    return np.asarray(order[np.diff(lightest, prepend=np.inf) < 0.0])


def merged(fronts: Sequence[tuple[Array, Array]]) -> tuple[Array, Array, Index]:
    """The front of all sums of one design of each group: power, mass (P,), and which (P, groups).

    A sum that holds a design beaten in its own group is beaten itself, so that sums of fronts of
    power (F,) [W] and mass (F,) [kg], pair by pair, lose nothing.
    """
    power, mass = np.zeros(1), np.zeros(1)
    taken = np.zeros((1, 0), dtype=np.intp)
    for p, m in fronts:
        both = (power[:, None] + p).ravel(), (mass[:, None] + m).ravel()
        kept = front(*both)
        before, own = np.unravel_index(kept, (len(power), len(p)))
        power, mass = both[0][kept], both[1][kept]
        taken = np.column_stack([taken[before], own])
    return power, mass, taken


def knee(power: Array, mass: Array) -> int:
    """The point of a front that lies furthest below the line between its ends, both scaled."""
    if len(power) < 3:
        return 0
    x, y = ((v - v.min()) / max(float(np.ptp(v)), 1e-300) for v in (mass, power))
    return int((x + y).argmin())
