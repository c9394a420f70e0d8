"""Bodies as found, by link and as a URDF of the same torque; strained bodies stay bodies."""

import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest

from pipeline.effects.bodies import physical
from pipeline.effects.model_file import Edit, apply_edits, new_model_file
from pipeline.machine.machine import MachineModel, strained
from pipeline.robot.urdf import model_of_angles, read_urdf
from pipeline.simulation.export import corrected_urdf, found_bodies
from tests.command_line import base_model, edit_of

#: A link with a cover, a link whose mass is its tool's alone, and what must stay in the text.
ARM = """<?xml version='1.0' encoding="UTF-8"?>
<!-- Müller's arm -->
<robot name="arm">
  <link name="base"/>
  <link name="upper"><!-- 2 kg --><inertial><origin xyz="0 0 0.1"/><mass value="2"/>
    <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.01"/></inertial>
    <visual><geometry><mesh filename="package://arm/upper.stl" scale="1 1 1"/></geometry></visual>
  </link>
  <link name="cover"><inertial><mass value="0.3"/>
    <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/></inertial></link>
  <link name="forearm"/>
  <link name="tool"><inertial><origin xyz="0 0.02 0.1" rpy="0.1 0.2 0.3"/><mass value="1"/>
    <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.01"/></inertial></link>
  <joint name="a" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="50" velocity="5"/></joint>
  <joint name="b" type="continuous"><parent link="upper"/><child link="forearm"/>
    <origin xyz="0 0 0.3"/><axis xyz="0 1 0"/><limit effort="50" velocity="5"/></joint>
  <joint name="c" type="fixed"><parent link="forearm"/><child link="tool"/>
    <origin xyz="0 0 0.2" rpy="0 0.5 0"/></joint>
  <joint name="d" type="fixed"><parent link="upper"/><child link="cover"/></joint>
</robot>
"""
WHOLE = {"mass": 0.4, "mx": 0.01, "my": 0.02, "mz": 0.1, "Ixx": 0.06, "Iyy": 0.05, "Izz": 0.02}
WHOLE |= dict.fromkeys(("Ixy", "Ixz", "Iyz"), 0.0)


def whole(link: str, within: float = 0.1) -> Edit:
    return edit_of("rigid_body_parameters", link, within=within, **WHOLE)


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    path = tmp_path / "arm.urdf"
    path.write_text(ARM, encoding="utf-8")
    return path


def torque_apart(text: str, machine: MachineModel) -> float:
    """Largest difference of generalised force over its size, at random states."""
    rng = np.random.default_rng(0)
    urdf = model_of_angles(text, "text", floating=machine.robot.floating)
    edited = machine.rigid
    data, apart = (urdf.createData(), edited.createData()), []
    for _ in range(30):
        q = pin.integrate(urdf, pin.neutral(urdf), rng.uniform(-1, 1, urdf.nv))
        v, a = rng.normal(size=(2, urdf.nv))
        one, other = (pin.rnea(m, d, q, v, a) for m, d in zip((urdf, edited), data, strict=True))
        apart.append(np.abs(one - other).max() / np.abs(other).max())
    return float(max(apart))


LEG = [
    edit_of("link_mass", "rm_tibia_link", mass=0.5, x=0.1, z=-0.2),
    edit_of("center_of_mass_offset", "rm_femur_link", x=0.01, y=0.0, z=-0.02),
    whole("rm_hip_link"),
]


@pytest.mark.parametrize(
    ("robot", "edits"),
    [
        ("hexapod.toml", [edit_of("link_mass", "base_link", mass=2.0), whole("rm_tibia_link")]),
        ("leg.urdf", LEG),
        ("arm", [whole("forearm"), edit_of("link_mass", "upper", mass=-0.2)]),
        ("arm", [edit_of("link_mass", "forearm", mass=0.5, y=0.1)]),
    ],
)
def test_the_corrected_urdf_asks_for_the_same_torque(root, arm, robot, edits):
    path = arm if robot == "arm" else root / "urdf" / robot
    bare, source = base_model(new_model_file(path)), read_urdf(path.with_suffix(".urdf"))
    text = corrected_urdf(source, str(path), bare, edits)
    assert torque_apart(source, bare) < 1e-13
    assert torque_apart(source, apply_edits(bare, edits)) > 1e-3
    assert torque_apart(text, apply_edits(bare, edits)) < 1e-13
    if robot == "arm":  # all but the inertial elements stays
        inertial = re.compile(r"<inertial>.*?</inertial>", re.DOTALL)
        left = (inertial.sub("", x) for x in (text, ARM))
        one, other = (ElementTree.canonicalize(x, strip_text=True) for x in left)
        assert one == other
        assert "2 kg" in text


def test_intervals_decide_what_differs_and_come_first(arm):
    bare = base_model(new_model_file(arm))
    clear = edit_of("link_mass", "upper", within=0.2, mass=0.5)
    first, second = found_bodies(bare, [whole("forearm", 20.0), clear]).to_dict("records")
    assert (first["link"], first["differs_in"]) == ("upper", "mass")
    np.testing.assert_allclose([first["low_mass_kg"], first["high_mass_kg"]], [2.7, 2.9])
    assert first["found_center_z_m"] == pytest.approx(first["urdf_center_z_m"])
    assert second["differs_in"] == ""
    for payload, differs in ((1e-15, ""), (1e-6, "mass")):  # rounding, and what is none
        found = found_bodies(bare, [edit_of("link_mass", "upper", mass=payload)])
        assert found["differs_in"].str.partition("+")[0].tolist() == [differs]
    assert second["high_center_z_m"] is None or np.isnan(second["high_center_z_m"])
    assert found_bodies(bare, [edit_of("coulomb_friction", "a", torque=0.1)]).empty


#: A rod of 2 kg and 0.6 m along z, nearly without thickness.
ROD = pin.Inertia.FromBox(2.0, 0.01, 0.01, 0.6)


def _parts(body: pin.Inertia) -> tuple[float, np.ndarray, np.ndarray]:
    return body.mass, np.array(body.lever), np.array(body.inertia)


def test_its_entries_are_mass_stretch_and_displacement():
    heavier, _, inertia = _parts(strained(ROD, [0, 0, 0, np.log(1.2), 0, 0, 0, 0, 0, 0]))
    assert heavier == pytest.approx(2.4)
    assert inertia == pytest.approx(1.2 * np.array(ROD.inertia))
    mass, centre, inertia = _parts(strained(ROD, [0, 0, 0, 0, 0, 0, 0, 0.1, 0, 0]))
    assert mass == pytest.approx(2.0)
    # A slender body moves sideways as far as along itself: in its longest radius of gyration.
    assert centre == pytest.approx([0.1 * 0.6 / np.sqrt(12), 0, 0])
    assert inertia == pytest.approx(np.array(ROD.inertia))
    longer = strained(ROD, [0, 0, np.log(1.5), 0, 0, 0, 0, 0, 0, 0])
    assert np.array(longer.inertia) == pytest.approx(
        np.array(pin.Inertia.FromBox(2.0, 0.01, 0.01, 0.9).inertia)
    )


@pytest.mark.parametrize("strain", [0.0, 0.003])
def test_a_point_becomes_a_body_that_a_file_may_hold(strain):
    point = pin.Inertia(0.2, np.array([0.0, 0.0, 0.042]), np.zeros((3, 3)))
    body = strained(point, [strain] * 10)
    assert physical(np.array(body.toDynamicParameters()))
    assert np.array(body.inertia) == pytest.approx(np.zeros((3, 3)), abs=1e-9)


@pytest.mark.parametrize("seed", range(2))
def test_axes_and_origin_of_a_body_are_of_no_matter(seed):
    rng = np.random.default_rng(seed)
    body = pin.SE3.Random().act(pin.Inertia.FromBox(2.0, 0.1, 0.3, 0.6))
    turn = pin.SE3(pin.Quaternion(rng.standard_normal(4)).normalized().matrix(), np.zeros(3))
    away = pin.SE3(np.eye(3), rng.standard_normal(3))
    E, d, a = rng.standard_normal((3, 3)), rng.standard_normal(3), float(rng.standard_normal())
    E = 0.2 * (E + E.T)

    def changed(of: pin.Inertia, E: np.ndarray, d: np.ndarray) -> np.ndarray:
        diagonal, beside = np.diag(E), E[[0, 0, 1], [1, 2, 2]]
        return np.array(strained(of, [*diagonal, a, *beside, *d]).toDynamicParameters())

    here = changed(body, E, d)
    R = turn.rotation
    turned = pin.Inertia.FromDynamicParameters(changed(turn.act(body), R @ E @ R.T, R @ d))
    assert turn.actInv(turned).toDynamicParameters() == pytest.approx(here)
    moved = pin.Inertia.FromDynamicParameters(changed(away.act(body), E, d))
    assert away.actInv(moved).toDynamicParameters() == pytest.approx(here)
    assert np.linalg.eigvalsh(pin.PseudoInertia.FromDynamicParameters(here).toMatrix()).min() > 0.0
