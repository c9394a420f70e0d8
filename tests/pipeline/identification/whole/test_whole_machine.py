"""A machine in which everything is a little wrong, through the command as a user types it."""

from __future__ import annotations

import csv
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import pinocchio as pin
import pytest
from numpy.typing import NDArray

from pipeline.cli.main import main
from pipeline.effects.model_file import load_model
from tests.pipeline.regression.arms import heavier, log

Array = NDArray[np.float64]
DRY, VISCOUS = (0.9, 0.6, 0.5), (0.0, 0.3, 0.0)
NAMES = ("joint_1", "joint_2", "joint_3")
LINK = """
  <link name="link_{n}"><inertial><origin xyz="0.15 0.02 -0.01"/><mass value="2"/>
    <inertia ixx="0.004" iyy="0.02" izz="0.022" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="joint_{n}" type="revolute"><parent link="{parent}"/><child link="link_{n}"/>
    <origin xyz="{at}"/><axis xyz="{axis}"/>
    <limit lower="-3" upper="3" effort="100" velocity="20"/></joint>"""


def urdf() -> str:
    out = '<robot name="arm"><link name="base"/>'
    for n in (1, 2, 3):
        parent, at = ("base", "0 0 0") if n == 1 else (f"link_{n - 1}", "0.3 0 0.05")
        axis = "0 0 1" if n % 2 else "0 1 0"
        out += LINK.format(n=n, parent=parent, at=at, axis=axis)
    return out + "\n</robot>\n"


@dataclass(frozen=True)
class Answer:
    """What the command wrote for one log."""

    folder: Path
    log: Path
    robot: Path
    out: Path
    code: int

    def rows(self, name: str, folder: Path | None = None) -> list[dict[str, str]]:
        with ((folder or self.out) / name).open(encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file))


def last_gaps(rows: list[dict[str, str]]) -> list[tuple[str, float, float]]:
    return [(r["effect"], float(r["gap_before"]), float(r["gap_after"])) for r in rows]


@pytest.fixture(scope="module")
def answer(tmp_path_factory: pytest.TempPathFactory) -> Answer:
    """Bodies 25 % off, friction at every joint; the log is long enough to be cut in four parts."""
    folder = tmp_path_factory.mktemp("arm")
    robot = folder / "arm.urdf"
    robot.write_text(urdf(), encoding="utf-8")
    laws = {k: lambda v, load, k=k: DRY[k] * np.sign(v) + VISCOUS[k] * v for k in range(len(NAMES))}
    model = pin.buildModelFromUrdf(str(robot))
    run, rest = log(heavier(model, {1: 1.25, 2: 0.75}), laws, seconds=60.0)
    table = {"time_s": np.concatenate([run.time, rest.time])}
    for k, name in enumerate(NAMES):
        table[f"{name}__position_rad"] = np.concatenate([run.q[:, k], rest.q[:, k]])
        table[f"{name}__torque_Nm"] = np.concatenate([run.tau[:, k], rest.tau[:, k]])
    path = folder / "log.csv"
    pd.DataFrame(table).to_csv(path, index=False)
    out = folder / "out"
    code = main(["gap", "add", str(path), "--robot", str(robot), "--out", str(out)])
    return Answer(folder, path, robot, out, code)


def test_bodies_are_named_first_and_friction_of_every_joint(answer: Answer) -> None:
    rows = answer.rows("found.csv")
    assert rows[0]["effect"] == "rigid_body_parameters"
    assert rows[0]["level"] == "confirmed"
    friction = [r for r in rows if r["effect"] == "joint_friction"]
    dry = {r["joint"]: r for r in friction if r["parameter"] == "coulomb"}
    for name, size in zip(NAMES, DRY, strict=True):
        row = dry[name]
        assert float(row["value"]) == pytest.approx(size, abs=0.06)
        assert 0.0 <= float(row["share"]) <= 1.0
    assert not {r["effect"] for r in rows if r["written"] == "true"} & {
        "coulomb_friction",
        "viscous_friction",
        "link_mass",
    }


def test_joints_with_the_same_law_are_told_as_one(answer: Answer) -> None:
    rows = [r for r in answer.rows("found.csv") if r["effect"] == "joint_friction"]
    orders = {(r["order"], r["law"]) for r in rows}
    assert len(orders) == len({r["law"] for r in rows})


def test_the_file_holds_every_link_as_a_body_near_the_truth(answer: Answer) -> None:
    machine = load_model(answer.out / "model.toml")
    truth = heavier(pin.buildModelFromUrdf(str(answer.robot)), {1: 1.25, 2: 0.75})
    # The first moment of the last link is what gravity tells best.
    found, true = (np.asarray(m.inertias[3].toDynamicParameters()) for m in (machine.rigid, truth))
    assert found[1] == pytest.approx(true[1], rel=0.05)
    assert len(machine.identified) == 3


def test_no_suspected_name_is_written(answer: Answer) -> None:
    edits = tomllib.loads((answer.out / "model.toml").read_text(encoding="utf-8"))["edit"]
    assert {edit["level"] for edit in edits} <= {"confirmed", "approximate"}
    for row in answer.rows("found.csv"):
        assert (row["written"] == "true") == (row["level"] != "suspected")


def test_shrink_gives_the_figures_that_were_promised(answer: Answer, tmp_path: Path) -> None:
    model = str(answer.out / "model.toml")
    main(["gap", "shrink", str(answer.log), "--model", model, "--out", str(tmp_path)])
    promised = [r for r in answer.rows("found.csv") if r["written"] == "true"]
    kept = answer.rows("found.csv", tmp_path)
    for (name, before, after), (again, b, a) in zip(
        last_gaps(promised), last_gaps(kept), strict=True
    ):
        assert name == again
        assert (b, a) == pytest.approx((before, after), rel=0.01)


def test_what_proves_decides_nothing(answer: Answer, tmp_path: Path) -> None:
    """Other torques in the held-out part: other gaps, the same findings to the last digit."""
    table = pd.read_csv(answer.log)
    size = int(0.7 * len(table))
    arguments = ["--robot", str(answer.robot), "--prove-last", "0.3", "--cutoff", "6"]
    found = []
    wave = np.sin(2.0 * table["time_s"].to_numpy())[size + 100 :]
    for name, factor in (("as_it_was", 0.0), ("spoilt", 1.5)):
        changed = table.copy()
        for column in [c for c in changed if c.endswith("__torque_Nm")]:
            changed.loc[size + 100 :, column] += factor * wave
        path = tmp_path / f"{name}.csv"
        changed.to_csv(path, index=False)
        main(["gap", "name", str(path), *arguments, "--out", str(tmp_path / name)])
        found.append(answer.rows("found.csv", tmp_path / name))
    decided = ("effect", "law", "place", "parameter", "value", "ci_low", "ci_high", "level")
    first, second = ([[row[k] for k in decided] for row in rows] for rows in found)
    assert first == second
    assert [r["gap_after"] for r in found[0]] != [r["gap_after"] for r in found[1]]


def test_base_parameters_stand_beside_the_urdf(answer: Answer) -> None:
    rows = answer.rows("base_parameters.csv")
    assert (answer.out / "base_parameters.meta.json").is_file()
    assert all(float(r["low"]) <= float(r["value"]) <= float(r["high"]) for r in rows)
    # Bodies were 25 % off: some combination is told far from what the URDF says.
    assert max(abs(float(r["far"])) for r in rows) > 1.0
    assert any(not float(r["low"]) <= float(r["urdf"]) <= float(r["high"]) for r in rows)


def test_bodies_are_told_by_link_and_a_urdf_holds_them(
    answer: Answer, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = {r["link"]: r for r in answer.rows("bodies.csv")}
    assert set(rows) == {"link_1", "link_2", "link_3"}
    last = rows["link_3"]

    assert float(last["urdf_mass_kg"]) == 2.0
    assert float(last["low_mass_kg"]) <= float(last["found_mass_kg"]) <= float(last["high_mass_kg"])
    found = pin.buildModelFromUrdf(str(answer.out / "model.urdf"))
    known = load_model(answer.out / "model.toml").rigid
    data, rng = (found.createData(), known.createData()), np.random.default_rng(0)
    for q, v, a in rng.normal(size=(20, 3, 3)):
        one, other = (pin.rnea(m, d, q, v, a) for m, d in zip((found, known), data, strict=True))
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12)
    # As the robot of a run that would write over it, it would be put right twice.
    robot, log = str(answer.out / "model.urdf"), str(answer.log)
    assert main(["gap", "add", log, "--robot", robot, "--out", str(answer.out)]) == 2
    assert "choose another folder" in capsys.readouterr().err
