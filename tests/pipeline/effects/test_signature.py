"""An effect's signature names a variable that can be drawn, each another one."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from actuators.errors import LegwattError
from pipeline.effects.base import SIGNATURES, Effect
from reports.figures.gap_run import signature_variable

NOTHING = np.zeros((3, 2))
LOG: Any = SimpleNamespace(
    **{"joints": ("near", "far"), "channels": ("current",), "time": np.zeros(3)},
    **dict.fromkeys("qva", NOTHING),
    **dict.fromkeys(("derivative", "lowpass"), lambda x: x),
)
PREDICTION: Any = SimpleNamespace(torque=NOTHING, effort=NOTHING[..., None])


def test_every_signature_is_a_variable_of_its_own() -> None:
    names = [name for name in SIGNATURES if name != "support"]  # the load, too, where a leg stands
    drawn = (signature_variable(n, LOG, PREDICTION, 0, ("near", "far"))[0] for n in names)
    assert len(set(drawn)) == len(names)
    with pytest.raises(LegwattError, match=r"Misread: no signature 'speed'; known: .*velocity"):
        type("Misread", (Effect,), {"signature": "speed"})
