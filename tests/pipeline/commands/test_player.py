"""What Pinocchio's visualizer in the browser is given; and what is said without viser."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pinocchio.visualize.viser_visualizer as visualizer
import pytest

from tests.command_line import Refused
from tests.compared import walked_by


class Server:
    """A server of viser that remembers what Pinocchio's own visualizer tells it."""

    def __init__(self, **_: object) -> None:
        self.scene, self.initial_camera, self.stop = MagicMock(), MagicMock(), MagicMock()
        for kind in ("frame", "box", "icosphere"):
            getattr(self.scene, f"add_{kind}").side_effect = lambda *_, **__: MagicMock()

    def get_port(self) -> int:
        return 8080


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> Server:
    module: Any = ModuleType("viser")
    made = Server()
    monkeypatch.setattr(Server, "__new__", lambda *_, **__: made)
    module.ViserServer = Server
    monkeypatch.setitem(sys.modules, "viser", module)
    monkeypatch.setattr(visualizer, "viser", module, raising=False)
    monkeypatch.setattr(visualizer, "import_viser_succeed", True)
    return made


def test_a_frame_shows_the_forces_of_the_ground(server: Server) -> None:
    """Three arrows on a tripod, from the feet, one scale for all."""
    from reports.view import play

    machine = walked_by("view", "--samples", "51")
    play(machine, "127.0.0.1", 8080, frames=1)
    arrows = server.scene.add_arrows.call_args.args[1]
    walking = machine.walk({})
    contacts = walking.demand.contacts[0]
    assert contacts is not None
    stands = [leg.name in contacts.stance for leg in machine.robot.spec.legs]
    force = contacts.force_world[0][stands]
    length = np.linalg.norm(arrows[:, 1] - arrows[:, 0], axis=1) / np.linalg.norm(force, axis=1)
    np.testing.assert_allclose(length, length[0], rtol=0.05)  # of a moment later
    assert server.scene.add_box.call_count + server.scene.add_icosphere.call_count == 25
    server.stop.assert_called_once()


def test_without_viser_one_line_says_how_to_install_it(
    monkeypatch: pytest.MonkeyPatch, refused: Refused, root: Path
) -> None:
    monkeypatch.setitem(sys.modules, "viser", None)
    assert "make view" in refused(["view", "--samples", "51"])
    assert "viser==" in (root / "reports" / "view.lock").read_text(encoding="utf-8")
