"""Joints that no log knows are held; a log that moves one that mimics another is refused."""

import numpy as np
import pinocchio as pin

from tests.command_line import exit_code, rows_of
from tests.pipeline.arm import torques

LINK = """
  <link name="{0}"><inertial><origin xyz="{3} 0 0"/><mass value="{4}"/>
    <inertia ixx="0.0002" iyy="0.0003" izz="0.0003" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="{0}_joint" type="{1}"><parent link="{2}"/><child link="{0}"/>
    <axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="100" velocity="20"/>{5}</joint>"""
#: An arm and two fingers, of which the right one mimics the left one.
PARTS = (
    ("arm", "revolute", "base", 0.15, 2, ""),
    ("left", "prismatic", "arm", 0.02, 0.3, ""),
    ("right", "prismatic", "arm", 0.02, 0.3, '<mimic joint="left_joint"/>'),
)
LINKS = "".join(LINK.format(*part) for part in PARTS)
GRIPPER = f'<robot name="arm"><link name="base"/>{LINKS}\n</robot>\n'


def test_a_gripper_that_the_log_does_not_know_is_held_and_one_that_it_moves_is_refused(
    tmp_path, capsys, refused
):
    robot, log, out = tmp_path / "arm.urdf", tmp_path / "log.csv", tmp_path / "out"
    robot.write_text(GRIPPER, encoding="utf-8")
    t, w = np.arange(0.0, 12.0, 0.01), 2 * np.pi * 0.31
    q = np.outer(0.8 * np.sin(w * t), [1.0, 0.0, 0.0])
    v = np.gradient(q, t, axis=0)
    torque = torques(pin.buildModelFromXML(GRIPPER), q, v, -(w**2) * q)[:, 0]
    torque += 0.01 * np.random.default_rng(1).standard_normal(torque.shape)
    names, columns = "time_s,arm_joint__position_rad,arm_joint__torque_Nm", [t, q[:, 0], torque]
    np.savetxt(log, np.column_stack(columns), delimiter=",", header=names, comments="")
    assert exit_code(["gap", "where", str(log), "--robot", str(robot), "--out", str(out)]) == 0
    assert "right_joint: joints that move: it mimics 'left_joint'" in capsys.readouterr().out
    assert {r["joint"] for r in rows_of(out / "where.csv")} == {"arm_joint"}
    names, columns = f"{names},left_joint__position_rad", [*columns, 1 - np.cos(t)]
    np.savetxt(log, np.column_stack(columns), delimiter=",", header=names, comments="")
    said = refused(["gap", "where", log, "--robot", robot], tmp_path / "refused")
    assert "'right_joint' mimics 'left_joint'" in said
