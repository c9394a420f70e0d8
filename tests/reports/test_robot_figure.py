"""Pictures of the robot are its URDF's: hulls, missing meshes, joint axes."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import coal
import matplotlib
import numpy as np
import pinocchio as pin
import pytest

from pipeline.dynamics.joint_demand import segment_demand
from pipeline.motion.gait import with_payload
from pipeline.motion.support import standing_posture
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from reports.figures.robot import FRONT, OBLIQUE, SIDE, TOP, draw_robot, robot_figure
from reports.figures.style import new_figure
from reports.scene import Leg, Scene, Solid, corners
from tests.pipeline.commands.robots import own_robot
from tests.reports.outside import outside

X, Y = np.eye(3)[:2]
CUBE = np.array([[i, j, k] for i in (-0.5, 0.5) for j in (-0.5, 0.5) for k in (-0.5, 0.5)])


@pytest.mark.parametrize(
    ("shape", "size"),
    [
        (coal.Box(1.0, 2.0, 3.0), [1, 2, 3]),
        (coal.Sphere(0.5), [1, 1, 1]),
        (coal.Cylinder(0.5, 3.0), [1, 1, 3]),
        (coal.Capsule(0.5, 2.0), [1, 1, 3]),
    ],
)
def test_corners_span_the_shape(shape: Any, size: list[float]) -> None:
    np.testing.assert_allclose(np.ptp(corners(shape), axis=0), size, rtol=0.1)


def test_missing_meshes_are_said_and_move_no_number(root: Path, tmp_path: Path) -> None:
    """The hexapod, and the same with a trunk that is a mesh nobody has."""
    with_box = load_robot(load_robot_file(root / "urdf" / "hexapod.toml"))
    path = own_robot(
        root, tmp_path, r"<box size=[^>]*/>", '<mesh filename="package://nobody/trunk.dae"/>'
    )
    without = load_robot(load_robot_file(path))
    scene = Scene(without)
    assert "trunk.dae" in scene.remark
    assert "numbers do not depend on meshes" in scene.remark
    assert Scene(with_box).remark == ""
    robot_figure(*scene.at(zero(without)), title="t")
    torque = [segment_demand(r, standing_posture(r))[0].torque for r in (with_box, without)]
    np.testing.assert_allclose(torque[0], torque[1], rtol=0, atol=1e-9)


def zero(robot: Robot) -> np.ndarray:
    """The configuration in which every joint is at zero."""
    return robot.configuration(np.zeros((1, len(robot.joints))), np.zeros((1, 3)))[0]


@pytest.mark.parametrize("name", ["hexapod", "solo12"])
def test_the_trunk_has_the_size_of_its_shape(root: Path, name: str) -> None:
    """A box, and a mesh of a package."""
    scene = Scene(load_robot(load_robot_file(root / "urdf" / f"{name}.toml")))
    size = {"hexapod": [0.6, 0.22, 0.12], "solo12": [0.45, 0.2, 0.06]}[name]
    assert scene.remark == ""
    trunk = scene.at(zero(scene.robot))[0][0]
    np.testing.assert_allclose(np.ptp(trunk.points, axis=0), size, rtol=0.15)


def test_each_link_is_the_outline_of_its_hull_the_nearest_last() -> None:
    red, blue = np.eye(3)[[0, 2]]
    leg = Leg("a", X[None], Y[None], (False,), X)
    far, near = Solid(CUBE, red), Solid(CUBE + [2.0, 0, 0], blue)
    for solids in ([far, near], [near, far]):
        axes = new_figure(2).subplots()
        draw_robot(axes, FRONT, solids, [leg])
        first, last = axes.patches  # x = 2 is nearer to a viewer ahead
        assert first.get_facecolor()[0] > last.get_facecolor()[0]
        np.testing.assert_allclose(np.ptp(first.get_xy(), axis=0), [1.0, 1.0])


def test_views_are_right_handed_and_look_where_they_say() -> None:
    for view in (FRONT, SIDE, TOP, OBLIQUE):
        np.testing.assert_allclose(view @ view.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(view) == pytest.approx(1.0)
    assert (FRONT @ Y)[0] == pytest.approx(1)  # from ahead its left is on our right
    assert (TOP @ Y)[1] == pytest.approx(1)
    assert (SIDE @ X)[0] == pytest.approx(1)


def test_axes_are_those_of_the_urdf(hexapod: Robot) -> None:
    scene = Scene(hexapod)
    data = hexapod.model.createData()
    pin.forwardKinematics(hexapod.model, data, zero(hexapod))
    for spec, leg in zip(hexapod.spec.legs, scene.at(zero(hexapod))[1], strict=True):
        for joint, position, axis in zip(spec.joints, leg.position, leg.axis, strict=True):
            pattern = rf'<joint name="{joint}".*?<axis xyz="([^"]*)"'
            found = re.search(pattern, hexapod.urdf, flags=re.S)
            assert found is not None
            own = np.array([float(part) for part in found[1].split()])
            placed = data.oMi[hexapod.model.getJointId(joint)]
            np.testing.assert_allclose(axis, placed.rotation @ own, atol=1e-12)
            np.testing.assert_allclose(position, placed.translation, atol=1e-12)


def test_every_link_is_placed_in_the_posture(hexapod: Robot) -> None:
    scene = Scene(hexapod)
    q = standing_posture(hexapod, hexapod.leg_names).configuration[0]
    solids, legs = scene.at(q)
    assert len(solids) == hexapod.urdf.count("<visual>")
    lowest = min(float(solid.points[:, 2].min()) for solid in solids)
    assert lowest == pytest.approx(min(leg.foot[2] for leg in legs), abs=0.03)
    figure = robot_figure(solids, legs, title="t", mass_centre=np.zeros(3))
    words = {t.get_text() for t in figure.findobj(matplotlib.text.Text)}
    assert {"RM", "LF"} <= words
    assert outside(figure) == []


def test_a_robot_without_shapes_is_drawn_as_lines(hexapod: Robot) -> None:
    bare = re.sub(r"<(visual|collision)>.*?</\1>", "", hexapod.urdf, flags=re.S)
    scene = Scene(replace(hexapod, urdf=bare))
    solids, legs = scene.at(zero(scene.robot))
    assert not solids
    lines = robot_figure(solids, legs, title="t").axes[1].lines
    np.testing.assert_allclose(lines[0].get_xydata()[-1], legs[0].foot[:2])


def test_a_payload_is_a_ball_of_steel_where_it_is(hexapod: Robot) -> None:
    gait = {"payload_mass": "4 kg", "payload_x": "100 mm", "payload_z": "150 mm"}
    scene = Scene(with_payload(load_robot(hexapod.spec.with_gait(**gait))))
    ball = scene.at(zero(scene.robot))[0][-1]
    np.testing.assert_allclose(ball.points.mean(axis=0), [0.1, 0.0, 0.15], atol=1e-3)
    volume = np.pi / 6 * float(np.ptp(ball.points[:, 0])) ** 3
    assert volume * 7850 == pytest.approx(4.0, rel=0.01)
