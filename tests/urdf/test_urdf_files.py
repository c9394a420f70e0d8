"""The committed robots: built from their TOML, physical, and read alike by others."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import RobotFileError, UrdfError
from pipeline.robot.check import Finding, check_file, check_robot
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import load_robot_file
from pipeline.robot.urdf_builder import build_urdf, leg_mass, trunk_mass

ROBOTS = ["hexapod.toml", "hexapod_axis90.toml", "leg.toml"]


@pytest.mark.parametrize("name", ROBOTS)
def test_the_committed_urdf_is_not_stale(root: Path, name: str) -> None:
    spec = load_robot_file(root / "urdf" / name)
    assert spec.urdf.read_text(encoding="utf-8") == build_urdf(spec), "run `make urdf`"


def test_every_urdf_has_a_robot_file(root: Path) -> None:
    specs = [load_robot_file(p) for p in (root / "urdf").glob("*.toml")]
    built = {spec.urdf.name for spec in specs if spec.build}
    assert built == {p.name for p in (root / "urdf").glob("*.urdf")}


@pytest.mark.parametrize("name", ROBOTS)
def test_committed_robots_pass_every_check(root: Path, name: str) -> None:
    failed = [f for f in check_file(root / "urdf" / name) if not f.passed]
    assert not failed


@pytest.mark.parametrize("name", ROBOTS)
def test_mass_is_the_stated_mass(root: Path, name: str) -> None:
    robot = load_robot(load_robot_file(root / "urdf" / name))
    total = sum(inertia.mass for inertia in robot.model.inertias)
    assert total == pytest.approx(robot.spec.parameters["total_mass"], rel=1e-9)
    assert total == pytest.approx(
        trunk_mass(robot.spec) + len(robot.spec.legs) * leg_mass(robot.spec)
    )


def test_yourdfpy_reads_the_same_robot(root: Path) -> None:
    import yourdfpy

    for name in ROBOTS:
        spec = load_robot_file(root / "urdf" / name)
        urdf = yourdfpy.URDF.load(str(spec.urdf), load_meshes=False)
        assert set(urdf.actuated_joint_names) == set(spec.joints)
        assert all(
            joint.limit is not None for joint in urdf.robot.joints if joint.type == "revolute"
        )
        assert all(leg.foot in urdf.link_map for leg in spec.legs)


def edited(root: Path, tmp_path: Path, pattern: str, replacement: str) -> Path:
    text = (root / "urdf" / "hexapod.urdf").read_text(encoding="utf-8")
    changed, count = re.subn(pattern, replacement, text, count=1, flags=re.S)
    assert count == 1
    path = tmp_path / "edited.urdf"
    path.write_text(changed, encoding="utf-8")
    return path


def failures(findings: list[Finding]) -> set[str]:
    return {finding.check for finding in findings if not finding.passed}


def test_broken_symmetry_and_wrong_total_are_found(root: Path, tmp_path: Path) -> None:
    robot_file = (root / "urdf" / "hexapod.toml").read_text(encoding="utf-8")
    path = tmp_path / "own.toml"
    heavier = r'(<link name="lf_femur_link">.*?<mass value=)"[^"]*"'
    urdf = edited(root, tmp_path, heavier, r'\1"1.77"')
    text = robot_file.replace('build = "hexapod"', "").replace("hexapod.urdf", urdf.name)
    # Without `build` the geometry parameters have no meaning and the feet are given outright.
    keep = ("total_mass", "foot_stroke", "foot_lift", "walking_speed", "gait_period", "gravity")
    head, *tables = re.split(r"(?m)^(?=\[parameters\.)", text)
    head = re.sub(r'station = "(\w+)"', lambda m: f"neutral_foot = {FEET[m.group(1)]}", head)
    for side, sign in (("left", ""), ("right", "-")):
        head = re.sub(rf'(side = "{side}"\nneutral_foot = \[[^,]*, )', rf"\g<1>{sign}", head)
    path.write_text(
        head + "".join(t for t in tables if t.split("]")[0].split(".")[1] in keep), encoding="utf-8"
    )
    assert failures(check_file(path)) == {"total mass", "mirror symmetry"}


FEET = {
    "front": "[0.27, 0.26, -0.3]",
    "middle": "[0.0, 0.26, -0.3]",
    "rear": "[-0.27, 0.26, -0.3]",
}


def test_a_leg_that_eats_the_trunk_is_refused(root: Path) -> None:
    spec = load_robot_file(root / "urdf" / "hexapod.toml").with_parameters({"femur_mass": 6.0})
    with pytest.raises(RobotFileError, match="legs of .* kg leave .* kg for the trunk"):
        load_robot(spec)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "the file is empty"),
        ("<robot", "malformed XML"),
        ("<sdf/>", "root element is <sdf>"),
        (
            '<robot name="x"><link name="a"><inertial><mass value="nan"/><inertia/></inertial>'
            "</link></robot>",
            "finite",
        ),
        (
            '<robot name="x"><link name="a"/><joint name="j" type="fixed"><parent link="a"/>'
            '<child link="b"/></joint></robot>',
            "line 1: <joint name='j'>: child 'b' is no link; known: a",
        ),
    ],
)
def test_malformed_urdfs_are_one_line(tmp_path: Path, content: str, message: str) -> None:
    path = tmp_path / "bad.urdf"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(UrdfError, match=message) as caught:
        check_file(path)
    assert "\n" not in str(caught.value)


def test_axis_variants_share_the_zero_pose(root: Path) -> None:
    """The angle of joint 1's axis changes nothing at zero."""
    from pipeline.robot.kinematics import foot_positions

    feet = [
        foot_positions(robot.chains, np.zeros((1, 6, 3)))
        for robot in (load_robot(load_robot_file(root / "urdf" / n)) for n in ROBOTS[:2])
    ]
    np.testing.assert_allclose(feet[0], feet[1], atol=1e-12)
    assert check_robot(load_robot(load_robot_file(root / "urdf" / ROBOTS[1])))
