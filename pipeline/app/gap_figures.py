"""Which figures a run of `gap` draws, and from what."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline.gap.circumstances import WHOLE, Where
from reports.figures.gap_where import WhereGroup, where_map_figure
from reports.figures.save import save_figure

#: Ways of sorting in the order in which the map shows them.
SHOWN = (WHOLE, "phase", "direction", "speed", "load", "power", "reversal", "position", "time")
TITLES = {WHOLE: "all rows", "power": "joint is"}


def write_where_map(rows: Sequence[Where], joints: Sequence[str], robot: str, out: Path) -> None:
    """Draw `where_map`."""
    ratio = {(r.joint, r.by, r.band): r.gap / r.noise_floor for r in rows if r.noise_floor > 0}
    groups = []
    for by in SHOWN:
        bands = tuple(dict.fromkeys(r.band for r in _in_order(rows) if r.by == by))
        if not bands:
            continue
        table = np.array([[ratio.get((j, by, band), np.nan) for band in bands] for j in joints])
        groups.append(WhereGroup(TITLES.get(by, by), bands, table))
    figure = where_map_figure(
        joints,
        groups,
        title=f"{robot}: where model and machine disagree",
        subtitle="root mean square gap in units of the noise floor; 1 is noise",
    )
    save_figure(figure, out, "where_map")


#: Order of bands within a group; bands not listed keep the order of their ranks.
_ORDER = (
    *("support", "transfer", "negative", "positive", "slow", "light", "low", "first", "middle"),
    *("fast", "heavy", "high", "last", "driving", "driven", "near", "away"),
)


def _in_order(rows: Sequence[Where]) -> list[Where]:
    place = {band: k for k, band in enumerate(_ORDER)}
    return sorted(rows, key=lambda r: place.get(r.band, len(place)))
