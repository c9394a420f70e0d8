"""Figures are drawn and name their run; a robot ends at its feet.

Warnings are errors, so that a missing glyph or a failed layout is found here.
"""

import matplotlib
import numpy as np
import pinocchio as pin
import pytest

import pipeline as lw
from pipeline.motion.walking import standing_posture
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import load_robot_file
from reports.figures.demand import Run
from reports.figures.robot import robot_figure
from reports.figures.style import save_figure
from reports.run import drawings
from tests.command_line import own_robot


@pytest.mark.parametrize(
    "name", ["hexapod", *(pytest.param(x, marks=pytest.mark.slow) for x in ("solo12", "anymal_c"))]
)
def test_every_figure_is_drawn_and_names_its_run(root, tmp_path, name):
    given = lw.load(root / "urdf" / f"{name}.toml").walking(samples=151)
    standing, walking = lw.stand(given), lw.walk(given)
    run = Run(given, standing.result, walking.result, standing.tables | walking.tables)
    for title, draw in drawings(run).items():
        figure = draw()
        save_figure(figure, tmp_path, title)
        words = [t.get_text() for t in figure.findobj(matplotlib.text.Text)]
        assert name in " ".join(words), title


def test_a_robot_whose_mesh_nobody_has_is_drawn_as_lines_that_end_at_its_feet(root, tmp_path):
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
