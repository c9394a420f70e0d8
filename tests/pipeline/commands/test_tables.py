"""Tables add up and are the same from each verb and process; `--set` takes every number."""

import json
import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pinocchio as pin
import pytest

import pipeline as lw
from actuators.loading.build import load_catalog
from pipeline.commands.robots import changes_of
from pipeline.robot.robot_file import load_robot_file
from tests.command_line import exit_code, own_robot, record_of
from tests.reports.test_page import checked


def test_every_file_is_plain_and_the_record_belongs_to_it(out):
    """No path, no infinity; inputs, versions and every column's meaning stand beside them."""
    for path in out.glob("*.csv"):
        content, meta = path.read_text("utf-8"), record_of(path)
        assert not re.search(r"(?i)\b(nan|inf|infinity)\b", content)
        assert str(out) not in content + json.dumps(meta)
        fields = meta["schema"]["fields"]
        assert [field["name"] for field in fields] == pd.read_csv(path).columns.tolist()
        assert all(field["description"] for field in fields)
        assert {"hexapod.toml", "motor_re40_24v.toml"} <= set(meta["inputs_sha256"])


def test_losses_and_work_add_up_over_the_cycle(out):
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


RPY = "roll_rad pitch_rad yaw_rad"
#: Of the base, which has no angular acceleration.
RATES = (
    "velocity_x_m_s velocity_y_m_s velocity_z_m_s",
    "angular_velocity_x_rad_s angular_velocity_y_rad_s angular_velocity_z_rad_s",
    "acceleration_x_m_s2 acceleration_y_m_s2 acceleration_z_m_s2",
)


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
def test_anyone_can_check_torque_from_the_tables_alone(root, tmp_path, gait):
    spec = load_robot_file(root / "urdf" / "hexapod.toml")
    options = [word for change in gait for word in ("--set", f"gait.{change}")]
    out = tmp_path / "walk"
    assert exit_code(["walk", "--samples", "51", "--out", str(out), *options]) == 0
    names = ("base", "joint_demand", "contact_forces")
    base, joints, forces = (pd.read_csv(out / f"walking_{name}.csv") for name in names)
    model = pin.buildModelFromUrdf(str(spec.urdf), pin.JointModelFreeFlyer())
    data, world = model.createData(), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    places = [model.joints[model.getJointId(joint)] for joint in spec.joints]
    at_q, at_v = ([getattr(p, key) for p in places] for key in ("idx_q", "idx_v"))

    def columns(table: pd.DataFrame, of: Sequence[str], names: str) -> np.ndarray:
        return table[[f"{own}__{name}" for own in of for name in names.split()]].to_numpy()

    place, rpy = columns(base, ["base"], "x_m y_m z_m"), columns(base, ["base"], RPY)
    velocity, spin, acceleration = (columns(base, ["base"], three) for three in RATES)
    angle, rate, change, given = (
        columns(joints, spec.joints, name)
        for name in ("position_rad", "velocity_rad_s", "acceleration_rad_s2", "torque_Nm")
    )
    force = columns(forces, spec.leg_names, "force_x_N force_y_N force_z_N")
    for k in range(len(base)):
        turn = pin.rpy.rpyToMatrix(rpy[k])
        q, v, a = pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
        q[:3], q[3:7], q[at_q] = place[k], pin.Quaternion(turn).coeffs(), angle[k]
        v[:6], v[at_v] = np.concatenate([turn.T @ velocity[k], turn.T @ spin[k]]), rate[k]
        a[:3], a[at_v] = turn.T @ acceleration[k] - np.cross(v[3:6], v[:3]), change[k]
        torque = pin.rnea(model, data, q, v, a)
        for leg, own in zip(spec.legs, force[k].reshape(-1, 3), strict=True):
            frame = model.getFrameId(leg.foot)
            torque -= pin.computeFrameJacobian(model, data, q, frame, world)[:3].T @ own
        np.testing.assert_allclose(torque[:6], 0, atol=1e-7)  # the ground alone carries the base
        np.testing.assert_allclose(torque[at_v], given[k], atol=1e-8)


FIGURES = (
    "joint_demand",  # Fig. 2 to 4
    *("stage_energy_reversible", "stage_energy_irreversible"),  # Fig. 18 and 20
    *("electrical_energy", "energy_per_minute_middle_legs", "robot", "gait"),
)


@pytest.mark.usefixtures("sketched")
def test_tables_are_those_of_standing_and_walking_and_the_page_shows_them(tmp_path, command, out):
    """The same input gives the same bytes, whichever verb asks."""
    assert command("reports", tmp_path) == 0
    for path in out.glob("*.csv"):
        assert path.read_bytes() == (tmp_path / path.name).read_bytes(), path.name
    page = checked(tmp_path)
    assert not re.search(r"N\*m|\d%", page.text)
    for name in ("robot_energy", "reproduction", "conclusions", "break_even", "omissions"):
        assert page.rows(f"{name}.csv")
    assert {f"{name}.svg" for name in FIGURES} <= {*page.targets}


@pytest.mark.slow
def test_two_processes_leave_the_same_bytes(root, tmp_path):
    """Figures included. (Within one process matplotlib numbers clip paths on and on.)"""
    for name in ("first", "second"):
        command = [sys.executable, "-m", "pipeline", "reports", "--out", str(tmp_path / name)]
        subprocess.run(command, cwd=root, check=True, capture_output=True, timeout=300)
    first, second = tmp_path / "first", tmp_path / "second"
    assert {p.name for p in first.iterdir()} == {p.name for p in second.iterdir()}
    for path in first.iterdir():
        assert path.read_bytes() == (second / path.name).read_bytes(), path.name


def test_a_urdf_of_ones_own_stands_like_the_built_one(root, tmp_path, command, out):
    """The robot of the refusals is sound before it is spoilt, and gives the same numbers."""
    assert command("stand", tmp_path, robot=own_robot(root, tmp_path, "</robot>", "</robot>")) == 0
    tables = (pd.read_csv(folder / "standing.csv", index_col=[0, 1]) for folder in (tmp_path, out))
    pd.testing.assert_frame_equal(*tables, rtol=1e-6, atol=1e-9)


ROBOT = Path(__file__).parents[3] / "urdf" / "hexapod.toml"
SPEC, CATALOG = load_robot_file(ROBOT), load_catalog()
MACHINE = lw.load(ROBOT)


def written(name: str) -> Any:
    return SPEC.parameters.parameter(name) if name in SPEC.parameters else CATALOG.parameter(name)


def test_every_number_can_be_set_to_itself():
    """In the unit its file writes, and nothing else changes."""
    names = [*SPEC.parameters, *(f"{component}.{p.name}" for component, p in CATALOG.rows())]
    changes = changes_of([f"{name}={written(name).value_as_written!r}" for name in names])
    for name, value in changes.items():
        changed = MACHINE.with_values({name: value})
        assert {**changed.robot.spec.parameters} == {**SPEC.parameters}
        for component, p in CATALOG.rows():
            assert changed.catalog.parameter(f"{component}.{p.name}").value == p.value


def test_a_change_reaches_the_files(tmp_path, command, out):
    """1.2 times the winding's resistance heats 1.2 times at rest."""
    resistance = written("motor_re40_24v.resistance").value_as_written
    change = f"motor_re40_24v.resistance={1.2 * resistance!r}"
    assert command("stand", tmp_path, "--set", change) == 0
    new, old = (pd.read_csv(folder / "standing.csv") for folder in (tmp_path, out))
    assert new["power_W"].to_numpy() == pytest.approx(1.2 * old["power_W"].to_numpy(), rel=1e-12)
    assert new["current_A"].equals(old["current_A"])
    assert record_of(tmp_path / "standing.csv")["options"]["set"] == [change]
    numbers = pd.read_csv(tmp_path / "parameters.csv").set_index(["group", "parameter"])
    row = numbers.loc["motor_re40_24v", "resistance"]
    assert row["basis"] == "assumed"
    assert f"replaces {resistance:g} ohm (calibrated)" in row["reason"]


def test_the_command_line_starts_without_what_computes(root):
    """`--help` and a wrong option answer at once."""
    code = "import sys, pipeline.commands.main; print(*{m.split('.')[0] for m in sys.modules})"
    done = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True)
    assert "pipeline" in done.stdout
    assert not {"numpy", "scipy", "pandas", "pinocchio", "matplotlib"} & {*done.stdout.split()}
