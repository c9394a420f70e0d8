"""Every table of the list is there, with a record that fits it and numbers that add up."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pinocchio as pin
import pytest

from pipeline.robot.robot_file import load_robot_file
from tests.command_line import exit_code, record_of, rows_of


def test_every_file_is_plain_and_the_record_belongs_to_it(out: Path) -> None:
    """No path, no infinity; inputs, versions and every column's meaning stand beside them."""
    for path in out.glob("*.csv"):
        content, meta = path.read_text("utf-8"), record_of(path)
        assert not re.search(r"(?i)\b(nan|inf|infinity)\b", content)
        assert str(out) not in content + json.dumps(meta)
        fields = meta["schema"]["fields"]
        assert [field["name"] for field in fields] == pd.read_csv(path).columns.tolist()
        assert all(field["description"] for field in fields)
        assert {"hexapod.toml", "motor_re40_24v.toml"} <= set(meta["inputs_sha256"])


def test_losses_and_work_add_up_over_the_cycle(out: Path) -> None:
    """E_el(+) - E_el(-) = work at the joint + heat of every element, per joint [J].

    The robot's speed and posture repeat, so nothing stays stored. Trapezoids on losses and power
    differ by the sampling's error, 1e-4 of the energy that flows.
    """
    names = ["alternative", "joint"]
    stages = pd.read_csv(out / "walking_stage_energy.csv").set_index([*names, "stage"])
    flows = stages[["forward_J", "reverse_J"]].unstack("stage")
    net = flows["forward_J"] - flows["reverse_J"]
    losses = pd.read_csv(out / "walking_losses.csv")
    heat = losses[losses["element"] != "dissipated_return"].groupby(names)["loss_J"].sum()
    heat = heat.reindex(net.index, fill_value=0.0)
    assert len(net) == 4 * 18
    assert (heat >= 0).all()
    ends = flows.loc[:, flows.columns.get_level_values("stage").isin(["el", "out"])]
    assert ((net["el"] - net["out"] - heat).abs() <= 1e-4 * ends.sum(axis=1)).all()


@pytest.mark.parametrize(
    "gait",
    [
        (),
        ("name=ripple", "speed=0.05 m/s", "yaw_rate=9 deg/s", "slope_forward=6 deg")
        + ("slope_left=3 deg", "body_pitch=2 deg"),
        ("name=wave", "sway=least", "stability_margin=120 mm", "heading=30 deg"),
    ],
    ids=["tripod", "ripple in a bend on a slope", "wave with sway"],
)
def test_anyone_can_check_torque_from_the_tables_alone(
    root: Path, tmp_path: Path, gait: tuple[str, ...]
) -> None:
    spec = load_robot_file(root / "urdf" / "hexapod.toml")
    options = [word for change in gait for word in ("--set", f"gait.{change}")]
    out = tmp_path / "walk"
    assert exit_code(["walk", "--samples", "51", "--out", str(out), *options]) == 0
    tables = [rows_of(out / f"walking_{t}.csv") for t in ("base", "joint_demand", "contact_forces")]
    model = pin.buildModelFromUrdf(str(spec.urdf), pin.JointModelFreeFlyer())
    data, world = model.createData(), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    ids = {joint: model.joints[model.getJointId(joint)] for joint in spec.joints}
    for base, joints, forces in zip(*tables, strict=True):
        at, rpy, velocity, spin, acceleration = (
            np.array([float(base[f"base__{name}"]) for name in names])
            for names in (
                [f"{axis}_m" for axis in "xyz"],
                ["roll_rad", "pitch_rad", "yaw_rad"],
                [f"velocity_{axis}_m_s" for axis in "xyz"],
                [f"angular_velocity_{axis}_rad_s" for axis in "xyz"],
                [f"acceleration_{axis}_m_s2" for axis in "xyz"],
            )
        )
        turn = pin.rpy.rpyToMatrix(rpy)
        q, v, a = pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
        q[:3], q[3:7] = at, pin.Quaternion(turn).coeffs()
        v[:6] = np.concatenate([turn.T @ velocity, turn.T @ spin])
        a[:3] = turn.T @ acceleration - np.cross(v[3:6], v[:3])  # no angular acceleration
        for joint, place in ids.items():
            q[place.idx_q] = float(joints[f"{joint}__position_rad"])
            v[place.idx_v] = float(joints[f"{joint}__velocity_rad_s"])
            a[place.idx_v] = float(joints[f"{joint}__acceleration_rad_s2"])
        torque = pin.rnea(model, data, q, v, a)
        for leg in spec.legs:
            frame = model.getFrameId(leg.foot)
            jacobian = pin.computeFrameJacobian(model, data, q, frame, world)[:3]
            force = [float(forces[f"{leg.name}__force_{axis}_N"]) for axis in "xyz"]
            torque -= jacobian.T @ force
        # Nothing but the ground carries the base.
        np.testing.assert_allclose(torque[:6], 0, atol=1e-7)
        for joint, place in ids.items():
            given = float(joints[f"{joint}__torque_Nm"])
            assert torque[place.idx_v] == pytest.approx(given, abs=1e-8)
