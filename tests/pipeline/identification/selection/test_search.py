"""Evidence of sets of names against closed forms, on columns made of random numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import multivariate_normal

from pipeline.effects.base import Coordinate
from pipeline.identification.regression.tolerances import UNCERTAINTY
from pipeline.identification.results import UNCERTAINTIES
from pipeline.identification.selection.evidence import FOLDS, MARGIN, State, noise_weights
from pipeline.identification.selection.pool import Channel, Pool, Term
from pipeline.identification.selection.search import Search
from pipeline.logs.prepared.measurement import TRAIN, VALIDATION

Array = NDArray[np.float64]
ROWS, BLOCKS = 160, 16
Offered = tuple["Made", tuple[str, ...], dict[str, float]]


@dataclass(frozen=True)
class Made:
    """An effect of as many coordinates as it has columns."""

    name: str
    coordinates: tuple[Coordinate, ...]
    place_kind: str = "joint"
    fixed: tuple[str, ...] = ()
    lowest: float = -np.inf
    has_law: bool = True
    contains: tuple[str, ...] = ()

    def plausible(self, model: Any, place: Any, x: dict[str, float], shape: Any) -> bool:
        """Whether no coordinate lies below what can be."""
        return min(x.values()) >= self.lowest


def made(name: str, count: int = 1, *, signed: bool = True, required: bool = True) -> Made:
    every = (Coordinate(f"c{k}", 1e-3, signed, required) for k in range(count))
    return Made(name, tuple(every))


@dataclass
class Log:
    """Columns at two joints, and what was measured there in multiples of the noise.

    Attributes:
        X: Columns by joint; one tolerance, one strain of a body, then those of the terms.
        r: Measured by joint.
        terms: Effects with their places.
    """

    X: list[Array]
    r: list[Array]
    terms: Sequence[Offered]
    tolerances: tuple[Any, ...] = field(
        default=(SimpleNamespace(kind="encoder"), SimpleNamespace(kind="xx"))
    )

    @property
    def pool(self) -> Pool:
        """Its normal equations."""
        terms, at = [], len(self.tolerances)
        for effect, place, shape in self.terms:
            n = len(effect.coordinates)
            terms.append(Term(effect, place, shape, np.arange(at, at + n)))  # type: ignore[arg-type]
            at += n
        channels = []
        part = np.array([TRAIN, VALIDATION] * (BLOCKS // 2), np.int8)
        for j, (X, r) in enumerate(zip(self.X, self.r, strict=True)):
            x, y = X.reshape(len(X), BLOCKS, -1), r.reshape(BLOCKS, -1)
            channels.append(
                Channel(
                    joint=j,
                    ids=np.arange(at),
                    H=np.einsum("ibk,jbk->bij", x, x),
                    h=np.einsum("ibk,bk->bi", x, y),
                    s=np.sum(y**2, axis=1),
                    count=np.full(BLOCKS, ROWS / BLOCKS),
                    part=part,
                    number=0,
                    effort=4.0,
                    noise=1.0,
                )
            )
        problem = SimpleNamespace(
            tolerances=self.tolerances,
            precision=np.ones(len(self.tolerances)),
            sigma=np.ones((len(self.X), 1)),
            model=SimpleNamespace(joints=("joint_1", "joint_2")),
            accepted=(),
            uncertainty=UNCERTAINTIES[0],
        )
        return Pool(problem, tuple(terms), at, tuple(channels), np.zeros(at))  # type: ignore[arg-type]


def log_of(
    terms: Sequence[Offered],
    truth: dict[int, float],
    seed: int = 0,
) -> Log:
    """Random columns; what is measured is noise and some columns' true multiples."""
    rng = np.random.default_rng(seed)
    count = 2 + sum(len(e.coordinates) for e, _, _ in terms)
    X = [rng.normal(size=(count, ROWS)) for _ in range(2)]
    r = [rng.normal(size=ROWS) + sum(v * x[k] for k, v in truth.items()) for x in X]
    return Log(X, r, terms)


FOUR: tuple[Offered, ...] = (
    (made("one"), ("a",), {}),
    (made("two", 2), ("a",), {}),
    (made("three", signed=False), ("b",), {}),
    (made("four", 3, signed=False, required=False), ("b",), {}),
)
WEIGHTS = np.array([0.7, 1.3])


def marginal(search: Search, log: Log, state: State) -> float:
    """ln of the density of what was measured, unknowns integrated out: N(0, 1 / w + X V X^T).

    The noise of the channels with weight w has the variance 1 / w.
    """
    columns = search.columns(state)
    prior = np.diag(1.0 / search.precision(columns, state.uncertainty))
    X = np.concatenate([x[columns] for x in log.X], axis=1)
    noise = np.diag(np.repeat(1.0 / search.weights, ROWS))
    density = multivariate_normal(cov=noise + X.T @ prior @ X)
    return float(density.logpdf(np.concatenate(log.r)))


@pytest.mark.parametrize(
    "state",
    [
        State(((0, (0,)),), UNCERTAINTIES[0]),
        State(((0, (0,)), (1, (0, 1))), UNCERTAINTIES[0]),
        State(((3, (0, 2)),), UNCERTAINTIES[2]),
        State((), UNCERTAINTIES[-1]),
    ],
)
def test_evidence_is_the_density_of_what_was_measured_and_what_names_cost(state: State) -> None:
    log = log_of(FOUR, {2: 0.8})
    search = Search(log.pool, WEIGHTS)
    nothing = State((), UNCERTAINTIES[0])
    rise = search.solve(state)[3] - search.solve(nothing)[3]
    names = len(state.terms) + (state.uncertainty > UNCERTAINTIES[0])
    cost = names * (np.log(len(FOUR) + 1) + MARGIN)
    expected = marginal(search, log, state) - marginal(search, log, nothing) - cost
    assert rise == pytest.approx(expected, abs=1e-4)


def test_columns_promise_what_a_step_to_their_optimum_gains() -> None:
    log, state = log_of(FOUR, {2: 0.8}), State(((0, (0,)),), UNCERTAINTIES[0])
    columns, L, x, _ = Search(log.pool, WEIGHTS).solve(state)
    off = np.array([0.3, -0.2, 0.1])
    for step, gain in ((0.0, 0.0), (1.0, 0.5 * float(np.sum((L.T @ off) ** 2)))):
        held = np.zeros(log.pool.size)
        held[columns] = x + step * off
        search = Search(replace(log.pool, held=held), WEIGHTS)
        assert search.promised(state) == pytest.approx(gain, abs=1e-5)


def test_a_coordinate_may_be_as_large_as_the_effort_and_a_body_as_the_urdf_is_unsure() -> None:
    search = Search(log_of(FOUR, {}).pool, WEIGHTS)
    precision = search.precision(np.arange(search.pool.size), 0.1)
    assert precision[0] == 1.0
    assert precision[1] == pytest.approx((UNCERTAINTY / 0.1) ** 2)
    # Columns of size 1 in an effort of mean square 4: a multiple of about 2 is as likely as not.
    np.testing.assert_allclose(precision[2:], 0.25, rtol=0.3)


def test_a_nonlinear_parameter_costs_what_a_coordinate_that_the_rows_tell_does() -> None:
    nonlinear: Offered = (made("nonlinear"), ("a",), {"speed": 0.1})
    knots: Offered = (
        Made("knots", nonlinear[0].coordinates, fixed=("speed",)),
        ("a",),
        {"speed": 0.1},
    )
    plain: Offered = (made("plain"), ("a",), {})
    log = log_of((nonlinear, knots, plain), {})
    for x in log.X:
        x[3] = x[4] = x[2]  # the three are one column
    search = Search(log.pool, WEIGHTS)
    state = [search.solve(State(((k, (0,)),), UNCERTAINTIES[0]))[3] for k in range(3)]
    assert state[0] == pytest.approx(state[2] - 0.5 * np.log(ROWS))
    assert state[1] == pytest.approx(state[2])


@pytest.mark.parametrize("seed", range(4))
def test_gains_are_what_solving_anew_gives(seed: int) -> None:
    """Also where coordinates turn out against their sign and are left out."""
    search = Search(log_of(FOUR, {2: 0.8, 6: 0.5, 7: -0.5}, seed).pool, WEIGHTS)
    for start in ((), ((0, (0,)),)):
        state = search.valid(State(start, UNCERTAINTIES[1]))
        gains = search.gains(state)
        for k in range(len(FOUR)):
            if k in state.numbers:
                assert gains[k] == -np.inf
                continue
            more = search.with_term(state, k)
            if k in more.numbers:
                assert gains[k] == pytest.approx(more.evidence - state.evidence, abs=1e-6)
            else:
                assert gains[k] == -np.inf


@pytest.mark.parametrize("seed", range(3))
def test_removals_are_what_solving_anew_gives(seed: int) -> None:
    search = Search(log_of(FOUR, {2: 0.8, 3: 0.3}, seed).pool, WEIGHTS)
    state = search.valid(State(((0, (0,)), (1, (0, 1))), UNCERTAINTIES[1]))
    assert state.numbers == (0, 1)
    expected = [search.without(state, k).evidence - state.evidence for k in state.numbers]
    np.testing.assert_allclose(search.removals(state), expected, atol=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_what_is_there_is_found_and_nothing_else(seed: int) -> None:
    log = log_of(FOUR, {2: 0.8, 5: 0.7}, seed)
    search = Search(log.pool)
    state = search.climbed(State((), UNCERTAINTIES[0]), UNCERTAINTIES)
    assert {FOUR[t][0].name for t in state.numbers} == {"one", "three"}
    assert state.uncertainty == UNCERTAINTIES[0]


@pytest.mark.parametrize("seed", range(10))
def test_of_noise_nothing_is_found(seed: int) -> None:
    search = Search(log_of(FOUR, {}, seed).pool)
    state = search.climbed(State((), UNCERTAINTIES[0]), UNCERTAINTIES)
    assert (state.terms, state.uncertainty) == ((), UNCERTAINTIES[0])


def test_bodies_far_from_the_urdfs_make_it_unsure() -> None:
    log = log_of(FOUR, {1: 20.0})  # strains count in hundredths: 20 %
    search = Search(log.pool)
    state = search.climbed(State((), UNCERTAINTIES[0]), UNCERTAINTIES)
    assert state.uncertainty >= 0.1
    assert state.terms == ()


def test_a_coordinate_against_its_sign_is_left_out_and_a_name_that_needs_it_with_it() -> None:
    search = Search(log_of(FOUR, {5: -0.8, 6: -0.8, 7: 0.8, 8: 0.8}).pool, WEIGHTS)
    start = State(((2, (0,)), (3, (0, 1, 2))), UNCERTAINTIES[0])
    state = search.valid(start)
    assert state.terms == ((3, (1, 2)),)
    assert state.evidence == pytest.approx(search.solve(state)[3])
    impossible: Offered = (replace(made("light"), lowest=-0.5), ("a",), {})
    search = Search(log_of((impossible,), {2: -0.8}).pool, WEIGHTS)
    assert search.valid(State(((0, (0,)),), UNCERTAINTIES[0])).terms == ()


def test_two_forms_of_a_name_and_two_couplings_of_a_joint_are_not_in_one_set() -> None:
    pair = replace(made("coupling"), place_kind="joint pair")
    terms: tuple[Offered, ...] = (
        (made("ripple"), ("a",), {"order": 2.0}),
        (made("ripple"), ("a",), {"order": 3.0}),
        (pair, ("a", "b"), {}),
        (pair, ("b", "c"), {}),
        (pair, ("c", "d"), {}),
    )
    search = Search(log_of(terms, dict.fromkeys(range(2, 7), 0.8)).pool, WEIGHTS)
    gains = search.gains(search.valid(State(((0, (0,)), (2, (0,))), UNCERTAINTIES[0])))
    assert np.isneginf(gains[[0, 1, 2, 3]]).all()
    assert gains[4] > 0.0


def test_a_block_is_judged_by_estimates_from_other_blocks() -> None:
    log = log_of(FOUR, {2: 0.8})
    search, state = Search(log.pool, WEIGHTS), State(((0, (0,)), (1, (0, 1))), UNCERTAINTIES[0])
    columns = search.columns(state)
    root = np.sqrt(WEIGHTS)
    prior = np.diag(search.precision(columns, state.uncertainty))
    block = np.arange(ROWS) // (ROWS // BLOCKS)
    expected = np.empty(BLOCKS)
    for fold in range(FOLDS):
        learnt = block % FOLDS != fold
        A, b = prior.copy(), np.zeros(columns.size)
        for x, r, w in zip(log.X, log.r, root, strict=True):
            A += (w * x[columns][:, learnt]) @ (w * x[columns][:, learnt]).T
            b += w**2 * x[columns][:, learnt] @ r[learnt]
        estimate = np.linalg.solve(A, b)
        for k in range(fold, BLOCKS, FOLDS):
            own = block == k
            expected[k] = sum(
                w**2 * np.sum((r[own] - estimate @ x[columns][:, own]) ** 2)
                for x, r, w in zip(log.X, log.r, root, strict=True)
            )
            expected[k] += estimate @ prior @ estimate / BLOCKS
    np.testing.assert_allclose(search.block_losses(state), expected, rtol=1e-6)


def test_weights_are_one_over_what_all_columns_leave_never_less_than_the_sensors_noise() -> None:
    log = log_of(FOUR, {2: 0.8})
    log.r = [3.0 * log.r[0], 0.1 * log.r[1]]
    loud, quiet = noise_weights(log.pool)
    assert loud == pytest.approx(1.0 / 9.0, rel=0.4)
    assert quiet == pytest.approx(1.0, rel=0.4)
    assert quiet <= 1.0


def test_what_estimates_leave_is_the_dispersion_of_all_samples() -> None:
    log = log_of(FOUR, {2: 0.8})
    held = np.zeros(log.pool.size)
    quiet = noise_weights(log.pool)
    left = sum(w * np.mean(r**2) for r, w in zip(log.r, quiet, strict=True)) / 2
    assert noise_weights(replace(log.pool, held=held), estimated=True) == pytest.approx(
        quiet / left
    )
    held[2] = 0.8
    of_the_truth = noise_weights(replace(log.pool, held=held), estimated=True)
    assert of_the_truth == pytest.approx(quiet, rel=0.1)


def test_samples_with_memory_count_for_less() -> None:
    """Noise and columns that stay the same over a block: as many samples as there are blocks."""
    rng = np.random.default_rng(0)
    log, length = log_of(FOUR[:1], {}), ROWS // BLOCKS
    for k in range(2):
        log.X[k] = np.repeat(rng.normal(size=(3, BLOCKS)), length, axis=1)
        log.r[k] = np.repeat(rng.normal(size=BLOCKS), length)
    assert (noise_weights(log.pool) < 0.4).all()
