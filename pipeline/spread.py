"""One function over many blocks: in this process, or on Dask, a local cluster or a remote one.

What is finished can be kept in a file, from which an interrupted computation goes on.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any, Final

from actuators.errors import LegwattError
from pipeline.atomic import write_text

_PATIENCE: Final = 10.0  # for a scheduler and its first worker [s]
Work = Callable[[Any], Any]


def _finished(work: Work, blocks: Sequence[Any], workers: int | str) -> Iterator[tuple[int, Any]]:
    """Each block's place in `blocks` and its result, in the order in which they finish."""
    if isinstance(workers, int) and not 1 <= workers <= 256:
        raise LegwattError(f"workers {workers}: give a number from 1 to 256")
    if workers == 1 or not blocks:
        yield from enumerate(map(work, blocks))
        return
    import distributed

    for name in ("distributed", "distributed.client", "tornado.application"):
        logging.getLogger(name).handlers = [logging.NullHandler()]  # what matters is said below
    where = workers if isinstance(workers, str) else "a local cluster"
    with ExitStack() as closing:
        try:
            cluster: Any = workers
            if isinstance(workers, int):
                look: Any = {"dashboard_address": ":0", "silence_logs": logging.CRITICAL}
                count = min(workers, len(blocks))
                cluster = distributed.LocalCluster(count, threads_per_worker=1, **look)
                closing.enter_context(cluster)
            client = closing.enter_context(distributed.Client(cluster, timeout=_PATIENCE))
            client.wait_for_workers(1, timeout=_PATIENCE)
        except (OSError, ValueError, TimeoutError):
            raise LegwattError(f"{where}: no scheduler with workers answers") from None
        try:
            futures = client.map(work, blocks, pure=False)
            places = {future.key: place for place, future in enumerate(futures)}
            for future in distributed.as_completed(futures):
                yield places[future.key], future.result()
        except distributed.scheduler.KilledWorker:
            raise LegwattError(f"{where}: a block ended several workers; try fewer") from None
        except (distributed.client.FutureCancelledError, distributed.CancelledError, OSError):
            raise LegwattError(f"{where}: the scheduler is gone") from None


def resumed(
    work: Work,
    tasks: Mapping[str, Any],
    path: Path,
    inputs: str,
    *,
    workers: int | str = 1,
    title: str = "",
) -> list[Any]:
    """Do what a file of finished tasks does not hold yet; all results in the order of the tasks.

    Args:
        work: Of one block; it returns what JSON can hold, and workers can import it.
        tasks: Name to block, a small description of what to do.
        path: One JSON line per finished task, headed by `inputs`. A file of other inputs is begun
            anew; a last line cut short by a kill is dropped.
        inputs: Hash of all that the results rest on.
        workers: Processes of this machine, 1 for the calling one; or the address of a Dask
            scheduler (``tcp://host:8786``), whose workers have this project at the same version.
            A block whose worker dies is given to another one.
        title: Before the progress bar.

    Raises:
        LegwattError: No such scheduler, it has no workers or died; a block ended several workers;
            the number of workers is out of range; what `work` raised, as it raised it.
    """
    from tqdm import tqdm

    head, done = json.dumps({"inputs": inputs}), {}
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    for line in lines[1:] if lines[:1] == [head] else ():
        with suppress(json.JSONDecodeError):
            entry = json.loads(line)
            done[entry["task"]] = entry["result"]
    kept = [json.dumps({"task": name, "result": result}) for name, result in done.items()]
    left = [name for name in tasks if name not in done]
    finished = _finished(work, [tasks[name] for name in left], workers)
    shown = tqdm(finished, title, len(tasks), initial=len(kept), leave=False, disable=None)
    for count, (place, result) in enumerate(shown):
        done[left[place]] = result
        if not count:  # nothing is written before there is a result
            write_text(path, "\n".join([head, *kept]) + "\n")
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps({"task": left[place], "result": result}) + "\n")
    return [done[name] for name in tasks]
