"""Two readers of a URDF that share no code put every link at the same place, or it is said."""

import numpy as np
import pytest

from pipeline.robot import second_reader
from pipeline.robot.second_reader import check_second_reader, placed_by_yourdfpy

ARM = """<robot name="arm">
  <link name="base"/><link name="upper"/><link name="fore"/><link name="slide"/>
  <joint name="b" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.1" rpy="0.3 -0.2 0.7"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="a" type="continuous"><parent link="upper"/><child link="fore"/>
    <origin xyz="0.3 0 0"/><axis xyz="0 0 1"/></joint>
  <joint name="c" type="prismatic"><parent link="fore"/><child link="slide"/>
    <origin xyz="0 0.2 0"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
</robot>"""


def test_revolute_continuous_and_prismatic_joints_are_read_alike(hexapod):
    assert check_second_reader(ARM, "arm.urdf").passed
    found = check_second_reader(hexapod.urdf, "hexapod")
    assert found.passed
    assert not found.note


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('rpy="0.3 -0.2 0.7"', 'rpy="0.3 -0.2 0.70001"'),
        ('axis xyz="0 0 1"', 'axis xyz="0 0 -1"'),
        ('xyz="0 0.2 0"', 'xyz="0 0.20001 0"'),
    ],
)
def test_what_one_of_them_reads_otherwise_is_named(monkeypatch, old, new):
    wrong = ARM.replace(old, new)
    monkeypatch.setattr(
        second_reader, "placed_by_yourdfpy", lambda _, turn: placed_by_yourdfpy(wrong, turn)
    )
    found = check_second_reader(ARM, "arm.urdf")
    assert not found.passed
    assert "lies elsewhere" in found.detail


def test_rounding_is_no_difference(monkeypatch):
    def near(urdf, turn):
        return {name: x + 1e-9 for name, x in placed_by_yourdfpy(urdf, turn).items()}

    monkeypatch.setattr(second_reader, "placed_by_yourdfpy", near)
    assert check_second_reader(ARM, "arm.urdf").passed
    assert np.isfinite(placed_by_yourdfpy(ARM, np.zeros(3))["slide"]).all()
