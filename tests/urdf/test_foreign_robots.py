"""Robots that others publish pass, although they hang sensors of 0 kg on fixed joints."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from actuators.errors import LegwattError
from pipeline.commands.robots import robot_file_of
from pipeline.dynamics.joint_demand import segment_demand
from pipeline.motion.support import standing_posture
from pipeline.robot.check import check_file
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import load_robot_file

ROBOTS = ("go2", "hyq")


@pytest.mark.parametrize("name", ROBOTS)
def test_published_robots_pass(name: str) -> None:
    assert not [finding for finding in check_file(Path(name)) if not finding.passed]


@pytest.mark.parametrize("name", ROBOTS)
def test_published_robots_stand_with_the_posture_that_a_refusal_offers(
    name: str, tmp_path: Path
) -> None:
    """From zero the knees' branch is not clear; with the offer pasted in the feet carry all."""
    text = re.sub(r"(?m)^start_posture = .*\n", "", robot_file_of(name).read_text("utf-8"))
    path = tmp_path / "robot.toml"
    path.write_text(text, encoding="utf-8")
    refusal = ""
    try:
        standing_posture(load_robot(load_robot_file(path)))
    except LegwattError as error:
        refusal = str(error)
    offers = re.findall(r"legs\.(\w+): (\[[^\]]*\])", refusal)
    assert bool(offers) == bool(refusal) == ("start_posture is missing: from zero" in refusal)
    for leg, offer in offers:
        text = text.replace(f"[legs.{leg}]", f"[legs.{leg}]\nstart_posture = {offer}")
    path.write_text(text, encoding="utf-8")
    robot = load_robot(load_robot_file(path))
    _, contacts = segment_demand(robot, standing_posture(robot))
    assert contacts is not None
    assert contacts.force_world[0, :, 2].sum() == pytest.approx(9.81 * robot.mass, rel=1e-9)
    assert np.all(contacts.force_world[0, :, 2] > 0)
