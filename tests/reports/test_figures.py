"""Figures show what they were given: lines and labels.

Warnings are errors, so that a missing glyph or a failed layout is found here.
"""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
import pinocchio as pin
import pytest

import pipeline as lw
from pipeline.motion.support import standing_posture
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import load_robot_file
from reports.figures.demand import joint_demand_figure
from reports.figures.robot import robot_figure
from reports.figures.run import drawings
from reports.figures.style import save_figure
from reports.pages.robot_page import needs
from tests.command_line import own_robot

JOINTS = {"a": "joint 1", "b": "joint 2"}


def cycle(torque: np.ndarray) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Two seconds of joints a and b: leg l stands in the first, leg r in the second."""
    second = np.linspace(0, 1, 11)
    demand = pd.DataFrame({"time_s": np.append(second, 1 + second)})
    contacts = demand.copy()
    for k, leg in enumerate("lr"):
        down = np.repeat([1.0 - k, float(k)], 11)
        contacts[f"{leg}__contact"] = down
        contacts[f"{leg}__force_z_N"] = 100 * down
        contacts[f"{leg}__friction_needed"] = np.where(down > 0, 0.1, np.nan)
        demand[f"{leg}_1__velocity_rad_s"] = 0.0
        demand[f"{leg}_1__torque_Nm"] = torque
    return demand, contacts


def demand(**more: np.ndarray):
    table, contacts = cycle(np.repeat([-30.0, 2.0], 11))
    legs = {"l": ["l_1"], "r": ["r_1"]}
    return joint_demand_figure(table.assign(**more), contacts, legs, title="t")


def test_joint_demand_draws_a_jump_as_a_jump_and_the_swing_thin() -> None:
    sliding = {"arm__velocity_m_s": np.zeros(22), "arm__torque_N": np.ones(22)}
    figure = demand(**sliding)
    _, torque, _, arm = figure.axes
    curves = [x for x in torque.lines if len(x.get_xdata()) == 11]
    assert [float(x.get_ydata()[0]) for x in curves] == [-30.0, 2.0, -30.0, 2.0]
    widths = [x.get_linewidth() for x in curves]
    assert widths[0] == widths[3] > widths[1] == widths[2]
    assert (torque.get_ylabel(), arm.get_ylabel()) == ("N·m", "N")
    robot: Any = SimpleNamespace(joints=("l_1", "arm"))
    asked = needs(cycle(np.repeat([-30.0, 2.0], 11))[0].assign(**sliding), robot).set_index("joint")
    peaks = asked[["peak torque [N·m]", "peak force [N]"]].to_dict("index")
    assert peaks["l_1"]["peak torque [N·m]"] == 30.0
    assert peaks["arm"]["peak force [N]"] == 1.0


@pytest.mark.parametrize(
    "name", ["hexapod", *(pytest.param(x, marks=pytest.mark.slow) for x in ("solo12", "anymal_c"))]
)
def test_every_figure_is_drawn_and_names_its_run(root: Path, tmp_path: Path, name: str) -> None:
    given = lw.load(root / "urdf" / f"{name}.toml").walking(samples=151)
    standing, walking = lw.stand(given), lw.walk(given)
    tables = standing.tables | walking.tables
    for title, draw in drawings(given, standing.result, walking.result, tables).items():
        figure = draw()
        save_figure(figure, tmp_path, title)
        words = [t.get_text() for t in figure.findobj(matplotlib.text.Text)]
        assert name in " ".join(words), title


X, Y = np.eye(3)[:2]


def test_a_robot_whose_mesh_nobody_has_is_drawn_as_lines_that_end_at_its_feet(
    root: Path, tmp_path: Path
) -> None:
    pattern = r"<(box|sphere) [^>]*/>"
    path = own_robot(root, tmp_path, pattern, '<mesh filename="package://nobody/trunk.dae"/>')
    robot = load_robot(load_robot_file(path))
    posture = standing_posture(robot, robot.leg_names)
    figure = robot_figure(robot, posture.configuration[0], title="t")
    assert "meshes are missing" in " ".join(t.get_text() for t in figure.texts)
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, posture.configuration[0])
    ends = np.array([line.get_xydata()[-1] for line in figure.axes[1].lines])
    for leg in robot.spec.legs:
        foot = data.oMf[robot.model.getFrameId(leg.foot)].translation[:2]
        assert np.abs(ends - foot).max(axis=1).min() < 1e-9
