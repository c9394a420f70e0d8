"""The standard matrix: every effect in every machine, several at once, unknowns, and nothing."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from pipeline.blind.twin.fixed.hidden import EFFECTS, LAWS_OF_FRICTION, UNKNOWN
from pipeline.blind.twin.fixed.machines import MACHINES
from pipeline.blind.twin.setup import stream

#: By machine: trials per effect alone, of two and three effects, per unknown one, of nothing.
#: An arm takes the workflow several times as long as a leg, so there are fewer of it.
COUNTS: Final = {
    "pendulum": (8, 16, 8, 5, 60),
    "leg": (9, 18, 9, 5, 60),
    "arm": (4, 8, 4, 2, 30),
}


@dataclass(frozen=True)
class StandardSpec:
    """What `make_fixed_trial` needs.

    Attributes:
        number: Within the matrix.
        seed: Of the trial.
        machine: Of `MACHINES`.
        effects: What is hidden; empty for nothing.
        background: What any machine has.
    """

    number: int
    seed: int
    machine: str
    effects: tuple[str, ...]
    background: str


def standard_matrix(seed: int = 1) -> tuple[StandardSpec, ...]:
    """The whole matrix in a drawn order, so that a part of it is a fair sample.

    Returns:
        412 trials with catalogued effects hidden, 60 with unknown ones, 150 with nothing.
    """
    cases = list(_cases(seed))
    order = stream(seed, "standard order").permutation(len(cases))
    seeds = stream(seed, "standard seeds").choice(2**31, len(cases), replace=False)
    return tuple(
        StandardSpec(number, int(seeds[number]), *cases[which])
        for number, which in enumerate(order)
    )


def _together(rng: np.random.Generator, effects: Sequence[str], count: int) -> tuple[str, ...]:
    """Some of them, none twice."""
    return tuple(effects[k] for k in rng.choice(len(effects), count, replace=False))


def _cases(seed: int) -> Iterator[tuple[str, tuple[str, ...], str]]:
    rng = stream(seed, "standard pairs")
    for machine in MACHINES:
        singles, pairs, triples, unknowns, empty = COUNTS[machine]
        # A pendulum has no second joint to be coupled with.
        possible = [e for e in EFFECTS if machine != "pendulum" or e != "transmission_coupling"]
        for effect in possible:
            # A payload is looked for against a machine that was weighed without it.
            background = "weighed" if effect == "link_mass" else "machine"
            yield from [(machine, (effect,), background)] * singles
        for count, trials in ((2, pairs), (3, triples)):
            alike = [e for e in possible if e != "link_mass"]
            for _ in range(trials):
                chosen = _together(rng, alike, count)
                while len(LAWS_OF_FRICTION.intersection(chosen)) > 1:
                    chosen = _together(rng, alike, count)
                yield machine, chosen, "machine"
        for effect in UNKNOWN:
            yield from [(machine, (effect,), "machine")] * unknowns
        yield from [(machine, (), "machine")] * (empty // 2)
        yield from [(machine, (), "bare")] * (empty - empty // 2)
