"""Stretches of made-up walks, for figures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from reports.figures.demand import Stretch


def stretch(
    time: np.ndarray, legs: Sequence[str], stance: Sequence[str], joints: int = 1, **given: object
) -> Stretch:
    """A stretch of zeros but for what is given."""
    n, count = len(time), len(legs)
    columns = {"velocity": joints, "torque": joints, "normal": count, "friction": count}
    values: dict[str, object] = {name: np.zeros((n, size)) for name, size in columns.items()}
    values |= {"feet": np.zeros((n, count, 3)), "mass_centre": np.zeros((n, 3))}
    values |= {"margin": np.full(n, 0.05)} | given
    return Stretch(time=time, stance=tuple(stance), **values)  # type: ignore[arg-type]


def crawl() -> list[Stretch]:
    """Four feet, one of which swings in each stretch."""
    legs = ("lf", "rf", "lh", "rh")
    out = []
    for k in range(4):
        t = np.linspace(k, k + 1, 21)
        feet = np.zeros((21, 4, 3))
        feet[..., :2] = [[0.3, 0.2], [0.3, -0.2], [-0.3, 0.2], [-0.3, -0.2]]
        phase = (t[:, None] - np.arange(4)) % 4
        feet[..., 0] += np.where(phase < 1, -0.06 + 0.12 * phase, 0.06 - 0.04 * (phase - 1))
        feet[:, k, 2] = 0.05 * np.sin(np.pi * (t - k))
        margin = 0.02 + 0.01 * k + 0.01 * np.cos(t)
        stance = [name for i, name in enumerate(legs) if i != k]
        out.append(stretch(t, legs, stance, feet=feet, margin=margin))
    return out
