"""A bare URDF whose machine has a spring, a ripple and a late sensor, through the command."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pinocchio as pin
import pytest

from pipeline.cli.main import main
from tests.command_line import rows_of
from tests.pipeline.identification.whole.test_whole_machine import DRY, NAMES, VISCOUS, urdf
from tests.pipeline.regression.arms import heavier, log

pytestmark = pytest.mark.slow
TRUE = {
    ("parallel_spring", "joint_3", "stiffness"): 3.0,
    ("parallel_spring", "joint_3", "rest"): 0.3,
    ("torque_ripple", "joint_3", "amplitude"): 0.5,
    ("torque_ripple", "joint_3", "order"): 23.0,
    ("time_delay", "joint_2", "delay"): 0.02,
}


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, str]]:
    folder = tmp_path_factory.mktemp("arm")
    robot, path, out = folder / "arm.urdf", folder / "log.csv", folder / "out"
    robot.write_text(urdf(), encoding="utf-8")
    laws = {k: lambda v, load, k=k: DRY[k] * np.sign(v) + VISCOUS[k] * v for k in range(3)}
    model = pin.buildModelFromUrdf(str(robot))
    parts = log(heavier(model, {1: 1.25, 2: 0.75}), laws, seconds=60.0)
    t, q, tau = (np.concatenate([getattr(p, n) for p in parts]) for n in ("time", "q", "tau"))
    tau[:, 2] += 3.0 * (q[:, 2] - 0.3) + 0.5 * np.sin(23.0 * q[:, 2] + 0.7)
    tau[:, 1] = np.interp(t - 0.02, t, tau[:, 1])
    table = {"time_s": t}
    for k, name in enumerate(NAMES):
        table |= {f"{name}__position_rad": q[:, k], f"{name}__torque_Nm": tau[:, k]}
    pd.DataFrame(table).to_csv(path, index=False)
    assert main(["gap", "add", str(path), "--robot", str(robot), "--out", str(out)]) == 0
    return rows_of(out / "found.csv")


def test_each_is_named_at_its_joint_with_its_size(found) -> None:
    rows = {(r["effect"], r["joint"] or r["place"], r["parameter"]): r for r in found}
    for key, size in TRUE.items():
        assert float(rows[key]["value"]) == pytest.approx(size, rel=0.06), key
        assert rows[key]["level"] == "confirmed"
        assert rows[key]["written"] == "true"


def test_nothing_else_is_named(found) -> None:
    friction = {"joint_friction", "rigid_body_parameters"}
    named = {r["effect"] for r in found if r["written"] == "true"} - friction
    assert named == {effect for effect, _, _ in TRUE}


def test_each_makes_the_gap_of_its_joint_smaller_and_noise_is_left(found) -> None:
    gaps = {r["effect"]: (float(r["gap_before"]), float(r["gap_after"])) for r in found}
    for effect in {e for e, _, _ in TRUE}:
        before, after = gaps[effect]
        assert after < before, effect
    last = found[-1]
    assert float(last["gap_after"]) < 2.0 * float(last["noise_floor"])
