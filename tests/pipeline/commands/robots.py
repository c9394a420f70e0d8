"""Robot files made from the hexapod's by one edit."""

import re
from pathlib import Path

from pipeline.robot.robot_file import load_robot_file

#: Parameters that a robot file with a URDF of the user's own still gives.
GAIT = ("total_mass", "foot_stroke", "foot_lift", "walking_speed", "gait_period", "gravity")


def changed(text: str, pattern: str, replacement: str) -> str:
    """A text with the first match of a pattern replaced; there must be one."""
    text, count = re.subn(pattern, replacement, text, count=1, flags=re.S | re.M)
    assert count == 1, pattern
    return text


def edited_robot(root: Path, folder: Path, pattern: str, replacement: str) -> Path:
    """The hexapod's robot file with the first match of a pattern replaced."""
    text = (root / "urdf" / "hexapod.toml").read_text(encoding="utf-8")
    path = folder / "robot.toml"
    path.write_text(changed(text, pattern, replacement), encoding="utf-8")
    return path


def own_robot(root: Path, folder: Path, pattern: str, replacement: str) -> Path:
    """A robot file that names a URDF of its own: the hexapod's, with one match replaced."""
    spec = load_robot_file(root / "urdf" / "hexapod.toml")
    urdf = changed(spec.urdf.read_text(encoding="utf-8"), pattern, replacement)
    (folder / "own.urdf").write_text(urdf, encoding="utf-8")
    head, *tables = re.split(r"(?m)^(?=\[parameters\.)", spec.path.read_text(encoding="utf-8"))
    head = head.replace('build = "hexapod"\n', "").replace('"hexapod.urdf"', '"own.urdf"')
    for leg in spec.legs:
        foot = f"neutral_foot = {list(leg.neutral_foot)}"
        head = re.sub(rf'(\[legs\.{leg.name}\].*?)station = "\w+"', rf"\1{foot}", head, flags=re.S)
    kept = [t for t in tables if t.split("]")[0].removeprefix("[parameters.") in GAIT]
    path = folder / "own.toml"
    path.write_text(head + "".join(kept), encoding="utf-8")
    return path
