"""The motion that decides between an effect and what imitates it on the log."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.effects.registry import EFFECTS, effect_named
from pipeline.identification.selection.deciding_motion import Rival, deciding_motion
from pipeline.logs.log_format import expected_of_model
from tests.pipeline.identification import bench_leg as leg

J2 = ("rm_joint_2",)
NAMED = Rival(effect_named("coulomb_friction"), J2, {"torque": 0.4})


@pytest.fixture(scope="module")
def log():  # type: ignore[no-untyped-def]
    return leg.measured(leg.leg_model(), leg.leg_motion())


@pytest.mark.parametrize(
    "name",
    [
        n
        for n, e in EFFECTS.items()
        if e.competes and n not in ("coulomb_friction", "internal_foot_force")
    ],
)
def test_any_effect_may_be_the_rival(name: str, log) -> None:  # type: ignore[no-untyped-def]
    model = leg.leg_model()
    effect = effect_named(name)
    if not effect.places(model, log):  # what needs the gears' temperature
        warm = np.linspace(20.0, 40.0, len(log))[:, None].repeat(3, axis=1)
        log = replace(log, temperature=warm)
    place = effect.places(model, log)[0]
    expected = expected_of_model(model.rigid, "leg", joints=model.joints)
    motion = deciding_motion(model, log, expected, NAMED, [Rival(effect, place)])
    assert motion is not None, "friction differs from every other effect on some motion"
    assert motion.misfit > 1.0
    assert (motion.position >= expected.lower - 1e-9).all()
    assert (motion.position <= expected.upper + 1e-9).all()
    speed = np.abs(np.diff(motion.position, axis=0)).max(axis=0) / np.diff(motion.time).min()
    assert (speed <= expected.velocity_limit * 1.01).all()
    # At rest at both ends, without a jump of the acceleration.
    rate = 1.0 / np.diff(motion.time).min()
    acceleration = np.diff(motion.position, 2, axis=0) * rate**2
    assert np.abs(acceleration[[0, -1]]).max() < 0.05 * np.abs(acceleration).max()
    assert np.abs(motion.position[[1, -2]] - motion.position[[0, -1]]).max() < 1e-4


def test_the_effect_itself_cannot_be_told_apart(log) -> None:  # type: ignore[no-untyped-def]
    model = leg.leg_model()
    expected = expected_of_model(model.rigid, "leg", joints=model.joints)
    same = Rival(effect_named("coulomb_friction"), J2)
    assert deciding_motion(model, log, expected, NAMED, [same]) is None
