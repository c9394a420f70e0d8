"""What moves as one body is judged as one body, and limits, lengths and masses by their units."""

from __future__ import annotations

import pytest

from pipeline.errors import UrdfError
from pipeline.robot.urdf_check import MERGED, Finding, check_urdf

INERTIA = '<inertia ixx="{0}" ixy="0" ixz="0" iyy="{1}" iyz="0" izz="{2}"/>'
GOOD = (0.01, 0.01, 0.01)


def link(name: str, mass: float | None = 1.0, moments: tuple[float, ...] = GOOD) -> str:
    if mass is None:
        return f'<link name="{name}"/>'
    tensor = INERTIA.format(*moments)
    return f'<link name="{name}"><inertial><mass value="{mass}"/>{tensor}</inertial></link>'


def joint(name: str, parent: str, child: str, kind: str = "revolute", **more: str) -> str:
    xyz = more.get("xyz", "0.3 0 0")
    limit = more.get("limit", 'lower="-1" upper="1" effort="10" velocity="5"')
    tag = "" if kind == "fixed" else f"<limit {limit}/>{more.get('inner', '')}"
    return (
        f'<joint name="{name}" type="{kind}"><origin xyz="{xyz}"/><parent link="{parent}"/>'
        f'<child link="{child}"/><axis xyz="0 0 1"/>{tag}</joint>'
    )


def robot(*parts: str) -> str:
    return f'<robot name="r">{"".join(parts)}</robot>'


def failed(*parts: str) -> list[tuple[str, str]]:
    return [(f.subject, f.check) for f in check_urdf(robot(*parts), "r.urdf") if not f.passed]


def notes(*parts: str) -> list[Finding]:
    return [f for f in check_urdf(robot(*parts), "r.urdf") if f.note]


ARM = (link("base"), link("arm"), joint("j", "base", "arm"))


def test_a_sensor_without_mass_merges_and_is_named() -> None:
    parts = (*ARM, link("imu", 0.0, (0, 0, 0)), joint("f", "arm", "imu", "fixed"))
    assert not failed(*parts)
    (note,) = notes(*parts)
    assert (note.subject, note.check) == ("arm", MERGED)
    assert note.detail == "with imu (0 kg): one body of 1 kg"


def test_a_frame_without_inertial_is_no_body_and_not_listed() -> None:
    assert not notes(*ARM, link("tip", None), joint("f", "arm", "tip", "fixed"))


def test_a_small_part_that_cannot_be_is_noted_a_large_one_fails() -> None:
    """A camera's doubtful 1e-5 kg*m^2 on a trunk of 0.01 shows nowhere; 1e-3 would."""
    for size, fails in ((1e-5, False), (1e-3, True)):
        camera = link("camera", 1e-6, (0.1 * size, 0.1 * size, size))
        parts = (*ARM, camera, joint("f", "arm", "camera", "fixed", xyz="0 0 0"))
        found = [f for f in check_urdf(robot(*parts), "r") if f.subject == "camera"]
        assert [f.passed for f in found] == [not fails]
        assert found[0].detail.startswith("moments ")


def test_merging_does_not_hide_an_impossible_link() -> None:
    """The foot's lever makes the sum positive; the shank's own moment is still negative."""
    foot = link("foot", 1.0)
    parts = (
        link("base"),
        link("arm", 1.0, (-0.005, 0.01, 0.01)),
        joint("j", "base", "arm"),
        foot,
        joint("f", "arm", "foot", "fixed"),
    )
    assert ("arm", "inertia possible") in failed(*parts)


def test_negative_mass_is_never_merged_away() -> None:
    parts = (*ARM, link("hole", -0.1), joint("f", "arm", "hole", "fixed"))
    assert ("hole", "mass positive") in failed(*parts)


def test_a_base_without_mass_stands_on_a_fixed_base() -> None:
    assert not failed(link("world", None), link("arm"), joint("j", "world", "arm"))


def test_a_point_mass_is_said() -> None:
    parts = (link("base"), link("arm", 1.0, (0, 0, 0)), joint("j", "base", "arm"))
    assert not failed(*parts)
    assert [note.check for note in notes(*parts)] == ["rotational inertia"]


def test_a_mimic_joint_and_one_of_several_coordinates_fail() -> None:
    other = (link("b2"), joint("j2", "arm", "b2", inner='<mimic joint="j"/>'))
    assert failed(*ARM, *other) == [("j2", "a drive of its own")]
    assert failed(*ARM, link("b2"), joint("j2", "arm", "b2", "floating")) == [
        ("j2", "one coordinate")
    ]


def test_a_mimic_on_a_fixed_joint_moves_nothing() -> None:
    parts = (link("b2"), joint("j2", "arm", "b2", "fixed").replace("</joint>", "{}</joint>"))
    assert not failed(*ARM, *(p.format('<mimic joint="j"/>') for p in parts))


@pytest.mark.parametrize(
    ("factor", "passed", "unit"),
    [(1e3, False, "in g?"), (100.0, True, "in g?"), (1.0, None, ""), (1e-3, True, "lengths in mm")],
)
def test_a_mass_that_does_not_fit_the_size_is_noted_or_refused(
    factor: float, passed: bool | None, unit: str
) -> None:
    """Two links of 1 kg within 0.4 m: air weighs 77 g there, water 64 kg, steel 500 kg."""
    moments = (0.01 * factor,) * 3
    parts = (link("base", factor, moments), link("arm", factor, moments), joint("j", "base", "arm"))
    found = [f for f in check_urdf(robot(*parts), "r.urdf") if f.check == "total mass"]
    assert [(f.passed, f.note) for f in found] == ([] if passed is None else [(passed, passed)])
    assert all(unit in f.detail and "A URDF takes kg and m" in f.detail for f in found)


def test_what_pinocchio_alone_refuses_is_told_in_its_words() -> None:
    """Whatever this project does not look for still ends in one line."""
    material = '<material name="m"><color rgba="1 1"/></material>'
    with pytest.raises(UrdfError) as caught:
        check_urdf(robot(*ARM, material, material), "r.urdf")
    assert "not a URDF that Pinocchio can read (" in str(caught.value)
    assert "\n" not in str(caught.value)
