"""How sure: draws of what is not known, chance of being best, regret, what to measure next.

Drawn from its range, uniformly and apart from others, in a Latin hypercube, is what sheets do not
print, the scatter of what they do print (`pipeline.choice.shelf`), the joint torques that gait and
controller really ask for, where in the band of friction each joint is held at rest, and what a
model file says of bodies and ground with an interval. Robots that share a part share its draw, so
that an interval of a sum is the sum's. With P the power of a robot in a draw, and * the answer,

    regret            mean P* - mean min P
    worth of knowing u    min mean P - mean over u of min mean(P | u)

the expected value of partial perfect information (Raiffa and Schlaifer, 1961), the inner mean over
quantile bins of u. A robot that exceeds a limit in a draw cannot be the best of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.stats.qmc import LatinHypercube

from actuators.arrays import Array, Index, Mask
from actuators.loading.data_sheet import Number
from pipeline.choice.designs import Designs
from pipeline.choice.evaluate import PLACES, Demand, Held
from pipeline.choice.robots import Robot, Search, demand_of, evaluate_robots
from pipeline.effects.base import place_text
from pipeline.effects.registry import effect_named
from pipeline.simulation.machine import Machine

Unknown = tuple[str, str, Number]
_BINS: Final = 8
_SHUFFLES: Final = 32
_EFFECTS: Final = 8  # draws of what a model file says
_BODIES: Final = ("link", "ground")  # places of effects that change what is asked of the joints
#: Factor on joint torques: internal forces between feet, a tracking controller and uneven ground
#: add to what the nominal gait asks for; a gait made for little torque saves (assumed).
DEMAND: Final = Number(1.0, 0.9, 1.2, "1", "0.9 to 1.2")
DEMAND_ENTRY: Final = "joint_torque_factor"
PLACE_ENTRY: Final = "friction_band_place"
_PLACE: Final = Number(0.5, 0.0, 1.0, "1", "0 to 1")


@dataclass(frozen=True, eq=False)
class Doubt:
    """Some robots over the draws; the first is the answer."""

    robots: Sequence[Robot]
    power: Array  #: (S, R) [W].
    modes: Array  #: The same in every mode, (S, R, M) [W].
    groups: Array  #: Power of the answer's groups, (S, G) [W].
    within: Mask  #: Whether every limit is kept (S, R).
    unknowns: tuple[Unknown, ...]  #: Part, entry and range of what was drawn, U of them.
    values: Array  #: Of these (S, U).
    moves: Array  #: Change of the answer's power from one end of each to the other, (U,) [W].

    @property
    def interval(self) -> tuple[float, float]:
        """Of the answer's power, 90 % [W]."""
        low, high = np.quantile(self.power[:, 0], [0.05, 0.95]).tolist()
        return low, high

    @property
    def chance(self) -> Array:
        """Share of the draws in which a robot takes least of those within limits, (R,)."""
        winner = np.where(self.within, self.power, np.inf).argmin(axis=1)
        return np.bincount(winner, minlength=self.power.shape[1]) / len(self.power)

    @property
    def regret(self) -> float:
        """Of the robot that is expected to take least, above each draw's best, in the mean [W]."""
        return float(self.power.mean(axis=0).min() - self.power.min(axis=1).mean())

    def worth(self) -> Array:
        """Expected regret that knowing each unknown alone removes, (U,) [W].

        Less what sorting the draws by chance seems to remove: bins of few draws flatter.
        """
        base = self.power.mean(axis=0).min()

        def removed(order: Index) -> float:
            parts = np.array_split(order, _BINS)
            known = sum(len(p) * self.power[p].mean(axis=0).min() for p in parts)
            return float(base - known / len(self.power))

        rng = np.random.default_rng(0)
        chance = np.mean([removed(rng.permutation(len(self.power))) for _ in range(_SHUFFLES)])
        each = [removed(np.argsort(own, kind="stable")) for own in self.values.T]
        return np.maximum(np.array(each) - chance, 0.0)


def doubt(search: Search, robots: Sequence[Robot], mass: Mapping[str, float], draws: int) -> Doubt:
    """Evaluate robots in every draw.

    Args:
        search: That found them.
        robots: The answer first.
        mass: Of one actuator of each group of the answer [kg], for what a model file says.
        draws: How many.
    """
    asked, shelf, groups = search.asked, search.shelf, search.asked.groups
    parts = dict.fromkeys(part for robot in robots for design in robot for part in design)
    unknowns = [*shelf.unknown([*parts]), ("robot", DEMAND_ENTRY, DEMAND)]
    joints = [(g, j) for g, own in groups.items() for j in own]
    placed = asked.standing == "drawn"
    unknowns += [(j, PLACE_ENTRY, _PLACE) for _, j in joints if placed]
    low, high = (np.array([getattr(n, end) for *_, n in unknowns]) for end in ("low", "high"))
    values = low + LatinHypercube(len(unknowns), rng=0).random(draws) * (high - low)
    keys = [(part, entry) for part, entry, _ in unknowns]
    sheets = [dict(zip(keys, row, strict=True)) for row in values.tolist()]
    effects, machines = drawn_machines(asked.machine)
    demands = [search.demand]
    if machines:
        demands = [demand_of(replace(asked, machine=own), mass) for _, own in machines]
        more = np.stack([machines[s % len(machines)][0] for s in range(draws)])
        unknowns += effects
        values = np.column_stack([values, more])
    power, within = np.zeros((draws, len(robots))), np.zeros((draws, len(robots)), dtype=np.bool_)
    of_groups = np.zeros((draws, len(groups)))
    modes = np.zeros((draws, len(robots), len(search.tracks)))
    for k, demand in enumerate(demands):
        at = np.arange(k, draws, len(demands))
        columns = [*zip(*robots, strict=True)]
        made = [
            Designs.together([shelf.designs(column, sheets[s]) for s in at]) for column in columns
        ]
        held = []
        for own in groups.values():
            places = [keys.index((j, PLACE_ENTRY)) for j in own] if placed else []
            place = np.repeat(values[at][:, places], len(robots), axis=0)
            factor = values[at, keys.index(("robot", DEMAND_ENTRY))]
            factor = np.repeat(factor, len(robots))
            held.append(Held(place if placed else PLACES[asked.standing], factor))
        found = evaluate_robots([], made, demand, asked.account, held)
        power[at] = found.power.reshape(len(at), -1)
        modes[at] = found.modes.reshape(len(at), len(robots), -1)
        within[at] = (found.use <= 1.0).reshape(len(at), -1)
        shares = found.shares
        each = [own.power.reshape(len(at), len(robots), -1)[:, 0] @ shares for own in found.groups]
        of_groups[at] = np.stack(each, axis=1)
    own_names = {part for design in robots[0] for part in (*design, shelf.driver)}
    own_names |= {"robot", *(j for _, j in joints)}
    moves = [
        _move(search, robots[0], part, entry, number) if part in own_names else 0.0
        for part, entry, number in unknowns[: len(keys)]
    ]
    if machines:  # regression on what the answer takes with each of them
        of_each = [demand_power(search, robots[0], own) for own in demands]
        drawn = np.column_stack([np.ones(len(machines)), np.stack([own for own, _ in machines])])
        slope = np.linalg.lstsq(drawn, np.array(of_each), rcond=None)[0][1:]
        moves += [s * (n.high - n.low) for s, (*_, n) in zip(slope, effects, strict=True)]
    return Doubt(robots, power, modes, of_groups, within, tuple(unknowns), values, np.array(moves))


def demand_power(search: Search, robot: Robot, demand: Demand) -> float:
    """What a robot takes with another demand, all else in the middle [W]."""
    parts = [search.shelf.designs([design]) for design in robot]
    found = evaluate_robots([robot], parts, demand, search.asked.account, search.held)
    return float(found.power[0])


def _move(search: Search, robot: Robot, part: str, entry: str, number: Number) -> float:
    """Power of a robot with one unknown at its upper end, less that at its lower end [W]."""
    ends = (number.low, number.high)
    parts = [
        Designs.together([search.shelf.designs([design], {(part, entry): end}) for end in ends])
        for design in robot
    ]
    middle = np.full(2, float(search.held.place))
    held = []
    for joints in search.asked.groups.values():
        factor = np.array(ends) if entry == DEMAND_ENTRY else np.ones(2)
        place = np.column_stack(
            [np.array(ends) if (part, entry) == (j, PLACE_ENTRY) else middle for j in joints]
        )
        held.append(Held(place, factor))
    found = evaluate_robots([robot] * 2, parts, search.demand, search.asked.account, held)
    return float(found.power[1] - found.power[0])


def drawn_machines(machine: Machine) -> tuple[list[Unknown], list[tuple[Array, Machine]]]:
    """What a machine's model file says of bodies and ground with an interval, E of it.

    What it says of drives goes with the actuators that are replaced.

    Returns:
        These, and for every draw their values (E,) and the machine with them; none without any.
    """
    file = machine.model_file
    every = [
        (k, edit, p)
        for k, edit in enumerate(file.edits if file else ())
        if effect_named(edit.effect).place_kind in _BODIES
        for p in edit.parameters
        if p.interval[0] < p.interval[1]
    ]
    if file is None or not every:
        return [], []
    unknowns = [
        (f"{e.effect} of {place_text(e.place)}", p.name, Number(p.value, *p.interval, p.unit, ""))
        for _, e, p in every
    ]
    low, high = np.array([p.interval for _, _, p in every]).T
    draws = []
    for shares in LatinHypercube(len(every), rng=2).random(_EFFECTS):
        edits, values = list(file.edits), low + shares * (high - low)
        for (k, edit, p), value in zip(every, values.tolist(), strict=True):
            (bound,) = (x for x in effect_named(edit.effect).parameters if x.name == p.name)
            own = float(np.clip(value, bound.low, bound.high))
            new = p.model_copy(update={"value": own, "interval": (own, own)})
            parameters = tuple(new if x.name == p.name else x for x in edits[k].parameters)
            edits[k] = edits[k].model_copy(update={"parameters": parameters})
        draws.append((values, machine.with_model(file.model_copy(update={"edits": tuple(edits)}))))
    return unknowns, draws
