"""The robot as a picture: the shapes of its URDF, read and placed by Pinocchio, and its joints.

No number of a result depends on a mesh: where one cannot be read, collision shapes are shown in
place of all, else nothing but the lines between the joints.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import coal
import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull, QhullError

from actuators.arrays import Array
from pipeline.robot.robot import Robot
from reports.figures.style import CYCLE, INK, QUIET, WIDTH, house_style, new_figure, note

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Unit vectors all around, at equal angles (a Fibonacci lattice).
_HEIGHT = np.linspace(-1.0, 1.0, 96)
_TURN = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(_HEIGHT.size)
_AROUND = np.stack([np.cos(_TURN), np.sin(_TURN), np.zeros_like(_TURN)], axis=1)
_BALL = np.sqrt(1.0 - _HEIGHT**2)[:, None] * _AROUND + _HEIGHT[:, None] * [0.0, 0.0, 1.0]
_SIDE = np.sign(_HEIGHT)[:, None] * [0.0, 0.0, 1.0]  # of the equator


def _camera(towards_viewer: Sequence[float], up: Sequence[float] = (0, 0, 1)) -> Array:
    """Rows: the image's right, its up, and the direction towards the viewer, in the world."""
    toward = np.asarray(towards_viewer, float) / np.linalg.norm(towards_viewer)
    right = np.cross(up, toward)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(toward, right), toward])


#: Views by the letters of the axes that are true in them.
VIEWS = {
    "": _camera((1.0, -1.35, 0.85)),
    "xy": _camera((0, 0, 1), up=(0, 1, 0)),
    "yz": _camera((1, 0, 0)),
    "xz": _camera((0, -1, 0)),
}
_NAMES = ("joint axes", "from above", "from ahead", "from the right")


@house_style()
def robot_figure(robot: Robot, configuration: Array, *, title: str, subtitle: str = "") -> Figure:
    """Four views of the robot; arrows show which way its joints turn, axes how long it is.

    Links are drawn in the order of their middles' depth, so that bodies that reach around each
    other may be drawn in the wrong order.

    Args:
        robot: Whose URDF has the shapes.
        configuration: Its posture, shape (nq,).
        title: First line.
        subtitle: Second line; says, too, where meshes are missing.
    """
    shapes, missing = _shapes(robot)
    model, data, placed = robot.model, robot.model.createData(), shapes.createData()
    pin.computeJointJacobians(model, data, configuration)
    pin.updateFramePlacements(model, data)
    pin.updateGeometryPlacements(model, data, shapes, placed)
    centre = pin.centerOfMass(model, data, configuration)
    solids = [
        (corners(one.geometry) * one.meshScale @ at.rotation.T + at.translation, one.meshColor[:3])
        for one, at in zip(shapes.geometryObjects, placed.oMg, strict=True)
    ]
    figure = new_figure(WIDTH, title, "; ".join(filter(None, (subtitle, missing))))
    grid = figure.subplots(2, 2).ravel()
    for axes, (letters, view), name in zip(grid, VIEWS.items(), _NAMES, strict=True):
        _draw(axes, view, solids, robot, data)
        axes.set_title(name, color=QUIET)
        axes.margins(0.12)
        axes.locator_params(nbins=4)
        if not letters:
            axes.set_axis_off()
            continue
        axes.set(xlabel=f"{letters[0]} [m]", ylabel=f"{letters[1]} [m]")
        at = view[:2] @ centre
        axes.plot(*at, "o", markersize=7, color="white", mec=INK, zorder=8)
        axes.plot(*at, "+", markersize=7, color=INK, zorder=8)
    _directions(grid[0], robot, data)
    for leg in robot.spec.legs:
        foot = data.oMf[model.getFrameId(leg.foot, pin.FrameType.BODY)].translation
        look = {"va": "center", "fontweight": "bold"}
        note(grid[1], leg.name.upper(), foot[:2], (0, 8.0 if foot[1] > 0 else -8.0), **look)
        note(grid[0], leg.name.upper(), (VIEWS[""] @ foot)[:2], (0, -6), **look)
    figure.legend(loc="outside lower center", ncols=4)
    return figure


def _shapes(robot: Robot) -> tuple[pin.GeometryModel, str]:
    """Shapes of a robot's links, often none, and what is to be said of meshes.

    ``package://`` is looked for in the folders above the URDF, in ``ROS_PACKAGE_PATH`` and among
    the robots of example-robot-data.
    """
    folder, missing = robot.spec.urdf.parent.absolute(), ""
    places = [folder, *folder.parents]
    spec = find_spec("example_robot_data")
    for root in Path(spec.origin).parents if spec is not None and spec.origin else ():
        share = root / "share" / "example-robot-data"
        places += [share.parent, share, share / "robots"] if share.is_dir() else []
    places += [Path(p) for p in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if p]
    for kind in (pin.GeometryType.VISUAL, pin.GeometryType.COLLISION):
        try:
            found = pin.buildGeomFromUrdfString(
                robot.model, robot.urdf, kind, package_dirs=[*map(str, places)]
            )
            return found, missing
        except (ValueError, RuntimeError):
            missing = "meshes are missing, which no number depends on"
    return pin.GeometryModel(), missing


def corners(shape: Any) -> Array:
    """Points whose convex hull is a shape about its own origin, (P, 3) [m]."""
    match shape:
        case coal.Box():
            return np.asarray(np.sign(_BALL) * shape.halfSide)
        case coal.Sphere():
            return _BALL * shape.radius
        case coal.Capsule():
            return _BALL * shape.radius + _SIDE * shape.halfLength
        case coal.Cylinder():
            return _AROUND * shape.radius + _SIDE * shape.halfLength
    return np.asarray(shape.vertices() if hasattr(shape, "vertices") else shape.points())


def _draw(
    axes: Axes, view: Array, solids: Sequence[tuple[Array, Array]], robot: Robot, data: pin.Data
) -> None:
    """Outlines of the links' convex hulls, and thin lines from joint to joint and to the feet."""
    seen = [(points @ view.T, color) for points, color in solids]
    for points, color in sorted(seen, key=lambda one: float(one[0][:, 2].mean())):
        flat = points[:, :2]
        with suppress(QhullError, ValueError):  # on a line, or too few
            flat = flat[ConvexHull(flat).vertices]
        face, edge = 0.4 + 0.6 * color, 0.3 + 0.4 * color  # pale, so that the legs can be seen
        axes.fill(*flat.T, facecolor=face, edgecolor=edge, lw=0.6, zorder=2)
    model, joints = robot.model, [robot.model.getJointId(joint) for joint in robot.joints]
    feet = [model.getFrameId(leg.foot, pin.FrameType.BODY) for leg in robot.spec.legs]
    ends = [(model.frames[k].parentJoint, data.oMf[k]) for k in feet]
    for start, end in [*ends, *((model.parents[k], data.oMi[k]) for k in joints)]:
        if start in joints:
            path = np.stack([data.oMi[start].translation, end.translation]) @ view.T
            axes.plot(*path[:, :2].T, "o-", color=QUIET, linewidth=1, markersize=2.5, zorder=3)
    axes.set_aspect("equal")
    axes.grid(False)


def _directions(axes: Axes, robot: Robot, data: pin.Data) -> None:
    """An arrow along each joint's axis: positive rotation is right-handed about it."""
    model, view = robot.model, VIEWS[""]
    drawn = float(np.ptp(axes.dataLim.get_points(), axis=0).max())
    unit = 0.7 * drawn if np.isfinite(drawn) else 0.1  # one joint without shapes
    named = set()
    for joint, slides in zip(robot.joints, robot.sliding, strict=True):
        k = model.getJointId(joint)
        depth = sum(model.names[one] in robot.joints for one in model.supports[k])
        jacobian = pin.getJointJacobian(model, data, k, pin.LOCAL_WORLD_ALIGNED)
        column = jacobian.reshape(6, model.nv)[:, model.joints[k].idx_v]  # flat of one joint
        axis = column[:3] if slides else column[3:]
        color, origin = CYCLE[(depth - 1) % len(CYCLE)], data.oMi[k].translation
        tail, tip = ((origin + np.array([[-0.06], [0.14]]) * unit * axis) @ view.T)[:, :2]
        look: dict[str, Any] = {"arrowstyle": "-|>,head_width=0.15,head_length=0.3"}
        look |= {"color": color, "linewidth": 2.2 if slides else 1, "shrinkA": 0, "shrinkB": 0}
        if np.hypot(*(tip - tail)) > 0.02 * unit:  # not towards the viewer
            axes.annotate("", tip, tail, arrowprops=look, zorder=7)
        label = "_" if depth in named else f"joint {depth}"
        named.add(depth)
        axes.plot(*(view @ origin)[:2], "o", markersize=3, color=color, zorder=7, label=label)
