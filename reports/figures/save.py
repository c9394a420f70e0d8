"""Lay figures out once and write them as PNG and SVG; the same figure gives the same bytes."""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from reports.atomic import replacing
from reports.errors import FigureError, ReportError
from reports.figures.style import house_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PNG = {"compress_level": 4}  # half the time of the default, for a few per cent more bytes
#: Decimals of a line's data: below what any picture shows, above what rounding differs in.
_DECIMALS = 11
#: Of a panel's place, as a share of the figure: far below a pixel.
_PLACE_DECIMALS = 7


def arrange(figure: Figure) -> None:
    """Lay a figure out once and for all, so that no later drawing does it again."""
    engine = figure.get_layout_engine()
    if engine is None:
        return
    engine.execute(figure)
    figure.set_layout_engine("none")
    # The layout's solver orders its unknowns by address: last bits differ from run to run.
    for axes in figure.axes:
        x, y, width, height = np.round(axes.get_position(original=True).bounds, _PLACE_DECIMALS)
        axes.set_position((x, y, width, height), which="original")
        axes.set_in_layout(True)


def save_figure(figure: Figure, folder: Path, name: str) -> None:
    """Write `<name>.png` (at the style's 150 dots per inch) and `<name>.svg`, whole or not at all.

    Raises:
        OutputError: The folder cannot be written.
    """
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    for line in (line for axes in figure.axes for line in axes.lines):
        x, y = (np.asarray(values) for values in line.get_data(orig=False))
        if x.dtype.kind == y.dtype.kind == "f":  # last bits may differ from process to process
            line.set_data(np.round(x, _DECIMALS), np.round(y, _DECIMALS))
    targets = (folder / f"{name}.png", folder / f"{name}.svg")
    with house_style(), replacing(*targets) as (png, svg):
        arrange(figure)
        # Not `savefig`: it draws every figure once more than it is written; and the canvas on
        # which it was laid out, which has measured every text.
        with png.open("wb") as stream:
            metadata: dict[str, Any] = {"Software": None}
            canvas: Any = figure.canvas
            canvas.print_png(stream, metadata=metadata, pil_kwargs=_PNG)
        with svg.open("wb") as stream:
            metadata = {"Date": None, "Creator": None}
            FigureCanvasSVG(figure).print_svg(stream, metadata=metadata)


def save_figures(
    drawings: Mapping[str, Callable[[], Figure]],
    folder: Path,
    *,
    processes: int | None = None,
    done: Callable[[float], None] | None = None,
) -> int:
    """Draw and save every figure.

    Args:
        drawings: File name without ending to what makes the figure.
        folder: For the files.
        processes: 1 or 2; by default 2 where there are two processors and forking is safe.
        done: Called with the share that is drawn, now and then.

    Returns:
        How many figures.

    Raises:
        ReportError: A figure that cannot be drawn or saved.
    """
    if processes is None:  # on macOS system libraries do not survive a fork, Windows has none
        processes = 2 if sys.platform == "linux" and len(os.sched_getaffinity(0)) > 1 else 1
    gc.freeze()  # what is loaded by now stays: the collector need not search it again and again
    try:
        if processes < 2 or len(drawings) < 2:
            _save(drawings, list(drawings), folder, done)
        else:
            _save_in_two(drawings, folder, done)
    finally:
        gc.unfreeze()
    return len(drawings)


def _save(
    drawings: Mapping[str, Callable[[], Figure]],
    names: Sequence[str],
    folder: Path,
    done: Callable[[float], None] | None,
) -> None:
    with house_style():  # once for all: entering it costs as much as a small drawing
        for turn, name in enumerate(names):
            if done is not None:
                done(turn / len(names))
            save_figure(drawings[name](), folder, name)


def _save_in_two(
    drawings: Mapping[str, Callable[[], Figure]],
    folder: Path,
    done: Callable[[float], None] | None,
) -> None:
    """A forked child draws every second figure."""
    import multiprocessing

    # Imported before the fork, so that it is done once.
    import matplotlib.backends.backend_agg
    import matplotlib.backends.backend_svg
    import matplotlib.figure  # noqa: F401

    context = multiprocessing.get_context("fork")
    receive, send = context.Pipe(duplex=False)
    names, parent, stopped = list(drawings), os.getpid(), context.Event()

    def stop_with_parent(_: float) -> None:
        if stopped.is_set() or os.getppid() != parent:
            sys.exit(0)

    def draw_half() -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent answers it for both
        try:
            _save(drawings, names[1::2], folder, stop_with_parent)
        except ReportError as error:
            send.send((type(error), str(error)))

    child = context.Process(target=draw_half, daemon=True)
    child.start()
    send.close()
    try:
        _save(drawings, names[::2], folder, done)
    finally:
        if sys.exc_info()[0] is not None:
            stopped.set()
        child.join()
    with receive:
        try:
            kind, text = receive.recv()
        except EOFError:  # nothing to report
            if child.exitcode == 0:
                return
            kind, text = FigureError, f"drawing figures ended with {child.exitcode}; run again"
        raise kind(text)
