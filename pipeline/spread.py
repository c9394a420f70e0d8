"""One function over many blocks: in this process, on a local Dask cluster, or on a remote one.

What is finished can be kept in a file, from which an interrupted computation goes on.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from threading import Lock
from typing import Any, Final

from actuators.errors import LegwattError
from pipeline.atomic import write_text

_PATIENCE: Final = "10s"  # for a scheduler and its first worker
_LOCK: Final = Lock()
_KEPT: Final = "finished blocks are kept; the same command goes on from them"


def spread(
    work: Callable[[Any], Any],
    blocks: Sequence[Any],
    *,
    workers: int | str = 1,
    title: str = "",
    done: int = 0,
) -> Iterator[tuple[int, Any]]:
    """Yield every block's place in `blocks` and its result, in the order in which they finish.

    Args:
        work: Of one block; it and the blocks can be pickled. What it loads it should keep in its
            process (`functools.cache`).
        blocks: Small descriptions of what to do.
        workers: Processes of this machine, 1 for the calling one; or the address of a Dask
            scheduler (``tcp://host:8786``), whose workers need this project at the same version
            and the files that `work` reads under the same names. A block whose worker dies is
            given to another one.
        title: Before the progress bar.
        done: Blocks that were finished earlier; they count in the bar only.

    Raises:
        LegwattError: No such scheduler, it has no workers or died; a block ended several workers;
            the number of workers is out of range; what `work` raised, as it raised it.
    """
    if isinstance(workers, int) and not 1 <= workers <= 256:
        raise LegwattError(f"workers {workers}: give a number from 1 to 256")
    if not blocks:
        return
    from tqdm import tqdm

    finished = enumerate(map(work, blocks)) if workers == 1 else _on_dask(work, blocks, workers)
    with tqdm(total=done + len(blocks), initial=done, desc=title, disable=None, leave=False) as bar:
        for place, result in finished:
            yield place, result
            bar.update(1)


def _alone(work: Callable[[Any], Any], block: Any) -> Any:
    """One block at a time, though a worker may have several threads; what is refused returns."""
    with _LOCK:
        try:
            return work(block)
        except LegwattError as refused:
            return refused


def _on_dask(
    work: Callable[[Any], Any], blocks: Sequence[Any], workers: int | str
) -> Iterator[tuple[int, Any]]:
    import dask
    import distributed

    for name in ("distributed", "distributed.client", "tornado.application"):
        logging.getLogger(name).handlers = [logging.NullHandler()]  # what matters is said below
    dask.config.set({"distributed.nanny.pre-spawn-environ.DASK_LOGGING__DISTRIBUTED": "critical"})
    client: Any = None
    cluster: Any = None
    where = workers if isinstance(workers, str) else "a local cluster"
    try:
        try:
            if isinstance(workers, int):
                cluster = distributed.LocalCluster(
                    min(workers, len(blocks)),
                    threads_per_worker=1,
                    dashboard_address=":0",
                    silence_logs=logging.CRITICAL,
                )
            client = distributed.Client(cluster or workers, timeout=_PATIENCE)
            client.wait_for_workers(1, timeout=_PATIENCE)
        except (OSError, ValueError, TimeoutError):
            lacks = "the scheduler has no workers" if client else "no scheduler answers"
            raise LegwattError(f"{where}: {lacks}") from None
        futures = [client.submit(_alone, work, block, pure=False) for block in blocks]
        places = {future.key: place for place, future in enumerate(futures)}
        for future in distributed.as_completed(futures):
            result = future.result()
            if isinstance(result, LegwattError):
                raise result
            yield places[future.key], result
    except distributed.scheduler.KilledWorker:
        text = f"{where}: a block ended several workers (killed, or out of memory); {_KEPT}"
        raise LegwattError(text) from None
    except (distributed.client.FutureCancelledError, distributed.CancelledError, OSError):
        raise LegwattError(f"{where}: the scheduler is gone; {_KEPT}") from None
    finally:
        for one in filter(None, (client, cluster)):
            one.close(timeout=5)


def resumed(
    work: Callable[[Any], Any],
    tasks: Mapping[str, Any],
    path: Path,
    inputs: str,
    *,
    workers: int | str = 1,
    title: str = "",
) -> list[Any]:
    """Do what a file of finished tasks does not hold yet; all results in the order of the tasks.

    Args:
        work: Of one block; it returns what JSON can hold.
        tasks: Name to block.
        path: One JSON line per finished task, headed by `inputs`. A file of other inputs is begun
            anew; a last line cut short by a kill is dropped.
        inputs: Hash of all that the results rest on.
        workers: See `spread`, as for `title` and what is raised.
    """
    head, kept, done = json.dumps({"inputs": inputs}), [], {}
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    for line in lines[1:] if lines[:1] == [head] else ():
        try:
            entry = json.loads(line)
        except json.JSONDecodeError:
            continue
        done[entry["task"]] = entry["result"]
        kept.append(line)
    left = [name for name in tasks if name not in done]
    blocks, begun = [tasks[name] for name in left], False
    finished = spread(work, blocks, workers=workers, title=title, done=len(tasks) - len(left))
    for place, result in finished:
        done[left[place]] = result
        if not begun:  # nothing is written before there is a result
            write_text(path, "\n".join([head, *kept]) + "\n")
            begun = True
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps({"task": left[place], "result": result}) + "\n")
    return [done[name] for name in tasks]
