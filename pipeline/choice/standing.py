"""Lock or not: the best robot at every share of standing, of those that lock and those that do not.

A joint that locks, by its gear or a brake, is held without current while the robot stands, its
driver off; others hold with their motors. The power of all modes that move, and of all that stand,
keeps its mean while their shares change.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from actuators.arrays import Array, Mask
from pipeline.choice.robots import FAMILIES, STANDING, Robot, Search
from pipeline.choice.unknowns import MonteCarlo

NONE, ALL, ANY = FAMILIES


@dataclass(frozen=True, eq=False)
class Envelope:
    """The best of each family at every share of standing."""

    robots: Mapping[str, Sequence[Robot]]  #: By family, one a share; families without any miss.
    power: Mapping[str, Array]  #: Of these [W], (F,).

    @property
    def crossing(self) -> float | None:
        """Share from which on the best that locks takes less; None where none is."""
        return crossing(STANDING, self.power[ALL] - self.power[NONE])


def crossing_range(search: Search, monte_carlo: MonteCarlo) -> tuple[float, float] | None:
    """The crossing in 90 % of the draws, among the robots that are drawn; None without any."""
    both, member = search.moving_standing, families(search, monte_carlo.robots)
    if both is None or not all(member[name].any() for name in (NONE, ALL)):
        return None
    moving, standing = (monte_carlo.modes @ weights for weights in both)  # (S, R)
    shares = STANDING[:, None, None]
    each = (1.0 - shares) * moving + shares * standing  # (F, S, R)
    none, every = (each[:, :, member[name]].min(axis=2) for name in (NONE, ALL))
    found = [crossing(STANDING, own) for own in (every - none).T]
    if not (known := [own for own in found if own is not None]):
        return None
    low, high = np.quantile(known, [0.05, 0.95]).tolist()
    return low, high


def crossing(shares: Array, more: Array) -> float | None:
    """Last share at which a difference (F,) falls through zero, None if never."""
    at = np.flatnonzero((more[:-1] > 0.0) & (more[1:] <= 0.0)).tolist()
    if not at:
        return None
    k = at[-1]
    part = more[k] / (more[k] - more[k + 1])
    return float(shares[k] + part * (shares[k + 1] - shares[k]))


def envelope(search: Search) -> Envelope | None:
    """Of all robots that a search evaluated; None for a day without motion or without standing."""
    both = search.moving_standing
    if both is None:
        return None
    names = [robot for robot, own in search.known.items() if own.use <= 1.0]
    modes = np.stack([search.known[robot].modes for robot in names])  # (R, M)
    moving, standing = (modes @ weights for weights in both)
    each = np.outer(1.0 - STANDING, moving) + np.outer(STANDING, standing)  # (F, R)
    robots, power = {}, {}
    for family, own in families(search, names).items():
        if own.any():
            held = np.where(own, each, np.inf)
            robots[family] = [names[k] for k in held.argmin(axis=1)]
            power[family] = held.min(axis=1)
    return Envelope(robots, power)


def families(search: Search, robots: Sequence[Robot]) -> dict[str, Mask]:
    """Which robots are of each family, (R,)."""
    locks = [[design in search.locking for design in robot] for robot in robots]
    none, every = (np.asarray(of(locks, axis=1)) for of in (np.any, np.all))
    return {NONE: ~none, ALL: every, ANY: np.ones(len(robots), dtype=np.bool_)}
