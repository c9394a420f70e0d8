"""What `check` lets pass and what not, on links small enough to judge by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from pipeline.check import check_robot, check_urdf
from pipeline.robot import Robot

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
) -> str:
    shapes = "".join(f"<visual>{solid}</visual>" for solid in solids)
    xyz = " ".join(repr(float(x)) for x in centre)
    (ixx, iyy, izz), (ixy, ixz, iyz) = moments, products
    return (
        f'<robot name="r"><link name="a"><inertial><origin xyz="{xyz}"/><mass value="{mass}"/>'
        f'<inertia ixx="{ixx}" ixy="{ixy}" ixz="{ixz}" iyy="{iyy}" iyz="{iyz}" izz="{izz}"/>'
        f"</inertial>{shapes}</link></robot>"
    )


def solid(shape: str, xyz: tuple[float, ...] = PLACE, rpy: tuple[float, ...] = TURN) -> str:
    place = " ".join(map(str, xyz))
    turn = " ".join(map(str, rpy))
    return f'<origin xyz="{place}" rpy="{turn}"/><geometry>{shape}</geometry>'


def passed(text: str, check: str) -> bool:
    (finding,) = [f for f in check_urdf(text, "r.urdf") if f.check == check]
    return finding.passed


@pytest.mark.parametrize(
    ("shape", "corner"),
    [
        (BOX, (0.1, 0.2, 0.3)),
        (BOX, (-0.1, 0.2, -0.3)),
        (SPHERE, (0.3, 0.0, 0.0)),
        (SPHERE, (0.0, 0.0, -0.3)),
        (CYLINDER, (0.2, 0.0, 0.5)),
        (CYLINDER, (0.0, -0.2, -0.5)),
        (CAPSULE, (0.0, 0.0, 0.7)),
        (CAPSULE, (0.2, 0.0, 0.0)),
    ],
)
def test_a_centre_of_mass_is_inside_up_to_the_surface(
    shape: str, corner: tuple[float, float, float]
) -> None:
    """In a solid placed and turned at will; the turn is Pinocchio's own."""
    turn, place = pin.rpy.rpyToMatrix(*TURN), np.array(PLACE)
    for share, inside in ((0.99, True), (1.01, False)):
        text = link(place + turn @ (share * np.array(corner)), (solid(shape),))
        assert passed(text, "centre of mass within the geometry") is inside


def test_one_of_several_solids_is_enough_and_a_mesh_leaves_it_open() -> None:
    near, far = solid(SPHERE, (0.0, 0.0, 0.0)), solid(SPHERE, (5.0, 0.0, 0.0))
    check = "centre of mass within the geometry"
    assert passed(link(solids=(far, near)), check)
    assert not passed(link(solids=(far,)), check)
    mesh = '<geometry><mesh filename="a.stl"/></geometry>'
    for solids in ((far, mesh), (far, "<origin/>"), ()):
        assert check not in {f.check for f in check_urdf(link(solids=solids), "r.urdf")}


@pytest.mark.parametrize("shape", [BOX, SPHERE, CYLINDER])
def test_what_has_no_origin_stands_at_the_links(shape: str) -> None:
    check = "centre of mass within the geometry"
    plain = f"<geometry>{shape}</geometry>"
    for origin in ("", "<origin/>", '<origin rpy="0.1 0.2 0.3"/>'):
        at_link = link(solids=(plain,)).replace('<origin xyz="0.0 0.0 0.0"/>', origin)
        assert passed(at_link, check)
        assert not passed(at_link.replace("<visual>", f"<visual>{PUSHED}"), check)


PUSHED = '<origin xyz="0.5 0.5 0.9"/>'


def test_a_solid_without_a_turn_is_not_turned() -> None:
    check = "centre of mass within the geometry"
    for corner, inside in (((0.09, 0.19, 0.29), True), ((0.19, 0.09, 0.29), False)):
        for origin in ("", "<origin/>", '<origin xyz="0 0 0"/>'):
            text = link(corner, (f"{origin}<geometry>{BOX}</geometry>",))
            assert passed(text, check) is inside


@pytest.mark.parametrize("shape", ["<box/>", "<sphere/>", "<cylinder/>", "<capsule/>"])
def test_a_solid_without_a_size_holds_nothing_but_its_own_point(shape: str) -> None:
    check = "centre of mass within the geometry"
    for centre in np.vstack([np.eye(3), -np.eye(3)]) * 0.4:
        assert not passed(link(centre, (f"<geometry>{shape}</geometry>",)), check)
    assert passed(link(solids=(f"<geometry>{shape}</geometry>",)), check)


@pytest.mark.parametrize(("mass", "good"), [(1e-9, True), (0.0, False), (-1.0, False)])
def test_mass_is_more_than_nothing(mass: float, good: bool) -> None:
    assert passed(link(mass=mass), "mass positive") is good


@pytest.mark.parametrize(
    ("moments", "products", "definite", "triangle"),
    [
        ((1.0, 1.0, 1.0), (0.0, 0.0, 0.0), True, True),
        ((0.0, 1.0, 1.0), (0.0, 0.0, 0.0), False, True),
        ((1.0, 2.0, 3.0), (0.0, 0.0, 0.0), True, True),  # a flat plate
        ((1.0, 2.0, 3.0 + 1e-7), (0.0, 0.0, 0.0), True, True),  # written with few digits
        ((1.0, 2.0, 3.0 + 1e-5), (0.0, 0.0, 0.0), True, False),
        ((3.00001, 1.0, 2.0), (0.0, 0.0, 0.0), True, False),
        # Equal moments, one product p: principal moments 1 - p, 1, 1 + p.
        ((1.0, 1.0, 1.0), (0.4, 0.0, 0.0), True, True),
        ((1.0, 1.0, 1.0), (0.6, 0.0, 0.0), True, False),
        ((1.0, 1.0, 1.0), (0.0, 0.6, 0.0), True, False),
        ((1.0, 1.0, 1.0), (0.0, 0.0, 0.6), True, False),
        ((1.0, 1.0, 1.0), (0.0, 0.0, 1.1), False, False),
    ],
)
def test_inertia_is_that_of_a_body(
    moments: tuple[float, float, float],
    products: tuple[float, float, float],
    definite: bool,
    triangle: bool,
) -> None:
    text = link(moments=moments, products=products)
    assert passed(text, "inertia positive definite") is definite
    assert passed(text, "triangle inequality") is triangle


def test_a_turned_inertia_is_judged_by_its_principal_moments() -> None:
    for largest, good in ((2.99, True), (3.01, False)):
        turn = pin.rpy.rpyToMatrix(0.3, 0.8, -0.5)
        tensor = turn @ np.diag([1.0, 2.0, largest]) @ turn.T
        text = link(
            moments=(tensor[0, 0], tensor[1, 1], tensor[2, 2]),
            products=(tensor[0, 1], tensor[0, 2], tensor[1, 2]),
        )
        assert passed(text, "triangle inequality") is good


@pytest.mark.parametrize("part", ["mass", "inertia"])
def test_half_an_inertia_is_found(part: str) -> None:
    given = {"mass": '<mass value="1"/>', "inertia": '<inertia ixx="1" iyy="1" izz="1"/>'}[part]
    text = f'<robot name="r"><link name="a"><inertial>{given}</inertial></link></robot>'
    assert not passed(text, "inertia complete")


@pytest.mark.parametrize(
    ("kind", "limit", "good"),
    [
        ("revolute", 'effort="1" velocity="1" lower="-1" upper="1"', True),
        ("revolute", 'effort="1" velocity="1" lower="-2" upper="-1"', True),
        ("revolute", 'effort="1" velocity="1" lower="1" upper="1"', False),
        ("revolute", 'effort="0" velocity="1" lower="-1" upper="1"', False),
        ("revolute", 'effort="1" velocity="0" lower="-1" upper="1"', False),
        ("revolute", 'effort="0.5" velocity="0.5" lower="-1" upper="1"', True),
        ("revolute", 'effort="1" velocity="1" upper="1"', False),
        ("prismatic", 'effort="1" velocity="1" lower="0"', False),
        ("prismatic", 'effort="1" lower="0" upper="1"', False),
        ("continuous", 'effort="1" velocity="1"', True),
        ("continuous", 'velocity="1"', False),
    ],
)
def test_limits_leave_a_joint_something_to_do(kind: str, limit: str, good: bool) -> None:
    text = f'<robot name="r"><joint name="j" type="{kind}"><limit {limit}/></joint></robot>'
    assert passed(text, "limits present") is good


def test_what_a_limit_lacks_is_said() -> None:
    text = '<robot name="r"><joint name="j" type="revolute"><limit lower="1"/></joint></robot>'
    (finding,) = check_urdf(text, "r.urdf")
    assert finding.detail == "missing effort, velocity, upper"


def test_symmetry_is_asked_of_every_pair_whatever_the_order(hexapod: Robot) -> None:
    spec = replace(hexapod.spec, legs=tuple(reversed(hexapod.spec.legs)))
    findings = check_robot(replace(hexapod, spec=spec))
    subjects = {f.subject for f in findings if f.check == "mirror symmetry"}
    assert subjects == {"lf/rf", "lm/rm", "lr/rr"}


def test_a_leg_without_its_mirror_image_is_found(hexapod: Robot) -> None:
    for gone in range(3, 6):
        legs = tuple(leg for k, leg in enumerate(hexapod.spec.legs) if k != gone)
        findings = check_robot(replace(hexapod, spec=replace(hexapod.spec, legs=legs)))
        lone = {f.subject for f in findings if f.check == "mirror symmetry" and not f.passed}
        assert lone == {hexapod.spec.legs[gone - 3].name}


def test_a_fixed_joint_needs_no_limits() -> None:
    text = '<robot name="r"><joint name="j" type="fixed"/><joint name="k" type="floating"/></robot>'
    assert check_urdf(text, "r.urdf") == []


def spoilt(hexapod: Robot, change: str, size: float) -> Robot:
    """The hexapod with one thing of `lm_joint_2` or its link another by a share or length."""
    model = hexapod.model.copy()
    index = model.getJointId("lm_joint_2")
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
def test_legs_mirror_each_other_within_a_millionth(hexapod: Robot, change: str) -> None:
    for size, good in ((8e-7, True), (1.2e-6, False)):
        findings = check_robot(spoilt(hexapod, change, size))
        symmetric = {f.subject: f.passed for f in findings if f.check == "mirror symmetry"}
        assert symmetric == {"lf/rf": True, "lm/rm": good, "lr/rr": True}


def test_links_add_up_to_the_stated_mass_within_a_millionth(hexapod: Robot) -> None:
    stated = hexapod.spec.parameters["total_mass"]
    for share, good in ((0.0, True), (5e-7, True), (2e-6, False), (-2e-6, False)):
        model = hexapod.model.copy()
        body = model.inertias[1]
        model.inertias[1] = pin.Inertia(body.mass + share * stated, body.lever, body.inertia)
        findings = check_robot(replace(hexapod, model=model))
        (total,) = [f for f in findings if f.check == "total mass"]
        assert total.passed is good
