"""What the fit's study says of computed quantities, and the lines of Fig. 21.

The study is frozen: `known.csv` and `bands.csv` hold the middle 95 % of what data sheets and
literature say before anything is fitted (*prior*), and of sets fitted without a figure (*left
out*).
"""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from actuators.arrays import Array
from pipeline.paper.judgement.basis import STUDY
from pipeline.paper.published import CYCLE
from pipeline.paper.quantities import CROSSING

MINUTE = 60.0  # [s]
Interval = tuple[float, float]
NONE: Interval = (math.nan, math.nan)


@cache
def known() -> Mapping[tuple[str, str], Mapping[str, Any]]:
    """Fields of rows, by table and id: see `pipeline.paper.judgement.rows.Row`."""
    names = ("prior", "prior_share", "left_out", "left_out_share", "posterior_share", "remark")
    out = {}
    with (STUDY / "known.csv").open(encoding="utf-8", newline="") as file:
        for table, name, *cells, remark in [*csv.reader(file)][1:]:
            a, b, share, c, d, *others = (float(cell or "nan") for cell in cells)
            own = ((a, b), share, (c, d), *others, remark)
            out[table, name] = dict(zip(names, own, strict=True))
    return out


@dataclass(frozen=True)
class EnergyPerMinute:
    """Energy in a minute against the fraction of it spent standing, of both middle legs."""

    subject: str  #: `CROSSING`.
    alternative: str  #: Name.
    fraction: Array  #: (F,) [1].
    energy: Array  #: (F,) [J].
    prior: Array | None  #: 95 % of what data sheets and literature say, (2, F) [J].
    left_out: Array | None  #: 95 % of the sets without this actuator's walking figures, (2, F) [J].


def per_minute(
    costs: Mapping[str, float], names: Mapping[str, object], *, with_bands: bool
) -> tuple[EnergyPerMinute, ...]:
    """The line of every alternative, with what the study says of it; for the costs `pair_costs`."""
    fraction = np.linspace(0.0, 1.0, 101)
    bands: dict[str, list[list[float]]] = {name: [] for name in names}
    if with_bands:
        with (STUDY / "bands.csv").open(encoding="utf-8", newline="") as file:
            for name, _, *ends in [*csv.reader(file)][1:]:
                bands[name].append([float(end or "nan") for end in ends])
    lines = []
    for name, rows in bands.items():
        walking = (1 - fraction) * (costs[f"{name} cycle_J"] / CYCLE)  # [W]
        energy = MINUTE * (walking + fraction * costs[f"{name} stand_W"])
        both = np.array(rows).T if rows else np.full((4, fraction.size), np.nan)
        prior, left_out = (None if np.isnan(b).any() else b for b in (both[:2], both[2:]))
        lines.append(EnergyPerMinute(CROSSING, name, fraction, energy, prior, left_out))
    return tuple(lines)
