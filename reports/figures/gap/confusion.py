"""Hidden effect against first name: a matrix of counts, the diagonal in its own colour."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from reports.figures.style import BLUE, INK, QUIET, SHADE, VERMILION, house_style, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle


@house_style()
def confusion(
    hidden: Sequence[str], named: Sequence[str], counts: NDArray[np.int_], subtitle: str
) -> Figure:
    """Draw the matrix; rows and columns without a trial are left out.

    Args:
        hidden: Rows.
        named: Columns; a row's own name is its right answer.
        counts: Shape (rows, columns).
        subtitle: Second line, e.g. the rates.
    """
    kept = [int(i) for i in np.flatnonzero(counts.sum(axis=1))]
    used = [k for k in range(len(named)) if counts[:, k].any()]
    height, width = 2.2 + 0.25 * max(len(kept), 6), 2.6 + 0.3 * max(len(used), 14)
    title = "What was hidden, and what was named first"
    figure = new_figure(height, title, subtitle, width=width)
    axes = figure.add_subplot()
    for row, i in enumerate(kept):
        total = int(counts[i].sum())
        for column, k in enumerate(used):
            count = int(counts[i, k])
            right = hidden[i] == named[k]
            if count == 0:
                if right:
                    axes.add_patch(_cell(row, column, SHADE, 1.0))
                continue
            axes.add_patch(_cell(row, column, BLUE if right else VERMILION, count / total))
            colour = "white" if count / total > 0.5 else INK
            axes.text(column, row, str(count), ha="center", va="center", color=colour, fontsize=8)
    axes.set_xlim(-0.5, max(len(used), 1) - 0.5)
    axes.set_ylim(max(len(kept), 1) - 0.5, -0.5)
    axes.set_xticks(range(len(used)), [_words(named[k]) for k in used], rotation=90)
    axes.set_yticks(range(len(kept)), [_words(hidden[i]) for i in kept])
    axes.tick_params(length=0)
    axes.set_xlabel("named first", color=QUIET)
    axes.set_ylabel("hidden", color=QUIET)
    for spine in axes.spines.values():
        spine.set_visible(False)
    axes.set_aspect("equal")
    return figure


def _cell(row: int, column: int, colour: str, share: float) -> Rectangle:
    from matplotlib.patches import Rectangle as Box

    return Box(
        (column - 0.46, row - 0.46), 0.92, 0.92, facecolor=colour, alpha=0.15 + 0.85 * share, lw=0
    )


def _words(name: str) -> str:
    return name.strip("()").replace("_", " ")
