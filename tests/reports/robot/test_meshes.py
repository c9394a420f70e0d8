"""Meshes are found, read, thinned and drawn; a missing one is said and changes no number."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh

from pipeline.api.pictures.scene import Scene
from pipeline.dynamics.joint_demand import segment_demand
from pipeline.motion.support import standing_posture
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import load_robot_file
from reports.figures.robot.projection import FRONT, draw_scene
from reports.figures.robot.solids import cylinder, mesh
from reports.figures.robot.visuals import mesh_file, read_mesh, read_visuals, thinned
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
    solid = read_mesh(found)
    assert solid is not None
    assert np.ptp(solid.points, axis=0).max() == pytest.approx(0.45, abs=0.02)


@pytest.mark.parametrize(("rgba", "color"), [("1 0 0 1", (1.0, 0.0, 0.0)), ("", (0.6, 0.6, 0.6))])
def test_scale_origin_and_the_urdfs_colour_apply(cube: Path, rgba: str, color: tuple) -> None:
    material = f'<material name="m"><color rgba="{rgba}"/></material>' if rgba else ""
    visuals = read_visuals(URDF.format(mesh=f"file://{cube}", material=material))
    ((link, solid),) = visuals.solids
    assert (link, solid.kind) == ("l", "mesh")
    np.testing.assert_allclose(solid.points.min(axis=0), [0, -0.5, -0.5])
    np.testing.assert_allclose(solid.points.max(axis=0), [2, 0.5, 0.5])
    np.testing.assert_allclose(solid.colors, np.tile(color, (len(solid.faces), 1)))
    assert visuals.remark == ""


def test_materials_without_a_name_keep_their_own_colours() -> None:
    visual = '<visual><geometry><box size="1 1 1"/></geometry><material name=""><color rgba="{}"/>'
    visual += "</material></visual>"
    boxes = visual.format("1 0 0 1") + visual.format("0 1 0 1")
    visuals = read_visuals(f'<robot name="r"><link name="l">{boxes}</link></robot>')
    assert [tuple(solid.colors[0]) for _, solid in visuals.solids] == [(1, 0, 0), (0, 1, 0)]


@pytest.mark.parametrize("content", [None, "no mesh at all"])
def test_collision_shapes_and_a_remark_replace_a_mesh_that_is_missing_or_broken(
    tmp_path: Path, content: str | None
) -> None:
    if content is not None:
        (tmp_path / "x.stl").write_text(content, encoding="utf-8")
    visuals = read_visuals(URDF.format(mesh="x.stl", material=""), tmp_path)
    ((_, box),) = visuals.solids
    assert box.kind == "box"
    np.testing.assert_allclose(np.ptp(box.points, axis=0), [3, 1, 1])
    assert "'x.stl'" in visuals.remark
    assert "numbers do not depend on meshes" in visuals.remark


def test_missing_meshes_move_no_number(root: Path, tmp_path: Path) -> None:
    """The hexapod, and the same with a trunk that is a mesh nobody has."""
    with_box = load_robot(load_robot_file(root / "urdf" / "hexapod.toml"))
    path = own_robot(
        root, tmp_path, r"<box size=[^>]*/>", '<mesh filename="package://nobody/trunk.dae"/>'
    )
    without = load_robot(load_robot_file(path))
    assert "trunk.dae" in Scene(without).visuals.remark
    torque = [segment_demand(r, standing_posture(r))[0].torque for r in (with_box, without)]
    np.testing.assert_allclose(torque[0], torque[1], rtol=0, atol=1e-9)


def test_a_large_mesh_is_thinned_and_keeps_its_size() -> None:
    ball = trimesh.creation.icosphere(subdivisions=7)
    colors = np.tile([0.1, 0.2, 0.3], (len(ball.faces), 1))
    whole = mesh(np.asarray(ball.vertices), np.asarray(ball.faces, dtype=np.intp), colors)
    small = thinned(whole)
    assert len(small.faces) == len(small.colors) < 0.4 * len(whole.faces)
    np.testing.assert_allclose(np.linalg.norm(small.points, axis=1), 1, atol=0.02)
    few = cylinder(0.1, 0.5)
    assert thinned(few) is few


def test_the_nearer_of_two_meshes_hides_the_farther() -> None:
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    square = np.array([[0, -1, -1], [0, 1, -1], [0, 1, 1], [0, -1, 1]], dtype=float)
    red, blue = (np.tile(c, (2, 1)) for c in ([1.0, 0, 0], [0, 0, 1.0]))
    back, front = mesh(square, faces, red), mesh(square + [0.5, 0, 0], faces, blue)
    for scene in ([back, front], [front, back]):
        axes = new_figure(2, width=2).subplots()
        draw_scene(axes, FRONT, scene, pixels=60)
        image = np.asarray(axes.images[0].get_array())
        middle = image[image.shape[0] // 2, image.shape[1] // 2]
        assert middle[2] > middle[0]


def test_a_published_robot_is_drawn_from_its_meshes(root: Path, tmp_path: Path) -> None:
    shutil.copyfile(root / "urdf" / "solo12.toml", tmp_path / "solo12.toml")
    scene = Scene(load_robot(load_robot_file(tmp_path / "solo12.toml")))
    solids, legs = scene.at(scene.zero)
    assert not scene.visuals.missing
    assert {link for link, _ in scene.visuals.solids} >= {"base_link", "FL_LOWER_LEG"}
    assert all(solid.kind == "mesh" for solid in solids)
    assert len(legs) == 4
