"""The standard matrix: every effect in every machine, several at once, unknowns, and nothing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from pipeline.blind.twin.fixed.hidden import EFFECTS, UNKNOWN
from pipeline.blind.twin.fixed.machines import MACHINES
from pipeline.blind.twin.setup import stream

#: Trials per effect and machine; per machine of two and of three effects, and of nothing hidden.
SINGLES: Final = 7
PAIRS: Final = 14
TRIPLES: Final = 7
UNKNOWNS: Final = 4
EMPTY: Final = 50


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
        406 trials with catalogued effects hidden, 60 with unknown ones, 150 with nothing.
    """
    cases = list(_cases(seed))
    order = stream(seed, "standard order").permutation(len(cases))
    seeds = stream(seed, "standard seeds").choice(2**31, len(cases), replace=False)
    return tuple(
        StandardSpec(number, int(seeds[number]), *cases[which])
        for number, which in enumerate(order)
    )


def _cases(seed: int) -> Iterator[tuple[str, tuple[str, ...], str]]:
    rng = stream(seed, "standard pairs")
    for machine in MACHINES:
        # A pendulum has no second joint to be coupled with.
        possible = [e for e in EFFECTS if machine != "pendulum" or e != "transmission_coupling"]
        for effect in possible:
            # A payload is looked for against a machine that was weighed without it.
            background = "weighed" if effect == "link_mass" else "machine"
            yield from [(machine, (effect,), background)] * SINGLES
        for count, trials in ((2, PAIRS), (3, TRIPLES)):
            alike = [e for e in possible if e != "link_mass"]
            for _ in range(trials):
                chosen = rng.choice(len(alike), count, replace=False)
                yield machine, tuple(alike[k] for k in chosen), "machine"
        for effect in UNKNOWN:
            yield from [(machine, (effect,), "machine")] * UNKNOWNS
        yield from [(machine, (), "machine")] * (EMPTY // 2)
        yield from [(machine, (), "bare")] * (EMPTY - EMPTY // 2)
