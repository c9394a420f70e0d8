"""Odd inputs over all verbs: one line and exit code 2, or an answer in finite numbers."""

import pytest

from tests import odd


def test_odd_inputs_are_answered_well():
    assert [f"{words}: {wrong}" for (words, _), wrong in odd.answers(1, 200)] == []


@pytest.mark.slow
def test_more_odd_inputs_are_answered_well():
    assert [f"{words}: {wrong}" for (words, _), wrong in odd.answers(2, 1800, long=True)] == []
