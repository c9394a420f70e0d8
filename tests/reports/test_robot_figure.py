"""Pictures of the robot are its URDF's: shapes, missing meshes, joint axes."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
import pinocchio as pin
import pytest

from pipeline.motion.support import standing_posture
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import load_robot_file
from reports.figures.robot import robot_figure
from tests.pipeline.commands.robots import own_robot

X, Y = np.eye(3)[:2]


@pytest.mark.parametrize(("name", "size"), [("hexapod", [0.6, 0.22]), ("solo12", [0.45, 0.22])])
def test_the_trunk_is_seen_from_above_and_feet_where_they_stand(
    root: Path, name: str, size: list[float]
) -> None:
    """A box, and a mesh of a package."""
    robot = load_robot(load_robot_file(root / "urdf" / f"{name}.toml"))
    posture = standing_posture(robot, robot.leg_names)
    figure = robot_figure(robot, posture.configuration[0], title="t")
    oblique, above, *_ = figure.axes
    outlines = [np.ptp(patch.get_xy(), axis=0) for patch in above.patches]
    assert any(np.allclose(outline, size, rtol=0.02) for outline in outlines)
    words = {t.get_text() for t in figure.findobj(matplotlib.text.Text)}
    assert {leg.name.upper() for leg in robot.spec.legs} <= words
    assert len(oblique.patches) == len(outlines)


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
