"""Every effect's signature names a variable that can be drawn, each another one."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from pipeline.effects.registry import EFFECTS
from reports.figures.gap_run import signature_variable

NOTHING = np.zeros((3, 2))
LOG: Any = SimpleNamespace(
    **{"joints": ("near", "far"), "channels": ("current",), "time": np.zeros(3)},
    **dict.fromkeys("qva", NOTHING),
    **dict.fromkeys(("derivative", "lowpass"), lambda x: x),
)
PREDICTION: Any = SimpleNamespace(torque=NOTHING, effort=NOTHING[..., None])


def test_every_signature_is_a_variable_of_its_own() -> None:
    # The support is drawn over the load, too, where a leg stands.
    names = {effect.signature for effect in EFFECTS.values()} - {"support"}
    drawn = {signature_variable(n, LOG, PREDICTION, 0, ("near", "far"))[0] for n in names}
    assert len(drawn) == len(names) > 5
