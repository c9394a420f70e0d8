"""Finished tasks of a long computation, kept so that an interrupted one goes on."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from pipeline.spread import spread


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
        head = json.dumps({"inputs": inputs})
        kept = [head]
        for line in lines[1:] if lines[:1] == [head] else ():
            try:
                entry = json.loads(line)
            except json.JSONDecodeError:
                continue
            self.done[entry["task"]] = entry["result"]
            kept.append(line)
        path.write_text("\n".join(kept) + "\n", encoding="utf-8")

    def add(self, task: str, result: Any) -> None:
        """Remember a finished task."""
        self.done[task] = result
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps({"task": task, "result": result}) + "\n")

    def run(
        self,
        work: Callable[[Any], Any],
        tasks: Mapping[str, Any],
        *,
        workers: int = 1,
        scheduler: str | None = None,
        title: str = "",
    ) -> list[Any]:
        """Do what is not done yet; return all results in the order of the tasks.

        Args:
            work: Of one block; must return what JSON can hold.
            tasks: Name to block; for this and the others see `pipeline.spread.spread`.
            workers: Processes.
            scheduler: Address of a Dask scheduler in place of them.
            title: Before the progress bar.

        Raises:
            SpreadError: Workers or the scheduler are not there, or ended before the work did.
        """
        left = [name for name in tasks if name not in self.done]
        blocks = [tasks[name] for name in left]
        for place, result in spread(
            work,
            blocks,
            workers=workers,
            scheduler=scheduler,
            title=title,
            done=len(tasks) - len(left),
        ):
            self.add(left[place], result)
        return [self.done[name] for name in tasks]
