"""Two readers of a URDF that share no code put every link at the same place, or it is said."""

import io

import pytest
import yourdfpy

from pipeline.robot.check import check_second_reader

ARM = """<robot name="arm">
  <link name="base"/><link name="upper"/><link name="fore"/><link name="slide"/>
  <joint name="b" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.1" rpy="0.3 -0.2 0.7"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="a" type="continuous"><parent link="upper"/><child link="fore"/>
    <origin xyz="0.3 0 0"/><axis xyz="0 0 1"/></joint>
  <joint name="c" type="prismatic"><parent link="fore"/><child link="slide"/>
    <origin xyz="0 0.2 0"/><axis xyz="1 0 0"/><mimic joint="b"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
</robot>"""


@pytest.mark.parametrize(
    ("old", "new", "alike"),
    [
        ("", "", True),
        ('rpy="0.3 -0.2 0.7"', 'rpy="0.3 -0.2 0.70001"', False),
        ('rpy="0.3 -0.2 0.7"', 'rpy="0.3 -0.2 0.70000001"', True),  # rounding
        ('axis xyz="0 0 1"', 'axis xyz="0 0 -1"', False),
    ],
)
def test_what_one_of_them_reads_otherwise_is_named(monkeypatch, old, new, alike):
    load = yourdfpy.URDF.load
    read = io.BytesIO(ARM.replace(old, new).encode())
    monkeypatch.setattr(yourdfpy.URDF, "load", lambda _, **options: load(read, **options))
    found = check_second_reader(ARM, "arm.urdf")
    assert (found.passed, found.note) == (alike, False)
    assert ("lies elsewhere" in found.detail) is not alike
