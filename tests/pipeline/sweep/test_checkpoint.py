"""Finished tasks of a sweep survive a kill."""

from __future__ import annotations

from pathlib import Path

from pipeline.checkpoint import Checkpoint


def test_checkpoint_survives_a_kill(tmp_path: Path) -> None:
    path = tmp_path / "work" / "tasks.jsonl"
    store = Checkpoint(path, "inputs-1")
    assert store.run(abs, {"a": -1}) == [1]
    store.add("b", [1.5])
    with path.open("a", encoding="utf-8") as file:
        file.write('{"task": "c", "resu')  # cut short
    again = Checkpoint(path, "inputs-1")
    assert again.done == {"a": 1, "b": [1.5]}
    assert again.run(abs, {"c": -3, "a": -7}) == [3, 1]  # `a` is done
    assert Checkpoint(path, "inputs-1").done["c"] == 3
    assert Checkpoint(path, "other inputs").done == {}
