"""A missing knee branch is told as such, with postures to choose from; a far foot as far."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from pipeline.errors import GaitError, OutOfReachError
from pipeline.robot.inverse.inverse_kinematics import neutral_postures
from pipeline.robot.robot import Robot


def with_legs(robot: Robot, **changes: object) -> Robot:
    legs = tuple(replace(leg, **changes) for leg in robot.spec.legs)  # type: ignore[arg-type]
    return replace(robot, spec=replace(robot.spec, legs=legs))


def test_every_offered_posture_is_a_start_that_arrives(hexapod: Robot) -> None:
    """The knee the other way lies beyond the limits; each offer, pasted in, is taken."""
    lost = with_legs(hexapod, start_posture=(0.0, -1.0, 3.0))
    with pytest.raises(GaitError, match="start_posture lies on another branch") as caught:
        neutral_postures(lost)
    offers = re.findall(r"legs\.(\w+): \[([^\]]*)\]", str(caught.value))
    assert [leg for leg, _ in offers] == list(hexapod.leg_names)
    legs = tuple(
        replace(leg, start_posture=tuple(float(x) for x in offer.split(",")))
        for leg, (_, offer) in zip(hexapod.spec.legs, offers, strict=True)
    )
    mended = replace(hexapod, spec=replace(hexapod.spec, legs=legs))
    np.testing.assert_allclose(neutral_postures(mended), neutral_postures(hexapod), atol=1e-9)


def test_a_foot_out_of_reach_is_as_far_as_the_stretched_leg_leaves_it(hexapod: Robot) -> None:
    """Straight out from joint 1, coxa, femur and tibia in one line: what is left is geometry."""
    p = hexapod.spec.parameters
    hip = p["joint_2_lateral"] - p["coxa_length"]
    reach = hip + p["coxa_length"] + p["femur_length"] + p["tibia_length"]
    legs = tuple(
        replace(leg, neutral_foot=(0.0, -reach - 0.0736, 0.0)) if leg.name == "rm" else leg
        for leg in hexapod.spec.legs
    )
    far = replace(hexapod, spec=replace(hexapod.spec, legs=legs))
    with pytest.raises(OutOfReachError, match=r"leg 'rm' .* lies 73\.6 mm beyond its reach"):
        neutral_postures(far)


def test_limits_that_forbid_every_branch_are_named(hexapod: Robot) -> None:
    legs = tuple(
        replace(leg, neutral_foot=(0.05, -0.14, -0.29)) if leg.name == "rf" else leg
        for leg in hexapod.spec.legs
    )
    narrow = replace(hexapod, spec=replace(hexapod.spec, legs=legs))
    with pytest.raises(GaitError, match=r"'rf_joint_\d' would\s+have to reach .* its limits are"):
        neutral_postures(narrow)
