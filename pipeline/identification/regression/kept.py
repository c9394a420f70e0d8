"""Which columns of a least-squares problem are kept from one estimate to the next."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.effects.base import Place
from pipeline.effects.registry import EFFECTS

Array = NDArray[np.float64]


@dataclass(frozen=True)
class EffectKey:
    """Which columns of an effect these are.

    Attributes:
        log: Number of the log.
        effect: Its name.
        place: Where.
        shape: Its nonlinear parameters.
        coordinates: In which it is fitted; an effect may have several forms.
    """

    log: int
    effect: str
    place: Place
    shape: tuple[tuple[str, float], ...]
    coordinates: tuple[str, ...]

    @property
    def additive(self) -> bool:
        """Whether effects of a joint hardly change it."""
        effect = EFFECTS[self.effect]
        return effect.additive or effect.rescales


@dataclass(frozen=True)
class ToleranceKey:
    """Which column of a tolerance this is.

    Attributes:
        log: Number of the log.
        kind: Of the tolerance.
        place: Where.
    """

    log: int
    kind: str
    place: str

    @property
    def additive(self) -> bool:
        """Whether effects of a joint hardly change it: a tolerance is small."""
        return True


#: Columns in one log, each by the joints on which it acts.
Kept = dict[EffectKey | ToleranceKey, list[dict[int, Array]]]
