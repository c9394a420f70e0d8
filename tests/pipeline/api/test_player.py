"""What the player in the browser is told: bodies, arrows, torques; and what is said without it."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest.mock import MagicMock

import matplotlib.image
import numpy as np
import pinocchio as pin
import pytest

from pipeline.api.pictures.scene import Scene
from pipeline.api.pictures.view import (
    Player,
    arrow,
    quaternions,
    towards,
    triangles,
    viser_module,
)
from pipeline.api.pictures.walk import rows_of_steps, steps_of
from pipeline.errors import ReportError
from pipeline.robot.robot import Robot
from pipeline.simulation.walk_stand import Walking, walk
from reports.figures.walk import Steps
from tests.command_line import Refused, exit_code
from tests.reports import browser

COUNT = 8


@pytest.fixture(scope="module")
def walking(hexapod: Robot) -> Walking:
    return walk(hexapod, {}, samples=101)


@pytest.fixture(scope="module")
def played(hexapod: Robot, walking: Walking) -> Steps:
    return steps_of(Scene(hexapod), walking, COUNT)


def rotated(quaternion: np.ndarray, vector: np.ndarray) -> np.ndarray:
    w, x, y, z = quaternion
    return np.asarray(pin.Quaternion(w, x, y, z).toRotationMatrix() @ vector)


def test_bodies_are_carried_to_where_pinocchio_has_them(
    hexapod: Robot, walking: Walking, played: Steps
) -> None:
    scene, k = Scene(hexapod), 5
    segment, sample = rows_of_steps(walking, COUNT)[k]
    solids = scene.at(walking.motion.segments[segment].configuration[sample])[0]
    expected = sorted(tuple(np.round(s.points.mean(axis=0), 6)) for s in solids)
    found = []
    for body in played.bodies:
        for solid in body.solids:
            centre = solid.points.mean(axis=0)
            moved = body.rotation[k] @ centre + body.position[k] + played.origin[k]
            found.append(tuple(np.round(moved, 6)))
    np.testing.assert_allclose(sorted(found), expected, atol=1e-6)


def test_surfaces_become_triangles_with_their_colours(hexapod: Robot) -> None:
    scene = Scene(hexapod)
    trunk = next(s for s in scene.at(scene.zero)[0] if s.body == 1)
    mesh = triangles([trunk])
    assert len(mesh.faces) == 12
    np.testing.assert_allclose(mesh.bounds, [trunk.points.min(axis=0), trunk.points.max(axis=0)])
    np.testing.assert_allclose(mesh.visual.face_colors[0, :3] / 255, trunk.colors[0], atol=0.01)


def test_arrows_point_along_the_force() -> None:
    vertices, faces = arrow(0.02)
    assert faces.max() < len(vertices)
    np.testing.assert_allclose(vertices[:, 2].max(), 1.0)
    for direction in ([0, 0, 1], [0, 0, -1], [1, 0, 0], [0.6, 0.0, 0.8], [-0.48, 0.6, 0.64]):
        unit = np.array(direction, dtype=float)
        np.testing.assert_allclose(rotated(towards(unit), np.array([0, 0, 1.0])), unit, atol=1e-12)
    turn = pin.exp3(np.array([0.2, -0.4, 1.0]))
    np.testing.assert_allclose(rotated(quaternions(turn[None])[0], np.eye(3)[0]), turn[:, 0])


def stub() -> tuple[ModuleType, MagicMock]:
    """A viser that remembers what it is told."""
    server = MagicMock()
    server.get_host.return_value, server.get_port.return_value = "127.0.0.1", 8080
    for add in ("add_mesh_trimesh", "add_mesh_simple", "add_icosphere"):
        getattr(server.scene, add).side_effect = lambda name, *_, **__: MagicMock(label=name)
    server.gui.add_checkbox.side_effect = lambda *_: MagicMock(value=True)
    server.gui.add_slider.side_effect = lambda *_, initial_value=0, **__: MagicMock(
        value=initial_value
    )
    module: Any = ModuleType("viser")
    module.ViserServer = MagicMock(return_value=server)
    return module, server


def test_each_step_shows_bodies_forces_and_torques(
    played: Steps, monkeypatch: pytest.MonkeyPatch
) -> None:
    module, server = stub()
    monkeypatch.setitem(sys.modules, "viser", module)
    player = Player("title", played, "127.0.0.1", 8080)
    assert player.address == "http://127.0.0.1:8080"
    steps = played
    lengths = {}
    for k in (0, 3):
        player.show(k)
        np.testing.assert_array_equal(player.bodies[2].position, played.bodies[2].position[k])
        for i, shown in enumerate(player.forces):
            assert shown.visible == bool(steps.stands[k, i])
            if shown.visible:
                np.testing.assert_array_equal(shown.position, steps.feet[k, i])
                lengths[k, i] = shown.scale[2] / np.linalg.norm(steps.force[k, i])
        assert f"t = {steps.time[k]:.2f} s" in player.words.content
        joint = played.joints[4]
        assert f"| {joint} | {steps.torque[k, 4]:.3g} N·m |" in player.words.content
    assert np.ptp(list(lengths.values())) < 1e-12  # one scale for all forces
    turns = iter([True, True, False])
    player.play(lambda: next(turns))
    player.stop()
    server.stop.assert_called_once()


@pytest.mark.slow
@browser.needs_chromium
def test_a_browser_shows_the_robot(
    played: Steps, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The picture of a page with the robot differs from that of the same page without it."""
    pytest.importorskip("viser", reason="the package viser is missing; `make view` installs it")
    player = Player("title", played, "127.0.0.1", 8080)
    pictures = []
    try:
        for shown in (True, False):
            for body in player.bodies:
                body.visible = shown
            player.server.flush()
            picture = tmp_path / f"{shown}.png"
            options = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")
            options += ("--window-size=800,600", "--virtual-time-budget=20000")
            browser.run(tmp_path, *options, f"--screenshot={picture}", player.address)
            pictures.append(matplotlib.image.imread(picture)[..., :3])
        assert capsys.readouterr().out == ""  # the command says where to look
    finally:
        player.stop()
    robot = np.abs(pictures[0] - pictures[1]).max(axis=-1) > 0.05
    rows, columns = np.nonzero(robot)
    assert robot.mean() > 0.01
    assert np.ptp(columns) > 80
    assert np.ptp(rows) > 40


def test_without_viser_one_line_says_how_to_install_it(
    monkeypatch: pytest.MonkeyPatch, refused: Refused
) -> None:
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(ReportError, match="make view"):
        viser_module()
    assert "reports/view.lock" in refused(["view"])


@pytest.mark.parametrize("port", ["0", "70000", "http"])
def test_a_port_that_is_none_is_refused(port: str, refused: Refused) -> None:
    assert "expected 1 to 65535" in refused(["view", "--port", port])


def test_the_lock_of_the_extra_is_where_the_message_says(root: Path) -> None:
    assert "viser==" in (root / "reports" / "view.lock").read_text(encoding="utf-8")


def test_view_walks_what_walk_walks(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Gait file, changed numbers, rule and friction of the ground's forces reach the picture."""
    monkeypatch.setitem(sys.modules, "viser", stub()[0])
    monkeypatch.setattr(Player, "play", lambda _: None)
    seen: list[tuple[str, Steps]] = []
    begin = Player.__init__

    def kept(player: Player, title: str, steps: Steps, host: str, port: int) -> None:
        seen.append((title, steps))
        begin(player, title, steps, host, port)

    monkeypatch.setattr(Player, "__init__", kept)
    gait = tmp_path / "wave.toml"
    gait.write_text('[gait]\nname = "wave"\nheading = "left"\n', encoding="utf-8")
    options = ["view", "--gait", str(gait), "--set", "gait.slope_forward=5 deg", "--samples", "51"]
    assert exit_code(options) == 0
    assert exit_code([*options, "--forces", "least_torque"]) == 0
    (title, paper), (_, other) = seen
    assert "wave" in title
    assert paper.ground[0] == pytest.approx(-np.sin(np.radians(5)))
    along = paper.origin[-1] - paper.origin[0]
    assert along[1] > 10 * abs(along[0])
    change = np.abs(other.force - paper.force).max()
    assert change > 0.1 * np.abs(paper.force).max()
    capsys.readouterr()
    assert exit_code([*options, "--friction-coefficient", "0.01"]) == 1
    assert "slides" in capsys.readouterr().err
