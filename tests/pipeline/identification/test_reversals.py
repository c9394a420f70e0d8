"""How a joint's dry friction changes its sense is found before laws compete, and kept by all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.effects.base import effect_named
from pipeline.identification.answer import identify
from pipeline.identification.design import make_data_sets
from pipeline.identification.offered import reversals
from tests.pipeline.identification import bench_leg as leg

J2 = "rm_joint_2"


@pytest.mark.parametrize("law", [{"rise": 0.05}, {"travel": 3e-3}])
def test_a_slow_change_is_no_break_away(law: dict[str, float]) -> None:
    nominal, motion = leg.leg_model(), leg.leg_motion(duration=8.0)
    motion = replace(motion, mask=np.ones_like(motion.mask))
    rubbing = effect_named("coulomb_friction").apply(nominal, (J2,), {"torque": 0.4, **law})
    log = leg.only(leg.measured(rubbing, motion), ("current",))
    found = reversals(nominal, make_data_sets([log]))
    assert list(found) == [J2]
    ((name, value),) = found[J2].items()
    assert {name} == set(law)
    assert value == pytest.approx(law[name], rel=0.3)
    told = {(f.effect, f.place) for f in identify(nominal, [log]).found if f.kept}
    assert told == {("coulomb_friction", (J2,))}


def test_a_jump_is_kept() -> None:
    nominal, motion = leg.leg_model(), leg.leg_motion(duration=8.0)
    log = leg.only(leg.measured(nominal, motion), ("current",))
    assert reversals(nominal, make_data_sets([log])) == {}
