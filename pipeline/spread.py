"""One function over many blocks: on processes of this machine, or on a Dask cluster."""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing
from threading import Lock, Thread
from typing import Any, Final, TypeVar

from pipeline.errors import PipelineError

Block = TypeVar("Block")
Result = TypeVar("Result")
MOST_WORKERS: Final = 256
_PATIENCE: Final = "10s"  # for a scheduler and its first worker
_LOCK: Final = Lock()
_KEPT: Final = "finished blocks are kept; the same command goes on from them"


class SpreadError(PipelineError):
    """Workers or the scheduler are not there, or ended before the work did."""


def spread(
    work: Callable[[Block], Result],
    blocks: Sequence[Block],
    *,
    workers: int = 1,
    scheduler: str | None = None,
    title: str = "",
    done: int = 0,
) -> Generator[tuple[int, Result], None, None]:
    """Yield every block's place in `blocks` and its result, in the order in which they finish.

    A result is yielded in the calling process as soon as it is there: what the caller stores before
    it asks for the next one survives an interrupt or a kill. On a terminal a bar shows how many
    blocks are done and how long the rest will take.

    Args:
        work: Of one block; can be pickled (a function of a module, or `functools.partial` of one).
            What it loads it should keep in its process (`functools.cache`).
        blocks: Small descriptions of what to do, which can be pickled.
        workers: Processes of this machine; with 1 the work is done in the calling process.
        scheduler: Address of a Dask scheduler (``tcp://host:8786``) in place of processes. Its
            workers need this project at the same version, and the files that `work` reads under the
            same names; each does one block at a time. A block whose worker dies is given to
            another one.
        title: Before the bar.
        done: Blocks that were finished earlier; they count in the bar only.

    Raises:
        SpreadError: No such scheduler, it has no workers or died; a process was killed; the number
            of workers is out of range.
        Exception: What `work` raises, as it raised it; blocks that have not begun are dropped.
    """
    if not 1 <= workers <= MOST_WORKERS:
        raise SpreadError(f"--workers {workers}: give a number from 1 to {MOST_WORKERS}")
    if not blocks:
        return
    from tqdm import tqdm

    if scheduler is not None:
        finished = _on_cluster(work, blocks, scheduler)
    elif workers == 1 or len(blocks) == 1:
        finished = ((place, work(block)) for place, block in enumerate(blocks))
    else:
        finished = _on_processes(work, blocks, workers)
    total = done + len(blocks)
    with (
        closing(finished),
        tqdm(total=total, initial=done, desc=title, disable=None, leave=False) as bar,
    ):
        for place, result in finished:
            yield place, result
            bar.update(1)


def _on_processes(
    work: Callable[[Block], Result], blocks: Sequence[Block], workers: int
) -> Generator[tuple[int, Result], None, None]:
    pool = ProcessPoolExecutor(min(workers, len(blocks)), initializer=_begin)
    try:
        places = {pool.submit(work, block): place for place, block in enumerate(blocks)}
        for future in as_completed(places):
            yield places.pop(future), future.result()
    except BrokenProcessPool:
        text = f"a worker process ended before its block (killed, or out of memory); {_KEPT}"
        raise SpreadError(text) from None
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for process in multiprocessing.active_children():
            process.terminate()
        raise
    pool.shutdown()


def _begin() -> None:
    """Leave Ctrl-C to the process that started this one, and end when that one does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()

    def follow() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    Thread(target=follow, daemon=True).start()


def _alone(work: Callable[[Block], Result], block: Block) -> Result:
    """One block at a time, though a worker may have several threads."""
    with _LOCK:
        return work(block)


def _on_cluster(
    work: Callable[[Block], Result], blocks: Sequence[Block], address: str
) -> Generator[tuple[int, Result], None, None]:
    try:
        import distributed
    except ImportError:
        text = "--scheduler needs the package distributed: pip install 'legwatt[cluster]'"
        raise SpreadError(text) from None
    for name in ("distributed", "distributed.client", "tornado.application"):
        logging.getLogger(name).handlers = [logging.NullHandler()]  # what matters is said below
    client: Any = None
    try:
        client = distributed.Client(address, timeout=_PATIENCE)
        client.wait_for_workers(1, timeout=_PATIENCE)
    except (OSError, ValueError, TimeoutError) as error:
        if client is not None:
            client.close(timeout=1)
            raise SpreadError(f"--scheduler {address}: it has no workers; start one") from None
        reason = str(error).split("\n")[0]
        raise SpreadError(f"--scheduler {address}: no scheduler answers ({reason})") from None
    try:
        futures = [client.submit(_alone, work, block, pure=False) for block in blocks]
        places = {future.key: place for place, future in enumerate(futures)}
        for future in distributed.as_completed(futures):
            yield places[future.key], future.result()
    except distributed.scheduler.KilledWorker:
        raise SpreadError(
            f"--scheduler {address}: a block ended several workers (out of memory?); {_KEPT}"
        ) from None
    except (distributed.client.FutureCancelledError, distributed.CancelledError, OSError):
        raise SpreadError(f"--scheduler {address}: the scheduler is gone; {_KEPT}") from None
    finally:
        client.close(timeout=1)
