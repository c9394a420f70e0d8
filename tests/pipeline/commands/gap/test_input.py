"""`gap` on logs and options that cannot be what they say: one line, or a suspicion by column."""

from pathlib import Path

import numpy as np
import pandas as pd
import pinocchio as pin
import pytest

from pipeline.simulation.machine import read_machine
from tests.command_line import Refused, exit_code, rows_of
from tests.leg_log import leg_logs
from tests.pipeline.identification import bench_leg as leg

Columns = dict[str, np.ndarray]
URDF = leg.ROOT / "urdf"


def written(path: Path, columns: Columns) -> Path:
    pd.DataFrame(columns).to_csv(path, index=False)
    return path


def where(log: Path, robot: Path, out: Path) -> list[dict[str, str]]:
    """Rows of what was compared; the log must be accepted."""
    assert exit_code(["gap", "where", str(log), "--robot", str(robot), "--out", str(out)]) == 0
    return rows_of(out / "where.csv")


@pytest.fixture(scope="module")
def simulated_leg() -> Columns:
    """A log that the model explains: only its model can tell that its units were changed."""
    return leg_logs(3, [])["log_1"]


def _exchanged(c: Columns) -> Columns:
    one, two = "rm_joint_1__current_A", "rm_joint_2__current_A"
    return c | {one: c[two], two: c[one]}


def _of_another_machine(c: Columns) -> Columns:
    other = leg_logs(4, [], 2)["log_2"]
    rows = min(other["time_s"].size, c["time_s"].size)
    return {k: (other if k.endswith("current_A") else c)[k][:rows] for k in c}


SPOILT = {
    "nothing": (lambda c: c, ()),
    # Drawn by a robot so light that its milliamperes are less than the drive's amperes.
    "mA": (lambda c: {k: v * (1e3 if "_A" in k else 1) for k, v in c.items()}, ("1__cur", "mA")),
    "exchanged joints": (_exchanged, ("rm_joint_1__current_A", "rm_joint_2")),
    "another robot": (_of_another_machine, ("spoilt", "another robot")),
}


@pytest.mark.parametrize("case", SPOILT)
def test_what_the_model_betrays_is_suspected_by_column(
    tmp_path: Path, simulated_leg: Columns, case: str
) -> None:
    spoil, words = SPOILT[case]
    log = written(tmp_path / "spoilt.csv", spoil(dict(simulated_leg)))
    where(log, URDF / "leg.toml", tmp_path / "out")
    quality = rows_of(tmp_path / "out" / "quality.csv")
    said = " ".join(str(row) for row in quality if row["verdict"] == "suspected")
    assert bool(said) == bool(words)
    assert all(word in said for word in words)


def test_data_given_twice_is_refused_under_any_name(
    tmp_path: Path, refused: Refused, simulated_leg: Columns
) -> None:
    log = written(tmp_path / "one.csv", simulated_leg)
    later = {k: v + 100.0 if k == "time_s" else v for k, v in simulated_leg.items()}
    shifted = written(tmp_path / "later.csv", later)
    part = written(tmp_path / "part.csv", {k: v[1000:4000] for k, v in simulated_leg.items()})
    for more in ([log], ["--holdout", shifted], ["--holdout", part]):
        arguments = ["gap", "where", log, *more, "--robot", URDF / "leg.toml"]
        assert "the same" in refused([*map(str, arguments)], tmp_path / "out")


def test_torque_means_the_same_with_a_robot_file_and_with_its_urdf(tmp_path: Path) -> None:
    """A leg's motion with the torque its motors supply, brought to the joints; friction at one."""
    m = leg.leg_motion(duration=12.0)
    rigid = read_machine(URDF / "leg.urdf").model.rigid
    data = rigid.createData()
    torque = np.array([pin.rnea(rigid, data, *x) for x in zip(m.q, m.v, m.a, strict=True)])
    torque[:, 1] += 1.5 * np.sign(m.v[:, 1])
    torque += 0.02 * np.random.default_rng(3).standard_normal(torque.shape)
    columns: Columns = {"time_s": m.time}
    for j, joint in enumerate(m.joints):
        columns[f"{joint}__position_rad"] = m.q[:, j]
        columns[f"{joint}__torque_Nm"] = torque[:, j]
    log = written(tmp_path / "log.csv", columns)
    gaps = []
    for name in ("leg.toml", "leg.urdf"):
        rows = where(log, URDF / name, tmp_path / name)
        gaps.append({r["joint"]: float(r["gap"]) for r in rows if r["by"] == "joint"})
    assert gaps[0]["rm_joint_2"] == pytest.approx(1.5, rel=0.05)
    assert gaps[0] == pytest.approx(gaps[1], rel=0.01)


def test_two_commands_judge_a_foreign_log(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`gap mapping` tells degrees, milliseconds and milliamperes, and what to run next."""
    t = np.arange(1500) / 250.0
    columns = {"zeit_ms": 1e3 * t}
    for k in (1, 2, 3):
        w = 2.0 * np.pi * (0.3 + 0.11 * k)
        columns[f"Winkel {k} angle"] = np.degrees(0.3 * np.sin(w * t))
        columns[f"Motor {k} current"] = 400.0 * np.cos(w * t + k)
    log, mapping = tmp_path / "log.csv", tmp_path / "mapping.toml"
    pd.DataFrame(columns).to_csv(log, sep=";", decimal=",", index=False)
    first = ["gap", "mapping", str(log), "--robot", str(URDF / "leg.toml"), "--out", str(mapping)]
    assert exit_code(first) == 0
    said = capsys.readouterr().out.splitlines()[-1]
    assert said.startswith("next: python -m pipeline gap ")
    second = said.removeprefix("next: python -m pipeline gap ").split()
    assert exit_code(["gap", "read", *second, "--out", str(tmp_path / "out")]) == 0
    assert "checks passed" in capsys.readouterr().out
    assert exit_code(first) == 2
    assert "is there already" in capsys.readouterr().err
