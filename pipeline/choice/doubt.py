"""How sure: draws over what no sheet prints, chance of being best, regret, what to measure next.

Every unprinted entry is drawn from its range, uniformly and apart from others, in a Latin
hypercube; designs that share a part share its draw. With P the score of a design in a draw, and *
the answer,

    regret            mean P* - mean min P
    worth of knowing u    min mean P - mean over u of min mean(P | u)

the expected value of partial perfect information (Raiffa and Schlaifer, 1961), the inner mean over
quantile bins of u. A design that exceeds a limit in a draw cannot be the best of it.

What a model file says of bodies and ground is drawn from its intervals, too; what it says of drives
goes with the actuators that are replaced.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from scipy.stats.qmc import LatinHypercube

from actuators.arrays import Array, Index, Mask
from actuators.loading.data_sheet import Number
from pipeline.choice.parts.designs import Designs
from pipeline.choice.parts.shelf import Drawn, Shelf
from pipeline.choice.search import Demanded, Feedback
from pipeline.choice.track import Account
from pipeline.effects.base import place_text
from pipeline.effects.registry import effect_named
from pipeline.simulation.machine import Machine

Design = tuple[str, str, str]
Unknown = tuple[str, str, Number]
DRAWS: Final = 256
_BINS: Final = 8
_EFFECTS: Final = 16  # draws of what a model file says
_BODIES: Final = ("link", "ground")  # places of effects that change what is asked of the joints


class Draws(NamedTuple):
    """Drawn values of what sheets do not print."""

    unknowns: tuple[Unknown, ...]  #: What was drawn, U of them.
    values: Array  #: Of these (S, U).
    sheets: Sequence[Drawn]  #: The same as `Shelf.designs` takes them, S of them.


@dataclass(frozen=True, eq=False)
class Doubt:
    """Designs of one group over the draws; the first is the answer."""

    power: Array  #: (S, D) [W].
    score: Array  #: With what their mass costs elsewhere (S, D) [W].
    within: Mask  #: Whether every limit is kept (S, D).
    unknowns: tuple[Unknown, ...]  #: Part, entry and range of what was drawn, U of them.
    values: Array  #: Of these (S, U).

    @property
    def expected(self) -> Array:
        """Mean score of each design, (D,) [W]."""
        return np.asarray(self.score.mean(axis=0))

    @property
    def order(self) -> Index:
        """The answer, then from the best expected score on; those within limits first."""
        order = np.lexsort((self.expected, self.within.mean(axis=0) < 0.5))
        return np.concatenate([[0], order[order != 0]])

    @property
    def _held(self) -> Array:
        return np.where(self.within, self.score, np.inf)

    @property
    def winner(self) -> Index:
        """The best design of every draw, (S,)."""
        return np.asarray(self._held.argmin(axis=1))

    @property
    def chance(self) -> Array:
        """Share of the draws in which a design is the best, (D,)."""
        return np.bincount(self.winner, minlength=self.score.shape[1]) / len(self.score)

    @property
    def regret(self) -> float:
        """Of the answer [W]."""
        least = self._held.min(axis=1)
        own = self.score[:, 0]
        return float(np.mean(own - np.where(np.isfinite(least), np.minimum(least, own), own)))

    def worth(self) -> Array:
        """Expected regret that knowing each unknown alone removes, (U,) [W]."""
        base = self.expected.min()
        out = np.zeros(len(self.unknowns))
        for u in range(len(out)):
            parts = np.array_split(np.argsort(self.values[:, u], kind="stable"), _BINS)
            known = sum(len(p) * self.score[p].mean(axis=0).min() for p in parts)
            out[u] = max(base - known / len(self.score), 0.0)
        return out

    def moves(self) -> Array:
        """Slope of the answer's power over each unknown's range, (U,) [W]."""
        own = self.power[:, 0]
        out = np.zeros(len(self.unknowns))
        for u, (_, _, number) in enumerate(self.unknowns):
            centred = self.values[:, u] - self.values[:, u].mean()
            slope = centred @ (own - own.mean()) / max(centred @ centred, 1e-300)
            out[u] = slope * (number.high - number.low)
        return out


def doubt(
    demanded: Demanded,
    shelf: Shelf,
    combinations: Sequence[Design],
    account: Account,
    feedback: Feedback,
    sheets: Draws,
    *,
    effects: Sequence[Unknown] = (),
    found: Sequence[tuple[Array, Demanded]] = (),
) -> Doubt:
    """Draw what is not printed of some designs, and evaluate them in every draw.

    Args:
        demanded: What the day asks of the group.
        shelf: The parts.
        combinations: Motor, gear and brake of each design.
        account: What is counted.
        feedback: What the mass of the actuators costs the robot.
        sheets: See `drawn`; the same for all groups, so that what they share is drawn once.
        effects: What is drawn of a model file, E of them.
        found: Values of these (E,) and the day's demand with them, in turn for one draw after the
            other; `demanded` for all if empty.
    """
    count, draws = len(combinations), len(sheets.sheets)
    named = {part for row in combinations for part in (*row, shelf.driver)}
    which = [u for u, (part, _, _) in enumerate(sheets.unknowns) if part in named]
    unknowns, values = tuple(sheets.unknowns[u] for u in which), sheets.values[:, which]
    turn = np.arange(draws) % max(len(found), 1)
    if found:
        unknowns += tuple(effects)
        values = np.column_stack([values, np.stack([own for own, _ in found])[turn]])
    designs = Designs.together([shelf.designs(combinations, sheet) for sheet in sheets.sheets])
    power, within = np.zeros(len(designs)), np.zeros(len(designs), dtype=np.bool_)
    for k, one in enumerate([asked for _, asked in found] or [demanded]):
        at = np.flatnonzero(np.repeat(turn == k, count))
        own = designs.taken(at)
        power[at] = one.power(own, account)
        within[at] = np.all([share <= 1.0 for share in one.limits(own).values()], axis=0)
    score = power + feedback.cost(demanded, designs)
    shape = (draws, count)
    arrays = (power.reshape(shape), score.reshape(shape), within.reshape(shape))
    return Doubt(*arrays, unknowns, values)


def drawn_machines(machine: Machine) -> tuple[tuple[Unknown, ...], list[tuple[Array, Machine]]]:
    """What a machine's model file says of bodies and ground with an interval, E of it.

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
        return (), []
    unknowns = tuple(
        (f"{e.effect} of {place_text(e.place)}", p.name, Number(p.value, *p.interval, p.unit, ""))
        for _, e, p in every
    )
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


def drawn(shelf: Shelf, combinations: Sequence[Design], draws: int, seed: int = 0) -> Draws:
    """Values of what the parts of some designs do not print, a Latin hypercube."""
    parts = dict.fromkeys(part for row in combinations for part in row)
    unknowns = tuple(shelf.unknown(list(parts)))
    values = np.zeros((draws, len(unknowns)))
    if unknowns:
        low, high = (np.array([getattr(n, end) for _, _, n in unknowns]) for end in ("low", "high"))
        values = low + LatinHypercube(len(unknowns), rng=seed).random(draws) * (high - low)
    keys = [(part, entry) for part, entry, _ in unknowns]
    each = [dict(zip(keys, row, strict=True)) for row in values.tolist()]
    return Draws(unknowns, values, each)
