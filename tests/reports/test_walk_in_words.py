"""Titles and pictures of a walk say where to, on what ground and with what load."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.api.figures import robot_drawings, stretches
from pipeline.api.pictures.scene import Scene
from pipeline.motion.gait import with_payload
from pipeline.robot.robot import Robot, load_robot
from pipeline.simulation.walk_stand import Walking, stand, walk
from reports.pages.robot_page import gait_and_conditions

LOADED = {
    "slope_left": "10 deg",
    "payload_mass": "4 kg",
    "payload_x": "100 mm",
    "payload_z": "150 mm",
}


def test_what_is_not_as_usual_is_said(hexapod: Robot) -> None:
    def said(**gait: str) -> str:
        return gait_and_conditions(hexapod.spec.with_gait(name="ripple", **gait))

    assert said() == "ripple gait"
    assert said(heading="-30 deg") == "ripple gait, heading 30° to the right"
    assert said(yaw_rate="-0.2 rad/s") == "ripple gait, turning 0.2 rad/s to the right"
    assert said(slope_forward="-5 deg", slope_left="2 deg", payload_mass="4 kg") == (
        "ripple gait, ground rising 5° behind, ground rising 2° to the left, payload 4 kg"
    )


@pytest.fixture(scope="module")
def loaded(hexapod: Robot) -> Robot:
    return with_payload(load_robot(hexapod.spec.with_gait(name="ripple", **LOADED)))


@pytest.fixture(scope="module")
def walking(loaded: Robot) -> Walking:
    return walk(loaded, {}, samples=51)


def test_a_payload_is_drawn_where_it_is_and_is_no_part_of_the_trunk(
    hexapod: Robot, loaded: Robot
) -> None:
    scene = Scene(loaded)
    ball = scene.at(scene.zero)[0][-1]
    np.testing.assert_allclose(ball.points.mean(axis=0), [0.1, 0.0, 0.15], atol=1e-3)
    volume = np.pi / 6 * float(np.ptp(ball.points[:, 2])) ** 3
    assert volume * 7850 == pytest.approx(4.0, rel=0.01)
    np.testing.assert_array_equal(scene.trunk_outline(), Scene(hexapod).trunk_outline())
    assert Scene(hexapod).load is None


def test_the_robot_is_drawn_along_the_ground_on_a_slope_too(
    loaded: Robot, walking: Walking
) -> None:
    parts = stretches(loaded, walking)
    figure = robot_drawings(Scene(loaded), stand(loaded, {}), parts)["robot"]()
    words = " ".join(t.get_text() for t in figure.texts).replace("\n", " ")
    assert "drawn along the ground" in words
    assert "ball: payload" in words
