"""The robot's pictures are measured from the robot: dimensions, directions, what hides what."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
import pinocchio as pin
import pytest

from pipeline.api.pictures.scene import Scene
from pipeline.errors import FigureError
from pipeline.motion.support import standing_posture
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from reports.figures.robot.joint_directions import joint_directions_figure
from reports.figures.robot.projection import FRONT, OBLIQUE, SIDE, TOP, draw_scene, extent
from reports.figures.robot.robot_view import robot_figure
from reports.figures.robot.solids import Leg, Solid, box, sphere
from reports.figures.robot.visuals import read_visuals
from reports.figures.style import new_figure


def standing(robot: Robot) -> tuple[list[Solid], list[Leg]]:
    return Scene(robot).at(standing_posture(robot, robot.leg_names).configuration[0])


def texts(figure) -> list[str]:
    return [t.get_text() for t in figure.findobj(matplotlib.text.Text) if t.get_text()]


@pytest.mark.parametrize("name", ["hexapod", "hexapod_axis90"])
def test_axes_are_those_of_the_urdf(root: Path, name: str) -> None:
    """A joint that turns by a little moves its child about the axis, by the URDF's numbers."""
    robot = load_robot(load_robot_file(root / "urdf" / f"{name}.toml"))
    scene = Scene(robot)
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, scene.zero)
    for leg in scene.legs(scene.zero):
        for joint in leg.joints:
            pattern = rf'<joint name="{joint.name}".*?<axis xyz="([^"]*)"'
            found = re.search(pattern, robot.urdf, flags=re.S)
            assert found is not None
            own = np.array([float(part) for part in found[1].split()])
            placed = data.oMi[robot.model.getJointId(joint.name)]
            np.testing.assert_allclose(joint.axis, placed.rotation @ own, atol=1e-12)
            np.testing.assert_allclose(joint.position, placed.translation, atol=1e-12)


def test_every_visual_is_drawn(hexapod: Robot) -> None:
    scene, legs = standing(hexapod)
    assert len(scene) == hexapod.urdf.count("<visual>")
    assert len(legs) == 6
    low, high = extent(SIDE, scene)
    assert high[0] - low[0] >= 0.6


def test_robot_figure_states_the_dimensions_of_table_one(hexapod: Robot) -> None:
    scene, legs = standing(hexapod)
    figure = robot_figure(scene, legs, title="t", mass_centre=np.zeros(3))
    words = texts(figure)
    for expected in ("600 mm", "520 mm", "180 mm", "340 mm", "270 mm", "RM", "LF"):
        assert expected in words
    assert len(figure.axes) == 4


def test_a_robot_without_boxes_is_drawn_as_sticks_and_its_trunk_not_measured(
    hexapod: Robot,
) -> None:
    """Spheres alone, as of a URDF whose links are meshes: no sphere is taken for the trunk."""
    shown = re.sub(r"<box size=[^>]*/>", "", hexapod.urdf)
    scene = Scene(replace(hexapod, urdf=shown))
    assert "legs without shapes in the URDF: sticks" in scene.remark
    posture = standing_posture(hexapod, hexapod.leg_names).configuration[0]
    solids, legs = scene.at(posture)
    words = texts(robot_figure(solids, legs, title="t"))
    assert "600 mm" not in words
    for expected in ("520 mm", "180 mm", "340 mm", "270 mm", "RM"):
        assert expected in words
    whole = Scene(hexapod)
    assert whole.remark == ""
    links = [solid for solid in whole.at(posture)[0] if solid.body > 1]
    assert "600 mm" not in texts(robot_figure(links, legs, title="t"))


def test_joint_directions_names_the_joints(hexapod: Robot) -> None:
    scene, legs = standing(hexapod)
    figure = joint_directions_figure(scene, legs, "rm", title="t", zero_pose="straight")
    words = texts(figure)
    for expected in ("1 rm_joint_1", "2 rm_joint_2", "3 rm_joint_3"):
        assert expected in words
    assert any("Zero pose: straight" in word for word in words)


def test_a_lateral_first_axis_is_shown_from_the_side(hexapod: Robot, root: Path) -> None:
    turned = load_robot(load_robot_file(root / "urdf" / "hexapod_axis90.toml"))
    for robot, view in ((hexapod, TOP), (turned, SIDE)):
        scene, legs = standing(robot)
        figure = joint_directions_figure(scene, legs, "rm", title="t")
        assert figure.axes[2].get_title(loc="left") == view.name
        assert "1" in [t.get_text() for t in figure.axes[2].texts]


def placed(solid: Solid, x: float) -> Solid:
    return solid.moved(pin.SE3(np.eye(3), np.array([x, 0.0, 0.0])).homogeneous)


def test_the_nearer_body_hides_the_farther_one() -> None:
    red, blue = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
    size = np.full(3, 0.1)
    far, near = placed(box(size, red), 0.0), placed(box(size, blue), 0.5)
    for scene in ([far, near], [near, far]):
        axes = new_figure(2, width=2).subplots()
        draw_scene(axes, FRONT, scene)
        image = np.asarray(axes.images[0].get_array())
        middle = image[image.shape[0] // 2, image.shape[1] // 2]
        assert middle[2] > middle[0]  # x = 0.5 lies nearer to a viewer ahead
        assert middle[3] == 1.0


def test_views_are_right_handed_and_look_where_they_say() -> None:
    for view in (FRONT, SIDE, TOP, OBLIQUE):
        np.testing.assert_allclose(view.axes @ view.axes.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(view.axes) == pytest.approx(1.0)
    left = np.array([0.0, 1.0, 0.0])
    assert FRONT.project(left)[0] == pytest.approx(1)  # from ahead its left is on our right
    assert TOP.project(left)[1] == pytest.approx(1)
    assert SIDE.project(np.array([1.0, 0, 0]))[0] == pytest.approx(1)


def test_sphere_cylinder_and_default_colour() -> None:
    urdf = """<robot name="r"><link name="l">
      <visual><geometry><sphere radius="0.2"/></geometry></visual>
      <visual><geometry><cylinder radius="1" length="1"/></geometry></visual>
      <visual><origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/>
        <geometry><box size="1 2 3"/></geometry></visual></link></robot>"""
    ball, tube, cuboid = (solid for _, solid in read_visuals(urdf).solids)
    assert [solid.kind for solid in (ball, tube, cuboid)] == ["sphere", "mesh", "box"]
    np.testing.assert_allclose(np.linalg.norm(ball.points, axis=1), 0.2)
    np.testing.assert_allclose(np.ptp(tube.points, axis=0), [2, 2, 1])
    np.testing.assert_allclose(np.ptp(cuboid.points, axis=0), [2, 1, 3])
    np.testing.assert_allclose(cuboid.points.mean(axis=0), [1, 0, 0], atol=1e-12)
    axes = new_figure(2, width=2).subplots()
    draw_scene(axes, TOP, [ball, tube, cuboid])
    assert len(axes.images) == 1


def test_surfaces_are_closed_and_look_outwards() -> None:
    """By the divergence theorem: the volume within is that of the body."""
    for solid, volume in ((box(np.array([1.0, 2.0, 3.0])), 6.0), (sphere(1.0), 4 / 3 * np.pi)):
        a, b, c = solid.points[solid.faces].transpose(1, 0, 2)
        assert np.einsum("ij,ij", a, np.cross(b, c)) / 6 == pytest.approx(volume, rel=5e-3)


@pytest.mark.parametrize(
    ("urdf", "says"),
    [
        ("<robot", "not XML"),
        ('<robot><link name="k"><visual><geometry><box size="a b c"/></geometry></visual></link>'
         "</robot>", "'a b c' where"),
        ('<robot><link name="k"><visual><geometry><box size="1 1"/></geometry></visual></link>'
         "</robot>", "'1 1' where"),
        ('<robot><link name="k"><visual><geometry><sphere radius="x"/></geometry></visual></link>'
         "</robot>", "'x' where"),
    ],
)  # fmt: skip
def test_broken_visuals_are_one_clear_line(urdf: str, says: str) -> None:
    with pytest.raises(FigureError, match=says) as caught:
        read_visuals(urdf)
    assert "\n" not in str(caught.value)
