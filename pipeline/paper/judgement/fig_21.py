"""Fig. 21: energy in a minute against the share of it spent standing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuators.arrays import Array
from pipeline.paper.hexapod import Totals
from pipeline.paper.judgement.evidence import BAND, LEFT_OUT_BY, SUBJECTS, Sets
from pipeline.paper.published import CYCLE

MINUTE = 60.0  # [s]


@dataclass(frozen=True)
class EnergyPerMinute:
    """Energy in a minute against the fraction of it spent standing."""

    subject: str  #: Key of `SUBJECTS`.
    alternative: str  #: Name.
    fraction: Array  #: (F,) [1].
    energy: Array  #: (F,) [J].
    prior: Array | None  #: 95 % of what data sheets and literature say, (2, F) [J].
    left_out: Array | None  #: 95 % of the sets without this actuator's walking figures, (2, F) [J].


def per_minute(whole: Totals, sets: Sets) -> tuple[EnergyPerMinute, ...]:
    """The line of every subject and alternative, with what the sets say of it."""
    fraction = np.linspace(0.0, 1.0, 101)

    def energy(cycle: Array, stand: Array) -> Array:
        """Of powers walking and standing, (W,) each [J, W]: (W, F) [J]."""
        walking = (1 - fraction) * (cycle / CYCLE)[:, None]  # [W]
        return MINUTE * (walking + fraction * stand[:, None])

    def line(subject: str, name: str) -> EnergyPerMinute:
        def band(key: str) -> Array | None:
            if key not in sets or sets[key].empty:
                return None
            columns = (sets[key][f"{name} {total}"].to_numpy() for total in SUBJECTS[subject])
            return np.quantile(energy(*columns), BAND, axis=0)

        (ours,) = energy(*(np.array([whole[name][total]]) for total in SUBJECTS[subject]))
        left_out = LEFT_OUT_BY.get(f"walking_ratio_{name}", "")
        return EnergyPerMinute(subject, name, fraction, ours, band("prior"), band(left_out))

    return tuple(line(subject, name) for subject in SUBJECTS for name in whole)
