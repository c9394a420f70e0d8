"""Figures of robots with other legs than the hexapod's: 2 to 8 legs of 2 to 7 joints, and more."""

from __future__ import annotations

import re
from pathlib import Path

import matplotlib
import numpy as np
import pytest

from actuators.energy.energy import StageEnergy
from actuators.shaft import DCMotor, ShaftSeries
from pipeline.api.pictures.scene import Scene
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import load_robot_file
from reports.figures.bars import electrical_energy_figure
from reports.figures.demand import ground_forces_figure, joint_torques_figure
from reports.figures.motor_limits import motor_limits_figure
from reports.figures.robot.gait_view import gait_figure
from reports.figures.robot.joint_directions import joint_directions_figure
from reports.figures.robot.robot_view import robot_figure
from reports.figures.robot.solids import JointMark, Leg, sticks
from reports.figures.stage_energy import stage_energy_figure
from reports.figures.walk import Stretch
from reports.typeset import number
from tests.reports import geometry
from tests.reports.walks import crawl, stretch

X, Y, Z = np.eye(3)


def texts(figure) -> list[str]:
    return [t.get_text() for t in figure.findobj(matplotlib.text.Text) if t.get_text()]


def leg(name: str, x: float, y: float, axes: list[np.ndarray], slides: int | None = None) -> Leg:
    """A leg of equal links down a staircase to the ground."""
    count = len(axes)
    marks = tuple(
        JointMark(
            f"{name}_{k}",
            np.array([x, y + np.sign(y) * 0.03 * k, 0.5 - 0.4 * k / count]),
            axis,
            slides=k == slides,
        )
        for k, axis in enumerate(axes)
    )
    return Leg(name, marks, np.array([x, y + np.sign(y) * 0.03 * count, 0.0]))


def drawn(legs: list[Leg]) -> list:
    return [s for one in legs for s in sticks(one, legs, range(len(one.joints) + 1))]


def part(first: float, joints: int, legs: tuple[str, ...], stance: tuple[str, ...]) -> Stretch:
    time = np.linspace(first, first + 1, 11)
    torque = np.sin(time[:, None] + np.arange(joints))
    normal = np.tile([float(one in stance) for one in legs], (11, 1))
    friction = np.where(normal > 0, 0.1, np.nan)
    given = {"torque": torque, "normal": normal, "friction": friction}
    return stretch(time, legs, stance, **given, margin=np.full(11, 0.03))


@pytest.mark.parametrize(("count", "depth"), [(2, 7), (4, 2), (8, 7)])
def test_every_joint_has_a_line_in_the_panel_of_its_place(count: int, depth: int) -> None:
    legs = {f"l{i}": [f"l{i}_{k}" for k in range(depth)] for i in range(count)}
    joints = [joint for own in legs.values() for joint in own]
    names = tuple(legs)
    parts = [part(0, len(joints), names, names), part(1, len(joints), names, names[1:])]
    figure = joint_torques_figure(parts, joints, legs, title="t")
    assert len(figure.axes) == depth
    for k, axes in enumerate(figure.axes):
        curves = [line for line in axes.lines if len(line.get_xdata()) == 11]
        assert len(curves) == 2 * count
        np.testing.assert_array_equal(curves[0].get_ydata(), parts[0].torque[:, k])
    assert geometry.outside(figure) == []
    thin = min(line.get_linewidth() for line in figure.axes[0].lines)
    assert thin < 1  # the first leg is in the air in the second stretch


def test_legs_of_unequal_length_and_joints_outside_legs_have_their_place() -> None:
    legs = {"a": ["a1", "a2", "a3"], "b": ["b1", "b2"]}
    joints = ["a1", "a2", "a3", "b1", "b2", "arm"]
    only = part(0, 6, ("a", "b"), ("a",))
    figure = joint_torques_figure([only], joints, legs, sliding=["a3"], title="t")
    assert [axes.get_ylabel().split("\n")[0] for axes in figure.axes] == [
        *("joint 1", "joint 2", "joint 3"),
        "outside legs",
    ]
    curves = [[x for x in axes.lines if len(x.get_xdata()) == 11] for axes in figure.axes]
    assert [len(found) for found in curves] == [2, 2, 1, 1]
    np.testing.assert_array_equal(curves[3][0].get_ydata(), only.torque[:, 5])
    assert "force [N]" in figure.axes[2].get_ylabel()
    assert "arm" in texts(figure.legends[0])


def test_ground_forces_state_the_least_margin() -> None:
    legs = ("a", "b", "c", "d")
    parts = [part(0, 1, legs, legs), part(1, 1, legs, legs[1:])]
    figure = ground_forces_figure(parts, legs, title="t")
    assert len(figure.axes) == 3
    assert any("least margin 30 mm" in word for word in texts(figure))


@pytest.mark.parametrize("joints", [2, 7])
def test_energy_figures_hold_up_to_seven_joints(joints: int) -> None:
    labels = {f"j{k}": f"joint {k + 1}" for k in range(joints)}
    stages = [
        StageEnergy(name, tuple(labels), np.arange(1.0, joints + 1), np.full(joints, 0.5))
        for name in ("out", "m", "el")
    ]
    places = {"out": "joint", "m": "motor", "el": "supply"}
    time = np.linspace(0, 1, 21)
    wave = np.sin(2 * np.pi * time)[:, None] * np.arange(1.0, joints + 1)
    series = ShaftSeries.at_joint(tuple(labels), time, wave, 60 * wave, wave, 0.02 * wave)
    motor = DCMotor("motor", 0.03, 0.3, 1000.0, 24.0, 5.0, 70.0)
    figures = (
        stage_energy_figure(stages, labels, places=places, title="t"),
        motor_limits_figure(series, [motor] * joints, labels, [(0.0, 0.5)], title="t"),
        electrical_energy_figure(
            list(labels.values()), {"a": np.arange(1.0, joints + 1)}, reference=None, title="t"
        ),
    )
    for figure in figures:
        assert {f"joint {k + 1}" for k in range(joints)} <= {w.strip() for w in texts(figure)}
        assert geometry.outside(figure) == []
        assert geometry.overlapping(figure) == []


@pytest.mark.parametrize(
    ("axes", "views"),
    [
        ([Z, X, X], ["from ahead", "from above"]),
        ([X, Y, Y], ["from ahead", "from the right"]),
        ([Y, Y], ["from ahead", "from the right"]),
        ([Z, X, Y, Y, Z, Y, X], ["from ahead", "from the right"]),
    ],
)
def test_directions_are_shown_from_the_ends_of_the_axes(
    axes: list[np.ndarray], views: list[str]
) -> None:
    legs = [leg(n, x, y, axes) for n, x, y in (("fr", 0.3, -0.2), ("fl", 0.3, 0.2))]
    figure = joint_directions_figure(drawn(legs), legs, "fl", title="t")
    shown = [panel.get_title(loc="left") for panel in figure.axes[1:]]
    assert set(shown) <= {"from ahead", "from above", "from the right"}
    best = {int(np.argmax(np.abs(axis))) for axis in axes}
    named = {0: "from ahead", 1: "from the right", 2: "from above"}
    if len(best) <= 2:
        assert {named[k] for k in best} <= set(shown)
    assert len(set(shown)) == 2
    words = texts(figure)
    for k, joint in enumerate(legs[1].joints, start=1):
        assert f"{k} {joint.name}" in words
    assert geometry.overlapping(figure) == []
    if len(best) == len(views):
        assert shown == views


def test_a_sliding_joint_gets_a_straight_arrow_and_a_word() -> None:
    legs = [leg(n, 0.3, y, [X, Z], slides=1) for n, y in (("r", -0.2), ("l", 0.2))]
    words = texts(joint_directions_figure(drawn(legs), legs, "r", title="t"))
    assert any("straight arrows: positive sliding" in word for word in words)


@pytest.mark.parametrize("scale", [0.2, 5.0])
def test_a_robot_of_any_size_is_dimensioned_alike(scale: float, root: Path) -> None:
    legs = [
        leg(f"{s}{p}", x, y, [X, Y, Y])
        for p, x in (("f", 0.4), ("h", -0.4))
        for s, y in (("l", 0.2), ("r", -0.2))
    ]
    scaled = [
        Leg(
            one.name,
            tuple(JointMark(j.name, scale * j.position, j.axis) for j in one.joints),
            scale * one.foot,
        )
        for one in legs
    ]
    figure = robot_figure(drawn(scaled), scaled, title="t")
    assert f"{800 * scale:.0f} mm" in texts(figure)
    assert geometry.outside(figure) == []
    assert geometry.overlapping(figure) == []


def test_a_gait_of_many_stances_shows_the_least_stable_instant_of_each() -> None:
    body = np.array([[-0.3, -0.1], [0.3, -0.1], [0.3, 0.1], [-0.3, 0.1]])
    parts = crawl()
    figure = gait_figure(("lf", "rf", "lh", "rh"), parts, shown="rh", body=body, title="t")
    said = [w for w in texts(figure) if w.startswith("least stable")]
    assert len(said) == 4
    for one in parts:
        least = f"stability margin {number(1e3 * float(one.margin.min()))} mm"
        assert any(least in word for word in said)
    assert geometry.outside(figure) == []
    words = texts(figure)
    assert {"120 mm", "50 mm"} <= set(words)  # stroke and height


@pytest.mark.slow
@pytest.mark.parametrize("name", ["solo12", "anymal_c"])
def test_nothing_to_object_to_in_any_figure_of_published_robots(root: Path, name: str) -> None:
    from tests.reports.test_geometry_of_run import objections, run

    every = run(root / "urdf" / f"{name}.toml")
    for figure, draw in every.items():
        assert objections(draw) == [], figure
        if not re.match("robot|zero_pose|gait|actuator_chain", figure):
            words = " ".join(texts(draw()))
            assert f"{name}, crawl gait" in words
            assert "paper" not in words


def test_the_trunk_seen_from_above_is_an_outline_in_its_own_frame(root: Path) -> None:
    scene = Scene(load_robot(load_robot_file(root / "urdf" / "hexapod.toml")))
    outline = scene.trunk_outline()
    np.testing.assert_allclose(np.abs(outline).max(axis=0)[0], 0.3, atol=1e-6)
    assert len(outline) == 4
