"""How sure: draws of what is not known, chances to keep limits and to be best, what moves watts.

Drawn from its range, uniformly, in a Latin hypercube, is what sheets do not print, the scatter of
what they do, the joint torques that gait and controller really ask for, and where in the band of
friction each joint is held. Robots share the draws of a part: intervals of a sum are the sum's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from actuators.arrays import Array, Mask
from actuators.loading.data_sheet import Number
from pipeline.choice.evaluate import Held
from pipeline.choice.robots import Robot, Robots, Search
from pipeline.choice.shelf import NO_MARGINS, Designs

Unknown = tuple[str, str, Number]
#: Factor on joint torques: internal forces between feet, a tracking controller and uneven ground
#: add to what the nominal gait asks for; a gait made for little torque saves (assumed).
DEMAND: Final = Number(1.0, 0.9, 1.2, "1", "0.9 to 1.2")
DEMAND_ENTRY, PLACE_ENTRY = "joint_torque_factor", "friction_band_place"
PLACE: Final = Number(0.5, 0.0, 1.0, "1", "0 to 1")


@dataclass(frozen=True, eq=False)
class MonteCarlo:
    """Some robots over the draws; the first is the answer."""

    robots: Sequence[Robot]
    power: Array  #: (S, R) [W].
    modes: Array  #: The same in every mode, (S, R, M) [W].
    within: Mask  #: Whether every limit is kept, without margins (S, R).
    unknowns: tuple[Unknown, ...]  #: Part, entry and range of what was drawn, U of them.
    values: Array  #: Of these (S, U).
    sensitivity: Array  #: Change of the answer's power from one end of each to the other, (U,) [W].

    @property
    def interval(self) -> tuple[float, float]:
        """Of the answer's power, 90 % [W]."""
        low, high = np.quantile(self.power[:, 0], [0.05, 0.95]).tolist()
        return low, high

    @property
    def variance_share(self) -> Array:
        """Of the answer's power by each unknown, (U,) [1]; watts are close to linear in each."""
        squares = self.sensitivity**2
        return np.asarray(squares / max(squares.sum(), 1e-300))

    def chance_least(self, among: Sequence[Robot]) -> dict[Robot, float]:
        """Share of the draws in which each of some robots takes least of them [1]."""
        least = self.power[:, [self.robots.index(robot) for robot in among]].argmin(axis=1)
        return {robot: float((least == k).mean()) for k, robot in enumerate(among)}


def monte_carlo(search: Search, robots: Sequence[Robot], draws: int) -> MonteCarlo:
    """Evaluate robots, the answer first, in so many draws."""
    robots = [*dict.fromkeys(robots)]
    problem, counts = search.problem, len(robots)
    parts = dict.fromkeys(part for robot in robots for design in robot for part in design)
    unknowns = [*search.shelf.unknown([*parts]), ("robot", DEMAND_ENTRY, DEMAND)]
    if problem.wanted.standing == "drawn":
        unknowns += [(j, PLACE_ENTRY, PLACE) for own in problem.groups.values() for j in own]
    numbers = [number for *_, number in unknowns]
    low, high = (np.array([getattr(n, end) for n in numbers]) for end in ("low", "high"))
    # As `scipy.stats.qmc.LatinHypercube` draws, whose import takes a second.
    rng = np.random.default_rng(0).spawn(1)[0]
    inside = rng.random((draws, len(unknowns)))
    slices = np.column_stack([rng.permutation(draws) for _ in unknowns])
    values = low + (slices + 1 - inside) / draws * (high - low)
    found = in_draws(search, robots, unknowns, values)
    # The answer with one unknown after the other at its upper and lower end.
    middle = np.array([number.value for number in numbers])
    ends = [np.where(np.eye(len(unknowns)), end, middle) for end in (high, low)]
    most, least = (in_draws(search, robots[:1], unknowns, own).power for own in ends)
    every = (found.power, found.modes, found.use)
    power, modes, use = (x.reshape(draws, counts, *x.shape[1:]) for x in every)
    return MonteCarlo(robots, power, modes, use <= 1.0, tuple(unknowns), values, most - least)


def in_draws(
    search: Search, robots: Sequence[Robot], unknowns: Sequence[Unknown], values: Array
) -> Robots:
    """Robots, without margins, with values (S, U) of what is not known: all of a draw in a row."""
    keys = [(part, entry) for part, entry, _ in unknowns]
    sheets = [dict(zip(keys, row, strict=True)) for row in values.tolist()]
    columns = [*zip(*robots, strict=True)]
    once = [*dict.fromkeys(design for column in columns for design in column)]
    every = Designs.together([search.shelf.designs(once, x, NO_MARGINS) for x in sheets])
    first = len(once) * np.arange(len(sheets))
    rows = [np.add.outer(first, [once.index(design) for design in column]) for column in columns]
    parts = [every.taken(own.ravel()) for own in rows]
    factor = np.repeat(values[:, keys.index(("robot", DEMAND_ENTRY))], len(robots))
    held = []
    for joints in search.problem.groups.values():
        place = search.held.place
        if (joints[0], PLACE_ENTRY) in keys:
            own = values[:, [keys.index((joint, PLACE_ENTRY)) for joint in joints]]
            place = np.repeat(own, len(robots), axis=0)
        held.append(Held(place, factor))
    return search.built_of(parts, held)
