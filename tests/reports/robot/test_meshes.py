"""Meshes are found, read, thinned and drawn; a missing one is said and changes no number."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh

from pipeline.api.pictures.scene import Scenery
from pipeline.dynamics.joint_demand import segment_demand
from pipeline.motion.standing import standing_posture
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import load_robot_file
from reports.figures.robot.meshes import Surface, cylinder, mesh_file, read_surface, thinned
from reports.figures.robot.projection import FRONT, OBLIQUE, SIDE, TOP, draw_scene
from reports.figures.robot.solids import Mesh, Primitive
from reports.figures.robot.visuals import read_shapes
from reports.figures.style import new_figure
from tests.pipeline.cli.robots import own_robot

URDF = """<robot name="r"><link name="l"><visual><origin xyz="1 0 0"/>
  <geometry><mesh filename="{mesh}" scale="2 1 1"/></geometry>{material}</visual>
  <collision><geometry><box size="3 1 1"/></geometry></collision></link></robot>"""


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
    assert mesh_file("package://cubes/meshes/cube.stl", urdf_folder) == cube
    assert mesh_file("package://cubes/meshes/cube.stl", tmp_path / "elsewhere") == cube
    elsewhere = Path("/nowhere")
    assert mesh_file("package://cubes/meshes/cube.stl", elsewhere) is None
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    assert mesh_file("package://cubes/meshes/cube.stl", elsewhere) == cube


def test_a_copy_of_a_published_urdf_finds_its_meshes_in_example_robot_data(tmp_path: Path) -> None:
    name = "package://example-robot-data/robots/solo_description/meshes/stl/solo12/solo_12_base.stl"
    found = mesh_file(name, tmp_path)
    assert found is not None
    surface = read_surface(found)
    assert surface is not None
    assert np.ptp(surface.vertices, axis=0).max() == pytest.approx(0.45, abs=0.02)


def test_scale_origin_and_the_urdfs_colour_apply(cube: Path) -> None:
    material = '<material name="m"><color rgba="1 0 0 1"/></material>'
    for text, color in ((material, (1.0, 0.0, 0.0)), ("", (0.6, 0.6, 0.6))):
        shapes = read_shapes(URDF.format(mesh=f"file://{cube}", material=text))
        (mesh,) = shapes.at({"l": np.eye(4)})
        assert isinstance(mesh, Mesh)
        np.testing.assert_allclose(mesh.points.min(axis=0), [0, -0.5, -0.5])
        np.testing.assert_allclose(mesh.points.max(axis=0), [2, 0.5, 0.5])
        np.testing.assert_allclose(mesh.colors, np.tile(color, (len(mesh.faces), 1)))
        assert shapes.remark == ""


def test_materials_without_a_name_keep_their_own_colours() -> None:
    visual = '<visual><geometry><box size="1 1 1"/></geometry><material name=""><color rgba="{}"/>'
    visual += "</material></visual>"
    boxes = visual.format("1 0 0 1") + visual.format("0 1 0 1")
    shapes = read_shapes(f'<robot name="r"><link name="l">{boxes}</link></robot>')
    assert [shape.color for shape in shapes.shapes] == [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)]


@pytest.mark.parametrize("content", [None, "no mesh at all"])
def test_for_a_mesh_that_is_missing_or_broken_stand_the_collision_shapes_and_a_word(
    tmp_path: Path, content: str | None
) -> None:
    if content is not None:
        (tmp_path / "x.stl").write_text(content, encoding="utf-8")
    shapes = read_shapes(URDF.format(mesh="x.stl", material=""), tmp_path)
    (box,) = shapes.at({"l": np.eye(4)})
    assert isinstance(box, Primitive)
    np.testing.assert_allclose(box.size, [3, 1, 1])
    assert "'x.stl'" in shapes.remark
    assert "numbers do not depend on meshes" in shapes.remark


def test_missing_meshes_move_no_number(root: Path, tmp_path: Path) -> None:
    """The hexapod, and the same with a trunk that is a mesh nobody has."""
    with_box = load_robot(load_robot_file(root / "urdf" / "hexapod.toml"))
    path = own_robot(
        root, tmp_path, r"<box size=[^>]*/>", '<mesh filename="package://nobody/trunk.dae"/>'
    )
    without = load_robot(load_robot_file(path))
    assert "trunk.dae" in Scenery(without).shapes.remark
    torque = [segment_demand(r, standing_posture(r))[0].torque for r in (with_box, without)]
    np.testing.assert_allclose(torque[0], torque[1], rtol=0, atol=1e-9)


def test_a_large_mesh_is_thinned_and_keeps_its_size() -> None:
    ball = trimesh.creation.icosphere(subdivisions=7)
    colors = np.tile([0.1, 0.2, 0.3], (len(ball.faces), 1))
    whole = Surface(np.asarray(ball.vertices), np.asarray(ball.faces, dtype=np.intp), colors)
    small = thinned(whole)
    assert len(small.faces) < 0.4 * len(whole.faces)
    assert small.colors is not None
    assert len(small.colors) == len(small.faces)
    np.testing.assert_allclose(np.linalg.norm(small.vertices, axis=1), 1, atol=0.02)
    few = cylinder(0.1, 0.5)
    assert thinned(few) is few
    solid = trimesh.Trimesh(few.vertices, few.faces)
    assert solid.is_watertight
    assert solid.volume == pytest.approx(np.pi * 0.1**2 * 0.5, rel=0.01)


def picture(solid: Primitive | Mesh, view) -> np.ndarray:
    axes = new_figure(2, 2).subplots()
    draw_scene(axes, view, [solid], pixels=120)
    return np.asarray(axes.images[0].get_array())


@pytest.mark.parametrize("view", [FRONT, SIDE, TOP, OBLIQUE])
def test_a_box_of_triangles_looks_like_the_box(view) -> None:
    """Two ways to draw one body: but for the lines at its edges, every pixel agrees."""
    placement = trimesh.transformations.euler_matrix(0.3, 0.2, 0.5)
    size, color = np.array([0.6, 0.3, 0.2]), (0.2, 0.5, 0.8)
    box = trimesh.creation.box(size, placement)
    faces = np.asarray(box.faces, dtype=np.intp)
    mesh = Mesh("l", np.asarray(box.vertices), faces, np.tile(color, (12, 1)))
    one = picture(Primitive("l", color, placement, size, sphere=False), view)
    other = picture(mesh, view)
    assert one.shape == other.shape
    inside = (one[..., 3] == 1) & (other[..., 3] == 1)
    same = np.abs(one - other)[..., :3].max(axis=-1) < 0.02
    assert inside.sum() > 1000
    assert same[inside].mean() > 0.9  # the rest are the edges within the outline


def test_the_nearer_of_two_meshes_hides_the_farther() -> None:
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    square = np.array([[0, -1, -1], [0, 1, -1], [0, 1, 1], [0, -1, 1]], dtype=float)
    red, blue = (np.tile(c, (2, 1)) for c in ([1.0, 0, 0], [0, 0, 1.0]))
    back, front = Mesh("b", square, faces, red), Mesh("f", square + [0.5, 0, 0], faces, blue)
    for scene in ([back, front], [front, back]):
        axes = new_figure(2, 2).subplots()
        draw_scene(axes, FRONT, scene, pixels=60)
        image = np.asarray(axes.images[0].get_array())
        middle = image[image.shape[0] // 2, image.shape[1] // 2]
        assert middle[2] > middle[0]


def test_a_published_robot_is_drawn_from_its_meshes(root: Path, tmp_path: Path) -> None:
    shutil.copyfile(root / "urdf" / "solo12.toml", tmp_path / "solo12.toml")
    scenery = Scenery(load_robot(load_robot_file(tmp_path / "solo12.toml")))
    solids, legs = scenery.at(scenery.zero)
    assert not scenery.shapes.missing
    assert {solid.link for solid in solids} >= {"base_link", "FL_LOWER_LEG"}
    assert all(isinstance(solid, Mesh) for solid in solids)
    assert len(legs) == 4
