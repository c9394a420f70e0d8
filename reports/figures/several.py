"""Draw several figures in two processes; their bytes do not depend on who draws which."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from reports.errors import FigureError, ReportError
from reports.figures.save import save_figure
from reports.figures.style import house_style

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Drawing:
    """A figure to be drawn.

    Attributes:
        name: File name without ending.
        draw: Makes the figure; nothing is drawn before it is called.
    """

    name: str
    draw: Callable[[], Figure]


def save_figures(
    drawings: Sequence[Drawing],
    out: Path,
    *,
    processes: int | None = None,
    done: Callable[[float], None] | None = None,
) -> int:
    """Draw and save every figure.

    Args:
        drawings: In any order.
        out: Folder.
        processes: 1 or 2; by default 2 where there are two processors and forking is safe.
        done: Told the share that is drawn, now and then.

    Returns:
        How many figures.

    Raises:
        ReportError: A figure that cannot be drawn or saved.
    """
    if processes is None:
        processes = 2 if _may_fork() else 1

    def shown(turns: Iterator[int]) -> Iterator[int]:
        for turn in turns:
            if done is not None:
                done(turn / len(drawings))
            yield turn

    if processes < 2 or len(drawings) < 2:
        _save(drawings, shown(iter(range(len(drawings)))), out)
    else:
        _save_in_two(drawings, out, shown)
    return len(drawings)


def _may_fork() -> bool:
    # On macOS system libraries do not survive a fork, Windows has none.
    return sys.platform == "linux" and len(os.sched_getaffinity(0)) > 1


def _save(drawings: Sequence[Drawing], turns: Iterator[int], out: Path) -> None:
    with house_style():  # once for all: entering it costs as much as a small drawing
        for turn in turns:
            save_figure(drawings[turn].draw(), out, drawings[turn].name)


def _save_in_two(
    drawings: Sequence[Drawing], out: Path, shown: Callable[[Iterator[int]], Iterator[int]]
) -> None:
    """The child inherits the drawings by forking; whoever is free takes the next one."""
    import multiprocessing

    # Imported before the fork, so that it is done once.
    import matplotlib.backends.backend_agg
    import matplotlib.backends.backend_svg
    import matplotlib.figure  # noqa: F401

    context = multiprocessing.get_context("fork")
    counter = context.Value("i", 0)

    def turns(wanted: Callable[[], bool]) -> Iterator[int]:
        while wanted():
            with counter.get_lock():
                turn = counter.value
                counter.value += 1
            if turn >= len(drawings):
                return
            yield turn

    def help_out(report: Connection, parent: int) -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent answers it for both
        try:
            _save(drawings, turns(lambda: os.getppid() == parent), out)
        except ReportError as error:
            report.send((type(error), str(error)))

    receive, send = context.Pipe(duplex=False)
    child = context.Process(target=help_out, args=(send, os.getpid()), daemon=True)
    child.start()
    send.close()
    try:
        _save(drawings, shown(turns(lambda: True)), out)
    finally:
        with counter.get_lock():
            counter.value = len(drawings)  # after an error or an interrupt nobody goes on
        child.join()
    try:
        kind, text = receive.recv()
    except EOFError:  # nothing to report
        if child.exitcode != 0:
            raise FigureError(
                f"the process that draws figures ended with {child.exitcode}; run again"
            ) from None
    else:
        raise kind(text)
    finally:
        receive.close()
