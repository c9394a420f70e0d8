"""How far a name is trusted, rule by rule, and the errors on which that rests."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pipeline.identification import results as limits
from pipeline.identification.results import UNCERTAINTIES
from pipeline.identification.selection.confidence import Rival, graded, rms, validation_errors
from pipeline.identification.selection.evidence import State
from pipeline.identification.selection.search import Search
from tests.pipeline.identification.selection.test_search import BLOCKS, FOUR, WEIGHTS, log_of

#: Nothing in the name's place: much less likely, and sure over blocks.
NOTHING = Rival(None, limits.EXCLUDED + 1.0, limits.SURE + 1.0)
OTHER = Rival(("effort_offset", ("hip",)), limits.EXCLUDED + 1.0, limits.SURE + 1.0)
FACTS: dict[str, bool] = {
    "closer": True,
    "certain": True,
    "law": True,
    "beside_curve": False,
    "more_left": False,
}


@pytest.mark.parametrize(
    ("facts", "nothing", "other", "level", "reason"),
    [
        ({}, {}, {}, limits.CONFIRMED, ""),
        ({"closer": False}, {"sure": 0.0}, {}, limits.SUSPECTED, limits.IDLE_NAME),
        # Sure over blocks, or closer to the validation rows: either is enough.
        ({"closer": False}, {}, {}, limits.CONFIRMED, ""),
        ({"certain": False}, {}, {}, limits.SUSPECTED, limits.NOTHING),
        ({}, {"behind": 0.0}, {}, limits.SUSPECTED, limits.NOTHING),
        ({}, {}, {"sure": 0.0}, limits.APPROXIMATE, "effort_offset at hip would explain"),
        ({}, {}, {"behind": 0.0}, limits.APPROXIMATE, "effort_offset at hip would explain"),
        # What has more coordinates may have the name in it: likelihood alone decides.
        ({}, {}, {"sure": 0.0, "richer": True}, limits.CONFIRMED, ""),
        ({}, {"sure": 0.0}, {}, limits.APPROXIMATE, "parts of the log disagree"),
        ({"law": False}, {}, {}, limits.APPROXIMATE, limits.SHAPELESS),
        ({"beside_curve": True}, {}, {}, limits.APPROXIMATE, limits.BESIDE),
        ({"more_left": True}, {}, {}, limits.APPROXIMATE, limits.MORE_LEFT),
    ],
)
def test_each_rule_lowers_the_level_with_its_reason(
    facts: dict[str, bool], nothing: dict[str, Any], other: dict[str, Any], level: str, reason: str
) -> None:
    rivals = [replace(NOTHING, **nothing), replace(OTHER, **other)]
    found, why = graded(rivals, **FACTS | facts)
    assert found == level
    assert why.startswith(reason)
    assert bool(why) == bool(reason)


def test_validation_errors_are_those_of_estimates_from_training_rows() -> None:
    log = log_of(FOUR, {2: 0.8})
    search, state = Search(log.pool, WEIGHTS), State(((0, (0,)),), UNCERTAINTIES[0])
    columns = search.columns(state)
    prior = np.diag(search.precision(columns, state.uncertainty))
    train = np.repeat(np.arange(BLOCKS) % 2 == 0, len(log.r[0]) // BLOCKS)
    pairs = list(zip(log.X, log.r, search.weights, strict=True))
    A = prior + sum(w * X[columns][:, train] @ X[columns][:, train].T for X, _, w in pairs)
    b = sum(w * X[columns][:, train] @ r[train] for X, r, w in pairs)
    x = np.linalg.solve(A, b)
    expected = [np.sqrt(np.mean((r - x @ X[columns])[~train] ** 2)) for X, r, _ in pairs]
    errors = validation_errors(search, state)
    assert errors == pytest.approx(expected, rel=1e-6)
    assert rms(errors, [0, 1]) == pytest.approx(np.sqrt(np.mean(np.square(expected))))
    assert np.isnan(rms(np.full(2, np.nan), [0]))
