"""Walking machines of any legs as URDF text and robot file, for tests."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file

#: Type and axis of each joint from the base outward.
Leg = Sequence[tuple[str, str]]
INERTIAL = (
    '<inertial><origin xyz="0.01 0.02 -0.05"/><mass value="{mass}"/>'
    '<inertia ixx="0.01" iyy="0.011" izz="0.012" ixy="0.001" ixz="0" iyz="0"/></inertial>'
)
#: Every kind of leg at once: two to seven joints, oblique axes, sliding and endless joints.
MIXED: tuple[Leg, ...] = (
    (("revolute", "1 0 0"), ("revolute", "0 1 0"), ("revolute", "0 1 0")),
    (("revolute", "0 1 0"), ("revolute", "0 1 0")),
    (("continuous", "0 0 1"), ("revolute", "0 0.6 -0.8"), ("prismatic", "0 0 -1")),
    (
        *(("revolute", "0 0 1"), ("revolute", "1 0 0"), ("revolute", "0 1 0")),
        *(("continuous", "0 1 0"), ("revolute", "0 -1 0"), ("prismatic", "0.6 0 0.8")),
        ("revolute", "1 2 3"),
    ),
)


def _corner(leg: int, legs: int) -> tuple[int, float]:
    """Left (1) or right (-1), and how far ahead from 1 to -1: pairs in rows."""
    rows = (legs + 1) // 2
    return (1 if leg % 2 == 0 else -1), 1 - 2 * (leg // 2) / max(rows - 1, 1)


def urdf_text(legs: Sequence[Leg], *, arm: bool = False, turned: bool = True) -> str:
    """A trunk on the legs given, placements drawn at random; `arm` adds a joint on top."""
    rng = np.random.default_rng(1)
    parts = [f'<robot name="walker"><link name="base">{INERTIAL.format(mass=9)}</link>']

    def joint(name: str, kind: str, axis: str, parent: str, child: str, place: str) -> None:
        limit = '<limit lower="-3" upper="3" effort="9" velocity="9"/>'
        parts.append(
            f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
            f"{place}"
            + (f'<axis xyz="{axis}"/>' if axis else "")
            + (limit if kind in ("revolute", "prismatic") else "")
            + f'</joint><link name="{child}">{INERTIAL.format(mass=0.7)}</link>'
        )

    for i, leg in enumerate(legs):
        side, along = _corner(i, len(legs))
        parent, place = "base", f'<origin xyz="{0.4 * along} {0.3 * side} 0"/>'
        for k, (kind, axis) in enumerate(leg):
            joint(f"leg{i}_{k}", kind, axis, parent, f"leg{i}_link{k}", place)
            parent = f"leg{i}_link{k}"
            x, y = rng.uniform(-0.05, 0.05, 2)
            turn = (
                " ".join(f"{a:.3f}" for a in rng.uniform(-0.3, 0.3, 3))
                if turned and k == 1
                else "0 0 0"
            )
            place = f'<origin xyz="{x:.3f} {y:.3f} {-0.6 / len(leg):.3f}" rpy="{turn}"/>'
        joint(f"leg{i}_tip", "fixed", "", parent, f"leg{i}_foot", place)
    if arm:
        joint("arm", "revolute", "0 1 0", "base", "arm_link", '<origin xyz="0 0 0.2"/>')
    return "".join(parts) + "</robot>"


def robot_text(legs: Sequence[Leg], *, arm: bool = False) -> str:
    """The robot file of such a machine."""
    lines = ["[robot]", 'name = "walker"', 'urdf = "walker.urdf"', 'base_link = "base"']
    lines += ["[held]", "arm = 0.4"] if arm else []
    for i, leg in enumerate(legs):
        side, along = _corner(i, len(legs))
        lines += [
            f"[legs.leg{i}]",
            f"joints = {json.dumps([f'leg{i}_{k}' for k in range(len(leg))])}",
            f'foot = "leg{i}_foot"',
            f'side = "{"left" if side > 0 else "right"}"',
            f"neutral_foot = [{0.4 * along}, {0.3 * side}, -0.55]",
        ]
    lines += ["[gait]", 'transfer_path = "harmonic"', "[parameters]"]
    numbers = {
        "total_mass": (round(9 + 0.7 * (sum(map(len, legs)) + len(legs) + arm), 6), "kg"),
        **{"foot_stroke": (0.1, "m"), "foot_lift": (0.05, "m"), "walking_speed": (0.2, "m/s")},
        **{"gait_period": (1, "s"), "gravity": (9.81, "m/s^2")},
    }
    for name, (value, unit) in numbers.items():
        basis = 'basis = "datasheet", source = "a test"'
        lines.append(f'{name} = {{value = {value}, unit = "{unit}", {basis}}}')
    return "\n".join(lines)


def walker(folder: Path, legs: Sequence[Leg], *, arm: bool = False, turned: bool = True) -> Robot:
    """Write such a machine into a folder and load it."""
    urdf = urdf_text(legs, arm=arm, turned=turned)
    (folder / "walker.urdf").write_text(urdf, encoding="utf-8")
    (folder / "walker.toml").write_text(robot_text(legs, arm=arm), encoding="utf-8")
    return load_robot(load_robot_file(folder / "walker.toml"))
