"""Joints that no log knows are held; a log that moves one that mimics another is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from actuators.errors import LegwattError
from pipeline.robot.check import refuse_urdf, tolerated
from pipeline.robot.urdf_check import check_urdf
from tests.command_line import Refused, exit_code, rows_of

NAMES = ("joint_1", "joint_2", "joint_3")
LINK = """
  <link name="link_{n}"><inertial><origin xyz="0.15 0.02 -0.01"/><mass value="2"/>
    <inertia ixx="0.004" iyy="0.02" izz="0.022" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="joint_{n}" type="revolute"><parent link="{parent}"/><child link="link_{n}"/>
    <origin xyz="{at}"/><axis xyz="{axis}"/>
    <limit lower="-3" upper="3" effort="100" velocity="20"/></joint>"""
FINGER = """
  <link name="{name}"><inertial><origin xyz="0.02 0 0"/><mass value="0.3"/>
    <inertia ixx="0.0002" iyy="0.0003" izz="{izz}" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="{name}_joint" type="prismatic"><parent link="link_3"/><child link="{name}"/>
    <origin xyz="0.3 {y} 0"/><axis xyz="0 1 0"/>
    <limit lower="0" upper="0.04" effort="10" velocity="1"/>{mimic}</joint>"""
MIMIC = '<mimic joint="left_joint"/>'


def urdf() -> str:
    out = '<robot name="arm"><link name="base"/>'
    for n in (1, 2, 3):
        parent, at = ("base", "0 0 0") if n == 1 else (f"link_{n - 1}", "0.3 0 0.05")
        axis = "0 0 1" if n % 2 else "0 1 0"
        out += LINK.format(n=n, parent=parent, at=at, axis=axis)
    return out + "\n</robot>\n"


def gripper(izz: float = 0.0003) -> str:
    fingers = FINGER.format(name="left", y=0.02, mimic="", izz=izz)
    fingers += FINGER.format(name="right", y=-0.02, mimic=MIMIC, izz=0.0003)
    return urdf().replace("</robot>", fingers + "</robot>")


@pytest.mark.parametrize(("share", "goes_on"), [(0.049, True), (0.051, False)])
def test_an_inertia_beyond_the_triangle_by_rounding_is_a_warning(
    share: float, goes_on: bool
) -> None:
    """(xx + yy) / (1 - share) exceeds the sum by `share` of itself."""
    text = gripper(izz=0.0005 / (1.0 - share))
    if goes_on:
        refuse_urdf(text, "arm.urdf")
        (line,) = [w for w in tolerated(check_urdf(text, "arm.urdf")) if w.startswith("left:")]
        assert "kept as stated" in line
    else:
        with pytest.raises(LegwattError, match="left: inertia possible fails"):
            refuse_urdf(text, "arm.urdf")


def recorded(folder: Path, text: str, *, finger: float | None) -> tuple[Path, Path]:
    """A URDF and a log of its three joints, and of the first finger where it is asked for."""
    robot, log = folder / "arm.urdf", folder / "log.csv"
    robot.write_text(text, encoding="utf-8")
    model = pin.buildModelFromXML(text)
    t = np.arange(0.0, 12.0, 0.01)
    speed = 2 * np.pi * np.array([0.31, 0.23, 0.41, 0.0, 0.0])
    q, v, a = (
        0.8 * f(np.outer(t, speed)) * speed**k * sign
        for k, f, sign in ((0, np.sin, 1), (1, np.cos, 1), (2, np.sin, -1))
    )
    data = model.createData()
    torque = np.array([pin.rnea(model, data, *x) for x in zip(q, v, a, strict=True)])
    torque += 0.01 * np.random.default_rng(1).standard_normal(torque.shape)
    columns = {"time_s": t}
    for k, name in enumerate(NAMES):
        columns |= {f"{name}__position_rad": q[:, k], f"{name}__torque_Nm": torque[:, k]}
    if finger is not None:
        columns["left_joint__position_rad"] = finger * (1 - np.cos(t)) / 2
    header = ",".join(columns)
    np.savetxt(
        log, np.column_stack(list(columns.values())), delimiter=",", header=header, comments=""
    )
    return robot, log


def test_a_gripper_that_the_log_does_not_know_is_held_and_one_that_it_moves_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], refused: Refused
) -> None:
    robot, log = recorded(tmp_path, gripper(), finger=None)
    out = tmp_path / "out"
    assert exit_code(["gap", "where", str(log), "--robot", str(robot), "--out", str(out)]) == 0
    assert "right_joint: it mimics 'left_joint'" in capsys.readouterr().out
    assert {r["joint"] for r in rows_of(out / "where.csv")} == set(NAMES)
    robot, log = recorded(tmp_path, gripper(), finger=0.03)
    said = refused(["gap", "where", log, "--robot", robot], tmp_path / "refused")
    assert "'right_joint' mimics 'left_joint'" in said
