"""Joints that no log knows are held; a log that moves one that mimics another is refused."""

import numpy as np
import pinocchio as pin

from tests.command_line import exit_code, rows_of

LINK = """
  <link name="{name}"><inertial><origin xyz="{centre} 0 0"/><mass value="{mass}"/>
    <inertia ixx="0.0002" iyy="0.0003" izz="0.0003" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="{name}_joint" type="{kind}"><parent link="{parent}"/><child link="{name}"/>
    <axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="100" velocity="20"/>{mimic}</joint>"""


def gripper() -> str:
    """An arm and two fingers, of which the right one mimics the left one."""
    parts = ['<robot name="arm"><link name="base"/>']
    arm = {"kind": "revolute", "parent": "base", "mimic": "", "centre": 0.15, "mass": 2}
    finger = {"kind": "prismatic", "parent": "arm", "centre": 0.02, "mass": 0.3}
    follows = '<mimic joint="left_joint"/>'
    for name, own, mimic in (("arm", arm, ""), ("left", finger, ""), ("right", finger, follows)):
        parts.append(LINK.format(**{**own, "name": name, "mimic": mimic}))
    return "".join([*parts, "\n</robot>\n"])


def test_a_gripper_that_the_log_does_not_know_is_held_and_one_that_it_moves_is_refused(
    tmp_path, capsys, refused
):
    robot, log, out = tmp_path / "arm.urdf", tmp_path / "log.csv", tmp_path / "out"
    robot.write_text(gripper(), encoding="utf-8")
    model = pin.buildModelFromXML(gripper())
    t, w = np.arange(0.0, 12.0, 0.01), 2 * np.pi * 0.31
    q = np.zeros((t.size, 3))
    q[:, 0] = 0.8 * np.sin(w * t)
    v, a = np.gradient(q, t, axis=0), -(w**2) * q
    data = model.createData()
    torque = np.array([pin.rnea(model, data, *x)[0] for x in zip(q, v, a, strict=True)])
    torque += 0.01 * np.random.default_rng(1).standard_normal(torque.shape)
    columns = {"time_s": t, "arm_joint__position_rad": q[:, 0], "arm_joint__torque_Nm": torque}

    def save() -> None:
        rows, head = np.column_stack(list(columns.values())), ",".join(columns)
        np.savetxt(log, rows, delimiter=",", header=head, comments="")

    save()
    assert exit_code(["gap", "where", str(log), "--robot", str(robot), "--out", str(out)]) == 0
    assert "right_joint: joints that move: it mimics 'left_joint'" in capsys.readouterr().out
    assert {r["joint"] for r in rows_of(out / "where.csv")} == {"arm_joint"}
    columns["left_joint__position_rad"] = 1 - np.cos(t)
    save()
    said = refused(["gap", "where", log, "--robot", robot], tmp_path / "refused")
    assert "'right_joint' mimics 'left_joint'" in said
