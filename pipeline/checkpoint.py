"""Finished tasks of a long computation, kept so that an interrupted one goes on."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from pipeline.atomic import write_text
from pipeline.spread import spread


class Checkpoint:
    """A file of one JSON line per finished task, headed by `inputs`, a hash of what it rests on.

    A file of other inputs is begun anew; a last line cut short by a kill is dropped.
    """

    def __init__(self, path: Path, inputs: str) -> None:
        self.path = path
        self.done: dict[str, Any] = {}
        head = json.dumps({"inputs": inputs})
        lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
        kept = [head]
        for line in lines[1:] if lines[:1] == [head] else ():
            try:
                entry = json.loads(line)
            except json.JSONDecodeError:
                continue
            self.done[entry["task"]] = entry["result"]
            kept.append(line)
        self._kept = "\n".join(kept) + "\n"

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

        `work` returns what JSON can hold. `tasks`: name to block. For the rest, and for what is
        raised, see `pipeline.spread.spread`.
        """
        left = [name for name in tasks if name not in self.done]
        blocks, done = [tasks[name] for name in left], len(tasks) - len(left)
        finished = spread(
            work, blocks, workers=workers, scheduler=scheduler, title=title, done=done
        )
        for place, result in finished:
            self.done[left[place]] = result
            if self._kept:  # nothing is written before there is a result
                write_text(self.path, self._kept)
                self._kept = ""
            with self.path.open("a", encoding="utf-8") as file:
                file.write(json.dumps({"task": left[place], "result": result}) + "\n")
        return [self.done[name] for name in tasks]
