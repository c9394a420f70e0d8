"""Columns that are not what they say: named with the line that mends them, and never without cause.

The arm's torques come from Pinocchio alone, with bodies that are not the URDF's, a payload that it
does not know, and friction.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pinocchio as pin
import pytest

from pipeline.identification import wrong_columns as wrong
from pipeline.identification.workflow.compared import compare_logs, load_logs
from pipeline.logs.log import Finding
from tests.compared import as_compared
from tests.leg_log import leg_logs

RATE = 200.0
LINK = """<link name="l{k}"><inertial><origin xyz="{x} 0.02 0.01"/><mass value="{m}"/>
<inertia ixx="{i}" ixy="0" ixz="0" iyy="{i}" iyz="0" izz="{i}"/></inertial></link>
<joint name="j{k}" type="continuous"><parent link="{parent}"/><child link="l{k}"/>
<origin xyz="{at} 0 0"/><axis xyz="{axis}"/></joint>"""
LIMIT = '<limit lower="-9" upper="9" effort="9" velocity="9"/>'

Spoil = Callable[[pd.DataFrame], None]


@pytest.fixture(scope="module")
def urdf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    links = [
        LINK.format(k=k, parent=f"l{k - 1}" if k else "base", at=at, axis=axis, m=m, x=x, i=i)
        for k, (at, axis, m, x, i) in enumerate(
            [
                (0.0, "0 1 0", 3.0, 0.2, 0.04),
                (0.4, "0.6 0.8 0", 2.0, 0.15, 0.02),
                (0.3, "0 1 0", 1.0, 0.1, 0.005),
            ]
        )
    ]
    path = tmp_path_factory.mktemp("arm") / "arm.urdf"
    path.write_text(f'<robot name="arm"><link name="base"/>{"".join(links)}</robot>', "utf-8")
    return path


def revolute(urdf: Path) -> str:
    """The URDF with limits, so that Pinocchio takes one number per joint."""
    text = urdf.read_text("utf-8").replace("continuous", "revolute")
    return text.replace("</joint>", f"{LIMIT}</joint>")


def logged(
    urdf: Path, seed: int, *, off: float, payload: float, quick: float = 1.0
) -> pd.DataFrame:
    """A log of an arm whose bodies differ from the URDF's by up to a share."""
    rng = np.random.default_rng(seed)
    model = pin.buildModelFromXML(revolute(urdf))
    for i in range(1, model.njoints):
        body, scale = model.inertias[i], float(np.exp(np.log1p(off) * rng.uniform(-1.0, 1.0)))
        lever = body.lever + 0.1 * off * rng.uniform(-1.0, 1.0, 3)
        model.inertias[i] = pin.Inertia(scale * body.mass, lever, scale * body.inertia)
    model.inertias[3] += pin.Inertia(payload, np.array([0.2, 0.0, 0.0]), np.zeros((3, 3)))
    t = np.arange(2400) / RATE
    w = 2 * np.pi * np.array([0.17, 0.53, 1.1])[:, None] * quick * rng.uniform(0.8, 1.2, (3, 3))
    phase = w[:, None, :] * t[None, :, None] + rng.uniform(0, 6, (3, 1, 3))
    size = np.array([0.8, 0.3, 0.1])[:, None, None]
    q = np.array([0.3, 0.5, -0.6]) + (size * np.sin(phase)).sum(axis=0)
    v = (size * w[:, None] * np.cos(phase)).sum(axis=0)
    a = -(size * w[:, None] ** 2 * np.sin(phase)).sum(axis=0)
    tau = np.array([pin.rnea(model, model.createData(), *x) for x in zip(q, v, a, strict=True)])
    spread = tau.std(axis=0)
    tau += spread * (0.15 * np.tanh(v / 0.02) + 0.05 * v + 0.02 * rng.standard_normal(q.shape))
    out = pd.DataFrame({"time_s": t})
    for k in range(3):
        out[f"j{k}__position_rad"] = q[:, k] + 1e-5 * rng.standard_normal(t.size)
        out[f"j{k}__torque_Nm"] = tau[:, k]
    return out


def judged(
    log: pd.DataFrame, urdf: Path, folder: Path, mapping: str = "", **more: Any
) -> list[Finding]:
    """Suspicions about columns; the run goes on."""
    path, file = folder / "log.parquet", folder / "mapping.toml"
    log.to_parquet(path)
    file.write_text(mapping, encoding="utf-8")
    options, given = as_compared(path, robot=urdf, step="where", mapping=file, **more)
    where = compare_logs(given, given.model, load_logs(given, options))
    return [f for f in where.loaded.findings if f.verdict == "suspected"]


def times(quantity: str, factor: float, joints: str = "012") -> Spoil:
    def spoil(log: pd.DataFrame) -> None:
        for j in joints:
            log[f"j{j}__{quantity}"] *= factor

    return spoil


def exchanged(*quantities: str) -> Spoil:
    def spoil(log: pd.DataFrame) -> None:
        for quantity in quantities:
            names = [f"j0__{quantity}", f"j2__{quantity}"]
            log[names] = log[names[::-1]].to_numpy()

    return spoil


def late(log: pd.DataFrame) -> None:
    for j in range(3):
        log[f"j{j}__torque_Nm"] = log[f"j{j}__torque_Nm"].shift(10).bfill()


def other_zero(log: pd.DataFrame) -> None:
    log["j1__position_rad"] += 1.5


CAUSES = {
    "one sign": (times("torque_Nm", -1.0, "1"), "the sign of the torque is turned"),
    "millinewton metres": (times("torque_Nm", 1e3), "it is in mN"),
    "five times": (times("torque_Nm", 5.0), "the torque is [4-6].* times what it should be"),
    "newton centimetres": (times("torque_Nm", 1e2), "it is in N.cm"),
    "torques": (exchanged("torque_Nm"), "the torques of j0 and j2 are exchanged"),
    "joints": (exchanged("torque_Nm", "position_rad"), "j0 and j2 are exchanged, positions"),
    "motor": (times("position_rad", 9.0, "2"), "the position is (8|9).* times what it should"),
    "degrees": (times("position_rad", 180 / np.pi, "1"), "it is in degrees"),
    "zero": (other_zero, "the zero of the position is 1.[4-6] rad off"),
    "late": (late, r"the torque is (4[6-9]|5[0-4])(\.\d+)? ms late"),
}


@pytest.mark.parametrize("name", CAUSES)
def test_a_wrong_column_is_named_with_the_line_that_mends_it(
    urdf: Path, tmp_path: Path, name: str
) -> None:
    spoil, says = CAUSES[name]
    log = logged(urdf, 3, off=0.2, payload=0.3, quick=2.0 if name == "late" else 1.0)
    spoil(log)
    said = "; ".join(f.detail for f in judged(log, urdf, tmp_path))
    assert re.search(says, said)
    lines = re.search(r"in a mapping file: ([^(]*\})", said)
    assert lines is not None
    assert judged(log, urdf, tmp_path, lines[1].replace("; ", "\n")) == []


def dragged(log: pd.DataFrame) -> None:
    for j in range(3):
        v = np.gradient(
            log[f"j{j}__position_rad"].rolling(9, center=True, min_periods=1).mean(), 1 / RATE
        )
        log[f"j{j}__torque_Nm"] += (
            3.0 * log[f"j{j}__torque_Nm"].std() * v * np.abs(v) / (v**2).max()
        )


def behind(log: pd.DataFrame) -> None:
    for j in range(3):
        log[f"j{j}__torque_Nm"] = log[f"j{j}__torque_Nm"].shift(5).bfill()


MACHINES: dict[str, Spoil] = {
    "a drag": dragged,
    "27 ms of delay": behind,
    "a gain that is no unit": times("torque_Nm", 1.7, "1"),
    "half the weight": times("torque_Nm", 0.5),
}


@pytest.mark.parametrize("name", MACHINES)
def test_what_the_machine_may_do_is_no_wrong_column(urdf: Path, tmp_path: Path, name: str) -> None:
    """Columns are accused last: identification names a drag, a delay, a gain, other bodies."""
    log = logged(urdf, 3, off=0.2, payload=0.3, quick=2.0)
    MACHINES[name](log)
    assert judged(log, urdf, tmp_path) == []


@pytest.mark.parametrize("seed", range(4))
def test_bodies_that_are_off_and_a_payload_are_no_wrong_columns(
    urdf: Path, tmp_path: Path, seed: int
) -> None:
    log = logged(urdf, seed, off=0.5, payload=(0.0, 1.5)[seed % 2])
    assert judged(log, urdf, tmp_path) == []


def test_a_strong_spring_is_no_wrong_column(urdf: Path, tmp_path: Path) -> None:
    log = logged(urdf, 1, off=0.2, payload=0.3, quick=0.5)
    log["j2__torque_Nm"] += 20.0 * (log["j2__position_rad"] + 1.0)
    assert judged(log, urdf, tmp_path) == []


def test_a_motor_of_another_constant_is_no_wrong_column(root: Path, tmp_path: Path) -> None:
    (log,) = leg_logs(3, ["torque_constant_error"]).values()
    assert judged(pd.DataFrame(log), root / "urdf" / "leg.toml", tmp_path) == []


def test_drives_with_less_friction_than_stated_are_no_wrong_column(
    root: Path, tmp_path: Path
) -> None:
    catalog = tmp_path / "actuators"
    shutil.copytree(root / "actuators" / "catalog", catalog)
    path = catalog / "rotor_re40.toml"
    stated = re.sub(r"(?m)^(interval|bounds) = .*$", r"\1 = [0, 999]", path.read_text("utf-8"))
    path.write_text(stated.replace("value = 3.6186055", "value = 36.0"), "utf-8")
    (log,) = leg_logs(3, ["torque_constant_error"]).values()
    leg = root / "urdf" / "leg.toml"
    assert judged(pd.DataFrame(log), leg, tmp_path, actuators=catalog) == []


def test_a_robot_that_stands_is_no_fixed_base(tmp_path: Path) -> None:
    """Two legs carry a trunk that a bare URDF fixes: the ground pushes their ends up by 40 N."""
    parts = 2 * [(0.0, 0.8, 0.1, 3e-3), (0.2, 0.4, 0.1, 2e-3)]
    legs = [
        LINK.format(
            k=k, parent=f"l{k - 1}" if k % 2 else "base", at=at, axis="0 1 0", m=m, x=x, i=i
        )
        for k, (at, m, x, i) in enumerate(parts)
    ]
    urdf = tmp_path / "stands.urdf"
    urdf.write_text(f'<robot name="stands"><link name="base"/>{"".join(legs)}</robot>', "utf-8")
    model = pin.buildModelFromXML(revolute(urdf))
    data, rng, t = model.createData(), np.random.default_rng(5), np.arange(2400) / RATE
    w = 2 * np.pi * rng.uniform(0.2, 0.6, 4)
    q, v, a = (0.4 * w**k * np.sin(w * t[:, None] + k * np.pi / 2) for k in range(3))
    q += np.array([0.7, -1.4, 0.7, -1.4])
    log = pd.DataFrame({"time_s": t})
    total = np.array([pin.rnea(model, data, *x) for x in zip(q, v, a, strict=True)])
    for n, x in enumerate(q):
        pin.computeJointJacobians(model, data, x)
        for joint in (2, 4):
            arm = data.oMi[joint].act(np.array([0.2, 0.0, 0.0]))
            J = pin.getJointJacobian(model, data, joint, pin.WORLD)
            total[n] -= 40.0 * (J[:3] - pin.skew(arm) @ J[3:])[2]
    total += 0.2 * np.tanh(v / 0.02) + 0.02 * rng.standard_normal(q.shape)
    for k in range(4):
        log[f"j{k}__position_rad"] = q[:, k] + 1e-5 * rng.standard_normal(t.size)
        log[f"j{k}__torque_Nm"] = total[:, k]
    (found,) = judged(log, urdf, tmp_path)
    assert "contact forces are missing" in found.detail


@pytest.mark.parametrize("turned", [[], pytest.param(["lr_joint_2"], marks=pytest.mark.slow)])
def test_a_walk_without_foot_forces_is_judged_by_its_legs_in_the_air(
    tmp_path: Path, turned: list[str]
) -> None:
    """What squeezes the ground and a touch-down that no motion shows are no wrong columns."""
    log = pd.read_parquet("pipeline/identification/demo/walk.parquet")
    log = log[[n for n in log.columns if "__force" not in n and "__voltage" not in n]]
    for joint in turned:
        log[f"{joint}__current_A"] *= -1.0
    found = judged(log, Path("urdf/hexapod.toml"), tmp_path)
    assert [f.column.split("__")[0] for f in found if "sign" in f.detail] == turned
    assert len(found) == len(turned)


@pytest.mark.parametrize(
    ("moved", "spoil"),
    [
        ({"WELL": 0.0}, times("torque_Nm", -1.0, "1")),
        ({"HALVED": 0.0}, times("torque_Nm", -1.0, "1")),
        ({"ODD": 3.0}, times("torque_Nm", -1.0, "1")),
        ({"BODIES": 2e3}, times("torque_Nm", 1e3)),
        ({"NEAR": 1.0}, times("torque_Nm", 1e2, "1")),
        ({"TOLD": 0.0}, times("torque_Nm", 1e3)),
        # Half of the weight and a delay of 25 ms are the machine's.
        ({"BODIES": 1.2, "FAR": 1.5}, times("torque_Nm", 0.45)),
        ({"DELAYS": (0.025,)}, behind),
    ],
)
def test_thresholds_matter(
    urdf: Path,
    tmp_path: Path,
    moved: dict[str, object],
    spoil: Spoil,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    log = logged(urdf, 3, off=0.0, payload=0.0, quick=2.0)
    spoil(log)
    own = [f.detail for f in judged(log, urdf, tmp_path)]
    for name, value in moved.items():
        monkeypatch.setattr(wrong, name, value)
    assert [f.detail for f in judged(log, urdf, tmp_path)] != own
