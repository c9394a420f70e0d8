"""What was found, written for other tools: they must compute the torques that we do."""

import sys
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from actuators.arrays import Array
from actuators.shaft import ShaftSeries
from pipeline.commands.main import main
from pipeline.effects.model_file import (
    apply_edits,
    assumed,
    model_text,
    new_model_file,
    read_model_file,
)
from pipeline.machine.machine import MachineModel
from pipeline.simulation.export import LEFT, exported
from tests.command_line import base_model

Effects = tuple[tuple[str, str, dict[str, float]], ...]
Write = Callable[[Effects], Path]
LINK = """
  <link name="{name}"><inertial>
    <origin xyz="{x} 0.02 -0.05" rpy="0.1 0.2 0.3"/><mass value="{mass}"/>
    <inertia ixx="0.01" iyy="0.02" izz="0.015" ixy="0.001" ixz="0.0" iyz="-0.001"/>
  </inertial></link>"""
URDF = (
    '<robot name="arm"><link name="base"/>'
    + LINK.format(name="upper", x=0.1, mass=2.0)
    + LINK.format(name="lower", x=0.15, mass=1.0)
    + """
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0.1 0.3" rpy="0.2 0 0.1"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="60" velocity="8"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
    <origin xyz="0.3 0 0" rpy="0 0.4 0"/><axis xyz="0.6 0 0.8"/>
    <limit lower="-2" upper="2" effort="30" velocity="8"/><dynamics damping="7"/></joint>
</robot>
"""
)
PLAIN: Effects = (
    ("coulomb_friction", "shoulder", {"torque": 1.3}),
    ("viscous_friction", "shoulder", {"coefficient": 0.7}),
    ("viscous_friction", "elbow", {"coefficient": 0.2}),
    ("rotor_inertia", "elbow", {"added": 0.08}),
    ("parallel_spring", "elbow", {"stiffness": 5.0, "rest": 0.3}),
    ("link_mass", "lower", {"mass": 0.5, "x": 0.2}),
    ("base_tilt", "ground", {"roll": 0.05, "pitch": -0.1}),
)
BENT: Effects = (
    ("load_dependent_friction", "shoulder", {"share": 0.1}),
    ("joint_elasticity", "elbow", {"stiffness": 900.0}),
)


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Write a model file with effects of an arm."""

    def _write(effects: Effects) -> Path:
        (tmp_path / "arm.urdf").write_text(URDF, encoding="utf-8")
        edits = [assumed(effect, (place,), values, "a test") for effect, place, values in effects]
        file = new_model_file(tmp_path / "arm.urdf").with_edits(edits)
        (tmp_path / "model.toml").write_text(model_text(file, tmp_path), encoding="utf-8")
        return tmp_path / "model.toml"

    return _write


def motion(n: int = 200) -> tuple[Array, Array, Array]:
    """A moving trajectory of two joints, no row near rest: position, speed, acceleration."""
    t = np.linspace(0.0, 3.0, n)[:, None]
    w, phase = np.array([2.1, 3.3]), np.array([0.4, 1.3])
    q, v = 0.8 * np.sin(w * t + phase), 0.8 * w * np.cos(w * t + phase)
    moves = (np.abs(v) > 0.3).all(axis=1)
    return q[moves], v[moves], (-(w**2) * q)[moves]


def machine_of(path: Path) -> MachineModel:
    file = read_model_file(path)
    return apply_edits(base_model(file), file.edits)


def our_torque(machine: MachineModel, q: Array, v: Array, a: Array) -> Array:
    """What the motors give at the joints, by rigid bodies and the drivetrains' own laws."""
    model = machine.rigid
    data = model.createData()
    out = np.array([pin.rnea(model, data, *row) for row in zip(q, v, a, strict=True)])
    for k, drive in enumerate(machine.actuators):
        columns = (x[:, [k]] for x in (q, v, a))
        load = drive.drive_load(q[:, [k]], out[:, [k]])
        time = np.arange(len(q), dtype=float)
        side = ShaftSeries((drive.name,), time, *columns, load, np.sign(v[:, [k]]))
        out[:, k] = drive.at_motor(side).torque[:, 0] * drive.ratio
    return out


def mujoco_torque(text: str, q: Array, v: Array, a: Array) -> Array:
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    out = np.empty_like(q)
    for k in range(len(q)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[k], v[k], a[k]
        mujoco.mj_inverse(model, data)
        out[k] = data.qfrc_inverse
    return out


def test_mujoco_computes_the_torques_that_we_do(write):
    model = write(PLAIN)
    (text, left, _), machine = exported(model, "mjcf"), machine_of(model)
    assert left == LEFT["mjcf"]
    q, v, a = motion()
    ours = our_torque(machine, q, v, a)
    assert np.abs(mujoco_torque(text, q, v, a) - ours).max() < 1e-3 * np.abs(ours).max()
    limits = mujoco.MjModel.from_xml_string(text)
    assert np.allclose(limits.jnt_range, [[-2.0, 2.0]] * 2)
    assert np.allclose(limits.jnt_actfrcrange, [[-60, 60], [-30, 30]])
    # Without what was found they are far apart: the comparison can fail.
    bare, *_ = exported(write(()), "mjcf")
    assert np.abs(mujoco_torque(bare, q, v, a) - ours).max() > 1.0
    _, lost, _ = exported(write((*PLAIN, *BENT)), "mjcf")
    assert {"load_dependent_friction at shoulder", "joint_elasticity at elbow"} < {*lost}


def test_without_mujoco_or_with_a_body_that_it_refuses_one_line_says_so(
    write, tmp_path, refused, monkeypatch
):
    arguments = ["gap", "export", str(write(())), "--to", "mjcf"]
    odd = tmp_path / "odd.urdf"  # beyond the triangle inequality by as much as is a warning
    text = URDF.replace('izz="0.015" ixy="0.001"', 'izz="0.0312" ixy="0"')
    odd.write_text(text.replace('iyz="-0.001"', 'iyz="0"'), encoding="utf-8")
    said = refused([*arguments, "--robot", str(odd)], tmp_path / "arm.xml")
    assert "MuJoCo refuses the machine" in said
    monkeypatch.setitem(sys.modules, "mujoco", None)
    assert "or write a URDF" in refused(arguments, tmp_path / "arm.xml")


def test_the_urdf_read_again_has_friction_and_bodies(write, tmp_path):
    model, out = write(PLAIN), tmp_path / "found.urdf"
    out.write_text(exported(model, "urdf")[0], encoding="utf-8")
    again = pin.buildModelFromUrdf(str(out))
    # Pinocchio reads `dynamics`: friction as dry friction, damping as viscous.
    assert np.allclose(again.upperDryFrictionLimit, [1.3, 0.0], atol=1e-7)
    assert np.allclose(again.damping, [0.7, 0.2], atol=1e-7)
    machine = machine_of(model)
    own = machine.rigid.inertias
    for mine, theirs in zip(own, again.inertias, strict=True):
        pair = mine.toDynamicParameters(), theirs.toDynamicParameters()
        assert np.allclose(*pair, rtol=1e-6, atol=1e-9)
    assert main(["check", str(out)]) == 0
