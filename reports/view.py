"""Plays a walked cycle in a browser: Pinocchio's Viser visualizer, ground forces as arrows.

viser is an optional extra. It serves a page with everything in it; no network is needed.
"""

from __future__ import annotations

import io
import time
from contextlib import redirect_stdout
from typing import Any

import numpy as np
import pinocchio as pin

from actuators.errors import LegwattError
from pipeline.simulation.machine import Machine
from reports.scene import geometry

_GREEN = (0, 158, 115)
_FRAMES = 30.0  # a second
_FORCE = 0.7  # the largest force's arrow, in distances of the feet


def play(machine: Machine, host: str, port: int, frames: int | None = None) -> None:
    """Walk one cycle and show it over and over until interrupted.

    Args:
        machine: Robot and gait.
        host: Address to listen on.
        port: To listen on; the next free one where it is taken.
        frames: How many to show; without end by default.

    Raises:
        LegwattError: The package viser is not installed.
        StanceError: A foot would have to pull or slide.
    """
    from pinocchio.visualize import ViserVisualizer

    try:
        import viser
    except ImportError:
        raise LegwattError(
            "view needs the package viser, which is not installed; `make view` installs it, or "
            "`.venv/bin/python -m pip install --require-hashes --no-deps -r reports/view.lock`"
        ) from None
    robot, walking = machine.edited, machine.walk({})
    forces = [c.force_world for c in walking.demand.contacts if c is not None]
    feet = [c.position for c in walking.demand.contacts if c is not None]
    size = float(np.ptp(feet[0][0], axis=0).max())
    per_newton = _FORCE * size / max(float(np.abs(np.concatenate(forces)).max()), 1e-9)
    with redirect_stdout(io.StringIO()):  # a table of addresses: a line says it below
        server: Any = viser.ViserServer(host=host, port=port, verbose=False)
    viewer = ViserVisualizer(robot.model, pin.GeometryModel(), geometry(robot)[0])
    viewer.initViewer(viewer=server, loadModel=True)
    server.initial_camera.position = size * np.array([1, -2, 1])
    server.initial_camera.look_at = np.zeros(3)
    print(f"open http://{host}:{server.get_port()} in a browser; Ctrl-C ends it", flush=True)
    segments = walking.motion.segments
    first, last = float(segments[0].time[0]), float(segments[-1].time[-1])
    begin, shown = time.monotonic(), 0
    try:
        while frames is None or shown < frames:
            at = first + (time.monotonic() - begin) % (last - first)
            k = max(i for i, s in enumerate(segments) if s.time[0] <= at)
            row = int(np.abs(segments[k].time - at).argmin())
            contacts = walking.demand.contacts[k]
            assert contacts is not None
            viewer.display(segments[k].configuration[row])
            pin.updateFramePlacements(viewer.model, viewer.data)
            arrows = []
            for leg, force in zip(robot.spec.legs, contacts.force_world[row], strict=True):
                frame = viewer.model.getFrameId(leg.foot, pin.FrameType.BODY)
                foot = viewer.data.oMf[frame].translation
                arrows += [[foot, foot + per_newton * force]] * (leg.name in contacts.stance)
            look = {"shaft_radius": 0.012 * size, "head_radius": 0.035 * size}
            look["head_length"] = 0.07 * size
            server.scene.add_arrows("/forces", np.array(arrows), _GREEN, **look)
            shown += 1
            time.sleep(1 / _FRAMES)
    finally:
        server.stop()
