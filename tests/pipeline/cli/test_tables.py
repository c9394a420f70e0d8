"""Every table of the list is there, with the promised columns and a sidecar that fits it."""

from __future__ import annotations

import hashlib
import json
import math
import re
from pathlib import Path

import pytest

from tests.command_line import Command, exit_code, rows_of, sidecar_of

LEGS = ("lf", "lm", "lr", "rf", "rm", "rr")
JOINTS = tuple(f"{leg}_joint_{k}" for leg in LEGS for k in (1, 2, 3))
ALTERNATIVES = ("ideal", "rotor", "reversible", "irreversible")
#: Promised columns and number of rows; None where the number follows from sampling or reversals.
TABLES = {
    "standing": (
        ["alternative", "joint", "joint_torque_Nm", "motor_torque_Nm", "current_A", "voltage_V"]
        + ["power_W"],
        4 * 18,
    ),
    "standing_energy": (["alternative", "leg", "energy_J"], 4 * 6),
    "standing_posture": (["joint", "position_rad"], 18),
    "standing_contacts": (
        ["foot", "x_m", "y_m", "z_m", "force_x_N", "force_y_N", "force_z_N"],
        6,
    ),
    "walking_joint_demand": (
        ["time_s"]
        + [f"{j}__{q}" for j in JOINTS for q in ("position_rad", "velocity_rad_s", "torque_Nm")],
        2 * 751,
    ),
    "walking_contact_forces": (
        ["time_s"] + [f"{leg}__force_{axis}_N" for leg in LEGS for axis in "xyz"],
        2 * 751,
    ),
    "walking_gait": (["leg", "touch_down", "duty_factor", "stroke_m", "lift_m"], 6),
    "walking_base": (
        ["time_s", "segment"]
        + [f"base__{q}" for q in ("x_m", "y_m", "z_m", "roll_rad", "pitch_rad", "yaw_rad")]
        + [f"base__velocity_{axis}_m_s" for axis in "xyz"]
        + [f"base__acceleration_{axis}_m_s2" for axis in "xyz"],
        2 * 751,
    ),
    "walking_stage_energy": (
        ["alternative", "joint", "stage", "stage_name", "forward_J", "reverse_J"],
        18 * (3 + 4 + 4 + 6),  # out, m, el; out, mt, m, el; out, wg, m, el; out, 2, ph, mp, m, el
    ),
    "walking_losses": (["alternative", "joint", "element", "loss_J"], None),
    "walking_energy": (["alternative", "leg", "electrical_J", "ratio_to_ideal"], 4 * 7),
    "robot_energy": (
        ["alternative", "average_power_W", "cost_of_transport", "support_share", "transfer_share"],
        4,
    ),
    "motor_limits": (
        ["alternative", "joint", "quantity", "unit", "limit", "peak", "breach"],
        4 * 18 * 4,
    ),
    "standing_limits": (
        ["alternative", "joint", "quantity", "limit", "peak", "breach"],
        4 * 18 * 3,
    ),
    "parameters": (["parameter", "value", "unit", "basis", "source", "interval_low"], None),
}


@pytest.mark.parametrize("name", TABLES)
def test_promised_columns_and_rows(out: Path, name: str) -> None:
    columns, count = TABLES[name]
    rows = rows_of(out / f"{name}.csv")
    header = (out / f"{name}.csv").read_text(encoding="utf-8").split("\n")[0].split(",")
    missing = [column for column in columns if column not in header]
    assert not missing
    assert len(set(header)) == len(header)
    assert rows
    assert count is None or len(rows) == count


@pytest.mark.parametrize("name", TABLES)
def test_sidecar_belongs_to_its_table(out: Path, name: str) -> None:
    path = out / f"{name}.csv"
    content = path.read_bytes()
    meta = sidecar_of(path)
    assert meta["sha256"] == hashlib.sha256(content).hexdigest()
    header = content.decode("utf-8").split("\n")[0].split(",")
    assert [column["name"] for column in meta["columns"]] == header
    assert all(column["meaning"] for column in meta["columns"])
    assert {"hexapod.toml", "motor_re40_24v.toml"} <= set(meta["inputs_sha256"])
    assert {"legwatt", "pin", "numpy"} <= set(meta["versions"])
    assert meta["options"]["samples_per_segment"] == 751


def test_bytes_are_plain(out: Path) -> None:
    """UTF-8 without a mark, LF, one header row, no comments, no path, no infinity."""
    for path in out.glob("*.csv"):
        content = path.read_bytes()
        assert b"\r" not in content
        assert not content.startswith((b"\xef\xbb\xbf", b"#"))
        assert content.endswith(b"\n")
        assert not re.search(rb"(?i)\b(nan|inf|infinity)\b", content)
        assert str(out).encode() not in content
    for path in out.glob("*.meta.json"):
        assert str(out) not in path.read_text(encoding="utf-8")
        assert json.loads(path.read_text(encoding="utf-8"))["table"] == path.name.split(".")[0]


def test_nothing_temporary_is_left(out: Path) -> None:
    assert {p.suffix for p in out.iterdir()} == {".csv", ".json"}
    assert not [p for p in out.iterdir() if p.name.startswith(".")]


def test_every_parameter_has_a_basis_and_a_source(out: Path) -> None:
    bases = {"published", "datasheet", "derived", "calibrated", "identified", "assumed"}
    for row in rows_of(out / "parameters.csv"):
        assert row["basis"] in bases, row
        assert row["source"], row
        if row["basis"] in ("calibrated", "identified", "assumed"):
            low, high = float(row["interval_low"]), float(row["interval_high"])
            assert low <= float(row["value"]) * (1 + 1e-12)
            assert float(row["value"]) <= high * (1 + 1e-12)
        if row["basis"] == "assumed":
            assert row["reason"], row


def test_no_dust(out: Path) -> None:
    """Of all numbers with one unit in a table, none but zero is 1e-13 of the largest.

    Standing still, a joint without a load shows 0 N*m where sums that cancel left 1e-32.
    """
    assert "0" in {row["joint_torque_Nm"] for row in rows_of(out / "standing.csv")}
    for path in out.glob("*.csv"):
        meta = sidecar_of(path)
        units = {column["name"]: column["unit"] for column in meta["columns"]}
        sizes: dict[str, list[float]] = {}
        for row in rows_of(path):
            for column, value in row.items():
                unit = row[units[column][4:]] if units[column].startswith("see ") else units[column]
                if unit and value and value not in ("true", "false"):
                    key = unit if unit != "1" else column
                    sizes.setdefault(key, []).append(abs(float(value)))
        assert sizes, path.name
        for key, values in sizes.items():
            if path.name != "parameters.csv":  # what was given is written as it was given
                assert min((v for v in values if v), default=1.0) > 1e-13 * max(values), (path, key)
    stated = {c["name"]: c.get("zero_below") for c in sidecar_of(out / "standing.csv")["columns"]}
    largest = max(abs(float(r["joint_torque_Nm"])) for r in rows_of(out / "standing.csv"))
    assert stated["motor_torque_Nm"] == pytest.approx(1e-12 * largest)


def test_stages_are_spelled_out_beside_their_codes(out: Path) -> None:
    rows = rows_of(out / "walking_stage_energy.csv")
    names = {(row["alternative"], row["stage"]): row["stage_name"] for row in rows}
    assert names["ideal", "out"] == "joint"
    assert names["rotor", "mt"] == "between rotor and transmission"
    assert names["reversible", "wg"] == "between timing belt and Harmonic Drive (wave generator)"
    assert names["irreversible", "ph"] == "between planetary and hypoid gear (pinion)"
    assert {name for (_, stage), name in names.items() if stage == "el"} == {"supply"}
    assert len(set(names)) == 17
    for (_, stage), name in names.items():
        assert name not in (stage, "")


@pytest.mark.usefixtures("sketched")
def test_a_run_with_decimal_commas(
    out: Path, tmp_path: Path, short_demo: Path, command: Command
) -> None:
    """The same numbers, without quotes or dots; the paper's 0.94 in a text column, too."""
    assert command("reports", tmp_path / "reports", "--decimal", "comma") == 0
    gap = ["gap", "where", str(short_demo), "--out", str(tmp_path / "gap"), "--decimal", "comma"]
    assert exit_code(gap) == 0
    number = re.compile(r"[-+]?[0-9]+\.[0-9]*(e[-+]?[0-9]+)?")
    tables = sorted(tmp_path.glob("*/*.csv"))
    assert {"standing.csv", "where.csv"} <= {path.name for path in tables}
    assert {sidecar_of(path)["dialect"]["delimiter"] for path in tables} == {";"}
    for path in tables:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
        assert '"' not in lines[0]
        for line in lines:
            assert not re.search(r'(^|;)"[-+0-9.,e]*"(;|$)', line), (path.name, line)
            assert not [cell for cell in line.split(";") if number.fullmatch(cell)], path.name
    for path in out.glob("*.csv"):
        commas = rows_of(tmp_path / "reports" / path.name, delimiter=";")
        for row, other in zip(rows_of(path), commas, strict=True):
            for column, value in row.items():
                same = other[column] == value
                assert same or float(other[column].replace(",", ".")) == float(value)
    conclusions = (tmp_path / "reports" / "conclusions.csv").read_text(encoding="utf-8-sig")
    assert ";1;0,94;" in conclusions


def test_legs_add_up_to_the_robot(out: Path) -> None:
    rows = rows_of(out / "walking_energy.csv")
    robot = {row["alternative"]: row for row in rows_of(out / "robot_energy.csv")}
    for name in ALTERNATIVES:
        energy = {r["leg"]: float(r["electrical_J"]) for r in rows if r["alternative"] == name}
        whole = energy.pop("robot")
        assert set(energy) == set(LEGS)
        assert sum(energy.values()) == pytest.approx(whole, rel=1e-12)
        assert float(robot[name]["average_power_W"]) == pytest.approx(whole / 3.0, rel=1e-12)
        transport = whole / 3.0 / (40 * 9.81 * 0.16)
        assert float(robot[name]["cost_of_transport"]) == pytest.approx(transport, rel=1e-12)
        shares = [float(robot[name][f"{phase}_share"]) for phase in ("support", "transfer")]
        assert sum(shares) == pytest.approx(1.0)
        assert min(shares) > 0


def test_electrical_stage_is_the_leg_energy(out: Path) -> None:
    """Without regeneration a leg draws E_el(+) of its joints; E_el(-) is the dumped return."""
    stages = rows_of(out / "walking_stage_energy.csv")
    losses = rows_of(out / "walking_losses.csv")
    for row in rows_of(out / "walking_energy.csv"):
        if row["leg"] == "robot":
            continue
        own = [
            s
            for s in stages
            if s["alternative"] == row["alternative"]
            and s["joint"].startswith(row["leg"])
            and s["stage"] == "el"
        ]
        assert len(own) == 3
        assert math.fsum(float(s["forward_J"]) for s in own) == pytest.approx(
            float(row["electrical_J"]), rel=1e-12
        )
        for s in own:
            dumped = next(
                float(loss["loss_J"])
                for loss in losses
                if loss["element"] == "dumped_return"
                and (loss["alternative"], loss["joint"]) == (s["alternative"], s["joint"])
            )
            assert dumped == pytest.approx(float(s["reverse_J"]), rel=1e-12, abs=1e-15)


def test_losses_and_work_add_up_over_the_cycle(out: Path) -> None:
    """E_el(+) - E_el(-) = work at the joint + heat of every element, per joint [J].

    The robot's speed and posture repeat, so nothing stays stored. Trapezoids on losses and power
    differ by the sampling's error, 1e-4 of the energy that flows.
    """
    stages = {
        (r["alternative"], r["joint"], r["stage"]): (float(r["forward_J"]), float(r["reverse_J"]))
        for r in rows_of(out / "walking_stage_energy.csv")
    }
    losses = rows_of(out / "walking_losses.csv")
    for name in ALTERNATIVES:
        for joint in JOINTS:
            taken, returned = stages[name, joint, "el"]
            work, back = stages[name, joint, "out"]
            heat = math.fsum(
                float(r["loss_J"])
                for r in losses
                if (r["alternative"], r["joint"]) == (name, joint)
                and r["element"] != "dumped_return"
            )
            assert heat >= 0
            assert taken - returned == pytest.approx(
                work - back + heat, abs=1e-4 * (taken + returned + work + back)
            )
