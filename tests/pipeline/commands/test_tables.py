"""Every table of the list is there, with the promised columns and a record that fits it."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import pytest

from tests.command_line import record_of, rows_of

LEGS = ("lf", "lm", "lr", "rf", "rm", "rr")
JOINTS = tuple(f"{leg}_joint_{k}" for leg in LEGS for k in (1, 2, 3))
ALTERNATIVES = ("ideal", "rotor", "reversible", "irreversible")


def test_every_file_is_plain_and_the_record_belongs_to_it(out: Path) -> None:
    """UTF-8 without a mark, LF, one header row, no comments, no path, no infinity."""
    tables = list(out.glob("*.csv"))
    for path in tables:
        content, meta = path.read_bytes(), record_of(path)
        assert b"\r" not in content
        assert not content.startswith((b"\xef\xbb\xbf", b"#"))
        assert content.endswith(b"\n")
        assert not re.search(rb"(?i)\b(nan|inf|infinity)\b", content)
        assert str(out) not in content.decode() + json.dumps(meta)
        header = content.decode("utf-8").split("\n")[0].split(",")
        fields = meta["schema"]["fields"]
        assert [field["name"] for field in fields] == header
        assert all(field["description"] for field in fields)
        assert {"hexapod.toml", "motor_re40_24v.toml"} <= set(meta["inputs_sha256"])
        assert {"legwatt", "pin", "numpy"} <= set(meta["versions"])
        assert meta["options"]["samples"] == 751


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
                and r["element"] != "dissipated_return"
            )
            assert heat >= 0
            assert taken - returned == pytest.approx(
                work - back + heat, abs=1e-4 * (taken + returned + work + back)
            )
