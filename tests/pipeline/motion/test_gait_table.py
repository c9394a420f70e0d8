"""What a table ``[gait]`` may say, what follows from it, and what is refused in one line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from actuators.errors import LegwattError
from pipeline.motion.gait import gait_of, with_payload
from pipeline.motion.support import standing_posture
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import RobotSpec, load_robot_file

LEGS = ("lf", "lm", "lr", "rf", "rm", "rr")


@pytest.fixture(scope="module")
def spec(root: Path) -> RobotSpec:
    return load_robot_file(root / "urdf" / "hexapod.toml")


@pytest.mark.parametrize(
    ("gait", "message"),
    [
        ({"perod": "3 s"}, r"unknown key 'perod'.* 'period'"),
        ({"period": 3}, r"'period'.* 3 has no unit; expected such as '1 s'"),
        ({"period": "0.049 s"}, r"0\.049 s: must be from 0\.05 to 1000 s"),
        ({"speed": "20.1 m/s"}, r"20\.1 m/s: must be from 0 to 20 m/s"),
        ({"phase": {"lf": 0.8}}, r"says nothing of lm, lr, rf, rm, rr"),
        ({"name": "crowl"}, r"gait: 'name': no gait 'crowl': did you mean 'crawl'\?"),
        ({"name": "wave", "phase": dict.fromkeys(LEGS, 0)}, r"gait\.name and gait\.phase both"),
        ({"name": "crawl"}, r"'crawl' is for 4 legs, the robot has 6; wave is for any"),
        ({"duty_factor": 0.45}, r"only 0 feet stand .*raise gait\.duty_factor"),
        ({"stability_margin": "1 cm"}, r"state gait\.sway = 'least', too"),
    ],
)
def test_one_line_says_what_is_wrong_with_a_gait(
    spec: RobotSpec, gait: dict[str, Any], message: str
) -> None:
    with pytest.raises(LegwattError, match=message) as refused:
        gait_of(replace(spec, gait=gait))
    assert "\n" not in str(refused.value)
    assert str(refused.value).startswith(f"{spec.path}: ")


@pytest.mark.parametrize(
    ("stated", "speed", "period", "stroke"),
    [
        ({}, 0.16, 3.0, 0.24),
        ({"speed": "0.12 m/s"}, 0.12, 4.0, 0.24),
        ({"speed": "0.1 m/s", "stroke": "0.1 m", "period": "2 s"}, 0.1, 2.0, 0.1),
    ],
)
def test_two_of_speed_period_and_stroke_give_the_third(
    spec: RobotSpec, stated: dict[str, Any], speed: float, period: float, stroke: float
) -> None:
    gait = gait_of(spec.with_gait(**stated))
    found = (gait.speed, gait.period, gait.strokes.max())
    assert found == pytest.approx((speed, period, stroke))


def test_a_payload_counts_in_mass_and_shifts_the_centre(spec: RobotSpec) -> None:
    plain = load_robot(spec)
    payload = {"payload_mass": "10 kg", "payload_x": "120 mm", "payload_z": "0.2 m"}
    loaded = with_payload(load_robot(spec.with_gait(**payload)))
    assert with_payload(plain) is plain
    q = standing_posture(plain).configuration[0]
    before = pin.centerOfMass(plain.model, plain.model.createData(), q)
    after = pin.centerOfMass(loaded.model, loaded.model.createData(), q)
    moment = before * plain.mass + 10 * np.array([0.12, 0, 0.2])
    np.testing.assert_allclose(after * (plain.mass + 10), moment)
