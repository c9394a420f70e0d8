"""Which texts a figure's edge cuts."""

from __future__ import annotations

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from reports.figures.style import arrange, house_style


def outside(figure: Figure) -> list[str]:
    """Texts that are drawn and cut by the figure's edge."""
    with house_style():
        arrange(figure)
        renderer = FigureCanvasAgg(figure).get_renderer()
        figure.draw(renderer)
        unseen = {
            id(label)
            for axes in figure.axes
            for axis in (axes.xaxis, axes.yaxis)
            for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks())
            if not axes.axison or not _within(tick.get_loc(), axis.get_view_interval())
            for label in (tick.label1, tick.label2)
        }
        cut = []
        for text in figure.findobj(Text):
            if text.get_visible() and text.get_text().strip() and id(text) not in unseen:
                box, edge = Text.get_window_extent(text, renderer), figure.bbox
                inside = edge.x0 - 1 <= box.x0 and box.x1 <= edge.x1 + 1
                if not (inside and edge.y0 - 1 <= box.y0 and box.y1 <= edge.y1 + 1):
                    cut.append(text.get_text())
    return cut


def _within(place: float, ends: object) -> bool:
    low, high = sorted(ends)  # type: ignore[call-overload]
    return bool(low <= place <= high)
