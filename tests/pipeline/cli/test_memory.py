"""What a walk needs is told before it is computed, and the rule is not far from what it takes."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import pytest

from pipeline.errors import GaitError
from pipeline.simulation import settings as memory
from tests.command_line import Command


@pytest.mark.slow
def test_the_rule_is_above_what_a_walk_takes_and_of_its_size(
    tmp_path: Path, command: Command
) -> None:
    samples = 3000
    tracemalloc.start()
    try:
        assert command("walk", tmp_path, "--samples", str(samples)) == 0
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    need = memory.needed(samples, 18, 4)
    assert 0.3 * need < peak < need


def test_the_most_that_fits_is_taken_and_one_more_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "free", lambda: 10**9)
    with pytest.raises(GaitError, match=r"1 GB are free; at most (\d+) samples fit") as caught:
        memory.refuse_beyond_memory(10**8, 18, 4)
    most = int(str(caught.value).split("at most ")[1].split()[0])
    memory.refuse_beyond_memory(most, 18, 4)
    with pytest.raises(GaitError):
        memory.refuse_beyond_memory(most + 1, 18, 4)
