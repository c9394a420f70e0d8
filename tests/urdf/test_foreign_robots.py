"""Robots that others publish pass, although they hang sensors of 0 kg on fixed joints."""

from __future__ import annotations

import json
import re
from pathlib import Path

import example_robot_data
import numpy as np
import pinocchio as pin
import pytest

from pipeline.dynamics.joint_demand import segment_demand
from pipeline.errors import GaitError
from pipeline.motion.standing import standing_posture
from pipeline.robot.check import check_file
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import load_robot_file
from pipeline.robot.urdf_check import MERGED

DOG = ("{leg}_hip_joint", "{leg}_thigh_joint", "{leg}_calf_joint")
#: URDF: base link, legs (left front, left hind, right front, right hind), joints, foot, place [m]
ROBOTS: dict[str, tuple[str, tuple[str, ...], tuple[str, ...], str, tuple[float, ...]]] = {
    "go2_description/urdf/go2.urdf": (
        "base",
        ("FL", "RL", "FR", "RR"),
        DOG,
        "{leg}_foot",
        (0.19, 0.14, -0.3),
    ),
    "a1_description/urdf/a1.urdf": (
        "base",
        ("FL", "RL", "FR", "RR"),
        DOG,
        "{leg}_foot",
        (0.18, 0.13, -0.3),
    ),
    "laikago_description/urdf/laikago.urdf": (
        "trunk",
        ("FL", "RL", "FR", "RR"),
        DOG,
        "{leg}_foot",
        (0.22, 0.14, -0.35),
    ),
    "hyq_description/robots/hyq_no_sensors.urdf": (
        "base_link",
        ("lf", "lh", "rf", "rh"),
        ("{leg}_haa_joint", "{leg}_hfe_joint", "{leg}_kfe_joint"),
        "{leg}_foot",
        (0.37, 0.32, -0.6),
    ),
    "anymal_b_simple_description/robots/anymal.urdf": (
        "base",
        ("LF", "LH", "RF", "RH"),
        ("{leg}_HAA", "{leg}_HFE", "{leg}_KFE"),
        "{leg}_FOOT",
        (0.35, 0.22, -0.45),
    ),
}
NUMBERS = {
    "foot_stroke": (0.1, "m"),
    "foot_lift": (0.05, "m"),
    "walking_speed": (0.2, "m/s"),
    "gait_period": (1, "s"),
    "gravity": (9.81, "m/s^2"),
}


def folder() -> Path:
    return Path(example_robot_data.getModelPath("go2_description"))


def robot_file(name: str, path: Path) -> tuple[Path, float]:
    """A robot file for a published URDF, and the URDF's mass [kg]."""
    urdf = folder() / name
    base, legs, joints, foot, (x, y, z) = ROBOTS[name]
    model = pin.buildModelFromUrdf(str(urdf))
    mass = sum(inertia.mass for inertia in model.inertias)
    lines = ["[robot]", 'name = "q"', f"urdf = {json.dumps(str(urdf))}", f'base_link = "{base}"']
    for k, leg in enumerate(legs):
        place = [x if k % 2 == 0 else -x, y if k < 2 else -y, z]
        lines += [f"[legs.{leg}]", f"joints = {json.dumps([j.format(leg=leg) for j in joints])}"]
        lines += [f'foot = "{foot.format(leg=leg)}"', f"neutral_foot = {place}"]
        lines += [f'side = "{"left" if k < 2 else "right"}"']
    lines += ["[gait]", 'transfer_path = "harmonic"']
    for key, (value, unit) in {"total_mass": (round(mass, 2), "kg"), **NUMBERS}.items():
        lines += [f"[parameters.{key}]", f"value = {value}", f'unit = "{unit}"']
        lines += ['basis = "published"', 'source = "data sheet"']
    path.write_text("\n".join(lines), encoding="utf-8")
    return path, mass


@pytest.mark.parametrize("name", ROBOTS)
def test_published_robots_pass_and_say_what_merged(name: str) -> None:
    findings = check_file(folder() / name)
    assert not [finding for finding in findings if not finding.passed]
    merged = [f.detail for f in findings if f.check == MERGED]
    assert merged
    assert all(re.search(r": one body of [\d.]+ kg$", detail) for detail in merged)


def test_go2_names_its_sensors() -> None:
    findings = check_file(folder() / "go2_description/urdf/go2.urdf")
    (detail,) = (f.detail for f in findings if (f.subject, f.check) == ("base", MERGED))
    assert "imu (0 kg), radar (0 kg)" in detail


@pytest.mark.parametrize("name", ROBOTS)
def test_published_robots_stand_on_four_feet(name: str, tmp_path: Path) -> None:
    """With the posture that the refusal offers, where one is needed; the feet carry the weight."""
    path, mass = robot_file(name, tmp_path / "robot.toml")
    assert not [finding for finding in check_file(path) if not finding.passed]
    refusal = ""
    try:
        standing_posture(load_robot(load_robot_file(path)))
    except GaitError as error:
        refusal = str(error)
    offers = re.findall(r"legs\.(\w+): (\[[^\]]*\])", refusal)
    assert bool(offers) == bool(refusal)
    text = path.read_text(encoding="utf-8")
    for leg, offer in offers:
        text = text.replace(f"[legs.{leg}]", f"[legs.{leg}]\nstart_posture = {offer}")
    path.write_text(text, encoding="utf-8")
    robot = load_robot(load_robot_file(path))
    _, contacts = segment_demand(robot, standing_posture(robot))
    assert contacts is not None
    assert contacts.force_world[0, :, 2].sum() == pytest.approx(9.81 * mass, rel=1e-9)
    assert np.all(contacts.force_world[0, :, 2] > 0)
