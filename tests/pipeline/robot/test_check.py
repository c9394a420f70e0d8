"""What `check` lets pass and what not, on links small enough to judge by hand."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from pipeline.errors import UrdfError
from pipeline.robot.check import check_robot, check_urdf
from pipeline.robot.robot import Robot

BOX = '<box size="0.2 0.4 0.6"/>'
SPHERE = '<sphere radius="0.3"/>'
CYLINDER = '<cylinder radius="0.2" length="1.0"/>'
CAPSULE = '<capsule radius="0.2" length="1.0"/>'
PLACE = (0.1, -0.2, 0.3)
TURN = (0.4, -0.7, 1.1)


def link(
    centre: tuple[float, ...] | np.ndarray = (0.0, 0.0, 0.0),
    solids: tuple[str, ...] = (),
    mass: float = 2.0,
    moments: tuple[float, float, float] = (0.3, 0.4, 0.5),
    products: tuple[float, float, float] = (0.0, 0.0, 0.0),
    name: str = "a",
) -> str:
    shapes = "".join(f"<visual>{solid}</visual>" for solid in solids)
    xyz = " ".join(repr(float(x)) for x in centre)
    (ixx, iyy, izz), (ixy, ixz, iyz) = moments, products
    return (
        f'<robot name="r"><link name="{name}"><inertial><origin xyz="{xyz}"/><mass value="{mass}"/>'
        f'<inertia ixx="{ixx}" ixy="{ixy}" ixz="{ixz}" iyy="{iyy}" iyz="{iyz}" izz="{izz}"/>'
        f"</inertial>{shapes}</link></robot>"
    )


def solid(shape: str, xyz: tuple[float, ...] = PLACE, rpy: tuple[float, ...] = TURN) -> str:
    place = " ".join(map(str, xyz))
    turn = " ".join(map(str, rpy))
    return f'<origin xyz="{place}" rpy="{turn}"/><geometry>{shape}</geometry>'


def outcomes(text: str, subject: str | None = None) -> dict[str, str]:
    """Of each check whether it is good, a note or fails; every check is made once."""
    findings = [f for f in check_urdf(text, "r.urdf") if subject in (None, f.subject)]
    out = {f.check: ("note" if f.note else "good") if f.passed else "fails" for f in findings}
    assert len(out) == len(findings)
    return out


def moved(*bodies: str, apart: float = 0.3, limit: str = "") -> str:
    """Links on joints one after another, the first on a base; ``a`` hangs on ``joint_a``."""
    names = [re.search(r'<link name="(\w+)"', body)[1] for body in bodies]  # type: ignore[index]
    limit = limit or 'lower="-1" upper="1" effort="1" velocity="1"'
    text = '<robot name="r"><link name="base"/>'
    for parent, name, body in zip(["base", *names], names, bodies, strict=False):
        text += body.removeprefix('<robot name="r">').removesuffix("</robot>")
        text += (
            f'<joint name="joint_{name}" type="revolute"><origin xyz="{apart} 0 0"/>'
            f'<parent link="{parent}"/><child link="{name}"/><limit {limit}/></joint>'
        )
    return text + "</robot>"


WITHIN = "centre of mass within the geometry"


@pytest.mark.parametrize(
    ("shape", "half", "at"),
    [
        (BOX, (0.1, 0.2, 0.3), (0.1, 0.1, 0.0)),
        (BOX, (0.1, 0.2, 0.3), (-0.1, 0.2, -0.3)),
        (SPHERE, (0.3, 0.3, 0.3), (0.3, 0.0, 0.0)),
        (CYLINDER, (0.2, 0.2, 0.5), (0.2, 0.0, 0.5)),
        (CAPSULE, (0.2, 0.2, 0.7), (0.0, 0.0, 0.7)),
    ],
)
def test_a_centre_of_mass_beside_a_solid_is_odd_and_wrong_from_the_solids_own_size(
    shape: str, half: tuple[float, float, float], at: tuple[float, float, float]
) -> None:
    """In a solid placed and turned at will; the turn is Pinocchio's own.

    Of the box around the solid the half diagonal is its size; up to 1 um counts as on the surface.
    """
    turn, place = pin.rpy.rpyToMatrix(*TURN), np.array(PLACE)
    outward = np.where(np.isclose(np.abs(at), half), np.sign(at), 0.0)
    outward /= np.linalg.norm(outward)
    size = float(np.linalg.norm(half))
    for out, outcome in (
        (-0.01, "good"),
        (0.9e-6, "good"),
        (1.1e-6, "note"),
        (size + 0.9e-6, "note"),
        (size + 1.1e-6, "fails"),
    ):
        text = link(place + turn @ (np.array(at) + out * outward), (solid(shape),))
        assert outcomes(text)[WITHIN] == outcome


def test_one_of_several_solids_is_enough_and_a_mesh_leaves_it_open() -> None:
    near, far = solid(SPHERE, (0.0, 0.0, 0.0)), solid(SPHERE, (5.0, 0.0, 0.0))
    assert outcomes(link(solids=(far, near)))[WITHIN] == "good"
    assert outcomes(link(solids=(far,)))[WITHIN] == "fails"
    mesh = '<geometry><mesh filename="a.stl"/></geometry>'
    for solids in ((far, mesh), (mesh,), ()):
        assert WITHIN not in outcomes(link(solids=solids))
    with pytest.raises(UrdfError, match=r"<link name='a'>: <visual> without <geometry>"):
        check_urdf(link(solids=(far, "<origin/>")), "r.urdf")


def test_the_centre_of_mass_of_a_hundredth_of_a_body_may_lie_anywhere() -> None:
    for mass, judged in ((0.0099, False), (0.0101, True)):
        part = link(mass=mass, solids=(solid(SPHERE, (5.0, 0.0, 0.0)),), name="part")
        fixed = '<joint name="f" type="fixed"><parent link="a"/><child link="part"/></joint>'
        text = link(mass=1.0 - mass).replace(
            "</robot>", part.removeprefix('<robot name="r">').replace("</robot>", fixed)
        )
        assert outcomes(text + "</robot>", "part").get(WITHIN) == ("fails" if judged else None)


@pytest.mark.parametrize(("mass", "good"), [(1e-9, "good"), (0.0, "fails"), (-1.0, "fails")])
def test_mass_of_what_moves_is_more_than_nothing(mass: float, good: str) -> None:
    assert outcomes(moved(link(mass=mass)), "a")["mass positive"] == good


def test_a_root_without_mass_stands_still_and_none_weighs_less() -> None:
    assert outcomes(link(mass=0.0)) == {"mass of the root": "note"}
    assert outcomes(link(mass=1e-9))["mass positive"] == "good"
    assert outcomes(link(mass=-1.0)) == {"mass positive": "fails"}


def test_between_joints_at_one_place_there_may_be_nothing_but_no_inertia_without_mass() -> None:
    nothing, arm = (0.0, 0.0, 0.0), link(name="arm")
    for apart, mass in ((0.9e-3, {"mass": "note"}), (1.1e-3, {"mass positive": "fails"})):
        cross = link(mass=0.0, moments=nothing, name="cross")
        assert outcomes(moved(cross, arm, apart=apart), "cross") == mass
    cross = link(mass=0.0, moments=(0.0, 0.0, 1e-6), name="cross")
    (finding,) = [f for f in check_urdf(moved(cross, arm, apart=0), "r") if f.subject == "cross"]
    assert (finding.check, finding.passed) == ("inertia possible", False)
    assert finding.detail == "moments 0, 0, 1e-06 kg*m^2 without mass"


@pytest.mark.parametrize(
    ("moments", "products", "wrong"),
    [
        ((1.0, 1.0, 1.0), (0.0, 0.0, 0.0), ""),
        ((1.0, 1.0, -0.9e-6), (0.0, 0.0, 0.0), ""),  # rounding
        ((1.0, 1.0, -1.1e-6), (0.0, 0.0, 0.0), "negative"),
        ((1.0, 2.0, 3.0 + 2.9e-6), (0.0, 0.0, 0.0), ""),  # written with few digits
        ((1.0, 2.0, 3.0 + 3.1e-6), (0.0, 0.0, 0.0), "largest"),
        ((3.0 + 3.1e-6, 1.0, 2.0), (0.0, 0.0, 0.0), "largest"),
        # A point of 2 kg within 1 um: moments that are rounding.
        ((1e-12, 1e-12, 3.9e-12), (0.0, 0.0, 0.0), ""),
        ((1e-12, 1e-12, 4.1e-12), (0.0, 0.0, 0.0), "largest"),
        # Equal moments, one product p: principal moments 1 - p, 1, 1 + p.
        ((1.0, 1.0, 1.0), (0.4, 0.0, 0.0), ""),
        ((1.0, 1.0, 1.0), (0.6, 0.0, 0.0), "largest"),
        ((1.0, 1.0, 1.0), (0.0, 0.0, 1.1), "negative"),
    ],
)
def test_inertia_is_that_of_a_body(
    moments: tuple[float, float, float], products: tuple[float, float, float], wrong: str
) -> None:
    """The same for a body of one link and for a link that merges into another's body."""
    alone = link(moments=moments, products=products)
    light = link(mass=1e-9, moments=(0.0, 0.0, 0.0), name="b")
    fixed = '<joint name="f" type="fixed"><parent link="b"/><child link="a"/></joint></robot>'
    merged = light.replace("</robot>", alone.removeprefix('<robot name="r">')).replace(
        "</robot>", fixed
    )
    (finding,) = [f for f in check_urdf(alone, "r.urdf") if f.check == "inertia possible"]
    assert finding.passed is not bool(wrong)
    assert wrong in finding.detail
    sums = [f for f in check_urdf(merged, "r.urdf") if f.check == "inertia possible"]
    assert {f.subject: f.passed for f in sums}["b"] is not bool(wrong)


@pytest.mark.parametrize(("part", "lacking"), [("mass", "inertia"), ("inertia", "mass")])
def test_half_an_inertia_is_refused(part: str, lacking: str) -> None:
    given = {"mass": '<mass value="1"/>', "inertia": '<inertia ixx="1" iyy="1" izz="1"/>'}[part]
    text = f'<robot name="r"><link name="a"><inertial>{given}</inertial></link></robot>'
    message = f"r.urdf: line 1: <link name='a'>: <inertial> without <{lacking}>; give both"
    with pytest.raises(UrdfError, match=f"^{message}$"):
        check_urdf(text, "r.urdf")


EFFORT, VELOCITY = "effort limit", "velocity limit"
ORDER, RADIANS = "lower limit below the upper", "limits in radians"


def on_a_joint(kind: str, limit: str) -> str:
    tag = f"<limit {limit}/>" if limit else ""
    joint = f'<joint name="j" type="{kind}"><parent link="b"/><child link="a"/>{tag}</joint>'
    return link().replace("</robot>", f'<link name="b"/>{joint}</robot>')


@pytest.mark.parametrize(
    ("kind", "limit", "odd"),
    [
        ("revolute", 'effort="1" velocity="1" lower="-1" upper="1"', {}),
        ("revolute", 'effort="1" velocity="1" lower="1" upper="1.001"', {}),
        ("revolute", 'effort="1" velocity="1" lower="1" upper="1"', {ORDER: "note"}),
        ("revolute", 'effort="1" velocity="1" lower="1.001" upper="1"', {ORDER: "fails"}),
        ("revolute", 'effort="1" velocity="1" upper="-1"', {ORDER: "fails"}),
        ("revolute", 'effort="1" velocity="1"', {ORDER: "note"}),
        ("revolute", 'effort="0" velocity="1" lower="-1" upper="1"', {EFFORT: "note"}),
        ("revolute", 'effort="1" velocity="0" lower="-1" upper="1"', {VELOCITY: "note"}),
        # Two turns are the most, unless the number is none.
        ("revolute", 'effort="1" velocity="1" lower="-1" upper="12.56"', {}),
        ("revolute", 'effort="1" velocity="1" lower="-1" upper="12.57"', {RADIANS: "fails"}),
        ("revolute", 'effort="1" velocity="1" lower="-1440" upper="1"', {RADIANS: "fails"}),
        ("revolute", 'effort="1" velocity="1" lower="-1440.1" upper="1"', {RADIANS: "note"}),
        ("prismatic", 'effort="1" velocity="1" lower="0"', {ORDER: "note"}),
        ("prismatic", 'effort="1" velocity="1" lower="-20" upper="20"', {}),
        ("continuous", 'effort="1" velocity="1"', {}),
        ("continuous", 'effort="1" velocity="1" lower="1" upper="-1"', {}),
    ],
)
def test_limits_leave_a_joint_something_to_do(kind: str, limit: str, odd: dict[str, str]) -> None:
    asked = {
        "revolute": (EFFORT, VELOCITY, ORDER, RADIANS),
        "prismatic": (EFFORT, VELOCITY, ORDER),
        "continuous": (EFFORT, VELOCITY),
    }[kind]
    good = dict.fromkeys(asked, "good")
    assert outcomes(on_a_joint(kind, limit), "j") == good | odd


@pytest.mark.parametrize(
    ("kind", "limit", "message"),
    [
        ("revolute", "", "a revolute joint needs <limit> with lower, upper, effort and velocity"),
        ("prismatic", 'effort="1" lower="0" upper="1"', "<limit> without velocity"),
        ("revolute", 'velocity="1" lower="0" upper="1"', "<limit> without effort"),
        ("revolute", 'effort="-1e-9" velocity="1"', "<limit>: effort = '-1e-9', may not be neg"),
        ("revolute", 'effort="1" velocity="-1"', "<limit>: velocity = '-1', may not be negative"),
    ],
)
def test_what_no_limit_may_lack_or_say(kind: str, limit: str, message: str) -> None:
    with pytest.raises(UrdfError, match=f"<joint name='j'>: {message}"):
        check_urdf(on_a_joint(kind, limit), "r.urdf")


def spoilt(hexapod: Robot, change: str, size: float) -> Robot:
    """The hexapod with one thing of `lm_joint_3` or its link another by a share or length."""
    model = hexapod.model.copy()
    index = model.getJointId("lm_joint_3")
    body, place = model.inertias[index], model.jointPlacements[index]
    if change == "mass":
        model.inertias[index] = pin.Inertia(body.mass * (1 + size), body.lever, body.inertia)
    elif change == "centre":
        shift = np.array([0.0, size, 0.0])
        model.inertias[index] = pin.Inertia(body.mass, body.lever + shift, body.inertia)
    elif change == "inertia":
        largest = np.zeros((3, 3))
        axis = int(np.argmax(np.diag(body.inertia)))
        largest[axis, axis] = size * body.inertia[axis, axis]
        model.inertias[index] = pin.Inertia(body.mass, body.lever, body.inertia + largest)
    elif change == "place":
        moved = place.translation + [size, 0.0, 0.0]
        model.jointPlacements[index] = pin.SE3(place.rotation, moved)
    else:
        turn = pin.rpy.rpyToMatrix(0.0, 0.0, size)
        model.jointPlacements[index] = pin.SE3(turn @ place.rotation, place.translation)
    return replace(hexapod, model=model)


@pytest.mark.parametrize("change", ["mass", "centre", "inertia", "place", "turn"])
def test_legs_mirror_each_other_within_a_hundredth(hexapod: Robot, change: str) -> None:
    """Masses and inertias of their own, lengths of the leg from its second joint to the foot."""
    p = hexapod.spec.parameters
    leg = p["coxa_length"] + p["femur_length"] + p["tibia_length"]
    for share, good in ((0.0099, True), (0.0101, False)):
        size = share * (leg if change in ("centre", "place") else 1.0)
        findings = check_robot(spoilt(hexapod, change, size))
        symmetric = {f.subject: f for f in findings if f.check == "mirror symmetry"}
        passed = {subject: f.passed and not f.note for subject, f in symmetric.items()}
        assert passed == {"lf/rf": True, "lm/rm": good, "lr/rr": True}
        largest = {
            subject: float(f.detail.removeprefix("largest relative difference "))
            for subject, f in symmetric.items()
        }
        assert largest["lm/rm"] == pytest.approx(share, rel=0.01)
        assert max(largest["lf/rf"], largest["lr/rr"]) < 1e-12


@pytest.mark.parametrize(
    ("rpy", "good"),
    [
        ((np.pi / 2, 0.0, 0.0), True),  # about the axis itself
        ((0.0, 0.0, np.pi), True),  # counts the other way
        ((0.0, 0.0, 0.0099), True),
        ((0.0, 0.0, 0.0101), False),  # another axis
    ],
)
def test_which_way_a_joints_frame_is_turned_is_a_files_own_matter(
    hexapod: Robot, rpy: tuple[float, float, float], good: bool
) -> None:
    """A shank that lies where it lay, told in another frame: only its axis may differ."""
    index = hexapod.model.getJointId("lm_joint_3")
    assert hexapod.model.joints[index].shortname() == "JointModelRX"
    turn = pin.SE3(pin.rpy.rpyToMatrix(*rpy), np.zeros(3))
    model = hexapod.model.copy()
    model.jointPlacements[index] = model.jointPlacements[index] * turn
    model.inertias[index] = turn.actInv(model.inertias[index])
    findings = check_robot(replace(hexapod, model=model))
    mirrors = [f for f in findings if f.check == "mirror symmetry"]
    symmetric = {f.subject: f.passed and not f.note for f in mirrors}
    assert symmetric == {"lf/rf": True, "lm/rm": good, "lr/rr": True}


@pytest.mark.parametrize(("size", "passed"), [(0.09, True), (0.11, False)])
def test_parts_differ_and_mistakes_fail(hexapod: Robot, size: float, passed: bool) -> None:
    """Up to a tenth left and right are noted as different, beyond it they are no mirror images."""
    findings = check_robot(spoilt(hexapod, "mass", size))
    (own,) = (f for f in findings if f.subject == "lm/rm")
    assert (own.passed, own.note) == (passed, passed)
