"""What both matrices of blind trials need: pools, progress, hashes, a fresh start."""

from __future__ import annotations

import hashlib
import multiprocessing
import shutil
import signal
import sys
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from pipeline.blind.answer import begin_answers, stop_answers

_ROOT: Final = Path(__file__).parents[2]


def together(hashes: Mapping[int, str]) -> str:
    """One hash of the hashes of all sealed truths, by number."""
    lines = sorted(f"{number} {sha256}\n" for number, sha256 in hashes.items())
    return hashlib.sha256("".join(lines).encode()).hexdigest()


def hash_of(*parts: object) -> str:
    """Hash of values, and of the project's files by the patterns among them."""
    total = hashlib.sha256()
    for part in parts:
        if isinstance(part, str) and "*" in part:
            for path in sorted(_ROOT.glob(part)):
                total.update(path.relative_to(_ROOT).as_posix().encode() + path.read_bytes())
        else:
            total.update(str(part).encode())
    return total.hexdigest()


def clear(out: Path) -> None:
    """Remove an earlier run's trials; its tables stay until there are new ones."""
    # What says that trials are done goes before them: a kill in between must not be gone on from.
    for name in ("sealed.jsonl", "answers.jsonl"):
        (out / name).unlink(missing_ok=True)
    for name in ("trials", "sealed", "answers"):
        shutil.rmtree(out / name, ignore_errors=True)


@contextmanager
def pool(pool: Executor) -> Iterator[Executor]:
    """A pool that drops what has not begun and ends what runs when it is interrupted."""
    begin_answers()
    try:
        yield pool
    except BaseException as reason:
        pool.shutdown(wait=False, cancel_futures=True)
        stop_answers()
        for process in multiprocessing.active_children():
            process.terminate()
        if isinstance(reason, KeyboardInterrupt):
            text = "interrupted; finished trials are kept, --resume goes on from them"
            raise KeyboardInterrupt(text) from None
        raise
    pool.shutdown()


def processes(workers: int) -> ProcessPoolExecutor:
    """Processes that leave Ctrl-C to the one that started them."""
    return ProcessPoolExecutor(
        workers, initializer=signal.signal, initargs=(signal.SIGINT, signal.SIG_IGN)
    )


@contextmanager
def progress(title: str, total: int) -> Iterator[Callable[[int], None]]:
    """A progress bar on a terminal, nothing elsewhere."""
    from tqdm import tqdm

    with tqdm(total=total, desc=title, disable=not sys.stderr.isatty()) as bar:

        def tick(count: int) -> None:
            bar.update(count)

        yield tick
