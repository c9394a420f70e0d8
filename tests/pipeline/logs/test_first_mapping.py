"""A foreign log in many disguises: the first mapping file reads it as what it is."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline.logs.first_mapping import assign, first_mapping
from pipeline.logs.mapping import load_mapping
from pipeline.logs.read import read_log

Array = NDArray[np.float64]
Columns = dict[str, Array]


def renamed(columns: Columns, pattern: dict[str, str], joints: dict[str, str]) -> Columns:
    """The columns under other names: quantity's end to a pattern with {}, joint to a name."""
    return {
        pattern[end].format(joints[joint]): values
        for name, values in columns.items()
        for joint, _, end in [name.partition("__")]
        if end in pattern
    }


def plotjuggler(columns: Columns) -> Columns:
    ends = {"position_rad": "position", "velocity_rad_s": "velocity", "torque_Nm": "effort"}
    ends = {k: f"/joint_states/{{}}/{end}" for k, end in ends.items()}
    return {"__time": columns["time_s"]} | renamed(columns, ends, {"a": "a", "b": "b"})


def ur_style(columns: Columns) -> Columns:
    ends = {"position_rad": "actual_q_{}", "velocity_rad_s": "actual_qd_{}"}
    ends |= {"torque_Nm": "actual_current_{}"}
    out = renamed(columns, ends, {"a": "0", "b": "1"})
    out |= {k: 0.1 * v for k, v in out.items() if "current" in k}
    return {"timestamp": columns["time_s"]} | out


def degrees_and_milliseconds(columns: Columns) -> Columns:
    ends = {"position_rad": "Joint{} Angle", "velocity_rad_s": "Joint{} Speed"}
    ends |= {"torque_Nm": "Joint{} Torque [mNm]"}
    out = renamed(columns, ends, {"a": "A", "b": "B"})
    for name in out:
        out[name] = out[name] * (1e3 if "Torque" in name else 180.0 / np.pi)
    return {"t": 1e3 * columns["time_s"]} | out


@pytest.mark.parametrize("disguise", [plotjuggler, ur_style, degrees_and_milliseconds])
def test_a_disguised_log_is_read_as_what_it_is(disguise, columns, write, two_joints, tmp_path):
    nothing = {"q_7": np.full(2000, np.nan)}  # no joint of anything
    path = write(disguise(columns) | nothing, "foreign.csv")
    made = first_mapping(path, two_joints)
    (tmp_path / "first.toml").write_text(made.text, encoding="utf-8")
    assert made.open == ()
    assert tomllib.loads(first_mapping(write(columns), two_joints).text) == {}  # it needs none
    log = read_log(path, two_joints, load_mapping(tmp_path / "first.toml"))
    velocity, effort = log.of("velocity"), log.of(log.effort)
    effort = 10.0 * effort if log.effort == "current" else effort
    assert np.allclose(log.time, columns["time_s"])
    for j, joint in enumerate("ab"):
        assert np.allclose(log.position[:, j], columns[f"{joint}__position_rad"], atol=1e-9)
        assert np.allclose(effort[:, j], columns[f"{joint}__torque_Nm"], atol=1e-9)
        assert np.allclose(velocity[:, j], columns[f"{joint}__velocity_rad_s"], atol=1e-9)


def test_joints_are_told_by_name_or_by_order_and_never_shifted():
    joints = ("arm_joint_1", "arm_joint_2", "arm_joint_3")
    assert assign(["2", "1", "3"], joints)[0]["2"] == "arm_joint_2"
    told, by = assign(["0", "1", "2"], joints)
    assert told == dict(zip("012", joints, strict=True))
    assert "guess" in by
    assert assign(["0", "1"], joints)[0] == {}


def test_a_joints_own_name_is_no_word_and_a_unit_tells_what_no_word_does(
    columns, write, two_joints
):
    joints = replace(two_joints, joints=("q_hip", "q_knee"))
    for position, torque in (("{}/pos", "{}/effort"), ("{}_deg", "{}_Nm")):
        ends = {"position_rad": position, "torque_Nm": torque}
        log = renamed(columns, ends, dict(zip("ab", joints.joints, strict=True)))
        lines = first_mapping(write({"t": columns["time_s"]} | log, "foreign.csv"), joints).mapped
        assert set(lines) == set(log), position
    single = replace(two_joints, joints=("hip",), lower=np.array([-2.0]), upper=np.array([2.0]))
    log = {"Winkel_deg": np.degrees(columns["a__position_rad"]), "M_Nm": columns["a__torque_Nm"]}
    text = first_mapping(write({"t": columns["time_s"]} | log, "foreign.csv"), single).text
    table = tomllib.loads(text)["columns"]
    assert table["Winkel_deg"] == {"as": "hip__position_rad", "unit": "deg"}
    assert table["M_Nm"] == {"as": "hip__torque_Nm", "unit": "N*m"}
