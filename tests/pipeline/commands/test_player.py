"""What Pinocchio's visualizer in the browser is given; and what is said without viser."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pinocchio as pin
import pinocchio.visualize.viser_visualizer as visualizer
import pytest

from actuators.errors import LegwattError
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import load_robot_file
from pipeline.simulation.machine import Machine
from reports.scene import Scene
from reports.view import Player, geometry, viser_module
from tests.command_line import Refused, exit_code
from tests.compared import walked_by


def given(*more: str) -> Machine:
    return walked_by("view", "--samples", "51", *more)


class Server:
    """A server of viser that remembers what Pinocchio's own visualizer tells it."""

    def __init__(self, **_: object) -> None:
        self.scene, self.initial_camera, self.atomic = MagicMock(), MagicMock(), MagicMock()
        for kind in ("frame", "box", "icosphere"):
            getattr(self.scene, f"add_{kind}").side_effect = lambda *_, **__: MagicMock()
        self.stop = MagicMock()

    def get_host(self) -> str:
        return "0.0.0.0"

    def get_port(self) -> int:
        return 8080


@pytest.fixture
def viser(monkeypatch: pytest.MonkeyPatch) -> None:
    module: Any = ModuleType("viser")
    module.ViserServer = Server
    monkeypatch.setitem(sys.modules, "viser", module)
    monkeypatch.setattr(visualizer, "viser", module, raising=False)
    monkeypatch.setattr(visualizer, "import_viser_succeed", True)


@pytest.mark.parametrize("name", ["hexapod", "solo12"])
def test_pinocchio_places_every_shape_where_the_pictures_do(root: Path, name: str) -> None:
    robot = load_robot(load_robot_file(root / "urdf" / f"{name}.toml"))
    scene = Scene(robot)
    shown = geometry(scene)
    data, placed = robot.model.createData(), shown.createData()
    pin.forwardKinematics(robot.model, data, scene.zero)
    pin.updateGeometryPlacements(robot.model, data, shown, placed)
    assert shown.ngeoms == len(scene.shapes)
    solids = scene.at(scene.zero)[0]
    for k, (shape, body) in enumerate(zip(scene.shapes, shown.geometryObjects, strict=True)):
        own = np.asarray(shape.mesh.vertices) * shape.scale
        found = own @ placed.oMg[k].rotation.T + placed.oMg[k].translation
        nearest = [np.abs(s.points[: len(found)] - found[: len(s.points)]).max() for s in solids]
        assert min(nearest) < 1e-9
        np.testing.assert_allclose(body.meshColor[:3], shape.color)
        assert body.meshPath == str(shape.file or "")


@pytest.mark.usefixtures("viser")
def test_each_frame_shows_the_posture_and_the_forces_of_the_ground() -> None:
    player = Player(given())
    assert player.address == "http://localhost:8080"
    scene = player.server.scene
    assert scene.add_box.call_count + scene.add_icosphere.call_count == 25
    walking, lengths = player.walking, []
    for k, row in ((0, 0), (0, 20), (1, 7)):
        segment, contacts = walking.motion.segments[k], walking.demand.contacts[k]
        assert contacts is not None
        player.show(float(segment.time[row] - walking.motion.segments[0].time[0]) + 1e-9)
        trunk = player.viewer.frames["pinocchio/visual/0_base_link"]
        np.testing.assert_allclose(trunk.position, segment.configuration[row][:3], atol=1e-9)
        arrows = scene.add_arrows.call_args.args[1]
        assert len(arrows) == len(contacts.stance) == 3
        stands = [leg.name in contacts.stance for leg in player.legs]
        force = contacts.force_world[row][stands]
        length = np.linalg.norm(arrows[:, 1] - arrows[:, 0], axis=1)
        lengths += list(length / np.linalg.norm(force, axis=1))
    np.testing.assert_allclose(lengths, lengths[0])  # one scale for all forces
    turns = iter([True, True, False])
    player.play(lambda: next(turns))
    player.stop()
    player.server.stop.assert_called_once()


def test_without_viser_one_line_says_how_to_install_it(
    monkeypatch: pytest.MonkeyPatch, refused: Refused, root: Path
) -> None:
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(LegwattError, match="make view"):
        viser_module()
    assert "reports/view.lock" in refused(["view"])
    assert "viser==" in (root / "reports" / "view.lock").read_text(encoding="utf-8")


@pytest.mark.usefixtures("viser")
def test_view_walks_what_walk_walks(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Gait file, changed numbers, rule and friction of the ground's forces reach the picture."""
    seen: list[Player] = []
    monkeypatch.setattr(Player, "play", lambda player: seen.append(player))
    gait = tmp_path / "wave.toml"
    gait.write_text('[gait]\nname = "wave"\nheading = "left"\n', encoding="utf-8")
    options = ["view", "--gait", str(gait), "--set", "gait.slope_forward=5 deg", "--samples", "51"]
    assert exit_code(options) == 0
    assert exit_code([*options, "--forces", "least_torque"]) == 0
    paper, other = (player.walking for player in seen)
    first, last = paper.motion.segments[0], paper.motion.segments[-1]
    assert first.ground_normal[0] == pytest.approx(-np.sin(np.radians(5)))
    along = last.configuration[-1, :3] - first.configuration[0, :3]
    assert along[1] > 10 * abs(along[0])
    forces = [walk.demand.contacts[0].force_world for walk in (paper, other)]  # type: ignore[union-attr]
    assert np.abs(forces[1] - forces[0]).max() > 0.1 * np.abs(forces[0]).max()
    assert "localhost:8080" in capsys.readouterr().out
    assert exit_code([*options, "--friction-coefficient", "0.01"]) == 1
    assert "slides" in capsys.readouterr().err
