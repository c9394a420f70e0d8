"""The matrix of blind trials: all effects, both motions, both noise levels, pairs, nothing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

from pipeline.blind.twin.effects import CATALOGUE, EFFECTS, UNCATALOGUED
from pipeline.blind.twin.errors import TwinError
from pipeline.blind.twin.sensors import NOISE_LEVELS
from pipeline.blind.twin.setup import stream
from pipeline.blind.twin.trial import MOTIONS


@dataclass(frozen=True)
class TrialSpec:
    """What `make_trial` needs to make a trial.

    Attributes:
        number: Within the matrix.
        seed: Of the trial.
        effects: What is hidden; empty for nothing.
        motion: ``"leg"`` or ``"walk"``.
        noise: ``"low"`` or ``"high"``.
    """

    number: int
    seed: int
    effects: tuple[str, ...]
    motion: str
    noise: str


def trial_matrix(
    seed: int = 1, *, repeats: int = 3, unknown_repeats: int = 2, pairs: int = 11, empty: int = 38
) -> tuple[TrialSpec, ...]:
    """The whole matrix in a drawn order, so that a part of it is a fair sample.

    Args:
        seed: Of the matrix; it sets the seeds of the trials, the pairs and the order.
        repeats: Trials per effect of the catalogue, motion and noise level.
        unknown_repeats: Likewise per effect outside of it.
        pairs: Trials with two effects of the catalogue per motion and noise level.
        empty: Trials with nothing hidden per motion and noise level.

    Returns:
        With the default numbers 322 trials with something hidden and 152 without.

    Raises:
        TwinError: A negative number.
    """
    if min(seed, repeats, unknown_repeats, pairs, empty) < 0:
        raise TwinError("the matrix of trials needs a seed and numbers from 0")
    cases = list(_cases(seed, repeats, unknown_repeats, pairs, empty))
    order = stream(seed, "matrix order").permutation(len(cases))
    seeds = stream(seed, "matrix seeds").choice(2**31, len(cases), replace=False)
    return tuple(
        TrialSpec(number, int(seeds[number]), *cases[which]) for number, which in enumerate(order)
    )


def _cases(
    seed: int, repeats: int, unknown_repeats: int, pairs: int, empty: int
) -> Iterator[tuple[tuple[str, ...], str, str]]:
    rng = stream(seed, "matrix pairs")
    for motion, noise in product(MOTIONS, NOISE_LEVELS):
        possible = [name for name in CATALOGUE if motion in EFFECTS[name].motions]
        for name in possible:
            yield from [((name,), motion, noise)] * repeats
        for name in UNCATALOGUED:
            yield from [((name,), motion, noise)] * unknown_repeats
        for _ in range(pairs):
            i, j = rng.choice(len(possible), 2, replace=False)
            yield (possible[i], possible[j]), motion, noise
        yield from [((), motion, noise)] * empty
