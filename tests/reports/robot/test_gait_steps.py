"""The moving picture of a gait: what each step shows, what moves it, what stands in print."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from pipeline.api.pictures.scene import Scene
from pipeline.api.pictures.walk import STEPS, steps_of
from pipeline.motion.motion import Motion
from pipeline.robot.robot import Robot
from pipeline.simulation.walk_stand import Walking, walk
from reports.figures.robot.gait_steps import gait_steps
from reports.figures.robot.solids import hull_points, outline
from reports.figures.walk import Steps

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def walking(hexapod: Robot) -> Walking:
    return walk(hexapod, {}, samples=101)


@pytest.fixture(scope="module")
def steps(hexapod: Robot, walking: Walking) -> Steps:
    return steps_of(Scene(hexapod), walking)


@pytest.fixture(scope="module")
def svg(steps: Steps) -> ET.Element:
    return ET.fromstring(gait_steps(steps, title="hexapod: <tripod> gait"))


def frames(svg: ET.Element) -> list[ET.Element]:
    return [g for g in svg.findall(f"{SVG}g") if "k" in g.get("class", "").split()]


def test_steps_are_samples_of_the_cycle(walking: Walking, steps: Steps, walk: Motion) -> None:
    """Feet that stand rest in the world; forces carry the weight; torques are the demand's."""
    np.testing.assert_allclose(steps.time, walk.period * np.arange(STEPS) / STEPS)
    world = steps.feet + steps.origin[:, None]
    for i in range(len(steps.legs)):
        for first, last in ((0, STEPS // 2), (STEPS // 2, STEPS)):
            if steps.stands[first:last, i].all():
                assert np.ptp(world[first:last, i], axis=0).max() < 2e-3  # nearest samples
    np.testing.assert_allclose(steps.force[..., 2].sum(axis=1), 40 * 9.81, rtol=0.05)
    assert not steps.force[~steps.stands].any()
    first = walking.demand.segments[0]
    np.testing.assert_array_equal(steps.torque[0], first.torque[0])


def test_every_leg_and_the_trunk_has_a_body(hexapod: Robot, steps: Steps) -> None:
    assert {body.leg for body in steps.bodies} == {*hexapod.leg_names, ""}
    for body in steps.bodies:
        turn = body.rotation @ body.rotation.transpose(0, 2, 1)
        np.testing.assert_allclose(turn, np.tile(np.eye(3), (STEPS, 1, 1)), atol=1e-9)


def test_every_step_is_a_group_that_is_shown_for_its_share_of_the_period(
    svg: ET.Element, steps: Steps
) -> None:
    groups = frames(svg)
    assert len(groups) == STEPS
    style = svg.findtext(f"{SVG}style") or ""
    assert f"{100 / STEPS:.4f}%{{visibility:hidden}}" in style
    assert f"animation:show {steps.period:g}s step-end infinite" in style
    starts = [float(re.findall(r"-?[\d.]+", g.get("style", ""))[0]) % steps.period for g in groups]
    np.testing.assert_allclose(starts, steps.time, atol=2e-3)


def test_in_print_and_without_motion_the_first_step_stands_still(svg: ET.Element) -> None:
    style = svg.findtext(f"{SVG}style") or ""
    still = ".k{animation:none}.first{visibility:visible}"
    assert f"@media print{{{still}}}" in style
    assert f"@media (prefers-reduced-motion:reduce){{{still}}}" in style
    assert [g.get("class") for g in frames(svg)].count("k first") == 1


def test_it_needs_no_script_and_no_network(steps: Steps) -> None:
    text = gait_steps(steps, title="t")
    assert "<script" not in text
    assert re.findall(r"https?://[^\"]*", text) == ["http://www.w3.org/2000/svg"]
    assert gait_steps(steps, title="t") == text


def test_arrows_and_polygons_follow_the_feet_that_stand(svg: ET.Element, steps: Steps) -> None:
    for k, group in enumerate(frames(svg)):
        full = [c for c in group.iter(f"{SVG}circle") if c.get("r") == "4.5"]
        filled = [c.get("fill") != "white" for c in full]
        assert filled == steps.stands[k].tolist()
        words = [t.text or "" for t in group.iter(f"{SVG}text")]
        assert any(f"t = {steps.time[k]:.2f} s" in word for word in words)


def test_nothing_lies_outside_the_picture(svg: ET.Element) -> None:
    for polygon in svg.iter(f"{SVG}polygon"):
        xy = np.array([p.split(",") for p in (polygon.get("points") or "").split()], dtype=float)
        assert xy.min() >= -1
        assert xy[:, 0].max() <= 951
        assert xy[:, 1].max() <= 561


def test_a_short_cycle_is_shown_slower_and_says_so(steps: Steps) -> None:
    from dataclasses import replace

    quick = replace(steps, period=0.5, time=steps.time / 6)
    text = gait_steps(quick, title="t")
    assert "one cycle of 0.5 s, shown in 2 s" in text
    assert "animation:show 2s" in text


def test_outlines_are_convex_hulls() -> None:
    points = np.random.default_rng(1).normal(size=(200, 2))
    ours = outline(points)
    assert len(ours) == len(ConvexHull(points).vertices)
    area = 0.5 * np.sum(ours[:, 0] * np.roll(ours[:, 1], -1) - ours[:, 1] * np.roll(ours[:, 0], -1))
    assert area == pytest.approx(ConvexHull(points).volume, rel=1e-5)
    assert len(outline(np.zeros((5, 2)))) == 1
    solid = np.random.default_rng(2).normal(size=(2000, 3))
    solid /= np.linalg.norm(solid, axis=1)[:, None]  # a ball
    few = hull_points(solid, 0.2)
    assert len(few) < len(ConvexHull(solid).vertices)
    assert ConvexHull(few).volume > 0.9 * ConvexHull(solid).volume
    flat = np.column_stack([points, np.zeros(200)])
    assert len(hull_points(flat, 1e-6)) == 200


def test_a_robot_without_shapes_moves_as_sticks(root: Path, tmp_path: Path) -> None:
    from pipeline.robot.robot import load_robot
    from pipeline.robot.robot_file import load_robot_file
    from tests.pipeline.cli.robots import own_robot

    path = own_robot(root, tmp_path, "<visual>", "<visual>")
    urdf = tmp_path / "own.urdf"
    bare = re.sub(r"<visual>.*?</visual>", "", urdf.read_text(encoding="utf-8"), flags=re.S)
    urdf.write_text(bare, encoding="utf-8")
    robot = load_robot(load_robot_file(path))
    found = steps_of(Scene(robot), walk(robot, {}, samples=51), 4)
    assert {body.leg for body in found.bodies} == set(robot.leg_names)
    ET.fromstring(gait_steps(found, title="t"))
