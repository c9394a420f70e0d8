"""What a motor is ahead of its joint: a line is a spring, a step is play."""

import numpy as np
import pytest

from actuators.arrays import Array
from pipeline.identification.two_positions import read_off, two_sides
from tests.pipeline.logs.made import made_log, motion, reduced_log


def twisted(
    compliance: float, width: float, loop: float = 0.0, noise: float = 1e-5
) -> tuple[Array, Array, Array]:
    rng = np.random.default_rng(9)
    _, q, v, _ = motion(6000)
    torque = 20 * np.sin(q[:, 0]) + 6 * np.cos(3 * q[:, 1])
    ahead = (
        0.4 + compliance * torque + 0.5 * width * np.sign(torque) + 0.5 * loop * np.sign(v[:, 0])
    )
    return ahead + rng.normal(0, noise, ahead.size), torque, v[:, 0]


@pytest.mark.parametrize(
    ("compliance", "width"), [(2e-4, 0.0), (1e-5, 5e-3), (2e-4, 5e-3), (0.0, 0.0)]
)
def test_a_line_is_a_spring_and_a_step_is_play(compliance: float, width: float) -> None:
    ahead, torque, v = twisted(compliance, width)
    ok = np.ones(v.size, dtype=np.bool_)
    seen = read_off(ahead, torque, v, ok, noise=0.05, rest=0.05)
    assert seen is not None
    assert seen.compliance[0] == pytest.approx(compliance, abs=4 * seen.compliance[1] + 1e-8)
    assert seen.width[0] == pytest.approx(width, abs=4 * seen.width[1] + 1e-6)
    assert seen.plays == (width > 0)
    assert seen.elastic == (compliance > 0)


def test_a_log_with_both_positions_says_what_its_gears_do() -> None:
    rng = np.random.default_rng(10)
    _, q, _, a = motion(6000)
    effort = 0.1 * a + 20 * np.sin(q) + rng.normal(0, 0.02, q.shape)
    motor = q + rng.normal(0, 1e-6, q.shape)
    motor[:, 0] += 3e-4 * (0.1 * a + 20 * np.sin(q))[:, 0]
    log = made_log(q + rng.normal(0, 1e-6, q.shape), effort, motor_position=motor)
    seen = two_sides(reduced_log(log))
    assert seen["a"].stiffness[0] == pytest.approx(1 / 3e-4, rel=0.03)
    assert not seen["b"].elastic
