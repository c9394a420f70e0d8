"""Finished tasks of a long computation, kept so that an interrupted one goes on."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, wait
from pathlib import Path
from typing import Any


class Checkpoint:
    """A file of one JSON line per finished task, headed by the hash of all inputs.

    A file of other inputs is begun anew; a last line cut short by a kill is dropped.

    Args:
        path: The file; its folder is made when it is missing.
        inputs: Hash of everything the results depend on.
    """

    def __init__(self, path: Path, inputs: str) -> None:
        self.path = path
        self.done: dict[str, Any] = {}
        path.parent.mkdir(parents=True, exist_ok=True)
        lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
        kept = []
        if lines and lines[0] == json.dumps({"inputs": inputs}):
            for line in lines[1:]:
                try:
                    entry = json.loads(line)
                except json.JSONDecodeError:
                    continue
                self.done[entry["task"]] = entry["result"]
                kept.append(line)
        text = "\n".join([json.dumps({"inputs": inputs}), *kept]) + "\n"
        path.write_text(text, encoding="utf-8")

    def add(self, task: str, result: Any) -> None:
        """Remember a finished task."""
        self.done[task] = result
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps({"task": task, "result": result}) + "\n")

    def run(
        self,
        pool: Executor,
        function: Callable[..., Any],
        tasks: Sequence[tuple[str, tuple[Any, ...]]],
        progress: Callable[[int], None],
    ) -> list[Any]:
        """Run what is not done yet, in any order; return all results in the order of the tasks.

        Args:
            pool: Of processes.
            function: Called with each task's arguments; must return what JSON can hold.
            tasks: Name and arguments.
            progress: Called with 1 per finished task.
        """
        waiting = {}
        for name, arguments in tasks:
            if name in self.done:
                progress(1)
            else:
                waiting[pool.submit(function, *arguments)] = name
        while waiting:
            # An interrupt that comes just before the wait is not seen before its end.
            ended, _ = wait(waiting, timeout=1.0, return_when=FIRST_COMPLETED)
            for future in ended:
                self.add(waiting.pop(future), future.result())
                progress(1)
        return [self.done[name] for name, _ in tasks]
