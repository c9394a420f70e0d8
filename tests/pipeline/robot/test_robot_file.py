"""Numbers of a robot file at the edge of what a robot can have, and how files extend each other."""

from __future__ import annotations

from pathlib import Path

import pytest

from actuators.errors import LegwattError
from actuators.parameters import ParameterSet
from pipeline.robot.robot import Robot
from pipeline.robot.robot_file import load_robot_file
from pipeline.robot.robot_tables import check_parameters


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
    ],
)
def test_edges_of_what_a_built_robot_can_have(
    hexapod: Robot, values: dict[str, float], message: str
) -> None:
    rows = [
        p.model_copy(update={"value": values[p.name], "bounds": None, "interval": None})
        if p.name in values
        else p
        for p in hexapod.spec.parameters.rows()
    ]
    parameters = ParameterSet(tuple(rows), "here")
    if not message:
        check_parameters(parameters, "hexapod", "here")
        return
    with pytest.raises(LegwattError, match=message):
        check_parameters(parameters, "hexapod", "here")


def test_a_file_that_extends_another_keeps_what_it_does_not_say(root: Path, tmp_path: Path) -> None:
    """Key by key, but legs as a whole."""
    base = load_robot_file(root / "urdf" / "hexapod.toml")
    leg = '[legs.rm]\njoints = ["a", "b", "c"]\nfoot = "f"\nside = "right"\nstation = "middle"\n'
    text = f'extends = "{base.path}"\n[robot]\nname = "other"\n{leg}[standing]\nfeet = ["rm"]\n'
    (tmp_path / "own.toml").write_text(text, encoding="utf-8")
    spec = load_robot_file(tmp_path / "own.toml")
    assert (spec.name, spec.standing_feet, spec.leg_names) == ("other", ("rm",), ("rm",))
    assert (spec.base_link, spec.gait) == (base.base_link, base.gait)
    assert dict(spec.parameters) == dict(base.parameters)
    assert [p.name for p in spec.sources] == ["own.toml", "hexapod.toml"]
