"""Plays a walked cycle in a browser: Pinocchio's Viser visualizer, ground forces as arrows.

viser is an optional extra. It serves a page with everything in it; no network is needed.
"""

from __future__ import annotations

import io
import time
from collections.abc import Callable
from contextlib import redirect_stdout
from types import ModuleType
from typing import Any

import numpy as np
import pinocchio as pin

from actuators.errors import LegwattError
from pipeline.simulation.machine import Machine
from reports.scene import Scene

_GREEN = (0, 158, 115)
_FRAMES = 30.0  # a second
_FORCE = 0.7  # the largest force's arrow, in distances of the feet


def viser_module() -> ModuleType:
    """The package viser.

    Raises:
        LegwattError: It is not installed.
    """
    try:
        import viser
    except ImportError:
        raise LegwattError(
            "view needs the package viser, which is not installed; `make view` installs it, or "
            "`.venv/bin/python -m pip install --require-hashes --no-deps -r reports/view.lock`"
        ) from None
    module: ModuleType = viser
    return module


def geometry(scene: Scene) -> pin.GeometryModel:
    """What a robot shows, for Pinocchio; meshes by their files."""
    import coal
    from trimesh import primitives

    out, model = pin.GeometryModel(), scene.robot.model
    for k, shape in enumerate(scene.shapes):
        frame = model.getFrameId(shape.link, pin.FrameType.BODY)
        placed = model.frames[frame].placement * pin.SE3(shape.placement)
        if isinstance(shape.mesh, primitives.Box):
            body: Any = coal.Box(*shape.mesh.primitive.extents)
        elif isinstance(shape.mesh, primitives.Sphere):
            body = coal.Sphere(float(shape.mesh.primitive.radius))
        elif isinstance(shape.mesh, primitives.Cylinder):
            own = shape.mesh.primitive
            body = coal.Cylinder(float(own.radius), float(own.height))
        else:
            body = coal.BVHModelOBBRSS()  # the visualizer reads the file itself
        joint, color = model.frames[frame].parentJoint, np.array([*shape.color, 1.0])
        file, scale = str(shape.file or ""), np.array(shape.scale)
        name = f"{k}_{shape.link}"
        out.addGeometryObject(
            pin.GeometryObject(name, joint, frame, placed, body, file, scale, True, color)
        )
    return out


class Player:
    """A server that shows one cycle over and over."""

    def __init__(self, given: Machine, *, host: str = "127.0.0.1", port: int = 8080) -> None:
        """Walk one cycle and serve it to a browser.

        Args:
            given: Robot and gait.
            host: Address to listen on.
            port: To listen on; the next free one where it is taken.

        Raises:
            LegwattError: The package viser is not installed.
            StanceError: A foot would have to pull or slide.
        """
        from pinocchio.visualize import ViserVisualizer

        viser, scene = viser_module(), Scene(given.edited)
        self.walking = given.walk({})
        self.legs = given.edited.spec.legs
        with redirect_stdout(io.StringIO()):  # a table of addresses: the command says it in a line
            self.server: Any = viser.ViserServer(host=host, port=port, verbose=False)
        self.viewer = ViserVisualizer(given.edited.model, pin.GeometryModel(), geometry(scene))
        self.viewer.initViewer(viewer=self.server, loadModel=True)
        self.viewer.displayFrames(bool(scene.bare))
        feet = scene.at(self.walking.motion.segments[0].configuration[0])[1]
        places = np.array([leg.foot for leg in feet])
        self.size = float(np.ptp(places, axis=0).max())
        self.server.initial_camera.position = places.mean(axis=0) + self.size * np.array([1, -2, 1])
        self.server.initial_camera.look_at = places.mean(axis=0)
        contacts = [c for c in self.walking.demand.contacts if c is not None]
        largest = max(float(np.linalg.norm(c.force_world, axis=-1).max()) for c in contacts)
        self.per_newton = _FORCE * self.size / max(largest, 1e-9)
        normal = self.walking.motion.segments[0].ground_normal
        turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), normal).coeffs()
        sizes = {"cell_size": self.size / 5, "section_size": self.size}
        on_ground = places[places @ normal <= (places @ normal).min() + 1e-3].mean(axis=0)
        self.server.scene.add_grid("/ground", position=on_ground, wxyz=np.roll(turn, 1), **sizes)
        self.show(0.0)

    @property
    def address(self) -> str:
        """Where a browser finds it."""
        host = self.server.get_host()
        return f"http://{'localhost' if host == '0.0.0.0' else host}:{self.server.get_port()}"

    def show(self, at: float) -> None:
        """Show the robot and the forces on its feet.

        Args:
            at: Since the cycle's begin [s].
        """
        segments = self.walking.motion.segments
        moment = float(segments[0].time[0]) + at
        k = max(i for i, s in enumerate(segments) if s.time[0] <= moment or i == 0)
        row = int(np.abs(segments[k].time - moment).argmin())
        contacts = self.walking.demand.contacts[k]
        assert contacts is not None
        model, data = self.viewer.model, self.viewer.data
        with self.server.atomic():
            self.viewer.display(segments[k].configuration[row])
            pin.updateFramePlacements(model, data)
            points = []
            for leg, force in zip(self.legs, contacts.force_world[row], strict=True):
                foot = data.oMf[model.getFrameId(leg.foot, pin.FrameType.BODY)].translation
                if leg.name in contacts.stance:
                    points.append([foot, foot + self.per_newton * force])
            look = {"shaft_radius": 0.012 * self.size, "head_radius": 0.035 * self.size}
            self.server.scene.add_arrows(  # takes the place of those before
                "/forces", np.array(points), _GREEN, head_length=0.07 * self.size, **look
            )

    def play(self, goes_on: Callable[[], bool] = lambda: True) -> None:
        """Play until interrupted, or as long as `goes_on` says."""
        segments = self.walking.motion.segments
        period = float(segments[-1].time[-1] - segments[0].time[0])
        begin = time.monotonic()
        while goes_on():
            time.sleep(1 / _FRAMES)
            self.show((time.monotonic() - begin) % period)

    def stop(self) -> None:
        """End the server."""
        self.server.stop()
