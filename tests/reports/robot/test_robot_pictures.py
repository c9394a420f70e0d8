"""The robot's pictures are measured from the robot: dimensions, directions, what hides what."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
import pinocchio as pin
import pytest

from pipeline.motion.standing import standing_posture
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from reports.errors import FigureError
from reports.figures.robot.joint_directions import joint_directions_figure
from reports.figures.robot.projection import FRONT, OBLIQUE, SIDE, TOP, draw_scene, extent
from reports.figures.robot.robot_view import robot_figure
from reports.figures.robot.solids import Leg, Mesh, Primitive, Solid, legs_of
from reports.figures.robot.visuals import joint_marks, read_shapes
from reports.figures.style import new_figure


def placements(robot: Robot, configuration) -> dict[str, np.ndarray]:
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, configuration)
    return {
        frame.name: data.oMf[i].homogeneous
        for i, frame in enumerate(robot.model.frames)
        if frame.type == pin.FrameType.BODY
    }


def standing(robot: Robot) -> tuple[list[Solid], list[Leg]]:
    links = placements(robot, standing_posture(robot, robot.leg_names).configuration[0])
    names = {leg.name: (leg.joints, leg.foot) for leg in robot.spec.legs}
    return read_shapes(robot.urdf).at(links), legs_of(names, joint_marks(robot.urdf, links), links)


def texts(figure) -> list[str]:
    return [t.get_text() for t in figure.findobj(matplotlib.text.Text) if t.get_text()]


def test_joint_marks_agree_with_pinocchio(hexapod: Robot) -> None:
    """Axis and origin against the joint's own column of Pinocchio's Jacobian."""
    configuration = standing_posture(hexapod).configuration[0]
    links = placements(hexapod, configuration)
    data = hexapod.model.createData()
    pin.computeJointJacobians(hexapod.model, data, configuration)
    for mark in joint_marks(hexapod.urdf, links):
        index = hexapod.model.getJointId(mark.name)
        column = hexapod.model.joints[index].idx_v
        jacobian = pin.getJointJacobian(hexapod.model, data, index, pin.LOCAL_WORLD_ALIGNED)
        np.testing.assert_allclose(mark.axis, jacobian[3:, column], atol=1e-12)
        np.testing.assert_allclose(mark.position, data.oMi[index].translation, atol=1e-12)


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
    with pytest.raises(FigureError, match="no leg"):
        robot_figure(scene, [], title="t")


def test_a_robot_without_boxes_is_drawn_as_sticks_and_its_trunk_not_measured(
    hexapod: Robot,
) -> None:
    """Spheres alone, as of a URDF whose links are meshes: no sphere is taken for the trunk."""
    scene, legs = standing(hexapod)
    spheres = [primitive for primitive in scene if primitive.sphere]
    words = texts(robot_figure(spheres, legs, title="t"))
    assert any("legs without shapes in the URDF: sticks" in word for word in words)
    assert "600 mm" not in words
    for expected in ("520 mm", "180 mm", "340 mm", "270 mm", "RM"):
        assert expected in words
    links = [primitive for primitive in scene if primitive.link != "base_link"]
    words = texts(robot_figure(links, legs, title="t"))
    assert not any("sticks" in word for word in words)
    assert "600 mm" not in words


def test_joint_directions_names_the_joints(hexapod: Robot) -> None:
    scene, legs = standing(hexapod)
    figure = joint_directions_figure(scene, legs, "rm", title="t", zero_pose="straight")
    words = texts(figure)
    for expected in ("1 rm_joint_1", "2 rm_joint_2", "3 rm_joint_3"):
        assert expected in words
    assert any("Zero pose: straight" in word for word in words)
    with pytest.raises(FigureError, match="'xx'"):
        joint_directions_figure(scene, legs, "xx", title="t")


def test_a_lateral_first_axis_is_shown_from_the_side(hexapod: Robot, root: Path) -> None:
    turned = load_robot(load_robot_file(root / "urdf" / "hexapod_axis90.toml"))
    for robot, view in ((hexapod, TOP), (turned, SIDE)):
        scene, legs = standing(robot)
        figure = joint_directions_figure(scene, legs, "rm", title="t")
        assert figure.axes[2].get_title(loc="left") == view.name
        assert "1" in [t.get_text() for t in figure.axes[2].texts]


def box(x: float, color: tuple[float, float, float]) -> Primitive:
    placement = np.eye(4)
    placement[0, 3] = x
    return Primitive("l", color, placement, np.full(3, 0.1), False)


def test_the_nearer_body_hides_the_farther_one() -> None:
    red, blue = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
    for scene in ([box(0.0, red), box(0.5, blue)], [box(0.5, blue), box(0.0, red)]):
        axes = new_figure(2, 2).subplots()
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
    ball, tube, cuboid = read_shapes(urdf).at({"l": np.eye(4)})
    assert ball.sphere
    np.testing.assert_allclose(ball.size, 0.4)
    np.testing.assert_allclose(cuboid.placement[:3, 0], [0, 1, 0], atol=1e-12)
    assert isinstance(tube, Mesh)
    np.testing.assert_allclose(np.ptp(tube.points, axis=0), [2, 2, 1])
    axes = new_figure(2, 2).subplots()
    draw_scene(axes, TOP, [ball, tube, cuboid])
    assert len(axes.images) == 1


@pytest.mark.parametrize(
    ("urdf", "says"),
    [
        ("<robot", "not XML"),
        ('<robot><link name="l"><visual><geometry><sphere radius="1"/></geometry></visual></link>'
         "</robot>", "'l' has a visual but no placement"),
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
        read_shapes(urdf).at({"k": np.eye(4)})
    assert "\n" not in str(caught.value)
