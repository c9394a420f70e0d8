"""Numbers of a robot file at the edge of what a robot can have, and how files extend each other."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from actuators.errors import LegwattError
from actuators.parameters import ParameterSet
from pipeline.robot.robot import Robot
from pipeline.robot.robot_file import load_robot_file
from pipeline.robot.robot_tables import check_parameters

POSTURE = r"\1" + "\nstart_posture = "


def with_values(hexapod: Robot, **values: float) -> ParameterSet:
    """The hexapod's numbers with some at other values, whatever their bounds and intervals."""
    rows = tuple(
        p.model_copy(update={"value": values[p.name], "bounds": None, "interval": None})
        if p.name in values
        else p
        for p in hexapod.spec.parameters.rows()
    )
    return ParameterSet(rows, "here")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"tibia_com": 1.001}, "tibia_com = .* lies outside 0 to 1"),
        ({"foot_lift": 0.0, "coxa_length": 0.0, "gravity": 30.0, "trunk_com_left": -10.0}, ""),
        ({"foot_lift": 0.999e-3}, "foot_lift = .* lies outside 0.001 to 10"),
        ({"gravity": 30.001}, "gravity = .* lies outside 1e-09 to 30"),
        ({"coxa_length": 0.2, "joint_2_lateral": 0.2}, ""),
        ({"coxa_length": 0.2, "joint_2_lateral": 0.19}, "joint_2_lateral is smaller than coxa"),
        ({"joint_2_lower": 0.5, "joint_2_upper": 0.5}, "joint_2_lower must be below joint_2_upper"),
        ({"total_mass": 0.0}, r"parameters\.total_mass = .* lies outside"),
        ({"link_width": 0.0}, r"parameters\.link_width = .* lies outside"),
    ],
)
def test_edges_of_what_a_built_robot_can_have(
    hexapod: Robot, values: dict[str, float], message: str
) -> None:
    parameters = with_values(hexapod, **values)
    if not message:
        check_parameters(parameters, "hexapod", "here")
        return
    with pytest.raises(LegwattError, match=message):
        check_parameters(parameters, "hexapod", "here")
    if "link_width" in values:  # a URDF of one's own has no such number
        check_parameters(parameters, None, "here")


def extending(root: Path, folder: Path, text: str) -> Path:
    path = folder / "own.toml"
    base = (root / "urdf" / "hexapod.toml").as_posix()
    path.write_text(f'extends = "{base}"\n' + text, encoding="utf-8")
    return path


def test_a_file_that_extends_another_keeps_what_it_does_not_say(root: Path, tmp_path: Path) -> None:
    """Key by key, but legs as a whole."""
    base = load_robot_file(root / "urdf" / "hexapod.toml")
    leg = '[legs.rm]\njoints = ["a", "b", "c"]\nfoot = "f"\nside = "right"\nstation = "middle"\n'
    text = f'[robot]\nname = "other"\n{leg}[standing]\nfeet = ["rm"]\n'
    spec = load_robot_file(extending(root, tmp_path, text))
    assert (spec.name, spec.standing_feet, spec.leg_names) == ("other", ("rm",), ("rm",))
    assert (spec.base_link, spec.gait) == (base.base_link, base.gait)
    assert dict(spec.parameters) == dict(base.parameters)
    assert [p.name for p in spec.sources] == ["own.toml", "hexapod.toml"]


def own_file(root: Path, folder: Path, pattern: str, replacement: str) -> Path:
    """The hexapod's file with its first match of a pattern replaced."""
    text = (root / "urdf" / "hexapod.toml").read_text(encoding="utf-8")
    changed, count = re.subn(pattern, replacement, text, count=1, flags=re.S | re.M)
    assert count == 1
    path = folder / "own.toml"
    path.write_text(changed, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("pattern", "replacement", "message"),
    [
        (r'side = "left"', 'side = "port"', "'legs.lf.side': 'port': known: left, right"),
        (r'"lf_joint_2"', '"lf_joint_1"', "joint 'lf_joint_1' belongs to two legs"),
        (r'feet = \["lf", "lr"', 'feet = ["lf", "lf"', "a leg is named twice"),
        (r', "lf_joint_3"', "", "'legs.lf': a built leg has 3 joints"),
        (r'(side = "left")', POSTURE + "[0, 1]", "as many numbers as there are joints, 3"),
    ],
)
def test_what_no_robot_file_may_say(
    root: Path, tmp_path: Path, pattern: str, replacement: str, message: str
) -> None:
    with pytest.raises(LegwattError, match=message):
        load_robot_file(own_file(root, tmp_path, pattern, replacement))


def test_a_circle_and_all_that_a_file_lacks_is_said_at_once(tmp_path: Path) -> None:
    for own, other in (("a", "b"), ("b", "a")):
        (tmp_path / f"{own}.toml").write_text(f'extends = "{other}.toml"\n', encoding="utf-8")
    with pytest.raises(LegwattError, match=r"a\.toml: extends itself through .*b\.toml"):
        load_robot_file(tmp_path / "a.toml")
    path = tmp_path / "own.toml"
    path.write_text('[robot]\nname = "x"\n[legs.a]\njoints = ["j"]\n', encoding="utf-8")
    lacking = "'robot.urdf': Field required; .*'legs.a.foot': Field required"
    with pytest.raises(LegwattError, match=rf"own\.toml: {lacking}"):
        load_robot_file(path)
