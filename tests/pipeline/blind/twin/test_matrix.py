from __future__ import annotations

from collections import Counter

import pytest

from pipeline.blind.twin.effects import EFFECTS
from pipeline.blind.twin.errors import TwinError
from pipeline.blind.twin.matrix import trial_matrix


def test_matrix_holds_what_is_asked_of_it() -> None:
    matrix = trial_matrix()
    assert sum(bool(t.effects) for t in matrix) >= 300
    assert sum(not t.effects for t in matrix) >= 150
    assert {name for t in matrix for name in t.effects} == set(EFFECTS)
    assert {len(t.effects) for t in matrix} == {0, 1, 2}
    assert all(t.motion in EFFECTS[name].motions for t in matrix for name in t.effects)
    assert len({t.seed for t in matrix}) == len(matrix)
    assert min(Counter((t.motion, t.noise) for t in matrix).values()) > 100


def test_matrix_is_the_same_for_the_same_seed() -> None:
    assert trial_matrix(4) == trial_matrix(4) != trial_matrix(5)
    assert [t.number for t in trial_matrix(4)] == list(range(len(trial_matrix(4))))


def test_matrix_refuses_negative_numbers() -> None:
    with pytest.raises(TwinError, match="numbers from 0"):
        trial_matrix(empty=-1)
