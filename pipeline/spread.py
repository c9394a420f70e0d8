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
from typing import Any, Final

from actuators.errors import LegwattError

Work = Callable[[Any], Any]
Finished = Generator[tuple[int, Any], None, None]
_PATIENCE: Final = "10s"  # for a scheduler and its first worker
_LOCK: Final = Lock()
_KEPT: Final = "finished blocks are kept; the same command goes on from them"


def spread(
    work: Work,
    blocks: Sequence[Any],
    *,
    workers: int = 1,
    scheduler: str | None = None,
    title: str = "",
    done: int = 0,
) -> Finished:
    """Yield every block's place in `blocks` and its result, in the order in which they finish.

    Args:
        work: Of one block; it and the blocks can be pickled. What it loads it should keep in its
            process (`functools.cache`).
        blocks: Small descriptions of what to do.
        workers: Processes of this machine; with 1 the work is done in the calling process.
        scheduler: Address of a Dask scheduler (``tcp://host:8786``) in place of processes. Its
            workers need this project at the same version, and the files that `work` reads under the
            same names. A block whose worker dies is given to another one.
        title: Before the progress bar.
        done: Blocks that were finished earlier; they count in the bar only.

    Raises:
        LegwattError: No such scheduler, it has no workers or died; a process was killed; the number
            of workers is out of range.
        Exception: What `work` raises, as it raised it; blocks that have not begun are dropped.
    """
    if not 1 <= workers <= 256:
        raise LegwattError(f"--workers {workers}: give a number from 1 to 256")
    if not blocks:
        return
    from tqdm import tqdm

    if scheduler is not None:
        finished = _on_cluster(work, blocks, scheduler)
    elif workers == 1 or len(blocks) == 1:
        finished = ((place, work(block)) for place, block in enumerate(blocks))
    else:
        finished = _on_processes(work, blocks, workers)
    bar = tqdm(total=done + len(blocks), initial=done, desc=title, disable=None, leave=False)
    with closing(finished), bar:
        for place, result in finished:
            yield place, result
            bar.update(1)


def _on_processes(work: Work, blocks: Sequence[Any], workers: int) -> Finished:
    with ProcessPoolExecutor(min(workers, len(blocks)), initializer=_begin) as pool:
        places = {pool.submit(work, block): place for place, block in enumerate(blocks)}
        try:
            for future in as_completed(places):
                yield places.pop(future), future.result()
        except BrokenProcessPool:
            text = f"a worker process ended before its block (killed, or out of memory); {_KEPT}"
            raise LegwattError(text) from None
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for process in multiprocessing.active_children():
                process.terminate()
            raise


def _begin() -> None:
    """Leave Ctrl-C to the process that started this one, and end when that one does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def follow() -> None:
        if parent := multiprocessing.parent_process():
            parent.join()
            os._exit(1)

    Thread(target=follow, daemon=True).start()


def _alone(work: Work, block: Any) -> Any:
    """One block at a time, though a worker may have several threads."""
    with _LOCK:
        return work(block)


def _on_cluster(work: Work, blocks: Sequence[Any], address: str) -> Finished:
    try:
        import distributed
    except ImportError:
        text = "a Dask scheduler needs the package distributed: pip install 'legwatt[cluster]'"
        raise LegwattError(text) from None
    for name in ("distributed", "distributed.client", "tornado.application"):
        logging.getLogger(name).handlers = [logging.NullHandler()]  # what matters is said below
    client: Any = None
    try:
        try:
            client = distributed.Client(address, timeout=_PATIENCE)
            client.wait_for_workers(1, timeout=_PATIENCE)
        except (OSError, ValueError, TimeoutError):
            lacks = "the scheduler has no workers" if client else "no scheduler answers"
            raise LegwattError(f"{address}: {lacks}") from None
        futures = [client.submit(_alone, work, block, pure=False) for block in blocks]
        places = {future.key: place for place, future in enumerate(futures)}
        for future in distributed.as_completed(futures):
            yield places[future.key], future.result()
    except distributed.scheduler.KilledWorker:
        text = f"{address}: a block ended several workers (out of memory?); {_KEPT}"
        raise LegwattError(text) from None
    except (distributed.client.FutureCancelledError, distributed.CancelledError, OSError):
        raise LegwattError(f"{address}: the scheduler is gone; {_KEPT}") from None
    finally:
        if client is not None:
            client.close(timeout=1)
