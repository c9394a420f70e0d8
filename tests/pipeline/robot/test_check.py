"""What `check` lets pass and what not, on links small enough to judge by hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pinocchio as pin
import pytest

from actuators.errors import LegwattError
from pipeline.robot.check import check_robot, refuse_urdf
from pipeline.robot.robot import Robot
from pipeline.robot.urdf_check import Finding, check_urdf

Three = tuple[float, float, float]
NOTHING = (0.0, 0.0, 0.0)
LIMIT = 'effort="1" velocity="1" lower="-1" upper="1"'


def link(
    name: str = "a",
    mass: float = 2.0,
    moments: Three = (0.03, 0.04, 0.05),
    products: Three = NOTHING,
    centre: Three = NOTHING,
) -> str:
    (ixx, iyy, izz), (ixy, ixz, iyz), (x, y, z) = moments, products, centre
    return (
        f'<link name="{name}"><inertial><origin xyz="{x} {y} {z}"/><mass value="{mass}"/>'
        f'<inertia ixx="{ixx}" ixy="{ixy}" ixz="{ixz}" iyy="{iyy}" iyz="{iyz}" izz="{izz}"/>'
        "</inertial></link>"
    )


def joint(
    parent: str, child: str, kind: str = "revolute", limit: str = LIMIT, at: float = 0.3
) -> str:
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


def test_a_sound_robot_passes_and_what_never_moves_is_none() -> None:
    assert not failed(*ARM)
    assert failed(link(), link("b"), joint("a", "b", "fixed")) == [("r", "joints that move")]
    assert failed(link()) == [("r", "joints that move")]
    with pytest.raises(LegwattError, match="joints that move fails .*every joint is fixed"):
        refuse_urdf(f'<robot name="r">{link()}</robot>', "r.urdf")


def test_what_moves_weighs_more_than_nothing() -> None:
    for mass, good in ((1e-9, True), (0.0, False), (-1.0, False)):
        wrong = failed(BASE, link(mass=mass, moments=(mass,) * 3), joint("base", "a"))
        assert (("a", "mass positive") not in wrong) is good
    hole = (link("hole", -0.1), joint("arm", "hole", "fixed"))
    assert failed(*ARM, *hole) == [("hole", "mass positive")]  # not merged away
    imu = (link("imu", 0.0, NOTHING), joint("arm", "imu", "fixed"))
    tip = ('<link name="tip"/>', joint("arm", "tip", "fixed"))
    assert not failed(*ARM, *imu, *tip)


@pytest.mark.parametrize(
    ("moments", "apart", "wrong"),
    [
        (NOTHING, 0.9e-3, []),
        (NOTHING, 1.1e-3, ["mass positive"]),
        ((0.0, 0.0, 1e-6), 0.0, ["inertia possible"]),
    ],
)
def test_between_joints_at_one_place_there_may_be_nothing(
    moments: Three, apart: float, wrong: list[str]
) -> None:
    cross = (link("cross", 0.0, moments), joint("base", "cross"))
    hung = (link("arm"), joint("cross", "arm", at=apart))
    assert failed(BASE, *cross, *hung) == [("cross", check) for check in wrong]


@pytest.mark.parametrize(
    ("moments", "products", "wrong"),
    [
        ((1.0, 1.0, 1.0), NOTHING, ""),
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
def test_inertia_is_that_of_a_body(moments: Three, products: Three, wrong: str) -> None:
    """The same for a body of one link and for a link that merges into another's body."""
    alone = link(moments=moments, products=products)
    (finding,) = [f for f in judged(alone) if f.check == "inertia possible"]
    assert finding.passed is not bool(wrong)
    assert wrong in finding.detail
    merged = (link("b", 1e-9, NOTHING), alone, joint("b", "a", "fixed", at=0.0))
    assert (("b", "inertia possible") in failed(*merged)) is bool(wrong)


def test_merging_hides_an_impossible_link_only_where_it_is_too_small_to_show() -> None:
    """The foot's lever makes the sum positive; the shank's own moment is still negative."""
    shank = (BASE, link("arm", 1.0, (-0.005, 0.01, 0.01)), joint("base", "arm"))
    foot = (link("foot", 1.0, (0.01, 0.01, 0.01)), joint("arm", "foot", "fixed"))
    assert failed(*shank, *foot) == [("arm", "inertia possible")]
    for size, wrong in ((6.0e-4, False), (6.6e-4, True)):  # 1 % of the arm's 0.05 kg*m^2
        camera = link("camera", 1e-3, (0.1 * size, 0.1 * size, size))
        found = failed(*ARM, camera, joint("arm", "camera", "fixed", at=0.0))
        assert (("camera", "inertia possible") in found) is wrong


@pytest.mark.parametrize(
    ("part", "failing"),
    [
        (link("b", 1.0, (35.9,) * 3), []),  # radius of gyration 10 times the chain of 0.6 m
        (link("b", 1.0, (36.1,) * 3), [("b", "inertia fits the size")]),
        (link("b", centre=(0.0, 9.99, 0.0)), []),
        (link("b", centre=(0.0, 10.01, 0.0)), [("b", "inertia fits the size")]),
        (link("b", 1690.0, (169.0,) * 3), []),  # a cube of 0.6 m of steel has 1696 kg
        (link("b", 1693.0, (169.0,) * 3), [("r", "total mass")]),
    ],
)
def test_what_is_in_grams_or_millimetres_does_not_fit_the_size(
    part: str, failing: list[tuple[str, str]]
) -> None:
    assert failed(*ARM, part, joint("arm", "b")) == failing


def test_a_joint_further_out_than_any_robot_is_long_is_in_millimetres() -> None:
    for at, wrong in ((9.99, []), (10.01, [("joint_b", "lengths in metres")])):
        assert failed(*ARM, link("b"), joint("arm", "b", at=at)) == wrong


def test_a_mimic_joint_is_held_outside_legs_and_a_floating_one_fails_unless_fixed() -> None:
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
    ("kind", "lower", "upper", "outcome"),
    [
        ("revolute", -1, 1, "good"),
        ("revolute", 1, 1, "note"),
        ("revolute", 1.001, 1, "fails"),
        ("revolute", -1, 12.56, "good"),  # two turns are the most, unless the number is none
        ("revolute", -1, 12.57, "fails"),
        ("revolute", -1440, 1, "fails"),
        ("revolute", -1440.1, 1, "good"),
        ("prismatic", 0, 0, "note"),
        ("continuous", 1, -1, "none"),
    ],
)
def test_limits_leave_a_joint_something_to_do(
    kind: str, lower: float, upper: float, outcome: str
) -> None:
    limit = f'effort="1" velocity="1" lower="{lower}" upper="{upper}"'
    found = [
        f for f in judged(BASE, link(), joint("base", "a", kind, limit)) if f.check == "limits"
    ]
    said = ["fails" if not f.passed else "note" if f.note else "good" for f in found]
    assert said == ([outcome] if outcome != "none" else [])


@pytest.mark.parametrize(("share", "near"), [(0.0049, True), (0.0051, False), (-0.0051, False)])
def test_the_urdf_weighs_what_the_file_states_within_half_a_percent(
    hexapod: Robot, share: float, near: bool
) -> None:
    model = hexapod.model.copy()
    body = model.inertias[1]
    model.inertias[1] = pin.Inertia(body.mass + share * 40.0, body.lever, body.inertia)
    found = check_robot(replace(hexapod, model=model))
    assert [f.passed for f in found if f.check == "total mass"] == [near]
