"""The bench counts functions that there are: it runs too long to be run by the tests."""

from __future__ import annotations

import importlib

import pytest

from tests.bench import COUNTED


@pytest.mark.parametrize(("module", "name", "phase"), COUNTED)
def test_every_phase_of_a_run_counts_a_function_that_there_is(
    module: str, name: str, phase: str
) -> None:
    assert callable(getattr(importlib.import_module(module), name)), phase
