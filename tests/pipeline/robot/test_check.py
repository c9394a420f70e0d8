"""What `check` lets pass and what not, judged by hand; the committed robots pass."""

import io
from collections.abc import Sequence
from dataclasses import replace

import pinocchio as pin
import pytest
import yourdfpy

import pipeline as lw
from actuators.errors import LegwattError
from pipeline.robot.check import Finding, check_robot, check_second_reader, check_urdf, refused
from pipeline.robot.robot_file import load_robot_file
from pipeline.robot.urdf import build_urdf

Three = tuple[float, float, float]
NOTHING = (0.0, 0.0, 0.0)
LIMIT = 'effort="1" velocity="1" lower="-1" upper="1"'


def link(
    name="a",
    mass=2.0,
    moments=(0.03, 0.04, 0.05),
    products=NOTHING,
    centre=NOTHING,
):
    (ixx, iyy, izz), (ixy, ixz, iyz), (x, y, z) = moments, products, centre
    return (
        f'<link name="{name}"><inertial><origin xyz="{x} {y} {z}"/><mass value="{mass}"/>'
        f'<inertia ixx="{ixx}" ixy="{ixy}" ixz="{ixz}" iyy="{iyy}" iyz="{iyz}" izz="{izz}"/>'
        "</inertial></link>"
    )


def joint(parent, child, kind="revolute", limit=LIMIT, at=0.3):
    """The joint on which a link hangs, called ``joint_`` and the link's name."""
    tag = f"<limit {limit}/>" if limit and kind != "fixed" else ""
    return (
        f'<joint name="joint_{child}" type="{kind}"><origin xyz="{at} 0 0"/>'
        f'<parent link="{parent}"/><child link="{child}"/>{tag}</joint>'
    )


def judged(*parts: str, legs: Sequence[str] = ()) -> list[Finding]:
    return check_urdf(f'<robot name="r">{"".join(parts)}</robot>', "r.urdf", legs)


def failed(*parts: str) -> list[tuple[str, str]]:
    return [(f.subject, f.check) for f in judged(*parts) if not f.passed]


BASE = '<link name="base"/>'
ARM = (link("base"), link("arm"), joint("base", "arm"))


def on_arm(part: str, kind: str = "revolute", at: float = 0.3) -> tuple[str, ...]:
    """The arm with a link "b" on it."""
    return (*ARM, part, joint("arm", "b", kind, at=at))


def crossed(moments: Three, apart: float) -> tuple[str, ...]:
    """A link without mass between two joints so far apart."""
    cross = (link("b", 0.0, moments), joint("base", "b"))
    return (BASE, *cross, link("arm"), joint("b", "arm", at=apart))


def camera(size: float) -> tuple[str, ...]:
    return on_arm(link("b", 1e-3, (0.1 * size, 0.1 * size, size)), "fixed", 0.0)


MASS, INERTIA = [("b", "mass positive")], [("b", "inertia possible")]
SIZE = [("b", "inertia fits the size")]


@pytest.mark.parametrize(
    ("parts", "failing"),
    [
        (ARM, []),
        ((link(), link("b"), joint("a", "b", "fixed")), [("r", "joints that move")]),
        (on_arm(link("b", -0.1), "fixed"), MASS),  # not merged away
        (on_arm(link("b", 0.0, NOTHING), "fixed"), []),
        (on_arm('<link name="b"/>', "fixed"), []),
        (crossed(NOTHING, 0.9e-3), []),
        (crossed(NOTHING, 1.1e-3), MASS),
        (crossed((0.0, 0.0, 1e-6), 0.0), INERTIA),
        # 1 % of the arm's 0.05 kg*m^2 hides what is impossible.
        (camera(6.0e-4), []),
        (camera(6.6e-4), INERTIA),
        # Radius of gyration 10 times the chain of 0.6 m.
        (on_arm(link("b", 1.0, (35.9,) * 3)), []),
        (on_arm(link("b", 1.0, (36.1,) * 3)), SIZE),
        (on_arm(link("b", centre=(0.0, 9.99, 0.0))), []),
        (on_arm(link("b", centre=(0.0, 10.01, 0.0))), SIZE),
        # A cube of 0.6 m of steel has 1696 kg.
        (on_arm(link("b", 1690.0, (169.0,) * 3)), []),
        (on_arm(link("b", 1693.0, (169.0,) * 3)), [("r", "total mass")]),
        (on_arm(link("b"), at=9.99), []),
        (on_arm(link("b"), at=10.01), [("joint_b", "lengths in metres")]),
    ],
)
def test_what_fails_is_named(parts, failing):
    assert failed(*parts) == failing


@pytest.mark.parametrize(
    ("moments", "products", "wrong"),
    [
        ((1.0, 1.0, -0.9e-6), NOTHING, ""),  # rounding
        ((1.0, 1.0, -1.1e-6), NOTHING, "negative"),
        ((1.0, 2.0, 3.0 + 2.9e-6), NOTHING, ""),  # written with few digits
        ((1.0, 2.0, 3.0 + 3.1e-6), NOTHING, "largest"),
        # A point of 2 kg within 1 um: moments that are rounding.
        ((1e-12, 1e-12, 3.9e-12), NOTHING, ""),
        ((1e-12, 1e-12, 4.1e-12), NOTHING, "largest"),
        # Equal moments, one product p: principal moments 1 - p, 1, 1 + p.
        ((1.0, 1.0, 1.0), (0.6, 0.0, 0.0), "largest"),
        ((1.0, 1.0, 1.0), (0.0, 0.0, 1.1), "negative"),
    ],
)
def test_inertia_is_that_of_a_body(moments, products, wrong):
    every = judged(link("b", moments=moments, products=products))
    (finding,) = (f for f in every if f.check == "inertia possible")
    assert finding.passed is not bool(wrong)
    assert wrong in finding.detail


@pytest.mark.parametrize(
    ("moments", "goes_on"), [((0.02, 0.03, 0.09), True), ((-0.001, 0.03, 0.02), False)]
)
def test_an_inertia_beyond_the_triangle_stops_all_but_a_comparison_with_a_log(moments, goes_on):
    found = judged(*on_arm(link("b", moments=moments)))
    if goes_on:
        (kept,) = refused(found, "r.urdf", tolerant=True)
        assert kept.startswith("b: inertia possible fails")
    for tolerant in (False, not goes_on):
        with pytest.raises(LegwattError, match="b: inertia possible fails"):
            refused(found, "r.urdf", tolerant=tolerant)


def test_the_root_of_a_fixed_robot_may_be_anything():
    arm = joint("b", "arm") + link("arm", moments=(0.02, 0.03, 0.09))
    text = f'<robot name="r">{link("b", mass=0.0)}{arm}</robot>'
    floating, fixed = (check_urdf(text, "r.urdf", floating=floats) for floats in (True, False))
    assert [f.subject for f in floating if not f.passed] == ["b", "arm"]
    assert [f.subject for f in fixed if not f.passed] == ["arm"]
    (note,) = [f for f in fixed if f.note]
    assert "the base is fixed" in note.detail


def test_a_mimic_joint_is_held_outside_legs_and_a_floating_one_fails_unless_fixed():
    def hung(kind: str, inner: str = "", legs: tuple[str, ...] = ()) -> list[tuple[str, bool]]:
        at = joint("arm", "b", kind).replace("</joint>", f"{inner}</joint>")
        found = judged(*ARM, link("b"), at, legs=legs)
        return [(f.subject, f.passed) for f in found if f.note or not f.passed]

    mimic = '<mimic joint="joint_arm"/>'
    assert hung("revolute", mimic) == [("joint_b", True)]
    assert hung("revolute", mimic, ("joint_b",)) == hung("revolute", mimic, ("joint_arm",))
    assert hung("revolute", mimic, ("joint_b",)) == [("joint_b", False)]
    assert hung("floating") == [("joint_b", False)]
    assert not hung("fixed", mimic)


@pytest.mark.parametrize(
    ("lower", "upper", "outcome"),
    [
        (1, 1, "note"),
        (1.001, 1, "fails"),
        (-1, 12.56, "good"),  # two turns are the most, unless the number is none
        (-1, 12.57, "fails"),
        (-1440, 1, "fails"),
        (-1440.1, 1, "good"),
    ],
)
def test_limits_leave_a_joint_something_to_do(lower, upper, outcome):
    limit = f'effort="1" velocity="1" lower="{lower}" upper="{upper}"'
    every = judged(BASE, link(), joint("base", "a", limit=limit))
    (found,) = (f for f in every if f.check == "limits")
    assert ("fails" if not found.passed else "note" if found.note else "good") == outcome


@pytest.mark.parametrize(("share", "near"), [(0.0049, True), (0.0051, False), (-0.0051, False)])
def test_the_urdf_weighs_what_the_file_states_within_half_a_percent(hexapod, share, near):
    model = hexapod.model.copy()
    body = model.inertias[1]
    model.inertias[1] = pin.Inertia(body.mass + share * 40.0, body.lever, body.inertia)
    found = check_robot(replace(hexapod, model=model))
    assert [f.passed for f in found if f.check == "total mass"] == [near]


KINDS = """<robot name="arm">
  <link name="base"/><link name="upper"/><link name="fore"/><link name="slide"/>
  <joint name="b" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.1" rpy="0.3 -0.2 0.7"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="a" type="continuous"><parent link="upper"/><child link="fore"/>
    <origin xyz="0.3 0 0"/><axis xyz="0 0 1"/></joint>
  <joint name="c" type="prismatic"><parent link="fore"/><child link="slide"/>
    <origin xyz="0 0.2 0"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
</robot>"""


@pytest.mark.parametrize(
    ("old", "new", "alike"),
    [
        ("", "", True),
        ('rpy="0.3 -0.2 0.7"', 'rpy="0.3 -0.2 0.70001"', False),
        ('rpy="0.3 -0.2 0.7"', 'rpy="0.3 -0.2 0.70000001"', True),  # rounding
        ('axis xyz="0 0 1"', 'axis xyz="0 0 -1"', False),
    ],
)
def test_what_one_of_them_reads_otherwise_is_named(monkeypatch, old, new, alike):
    load = yourdfpy.URDF.load
    read = io.BytesIO(KINDS.replace(old, new).encode())
    monkeypatch.setattr(yourdfpy.URDF, "load", lambda _, **options: load(read, **options))
    found = check_second_reader(KINDS, "arm.urdf")
    assert (found.passed, found.note) == (alike, False)
    assert ("lies elsewhere" in found.detail) is not alike


ROBOTS = ["hexapod.toml", "hexapod_axis90.toml", "leg.toml"]


@pytest.mark.parametrize("name", ROBOTS)
def test_committed_robots_are_built_from_their_files_and_pass_every_check(root, name):
    spec = load_robot_file(root / "urdf" / name)
    assert spec.urdf.read_text(encoding="utf-8") == build_urdf(spec), "run `make urdf`"
    assert not [f for f in lw.check(root / "urdf" / name) if not f.passed]
