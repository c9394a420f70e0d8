"""Pictures of the robot are its URDF's: hulls, missing meshes, sticks, joint axes, any legs."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
import pinocchio as pin
import pytest
import trimesh

from actuators.errors import LegwattError
from pipeline.dynamics.joint_demand import segment_demand
from pipeline.motion.gait import with_payload
from pipeline.motion.support import standing_posture
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from reports.figures.robot import (
    FRONT,
    OBLIQUE,
    SIDE,
    TOP,
    JointMark,
    Leg,
    Solid,
    draw_robot,
    robot_figure,
)
from reports.figures.style import new_figure
from reports.scene import Scene, mesh_file, read_shapes
from tests.pipeline.commands.robots import own_robot
from tests.reports.outside import outside

X, Y = np.eye(3)[:2]
CUBE = np.array([[i, j, k] for i in (-0.5, 0.5) for j in (-0.5, 0.5) for k in (-0.5, 0.5)])
URDF = """<robot name="r"><link name="l"><visual><origin xyz="1 0 0"/>
  <geometry><mesh filename="{mesh}" scale="2 1 1"/></geometry>{material}</visual>
  <collision><geometry><box size="3 1 1"/></geometry></collision></link></robot>"""


def texts(figure) -> list[str]:
    return [t.get_text() for t in figure.findobj(matplotlib.text.Text) if t.get_text()]


@pytest.fixture
def cube(tmp_path: Path) -> Path:
    """A cube of 1 m in a package, three folders below its root."""
    path = tmp_path / "cubes" / "meshes" / "cube.stl"
    path.parent.mkdir(parents=True)
    trimesh.creation.box((1, 1, 1)).export(path)
    return path


def test_a_mesh_is_found_beside_the_urdf_above_it_and_in_the_ros_path(
    cube: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    urdf_folder = tmp_path / "cubes" / "urdf"
    urdf_folder.mkdir()
    assert mesh_file("../meshes/cube.stl", urdf_folder) is not None
    assert mesh_file(f"file://{cube}", None) == cube
    for folder in (urdf_folder, tmp_path / "elsewhere"):
        assert mesh_file("package://cubes/meshes/cube.stl", folder) == cube
    assert mesh_file("package://cubes/meshes/cube.stl", Path("/nowhere")) is None
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    assert mesh_file("package://cubes/meshes/cube.stl", Path("/nowhere")) == cube
    name = "package://example-robot-data/robots/solo_description/meshes/stl/solo12/solo_12_base.stl"
    assert mesh_file(name, tmp_path) is not None


@pytest.mark.parametrize(("rgba", "color"), [("1 0 0 1", (1.0, 0.0, 0.0)), ("", (0.6, 0.6, 0.6))])
def test_scale_origin_and_the_urdfs_colour_apply(cube: Path, rgba: str, color: tuple) -> None:
    material = f'<material name="m"><color rgba="{rgba}"/></material>' if rgba else ""
    (shape,), missing = read_shapes(URDF.format(mesh=f"file://{cube}", material=material))
    assert (shape.link, missing) == ("l", [])
    np.testing.assert_allclose(shape.points.min(axis=0), [0, -0.5, -0.5])
    np.testing.assert_allclose(shape.points.max(axis=0), [2, 0.5, 0.5])
    np.testing.assert_allclose(shape.color, color, atol=0.01)


@pytest.mark.parametrize("name", ["missing.stl", "x.stl", "x.dae", "x.obj", "x.glb", "x.ply"])
def test_collision_shapes_replace_a_mesh_that_is_missing_or_broken(
    tmp_path: Path, name: str
) -> None:
    if name != "missing.stl":
        (tmp_path / name).write_text("no mesh at all", encoding="utf-8")
    (box,), missing = read_shapes(URDF.format(mesh=name, material=""), tmp_path)
    np.testing.assert_allclose(np.ptp(box.points, axis=0), [3, 1, 1])
    assert missing == [name]


def test_a_shape_whose_numbers_are_none_is_one_clear_line() -> None:
    shape = '<visual><geometry><box size="a b c"/></geometry></visual>'
    with pytest.raises(LegwattError, match="cannot be drawn") as caught:
        read_shapes(f'<robot name="r"><link name="k">{shape}</link></robot>')
    assert "\n" not in str(caught.value)


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
    assert any("missing" in word for word in scene.words)
    assert Scene(with_box).remark == ""
    robot_figure(*scene.at(scene.zero), title="t")
    torque = [segment_demand(r, standing_posture(r))[0].torque for r in (with_box, without)]
    np.testing.assert_allclose(torque[0], torque[1], rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "link", "size"),
    [("hexapod", "base_link", [0.6, 0.22, 0.12]), ("solo12", "base_link", [0.45, 0.2, 0.06])],
)
def test_the_hull_of_a_link_has_the_size_of_its_shape(
    root: Path, name: str, link: str, size: list[float]
) -> None:
    scene = Scene(load_robot(load_robot_file(root / "urdf" / f"{name}.toml")))
    points = np.concatenate([s.points for s in scene.shapes if s.link == link])
    assert not scene.missing
    np.testing.assert_allclose(np.ptp(points, axis=0), size, rtol=0.15)


def test_each_link_is_the_outline_of_its_hull_the_nearest_last() -> None:
    red, blue = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
    leg = Leg("a", (JointMark("a_1", X, Y, False),), X)
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


@pytest.mark.parametrize("name", ["hexapod", "hexapod_axis90"])
def test_axes_are_those_of_the_urdf(root: Path, name: str) -> None:
    robot = load_robot(load_robot_file(root / "urdf" / f"{name}.toml"))
    scene = Scene(robot)
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, scene.zero)
    for one in scene.at(scene.zero)[1]:
        for joint in one.joints:
            pattern = rf'<joint name="{joint.name}".*?<axis xyz="([^"]*)"'
            found = re.search(pattern, robot.urdf, flags=re.S)
            assert found is not None
            own = np.array([float(part) for part in found[1].split()])
            placed = data.oMi[robot.model.getJointId(joint.name)]
            np.testing.assert_allclose(joint.axis, placed.rotation @ own, atol=1e-12)
            np.testing.assert_allclose(joint.position, placed.translation, atol=1e-12)


def test_every_link_is_placed_in_the_posture(hexapod: Robot) -> None:
    scene = Scene(hexapod)
    q = standing_posture(hexapod, hexapod.leg_names).configuration[0]
    solids, legs = scene.at(q)
    assert len(solids) == hexapod.urdf.count("<visual>")
    assert len(legs) == 6
    assert not any(one.bare for one in legs)
    lowest = min(float(solid.points[:, 2].min()) for solid in solids)
    feet = np.array([one.foot for one in legs])
    assert lowest == pytest.approx(feet[:, 2].min(), abs=0.03)
    figure = robot_figure(solids, legs, title="t", mass_centre=np.zeros(3))
    assert len(figure.axes) == 4
    assert {"RM", "LF"} <= set(texts(figure))
    assert outside(figure) == []


def test_a_robot_whose_feet_alone_are_shown_is_drawn_as_sticks(hexapod: Robot) -> None:
    shown = re.sub(r"<visual>(?:(?!</visual>).)*<box.*?</visual>", "", hexapod.urdf, flags=re.S)
    scene = Scene(replace(hexapod, urdf=shown))
    assert "legs without shapes in the URDF: sticks between their joints" in scene.words
    solids, legs = scene.at(scene.zero)
    assert all(one.bare for one in legs)
    figure = robot_figure(solids, legs, title="t")
    paths = [line for line in figure.axes[1].lines if len(line.get_xdata()) == 5]
    assert len(paths) == 6
    np.testing.assert_allclose(paths[0].get_xydata()[-1], legs[0].foot[:2])
    empty = Scene(replace(hexapod, urdf=re.sub(r"<visual>.*?</visual>", "", shown, flags=re.S)))
    robot_figure(*empty.at(empty.zero), title="t")
    hips = np.array([one.joints[0].position[:2] for one in legs])
    np.testing.assert_allclose(
        np.ptp(empty.trunk_outline(), axis=0), np.ptp(hips, axis=0), atol=1e-5
    )


def test_a_payload_is_drawn_where_it_is_and_is_no_part_of_the_trunk(hexapod: Robot) -> None:
    gait = {"payload_mass": "4 kg", "payload_x": "100 mm", "payload_z": "150 mm"}
    scene = Scene(with_payload(load_robot(hexapod.spec.with_gait(**gait))))
    ball = scene.at(scene.zero)[0][-1]
    np.testing.assert_allclose(ball.points.mean(axis=0), [0.1, 0.0, 0.15], atol=1e-3)
    volume = np.pi / 6 * float(np.ptp(ball.points[:, 2])) ** 3
    assert volume * 7850 == pytest.approx(4.0, rel=0.01)
    corners = Scene(hexapod).trunk_outline()
    np.testing.assert_array_equal(scene.trunk_outline(), corners)
    np.testing.assert_allclose(np.abs(corners).max(axis=0)[0], 0.3, atol=1e-6)
