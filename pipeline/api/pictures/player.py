"""Plays a cycle with viser: the robot, ground forces as arrows, joint torques as balls.

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
from numpy.typing import NDArray

from pipeline.api.pictures.cycle import Cycle, arrow, quaternions, towards, triangles
from reports.errors import ReportError

Array = NDArray[np.float64]
_GREEN, _PLUS, _MINUS = (0, 158, 115), (0, 114, 178), (230, 159, 0)
#: In sizes of the robot: the largest force's arrow, the largest torque's ball.
_FORCE, _TORQUE = 0.8, 0.075
_FRAMES = 30.0  # a second


def viser_module() -> ModuleType:
    """The package viser.

    Raises:
        ReportError: It is not installed.
    """
    try:
        import viser
    except ImportError:
        raise ReportError(
            "view needs the package viser, which is not installed; `make view` installs it, or "
            "`.venv/bin/python -m pip install --require-hashes --no-deps -r reports/view.lock`"
        ) from None
    module: ModuleType = viser
    return module


class Player:
    """A server that shows one cycle over and over."""

    def __init__(self, cycle: Cycle, host: str, port: int) -> None:
        """Start the server; nothing moves before `show` or `play`.

        Args:
            cycle: To be shown.
            host: Address to listen on.
            port: To listen on; the next free one where it is taken.
        """
        self.cycle = cycle
        points = np.concatenate([s.points for b in cycle.bodies for s in b.solids])
        self.size = float(np.ptp(points, axis=0).max())
        with redirect_stdout(io.StringIO()):  # its table of addresses; `address` says it in a line
            self.server: Any = viser_module().ViserServer(host=host, port=port, verbose=False)
        self.server.gui.main_panel.dock_right()
        self.bodies = [self._body(i) for i in range(len(cycle.bodies))]
        self.turns = [quaternions(body.rotation) for body in cycle.bodies]
        self._ground()
        self._markers()
        self._controls()
        self._camera()
        self.show(0)

    @property
    def address(self) -> str:
        """Where a browser finds it."""
        host = self.server.get_host()
        return f"http://{'localhost' if host == '0.0.0.0' else host}:{self.server.get_port()}"

    def _body(self, index: int) -> Any:
        body = self.cycle.bodies[index]
        return self.server.scene.add_mesh_trimesh(f"/robot/{body.name}", triangles(body.solids))

    def _ground(self) -> None:
        """A grid on the ground, whose cells are a tenth of the robot's size."""
        steps = self.cycle.steps
        feet = steps.feet[0][steps.stands[0]].mean(axis=0)
        normal = self.cycle.ground
        along = np.array([1.0, 0.0, 0.0]) - normal[0] * normal
        along /= np.linalg.norm(along)
        turn = np.column_stack([along, np.cross(normal, along), normal])
        self.grid = self.server.scene.add_grid(
            "/ground",
            width=6 * self.size,
            height=6 * self.size,
            cell_size=self.size / 10,
            section_size=self.size,
            wxyz=quaternions(turn[None])[0],
            position=feet,
        )
        self.grid_at = feet

    def _markers(self) -> None:
        steps = self.cycle.steps
        scene = self.server.scene
        largest = float(np.linalg.norm(steps.force, axis=-1).max())
        self.per_newton = _FORCE * self.size / max(largest, 1e-9)
        vertices, faces = arrow(0.03 * self.size)
        self.forces = [
            scene.add_mesh_simple(f"/forces/{leg}", vertices, faces, color=_GREEN)
            for leg in steps.legs
        ]
        self.largest = {unit: 1e-9 for unit in self.cycle.units}
        for j, unit in enumerate(self.cycle.units):
            self.largest[unit] = max(self.largest[unit], float(np.abs(steps.torque[:, j]).max()))
        self.torques = [
            scene.add_icosphere(f"/torques/{name}", radius=1.0, subdivisions=2, opacity=0.75)
            for name in self.cycle.joints
        ]

    def _controls(self) -> None:
        steps, gui = self.cycle.steps, self.server.gui
        gui.add_markdown(f"## {self.cycle.title}")
        self.playing = gui.add_checkbox("play", True)
        self.speed = gui.add_slider("speed", min=0.05, max=2.0, step=0.05, initial_value=1.0)
        self.step = gui.add_slider("step", min=0, max=steps.time.size - 1, step=1, initial_value=0)
        self.with_forces = gui.add_checkbox("ground forces", True)
        self.with_torques = gui.add_checkbox("joint torques", True)
        self.words = gui.add_markdown("")
        self.step.on_update(lambda _: self.show(int(self.step.value)))
        for box in (self.with_forces, self.with_torques):
            box.on_update(lambda _: self.show(int(self.step.value)))

    def _camera(self) -> None:
        camera = self.server.initial_camera
        middle = self.cycle.steps.mass_centre[0]
        camera.position = middle + self.size * np.array([1.2, -1.6, 0.9])
        camera.look_at = middle - [0.0, 0.0, 0.25 * self.size]

    def show(self, k: int) -> None:
        """Show one step.

        Args:
            k: From 0.
        """
        steps = self.cycle.steps
        with self.server.atomic():
            for handle, body, turns in zip(self.bodies, self.cycle.bodies, self.turns, strict=True):
                handle.position, handle.wxyz = body.position[k], turns[k]
            moved = steps.origin[k] - steps.origin[0]
            self.grid.position = self.grid_at - np.fmod(moved, self.size)
            for i, shown in enumerate(self.forces):
                self._point(shown, steps.feet[k, i], steps.force[k, i])
            for j, ball in enumerate(self.torques):
                torque = float(steps.torque[k, j])
                share = abs(torque) / self.largest[self.cycle.units[j]]
                ball.position = steps.joints[k, j]
                ball.scale = _TORQUE * self.size * max(float(np.sqrt(share)), 1e-3)
                ball.color = _PLUS if torque >= 0 else _MINUS
                ball.visible = bool(self.with_torques.value)
            self.words.content = self._said(k)

    def _point(self, shown: Any, foot: Array, force: Array) -> None:
        """An arrow from a foot along the force on it."""
        size = float(np.linalg.norm(force))
        shown.visible = bool(self.with_forces.value) and size > 0
        if shown.visible:
            shown.position, shown.wxyz = foot, towards(force / size)
            shown.scale = (1.0, 1.0, self.per_newton * size)

    def _said(self, k: int) -> str:
        """Time, margin and torques in words."""
        steps = self.cycle.steps
        rows = "\n".join(
            f"| {name} | {steps.torque[k, j]:.3g} {unit} |"
            for j, (name, unit) in enumerate(zip(self.cycle.joints, self.cycle.units, strict=True))
        )
        forces = "\n".join(
            f"| {leg} | {np.linalg.norm(steps.force[k, i]):.3g} N |"
            for i, leg in enumerate(steps.legs)
        )
        return (
            f"t = {steps.time[k]:.2f} s, stability margin {1e3 * steps.margin[k]:.0f} mm\n\n"
            f"| foot | force |\n| --- | --- |\n{forces}\n\n"
            f"| joint | torque |\n| --- | --- |\n{rows}"
        )

    def play(self, goes_on: Callable[[], bool] = lambda: True) -> None:
        """Play until interrupted, or as long as `goes_on` says."""
        steps = self.cycle.steps
        at, before = 0.0, time.monotonic()
        while goes_on():
            time.sleep(1 / _FRAMES)
            now = time.monotonic()
            if self.playing.value:
                at = (at + (now - before) * float(self.speed.value)) % steps.period
                self.step.value = int(at / steps.period * steps.time.size) % steps.time.size
            else:
                at = float(steps.time[int(self.step.value)])
            before = now

    def stop(self) -> None:
        """End the server."""
        self.server.stop()
