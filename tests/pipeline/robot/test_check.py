"""What `check` lets pass and what not, on links small enough to judge by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from actuators.errors import LegwattError
from pipeline.robot.check import check_robot, check_urdf
from pipeline.robot.robot import Robot
from pipeline.robot.urdf_check import MERGED, Finding

BOX = '<box size="0.2 0.4 0.6"/>'
SPHERE = '<sphere radius="0.3"/>'
CYLINDER = '<cylinder radius="0.2" length="1.0"/>'
CAPSULE = '<capsule radius="0.2" length="1.0"/>'
PLACE = (0.1, -0.2, 0.3)
TURN = (0.4, -0.7, 1.1)
NOTHING = (0.0, 0.0, 0.0)
LIMIT = 'effort="1" velocity="1" lower="-1" upper="1"'


def words(numbers: tuple[float, ...] | np.ndarray) -> str:
    return " ".join(repr(float(x)) for x in numbers)


def link(
    name: str = "a",
    mass: float = 2.0,
    moments: tuple[float, float, float] = (0.3, 0.4, 0.5),
    products: tuple[float, float, float] = NOTHING,
    centre: tuple[float, ...] | np.ndarray = NOTHING,
    solids: tuple[str, ...] = (),
) -> str:
    shapes = "".join(f"<visual>{solid}</visual>" for solid in solids)
    (ixx, iyy, izz), (ixy, ixz, iyz) = moments, products
    return (
        f'<link name="{name}"><inertial><origin xyz="{words(centre)}"/><mass value="{mass}"/>'
        f'<inertia ixx="{ixx}" ixy="{ixy}" ixz="{ixz}" iyy="{iyy}" iyz="{iyz}" izz="{izz}"/>'
        f"</inertial>{shapes}</link>"
    )


def solid(shape: str, xyz: tuple[float, ...] = PLACE, rpy: tuple[float, ...] = TURN) -> str:
    place = f'<origin xyz="{words(xyz)}" rpy="{words(rpy)}"/>'
    return f"{place}<geometry>{shape}</geometry>"


def joint(
    parent: str, child: str, kind: str = "revolute", limit: str = LIMIT, at: float = 0.3
) -> str:
    """The joint on which a link hangs, called ``joint_`` and the link's name."""
    tag = f"<limit {limit}/>" if limit and kind != "fixed" else ""
    return (
        f'<joint name="joint_{child}" type="{kind}"><origin xyz="{at} 0 0"/>'
        f'<parent link="{parent}"/><child link="{child}"/>{tag}</joint>'
    )


def judged(*parts: str) -> list[Finding]:
    return check_urdf(f'<robot name="r">{"".join(parts)}</robot>', "r.urdf")


def failed(*parts: str) -> list[tuple[str, str]]:
    return [(f.subject, f.check) for f in judged(*parts) if not f.passed]


def outcomes(*parts: str, subject: str | None = None) -> dict[str, str]:
    """Of each check whether it is good, a note or fails; every check is made once."""
    findings = [f for f in judged(*parts) if subject in (None, f.subject)]
    out = {f.check: ("note" if f.note else "good") if f.passed else "fails" for f in findings}
    assert len(out) == len(findings)
    return out


BASE = '<link name="base"/>'
ARM = (link("base"), link("arm", 1.0, (0.01, 0.01, 0.01)), joint("base", "arm"))
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
        centre = place + turn @ (np.array(at) + out * outward)
        assert outcomes(link(centre=centre, solids=(solid(shape),)))[WITHIN] == outcome


def test_one_of_several_solids_is_enough_and_a_mesh_leaves_it_open() -> None:
    near, far = solid(SPHERE, NOTHING), solid(SPHERE, (5.0, 0.0, 0.0))
    assert outcomes(link(solids=(far, near)))[WITHIN] == "good"
    assert outcomes(link(solids=(far,)))[WITHIN] == "fails"
    mesh = '<geometry><mesh filename="a.stl"/></geometry>'
    for solids in ((far, mesh), (mesh,), ()):
        assert WITHIN not in outcomes(link(solids=solids))


def test_the_centre_of_mass_of_a_hundredth_of_a_body_may_lie_anywhere() -> None:
    for mass, outcome in ((0.0099, None), (0.0101, "fails")):
        part = link("part", mass, solids=(solid(SPHERE, (5.0, 0.0, 0.0)),))
        body = (link(mass=1.0 - mass), part, joint("a", "part", "fixed", at=0.0))
        assert outcomes(*body, subject="part").get(WITHIN) == outcome


def test_what_moves_weighs_more_than_nothing_and_only_a_root_may_be_without_mass() -> None:
    for mass, good in ((1e-9, "good"), (0.0, "fails"), (-1.0, "fails")):
        parts = (BASE, link(mass=mass), joint("base", "a"))
        assert outcomes(*parts, subject="a")["mass positive"] == good
    assert outcomes(link(mass=0.0)) == {"mass of the root": "note"}
    assert outcomes(link(mass=1e-9))["mass positive"] == "good"
    assert outcomes(link(mass=-1.0)) == {"mass positive": "fails"}
    hole = (link("hole", -0.1), joint("arm", "hole", "fixed"))
    assert ("hole", "mass positive") in failed(*ARM, *hole)  # not merged away


def test_between_joints_at_one_place_there_may_be_nothing_but_no_inertia_without_mass() -> None:
    def between(moments: tuple[float, float, float], apart: float) -> dict[str, str]:
        cross = (link("cross", 0.0, moments), joint("base", "cross"))
        hung = (link("arm"), joint("cross", "arm", at=apart))
        return outcomes(BASE, *cross, *hung, subject="cross")

    assert between(NOTHING, 0.9e-3) == {"mass": "note"}
    assert between(NOTHING, 1.1e-3) == {"mass positive": "fails"}
    assert between((0.0, 0.0, 1e-6), 0.0) == {"inertia possible": "fails"}


def test_what_hangs_on_a_fixed_joint_merges_and_is_named() -> None:
    """A sensor without mass, and a frame without inertia, which is no body and not listed."""
    imu = (link("imu", 0.0, NOTHING), joint("arm", "imu", "fixed"))
    tip = ('<link name="tip"/>', joint("arm", "tip", "fixed"))
    (note,) = [f for f in judged(*ARM, *imu, *tip) if f.note or not f.passed]
    assert (note.subject, note.check) == ("arm", MERGED)
    assert note.detail == "with imu (0 kg): one body of 1 kg"


@pytest.mark.parametrize(("size", "passed"), [(1e-5, True), (1e-3, False)])
def test_a_small_part_that_cannot_be_is_noted_a_large_one_fails(size: float, passed: bool) -> None:
    """A camera's doubtful 1e-5 kg*m^2 on a trunk of 0.01 shows nowhere; 1e-3 would."""
    camera = link("camera", 1e-6, (0.1 * size, 0.1 * size, size))
    found = judged(*ARM, camera, joint("arm", "camera", "fixed", at=0.0))
    assert [f.passed for f in found if f.subject == "camera"] == [passed]


def test_merging_does_not_hide_an_impossible_link() -> None:
    """The foot's lever makes the sum positive; the shank's own moment is still negative."""
    shank = (BASE, link("arm", 1.0, (-0.005, 0.01, 0.01)), joint("base", "arm"))
    foot = (link("foot", 1.0, (0.01, 0.01, 0.01)), joint("arm", "foot", "fixed"))
    assert ("arm", "inertia possible") in failed(*shank, *foot)


def test_a_point_mass_is_said() -> None:
    parts = (link("base"), link("arm", 1.0, NOTHING), joint("base", "arm"))
    assert [f.check for f in judged(*parts) if f.note or not f.passed] == ["rotational inertia"]


def test_a_mimic_joint_and_one_of_several_coordinates_fail_unless_fixed() -> None:
    def hung(kind: str, inner: str = "") -> list[tuple[str, str]]:
        at = joint("arm", "b", kind).replace("</joint>", f"{inner}</joint>")
        return failed(*ARM, link("b"), at)

    mimic = '<mimic joint="joint_arm"/>'
    assert hung("revolute", mimic) == [("joint_b", "a drive of its own")]
    assert hung("floating") == [("joint_b", "one coordinate")]
    assert not hung("fixed", mimic)


@pytest.mark.parametrize(
    ("factor", "passed", "unit"),
    [(1e3, False, "in g?"), (100.0, True, "in g?"), (1.0, None, ""), (1e-3, True, "lengths in mm")],
)
def test_a_mass_that_does_not_fit_the_size_is_noted_or_refused(
    factor: float, passed: bool | None, unit: str
) -> None:
    """Two links of 1 kg within 0.4 m: air weighs 77 g there, water 64 kg, steel 500 kg."""
    one, other = (link(name, factor, (0.01 * factor,) * 3) for name in ("base", "arm"))
    found = [f for f in judged(one, other, joint("base", "arm")) if f.check == "total mass"]
    assert [(f.passed, f.note) for f in found] == ([] if passed is None else [(passed, passed)])
    assert all(unit in f.detail for f in found)


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
    (finding,) = [f for f in judged(alone) if f.check == "inertia possible"]
    assert finding.passed is not bool(wrong)
    assert wrong in finding.detail
    merged = (link("b", 1e-9, NOTHING), alone, joint("b", "a", "fixed", at=0.0))
    assert (("b", "inertia possible") in failed(*merged)) is bool(wrong)


EFFORT, VELOCITY = "effort limit", "velocity limit"
ORDER, RADIANS = "lower limit below the upper", "limits in radians"


@pytest.mark.parametrize(
    ("kind", "limit", "odd"),
    [
        ("revolute", LIMIT, {}),
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
    parts = (BASE, link(), joint("base", "a", kind, limit))
    assert outcomes(*parts, subject="joint_a") == good | odd


def hung(kind: str, limit: str) -> str:
    return BASE + link() + joint("base", "a", kind, limit)


def half(part: str) -> str:
    return f'<link name="a"><inertial>{part}</inertial></link>'


MATERIAL = '<material name="m"><color rgba="1 1"/></material>'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (hung("revolute", ""), "<joint name='joint_a'>: a revolute joint needs <limit>"),
        (hung("prismatic", 'effort="1" lower="0" upper="1"'), "<limit> without velocity"),
        (hung("revolute", 'velocity="1" lower="0" upper="1"'), "<limit> without effort"),
        (hung("revolute", 'effort="-1e-9" velocity="1"'), "effort = '-1e-9', may not be neg"),
        (hung("revolute", 'effort="1" velocity="-1"'), "velocity = '-1', may not be negative"),
        (half('<mass value="1"/>'), "line 1: <link name='a'>: <inertial> without <inertia>"),
        (half('<inertia ixx="1" iyy="1" izz="1"/>'), "<inertial> without <mass>"),
        (link(solids=("<origin/>",)), "<link name='a'>: <visual> without <geometry>"),
        (BASE + MATERIAL + MATERIAL, r"not a URDF that Pinocchio can read \("),
    ],
)
def test_what_no_urdf_may_lack_or_say(text: str, message: str) -> None:
    with pytest.raises(LegwattError, match=message) as caught:
        judged(text)
    assert "\n" not in str(caught.value)


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


def mirrors(robot: Robot) -> dict[str, Finding]:
    return {f.subject: f for f in check_robot(robot) if f.check == "mirror symmetry"}


def good(findings: dict[str, Finding]) -> dict[str, bool]:
    return {subject: f.passed and not f.note for subject, f in findings.items()}


@pytest.mark.parametrize("change", ["mass", "centre", "inertia", "place", "turn"])
def test_legs_mirror_each_other_within_a_hundredth(hexapod: Robot, change: str) -> None:
    """Masses and inertias of their own, lengths of the leg from its second joint to the foot."""
    p = hexapod.spec.parameters
    leg = p["coxa_length"] + p["femur_length"] + p["tibia_length"]
    for share, same in ((0.0099, True), (0.0101, False)):
        size = share * (leg if change in ("centre", "place") else 1.0)
        found = mirrors(spoilt(hexapod, change, size))
        assert good(found) == {"lf/rf": True, "lm/rm": same, "lr/rr": True}
        largest = {subject: float(f.detail.split()[-1]) for subject, f in found.items()}
        assert largest["lm/rm"] == pytest.approx(share, rel=0.01)
        assert max(largest["lf/rf"], largest["lr/rr"]) < 1e-12


@pytest.mark.parametrize(
    ("rpy", "same"),
    [
        ((np.pi / 2, 0.0, 0.0), True),  # about the axis itself
        ((0.0, 0.0, np.pi), True),  # counts the other way
        ((0.0, 0.0, 0.0099), True),
        ((0.0, 0.0, 0.0101), False),  # another axis
    ],
)
def test_which_way_a_joints_frame_is_turned_is_a_files_own_matter(
    hexapod: Robot, rpy: tuple[float, float, float], same: bool
) -> None:
    """A shank that lies where it lay, told in another frame: only its axis may differ."""
    index = hexapod.model.getJointId("lm_joint_3")
    assert hexapod.model.joints[index].shortname() == "JointModelRX"
    turn = pin.SE3(pin.rpy.rpyToMatrix(*rpy), np.zeros(3))
    model = hexapod.model.copy()
    model.jointPlacements[index] = model.jointPlacements[index] * turn
    model.inertias[index] = turn.actInv(model.inertias[index])
    found = mirrors(replace(hexapod, model=model))
    assert good(found) == {"lf/rf": True, "lm/rm": same, "lr/rr": True}


@pytest.mark.parametrize(("size", "passed"), [(0.09, True), (0.11, False)])
def test_parts_differ_and_mistakes_fail(hexapod: Robot, size: float, passed: bool) -> None:
    """Up to a tenth left and right are noted as different, beyond it they are no mirror images."""
    own = mirrors(spoilt(hexapod, "mass", size))["lm/rm"]
    assert (own.passed, own.note) == (passed, passed)
