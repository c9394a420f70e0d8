"""One function over many blocks: in this process, or on Dask, a local cluster or a remote one.

What is finished can be kept in a file, from which an interrupted computation goes on.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from threading import Lock
from typing import Any, Final

from actuators.errors import LegwattError
from pipeline.atomic import write_text

_PATIENCE: Final = 10.0  # for a scheduler and its first worker [s]
_LOCK: Final = Lock()
_KEPT: Final = "finished blocks are kept; the same command goes on from them"

Work = Callable[[Any], Any]


def spread(
    work: Work, blocks: Sequence[Any], *, workers: int | str = 1, title: str = "", done: int = 0
) -> Iterator[tuple[int, Any]]:
    """Yield every block's place in `blocks` and its result, in the order in which they finish.

    Args:
        work: Of one block; it and the blocks can be pickled, and workers can import it. What it
            loads it should keep in its process (`functools.cache`).
        blocks: Small descriptions of what to do.
        workers: Processes of this machine, 1 for the calling one; or the address of a Dask
            scheduler (``tcp://host:8786``), whose workers need this project at the same version
            and the files that `work` reads under the same names. A block whose worker dies is
            given to another one.
        title: Before the progress bar.
        done: Blocks that were finished earlier; they count in the bar only.

    Raises:
        LegwattError: No such scheduler, it has no workers or died; a block ended several workers;
            a worker cannot import what it shall do; the number of workers is out of range; what
            `work` raised, as it raised it.
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


def _alone(work: Work, block: Any) -> Any:
    """One block at a time, though a worker may have several threads; what is refused returns."""
    with _LOCK:
        try:
            return work(block)
        except LegwattError as refused:
            return refused


def _close(one: Any) -> None:
    """End a client or a cluster; what a busy computer has not ended in time ends with Python."""
    with suppress(TimeoutError):
        one.close(timeout=5)


def _on_dask(work: Work, blocks: Sequence[Any], workers: int | str) -> Iterator[tuple[int, Any]]:
    import cloudpickle
    import dask
    import distributed

    def unpacked(packed: bytes) -> tuple[str, Any]:
        # Sent by value, as it is no name of a module: it runs on workers that lack the project. A
        # function that a worker cannot import would else end its connection, and be sent for ever.
        import pickle

        try:
            call, *given = pickle.loads(packed)
        except Exception as error:
            return f"{type(error).__name__}: {error}", None
        return "", call(*given)

    for name in ("distributed", "distributed.client", "tornado.application"):
        logging.getLogger(name).handlers = [logging.NullHandler()]  # what matters is said below
    dask.config.set({"distributed.nanny.pre-spawn-environ.DASK_LOGGING__DISTRIBUTED": "critical"})
    where = workers if isinstance(workers, str) else "a local cluster"
    lacks = "no scheduler answers"
    with ExitStack() as closing:
        try:
            cluster: Any = workers
            if isinstance(workers, int):
                cluster = distributed.LocalCluster(
                    min(workers, len(blocks)),
                    threads_per_worker=1,
                    dashboard_address=":0",
                    silence_logs=logging.CRITICAL,
                )
                closing.callback(_close, cluster)
            client = distributed.Client(cluster, timeout=_PATIENCE)
            closing.callback(_close, client)
            lacks = "the scheduler has no workers"
            client.wait_for_workers(1, timeout=_PATIENCE)
        except (OSError, ValueError, TimeoutError):
            raise LegwattError(f"{where}: {lacks}") from None
        try:
            packed = [cloudpickle.dumps((_alone, work, block)) for block in blocks]
            futures = [client.submit(unpacked, each, pure=False) for each in packed]
            places = {future.key: place for place, future in enumerate(futures)}
            for future in distributed.as_completed(futures):
                unusable, result = future.result()
                if unusable:
                    raise LegwattError(
                        f"{where}: a worker cannot import what it shall do ({unusable}); give it "
                        "the same version of the project, and a function of one of its modules"
                    )
                if isinstance(result, LegwattError):
                    raise result
                yield places[future.key], result
        except distributed.scheduler.KilledWorker:
            text = f"{where}: a block ended several workers (killed, or out of memory); {_KEPT}"
            raise LegwattError(text) from None
        except (distributed.client.FutureCancelledError, distributed.CancelledError, OSError):
            raise LegwattError(f"{where}: the scheduler is gone; {_KEPT}") from None


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
        work: Of one block; it returns what JSON can hold.
        tasks: Name to block.
        path: One JSON line per finished task, headed by `inputs`. A file of other inputs is begun
            anew; a last line cut short by a kill is dropped.
        inputs: Hash of all that the results rest on.
        workers: See `spread`, as for `title` and what is raised.
    """
    head, done = json.dumps({"inputs": inputs}), {}
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    for line in lines[1:] if lines[:1] == [head] else ():
        try:
            entry = json.loads(line)
        except json.JSONDecodeError:
            continue
        done[entry["task"]] = entry["result"]
    kept = [json.dumps({"task": name, "result": result}) for name, result in done.items()]
    left = [name for name in tasks if name not in done]
    finished = spread(
        work, [tasks[name] for name in left], workers=workers, title=title, done=len(kept)
    )
    for count, (place, result) in enumerate(finished):
        done[left[place]] = result
        if not count:  # nothing is written before there is a result
            write_text(path, "\n".join([head, *kept]) + "\n")
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps({"task": left[place], "result": result}) + "\n")
    return [done[name] for name in tasks]
