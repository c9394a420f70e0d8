"""Robots of the project that walk another gait than their file's, for tests."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file


def gaited(root: Path, name: str, gait: Mapping[str, Any]) -> Robot:
    return load_robot(load_robot_file(root / "urdf" / f"{name}.toml").with_gait(**gait))
