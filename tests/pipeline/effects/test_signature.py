"""An effect's signature names a variable that can be drawn, each another one."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pipeline.api.gap.figures import signature_variable
from pipeline.effects.base import SIGNATURES, Effect
from pipeline.effects.registry import effect_named
from pipeline.logs.errors import EffectError

LOG: Any = SimpleNamespace(
    joints=("near", "far"),
    channels=("current",),
    time=np.zeros(3),
    q=np.zeros((3, 2)),
    v=np.zeros((3, 2)),
    a=np.zeros((3, 2)),
    derivative=lambda x: x,
    lowpass=lambda x: x,
)
PREDICTION: Any = SimpleNamespace(torque=np.zeros((3, 2)), effort=np.zeros((3, 2, 1)))


def test_every_signature_is_a_variable_of_its_own() -> None:
    labels = {
        name: signature_variable(name, LOG, PREDICTION, 0, ("near", "far"))[0]
        for name in SIGNATURES
        if name != "support"  # the load, too: on the leg that stands
    }
    assert len(set(labels.values())) == len(labels)


def test_a_signature_that_nothing_draws_is_refused_where_the_effect_is_written() -> None:
    with pytest.raises(EffectError, match=r"Misread: no signature 'speed'; known: .*velocity"):
        type("Misread", (Effect,), {"signature": "speed"})


@pytest.mark.parametrize(
    ("name", "kinds"),
    [
        *((name, ("compliance",)) for name in ("backlash", "joint_elasticity")),
        ("torque_constant_error", ("torque_constant",)),
        ("effort_offset", ("effort_zero",)),
        ("position_offset", ("encoder",)),
        ("coulomb_friction", ()),
    ],
)
def test_tolerances_that_are_an_effect_in_small_are_left_out_at_its_place(
    name: str, kinds: tuple[str, ...]
) -> None:
    assert effect_named(name).absorbs(("here",)) == tuple((kind, "here") for kind in kinds)
