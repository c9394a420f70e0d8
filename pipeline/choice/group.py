"""One group of joints: which designs are within limits, and which of them are worth keeping."""

from __future__ import annotations

import fnmatch
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile
from typing import Final

import numpy as np

from actuators.arrays import Array, Index, Mask
from actuators.errors import LegwattError, closest
from pipeline.choice.parts.designs import Designs
from pipeline.choice.search import Demanded, Feedback
from pipeline.choice.track import Account
from pipeline.robot.robot_file import RobotSpec

#: Designs of a group that are looked at in every draw.
FINALISTS: Final = 24
_FIRST: Final = 400  # looked at sample by sample before bounds decide


@dataclass(frozen=True, eq=False)
class Found:
    """What a search of one group found."""

    demanded: Demanded  #: What the day asks.
    designs: Designs  #: All of them.
    use: Mapping[str, Array]  #: Share of each limit that is used, by its name (D,).
    within: Index  #: Those within every limit.
    #: Of these, the ones evaluated sample by sample; nothing better is among the others.
    looked: Index
    power: Array  #: Of those [W].
    score: Array  #: Power and what their mass costs elsewhere [W].

    def best(
        self, which: Mask, account: Account, feedback: Feedback
    ) -> tuple[str, str, str] | None:
        """The best by score among some of the designs (D,); None if none is within limits."""
        own = self.within[which[self.within]]
        if not len(own):
            return None
        found = search(self.demanded, self.designs.taken(own), account, feedback)
        return found.names(found.finalists[:1])[0]

    def names(self, which: Sequence[int] | Index) -> list[tuple[str, str, str]]:
        """Motor, gear and brake of designs by their numbers among `looked`."""
        return [self.designs.parts[i] for i in self.looked[which]]

    @property
    def mass(self) -> Array:
        """Of all actuators of the group, of those looked at [kg]."""
        return np.asarray(self.designs.mass[self.looked] * len(self.demanded.joints))

    @property
    def finalists(self) -> Index:
        """The best by score, numbers among `looked`."""
        return np.asarray(np.argsort(self.score, kind="stable")[:FINALISTS])

    @property
    def front(self) -> Index:
        """The front of score and mass, numbers among `looked`."""
        return front(self.score, self.mass)


def search(
    demanded: Demanded, designs: Designs, account: Account, feedback: Feedback | None = None
) -> Found:
    """Every design of one group; exact, and most of them by bounds alone.

    Raises:
        LegwattError: None is within limits; says which limit removed how many.
    """
    use = demanded.limits(designs)
    over = {name: share > 1.0 for name, share in use.items()}
    within = np.flatnonzero(~np.any(list(over.values()), axis=0))
    if not len(within):
        removed = sorted(
            ((int(o.sum()), name) for name, o in over.items() if o.any()), reverse=True
        )
        words = ", ".join(f"{name} {n}" for n, name in removed)
        raise LegwattError(
            f"group '{demanded.name}': none of {len(designs)} designs is within limits; "
            f"removed by {words}"
        )
    own = designs.taken(within)
    cost = (feedback or Feedback()).cost(demanded, own)
    bound = demanded.net(own) + cost
    score = np.full(len(own), np.inf)
    todo = np.union1d(np.argsort(bound)[:_FIRST], np.argsort(own.mass)[:_FIRST])
    while len(todo):
        score[todo] = demanded.power(own.taken(todo), account) + cost[todo]
        done = np.isfinite(score)
        last = np.sort(score[done])[:FINALISTS][-1]
        best = _best_below(own.mass, np.where(done, score, np.inf))
        todo = np.flatnonzero(~done & ((bound < last) | (bound < best)))
        todo = todo[np.argsort(bound[todo])][: 4 * _FIRST]
    looked = np.flatnonzero(np.isfinite(score))
    return Found(
        demanded, designs, use, within, within[looked], (score - cost)[looked], score[looked]
    )


def _best_below(mass: Array, score: Array) -> Array:
    """The least score among designs no heavier, (D,)."""
    order = np.argsort(mass, kind="stable")
    least = np.minimum.accumulate(score[order])
    last = np.searchsorted(mass[order], mass, side="right") - 1
    return np.asarray(least[last])


def groups_of(spec: RobotSpec, given: Sequence[str] = ()) -> dict[str, tuple[str, ...]]:
    """Joints that are built alike, by the name of their group.

    Args:
        spec: The robot.
        given: ``NAME=PATTERN,PATTERN`` of one's own; by default the first joints of all legs, the
            second ones, and so on, and those outside the legs.

    Raises:
        LegwattError: A pattern fits no joint, or a joint is in no group or in two.
    """
    out: dict[str, tuple[str, ...]] = {}
    for text in given:
        name, _, patterns = text.partition("=")
        each = [p.strip() for p in patterns.split(",") if p.strip()]
        for pattern in each:
            if not fnmatch.filter(spec.joints, pattern):
                hint = closest(pattern, spec.joints)
                raise LegwattError(f"--group {text}: no joint '{pattern}': {hint}")
        joints = tuple(j for j in spec.joints if any(fnmatch.fnmatchcase(j, p) for p in each))
        if not name or not joints or name in out:
            raise LegwattError(f"--group {text}: expected NAME=PATTERN,PATTERN, each name once")
        out[name] = joints
    if not given:
        for k in range(max((len(leg.joints) for leg in spec.legs), default=0)):
            alike = tuple(leg.joints[k] for leg in spec.legs if k < len(leg.joints))
            out[_shared(alike, f"joint {k + 1}", out)] = alike
        legs = {joint for leg in spec.legs for joint in leg.joints}
        if others := tuple(joint for joint in spec.joints if joint not in legs):
            out["held"] = others
    for joint in spec.joints:
        if (count := sum(joint in joints for joints in out.values())) != 1:
            raise LegwattError(
                f"--group: joint '{joint}' is in {'two groups' if count else 'no group'}"
            )
    return out


def _shared(joints: Sequence[str], otherwise: str, taken: Mapping[str, object]) -> str:
    """What the names of joints end in, or begin with, alike."""

    def alike(names: Sequence[str]) -> str:
        same = takewhile(lambda letters: len(set(letters)) == 1, zip(*names, strict=False))
        return "".join(letters[0] for letters in same)

    end = alike([joint[::-1] for joint in joints])[::-1].strip("_- ")
    name = end or alike(joints).strip("_- ")
    return otherwise if not name or name in taken else name


def front(power: Array, mass: Array) -> Index:
    """Designs (D,) that none beats in power and mass, from the least power on."""
    order = np.lexsort((mass, power))
    lightest = np.minimum.accumulate(mass[order])
    first = np.ones(len(order), dtype=np.bool_)
    first[1:] = mass[order][1:] < lightest[:-1]
    return np.asarray(order[first])


def merged(fronts: Sequence[tuple[Array, Array]]) -> tuple[Array, Array, Index]:
    """The front of all sums of one design of each group.

    Groups share nothing but power and mass, which add: a sum that holds a design beaten in its own
    group is beaten itself, so that sums of fronts, pair by pair, lose nothing.

    Args:
        fronts: Of each group, power (F,) [W] and mass (F,) [kg].

    Returns:
        Power (P,), mass (P,), and which design of each group's front a point takes (P, groups).
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
