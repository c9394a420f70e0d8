"""How far a supply's voltage falls under its current.

V = V0 - R I - a t        (Plett, Battery Management Systems I, section 2.3)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.identification.supply.regression import BLOCKS, DRAWS, SEED, SMALLEST
from pipeline.identification.supply.samples import Samples


@dataclass(frozen=True)
class Sag:
    """A supply's resistance with its 95 % interval, and how it shows."""

    resistance: float  #: [ohm].
    low: float  #: Lower end [ohm].
    high: float  #: Upper end [ohm].
    voltage: float  #: Without current, at the first sample [V].
    #: Mean power that the resistance turns into heat before the voltage is measured [W].
    lost: float


def sag_of(samples: Sequence[Samples]) -> Sag | None:
    """The supply's resistance; None where voltage and current were not both measured.

    Each log has a voltage without current and a slope in time of its own: a battery runs down.
    """
    if not all(s.measured and np.isfinite(s.current).all() for s in samples):
        return None
    x, y, block = [], [], []
    for k, s in enumerate(samples):
        own = np.zeros((s.end.size, 1 + 2 * len(samples)))
        own[:, 0] = -s.current
        own[:, 1 + 2 * k], own[:, 2 + 2 * k] = 1.0, s.end - s.end[0]
        x.append(own)
        y.append(s.voltage)
        count = max(1, min(BLOCKS, s.end.size // SMALLEST))
        block.append(k * BLOCKS + np.arange(s.end.size) * count // s.end.size)
    design, volts, number = np.concatenate(x), np.concatenate(y), np.concatenate(block)
    current = -design[:, 0]
    if np.ptp(current) == 0.0:
        return None
    found = np.linalg.lstsq(design, volts, rcond=None)[0]
    rows = [np.flatnonzero(number == b) for b in np.unique(number)]
    rng = np.random.default_rng(SEED)
    draws = []
    for _ in range(DRAWS):
        kept = np.concatenate([rows[b] for b in rng.integers(0, len(rows), len(rows))])
        draws.append(np.linalg.lstsq(design[kept], volts[kept], rcond=None)[0][0])
    low, high = np.quantile(draws, [0.025, 0.975])
    lost = float(found[0] * np.mean(current**2))
    return Sag(float(found[0]), float(low), float(high), float(found[1]), lost)
