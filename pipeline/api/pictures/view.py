"""Plays a cycle with viser: the robot, ground forces as arrows, joint torques as balls.

viser is an optional extra. It serves a page with everything in it; no network is needed.
"""

from __future__ import annotations

import io
import time
from collections.abc import Callable, Iterable
from contextlib import redirect_stdout
from types import ModuleType
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from actuators.arrays import Array
from pipeline.api.pictures.scene import Scene
from pipeline.api.pictures.walk import steps_of
from pipeline.errors import ReportError
from pipeline.simulation.settings import Settings
from reports.figures.robot.solids import Solid, reach
from reports.figures.walk import Steps
from reports.pages.robot_words import gait_and_conditions

#: Steps of a cycle.
STEPS = 120
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


def player(given: Settings, *, host: str = "127.0.0.1", port: int = 8080) -> Player:
    """Walk one cycle and serve it to a browser.

    Args:
        given: Robot and gait.
        host: Address to listen on.
        port: To listen on; the next free one where it is taken.

    Raises:
        ReportError: The package viser is not installed.
        StanceError: A foot would have to pull or slide.
    """
    walking = given.walk({})
    title = f"{given.machine.spec.name}, {gait_and_conditions(given.machine.spec)}"
    return Player(title, steps_of(Scene(given.machine), walking, STEPS), host, port)


class Player:
    """A server that shows one cycle over and over."""

    def __init__(self, title: str, steps: Steps, host: str, port: int) -> None:
        """Start the server; nothing moves before `show` or `play`.

        Args:
            title: Robot and gait.
            steps: The cycle.
            host: Address to listen on.
            port: To listen on; the next free one where it is taken.
        """
        self.title, self.steps = title, steps
        self.size = reach([solid for body in steps.bodies for solid in body.solids])
        with redirect_stdout(io.StringIO()):  # its table of addresses; `address` says it in a line
            self.server: Any = viser_module().ViserServer(host=host, port=port, verbose=False)
        self.server.gui.main_panel.dock_right()
        self.bodies = [
            self.server.scene.add_mesh_trimesh(f"/robot/{body.name}", triangles(body.solids))
            for body in steps.bodies
        ]
        self.turns = [quaternions(body.rotation) for body in steps.bodies]
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

    def _ground(self) -> None:
        """A grid on the ground, whose cells are a tenth of the robot's size."""
        steps = self.steps
        feet = steps.feet[0][steps.stands[0]].mean(axis=0)
        normal = self.steps.ground
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
        steps = self.steps
        scene = self.server.scene
        largest = float(np.linalg.norm(steps.force, axis=-1).max())
        self.per_newton = _FORCE * self.size / max(largest, 1e-9)
        vertices, faces = arrow(0.03 * self.size)
        self.forces = [
            scene.add_mesh_simple(f"/forces/{leg}", vertices, faces, color=_GREEN)
            for leg in steps.legs
        ]
        self.largest = {unit: 1e-9 for unit in self.steps.units}
        for j, unit in enumerate(self.steps.units):
            self.largest[unit] = max(self.largest[unit], float(np.abs(steps.torque[:, j]).max()))
        self.torques = [
            scene.add_icosphere(f"/torques/{name}", radius=1.0, subdivisions=2, opacity=0.75)
            for name in self.steps.joints
        ]

    def _controls(self) -> None:
        steps, gui = self.steps, self.server.gui
        gui.add_markdown(f"## {self.title}")
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
        middle = self.steps.mass_centre[0]
        camera.position = middle + self.size * np.array([1.2, -1.6, 0.9])
        camera.look_at = middle - [0.0, 0.0, 0.25 * self.size]

    def show(self, k: int) -> None:
        """Show one step.

        Args:
            k: From 0.
        """
        steps = self.steps
        with self.server.atomic():
            for handle, body, turns in zip(self.bodies, self.steps.bodies, self.turns, strict=True):
                handle.position, handle.wxyz = body.position[k], turns[k]
            moved = steps.origin[k] - steps.origin[0]
            self.grid.position = self.grid_at - np.fmod(moved, self.size)
            for i, shown in enumerate(self.forces):
                self._point(shown, steps.feet[k, i], steps.force[k, i])
            for j, ball in enumerate(self.torques):
                torque = float(steps.torque[k, j])
                share = abs(torque) / self.largest[self.steps.units[j]]
                ball.position = steps.places[k, j]
                ball.scale = _TORQUE * self.size * max(float(np.sqrt(share)), 1e-3)
                ball.color = _PLUS if torque >= 0 else _MINUS
                ball.visible = bool(self.with_torques.value)
            self.words.content = self._words(k)

    def _point(self, shown: Any, foot: Array, force: Array) -> None:
        """An arrow from a foot along the force on it."""
        size = float(np.linalg.norm(force))
        shown.visible = bool(self.with_forces.value) and size > 0
        if shown.visible:
            shown.position, shown.wxyz = foot, towards(force / size)
            shown.scale = (1.0, 1.0, self.per_newton * size)

    def _words(self, k: int) -> str:
        """Time, margin and torques in words."""
        steps = self.steps
        rows = "\n".join(
            f"| {name} | {steps.torque[k, j]:.3g} {unit} |"
            for j, (name, unit) in enumerate(zip(self.steps.joints, self.steps.units, strict=True))
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
        steps = self.steps
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


def triangles(solids: Iterable[Solid]) -> Any:
    """Surfaces as one Trimesh with a colour for every face."""
    import trimesh

    parts: list[Any] = []
    for solid in solids:
        part: Any = trimesh.Trimesh(solid.points, solid.faces, process=False)
        rgba = np.column_stack([solid.colors, np.ones(len(solid.faces))])
        part.visual.face_colors = np.round(255 * rgba).astype(np.uint8)
        parts.append(part)
    return trimesh.util.concatenate(parts)


def quaternions(rotation: Array) -> Array:
    """Rotations as w, x, y, z: (S, 3, 3) to (S, 4)."""
    return np.roll(Rotation.from_matrix(rotation).as_quat(), 1, axis=-1)


def towards(direction: Array) -> Array:
    """The least rotation from z to a unit vector, as w, x, y, z, shape (4,)."""
    turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), direction)
    return np.array([turn.w, turn.x, turn.y, turn.z])


def arrow(width: float) -> tuple[Array, NDArray[np.intp]]:
    """Vertices and faces of an arrow along z, one long, to be scaled.

    Args:
        width: Radius of its head [m].
    """
    import trimesh

    shaft: Any = trimesh.creation.cylinder(
        radius=0.4 * width, segment=np.array([[0, 0, 0], [0, 0, 0.8]])
    )
    head: Any = trimesh.creation.cone(radius=width, height=0.2)
    head.apply_translation([0, 0, 0.8])
    both: Any = trimesh.util.concatenate([shaft, head])
    return np.asarray(both.vertices, float), np.asarray(both.faces, dtype=np.intp)
