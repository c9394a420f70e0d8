"""Columns that are not what they say: named with the line that mends them, and never without cause.

The arm's torques come from Pinocchio alone, with bodies that are not the URDF's, a payload that it
does not know, and friction.
"""

import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pinocchio as pin
import pytest

from pipeline.identification.workflow.compared import compare_logs, load_logs
from tests.command_line import as_compared
from tests.pipeline.arm import BODIES, arm_file, arm_text, sines, table, torques
from tests.pipeline.dynamics.walking_engine import walked
from tests.pipeline.identification import bench_leg as leg
from tests.pipeline.identification.legs import frame_of, robot_of

RATE = 200.0
Spoil = Callable[[pd.DataFrame], None]


@pytest.fixture(scope="module")
def urdf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return arm_file(tmp_path_factory.mktemp("arm"), "continuous")


def logged(seed, *, off, payload, quick=1.0, bodies=BODIES):
    """A log of an arm whose bodies differ from the URDF's by up to a share."""
    rng, t = np.random.default_rng(seed), np.arange(2400) / RATE
    model = pin.buildModelFromXML(arm_text(bodies=bodies))
    for i in range(1, model.njoints):
        body, scale = model.inertias[i], float(np.exp(np.log1p(off) * rng.uniform(-1.0, 1.0)))
        lever = body.lever + 0.1 * off * rng.uniform(-1.0, 1.0, 3)
        model.inertias[i] = pin.Inertia(scale * body.mass, lever, scale * body.inertia)
    model.inertias[3] += pin.Inertia(payload, np.array([0.2, 0.0, 0.0]), np.zeros((3, 3)))
    q, v, a = sines(rng, t, quick * np.array([0.17, 0.53, 1.1]), (0.8, 0.3, 0.1))
    tau = torques(model, q, v, a)
    tau += tau.std(axis=0) * (
        0.15 * np.tanh(v / 0.02) + 0.05 * v + 0.02 * rng.standard_normal(q.shape)
    )
    return table(t, q + 1e-5 * rng.standard_normal(q.shape), tau)


def judged(log, urdf, folder, mapping="", verdict="suspected", **more: Any):
    """Suspicions about columns; the run goes on."""
    path, file = folder / "log.parquet", folder / "mapping.toml"
    log.to_parquet(path)
    file.write_text(mapping, encoding="utf-8")
    options, given = as_compared(path, robot=urdf, step="where", mapping=file, **more)
    where = compare_logs(given, given.model, load_logs(given, options))
    return [f for f in where.loaded.findings if f.verdict == verdict]


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


def late(rows: int) -> Spoil:
    def spoil(log: pd.DataFrame) -> None:
        efforts = log.columns[log.columns.str.endswith("torque_Nm")]
        log[efforts] = log[efforts].shift(rows).bfill()

    return spoil


def other_zero(log: pd.DataFrame) -> None:
    log["j1__position_rad"] += 1.5


def of_the_joint(log: pd.DataFrame) -> None:
    log["j2__motor_position_rad"] = log.pop("j2__position_rad")


def of_motors(log: pd.DataFrame) -> None:
    for j, ratio in enumerate((50.0, 100.0, 30.0)):
        log[f"j{j}__torque_Nm"] /= ratio


#: What is spoilt, and what is said; gears that the mapping knows, and the arm's payload [kg].
CAUSES: dict[str, tuple[Spoil, str, str, float]] = {
    "one sign": (times("torque_Nm", -1.0, "1"), "the sign of the torque is turned", "", 0.3),
    "millinewton metres": (times("torque_Nm", 1e3), "it is in mN", "", 0.3),
    "five times": (times("torque_Nm", 5.0), "torque is [4-6].* times what it should be", "", 0.3),
    "newton centimetres": (times("torque_Nm", 1e2), "it is in N.cm", "", 0.3),
    "torques": (exchanged("torque_Nm"), "the torques of j0 and j2 are exchanged", "", 0.3),
    "joints": (exchanged("torque_Nm", "position_rad"), "j0 and j2 are exchanged, pos", "", 0.3),
    "motor": (times("position_rad", 9.0, "2"), "position is (8|9).* times what it sho", "", 0.3),
    "degrees": (times("position_rad", 180 / np.pi, "1"), "it is in degrees", "", 0.3),
    "zero": (other_zero, "the zero of the position is 1.[4-6] rad off", "", 0.3),
    "late": (late(10), r"the torque is (4[6-9]|5[0-4])(\.\d+)? ms late", "", 0.3),
    "a joint's position": (of_the_joint, "it is that of the joint", "j2 = 50", 0.3),
    # Near the factor of degrees, it is the one that leaves less.
    "a motor's position": (times("position_rad", 50.0, "1"), "that of the motor", "j1 = 50", 0.3),
    "motors' torques": (of_motors, "that of the motor", "j0 = 50\nj1 = 100\nj2 = 30", 0.3),
    "and a payload": (of_motors, "that of the motor", "j0 = 50\nj1 = 100\nj2 = 30", 1.0),
}


@pytest.mark.parametrize("name", CAUSES)
def test_a_wrong_column_is_named_with_the_line_that_mends_it(urdf, tmp_path, name):
    spoil, says, gears, payload = CAUSES[name]
    log = logged(3, off=0.2, payload=payload, quick=2.0 if name == "late" else 1.0)
    spoil(log)
    gears = f"[gear_ratio]\n{gears}\n" if gears else ""
    said = [f.detail for f in judged(log, urdf, tmp_path, gears)]
    assert re.search(says, "; ".join(said))
    lines = [line for own in said for line in re.findall(r"in a mapping file: ([^(]*\})", own)]
    mended = "\n".join(lines).replace("; ", "\n")
    assert mended
    assert judged(log, urdf, tmp_path, f"{mended}\n{gears}") == []


def test_exchanged_torques_are_named_where_other_bodies_nearly_explain_them(urdf, tmp_path):
    log, names = logged(2, off=0.2, payload=0.5), ["j0__torque_Nm", "j1__torque_Nm"]
    log[names] = log[names[::-1]].to_numpy()
    (found,) = judged(log, urdf, tmp_path)
    assert "the torques of j0 and j1 are exchanged" in found.detail


def smooth(log: pd.DataFrame, joint: str) -> np.ndarray:
    return log[f"{joint}__position_rad"].rolling(9, center=True, min_periods=1).mean().to_numpy()


def dragged(log: pd.DataFrame) -> None:
    for torque in (f"j{j}__torque_Nm" for j in range(3)):
        v = np.gradient(smooth(log, torque[:2]), 1 / RATE)
        log[torque] += 3.0 * log[torque].std() * v * np.abs(v) / (v**2).max()


def winding(log: pd.DataFrame) -> None:
    """Dry friction that turns over 0.02 rad: Dahl's law step by step."""
    q = smooth(log, "j1")
    sense = np.zeros(q.size)
    for k, moved in enumerate(np.diff(q)):
        sense[k + 1] = sense[k] + (np.sign(moved) - sense[k]) * min(abs(moved) / 0.02, 1.0)
    log["j1__torque_Nm"] += 5.0 * log["j1__torque_Nm"].std() * sense


def sprung(log: pd.DataFrame) -> None:
    log["j2__torque_Nm"] += 20.0 * (log["j2__position_rad"] + 1.0)


#: Seed, how quick, and what the machine does.
MACHINES: dict[str, tuple[int, float, Spoil]] = {
    "a drag": (3, 2.0, dragged),
    "27 ms of delay": (3, 2.0, late(5)),
    "a gain that is no unit": (3, 2.0, times("torque_Nm", 1.7, "1")),
    "half the weight": (3, 2.0, times("torque_Nm", 0.5)),
    "friction over a travel": (3, 0.3, winding),
    "a strong spring": (1, 0.5, sprung),
}


@pytest.mark.parametrize("name", MACHINES)
def test_what_the_machine_may_do_is_no_wrong_column(urdf, tmp_path, name):
    """Columns are accused last: identification names a drag, a delay, a gain, other bodies."""
    seed, quick, does = MACHINES[name]
    log = logged(seed, off=0.2, payload=0.3, quick=quick)
    does(log)
    assert judged(log, urdf, tmp_path) == []


@pytest.mark.parametrize("seed", range(4))
def test_bodies_that_are_off_and_a_payload_are_no_wrong_columns(urdf, tmp_path, seed):
    log = logged(seed, off=0.5, payload=(0.0, 1.5)[seed % 2])
    assert judged(log, urdf, tmp_path) == []


def test_efforts_of_another_log_are_told(urdf, tmp_path):
    log, other = (logged(seed, off=0.2, payload=0.3) for seed in (0, 20))
    torques = [name for name in log if name.endswith("torque_Nm")]
    (found,) = judged(log.assign(**other[torques]), urdf, tmp_path)
    assert "efforts of another log" in found.detail


def test_a_log_of_another_arm_is_told_by_the_joints_that_nothing_explains(urdf, tmp_path):
    other = (BODIES[0], (0.4, "0 0 1", 2.0, 0.15, 0.02), (0.3, "0 0 1", 1.0, 0.1, 0.005))
    log = logged(0, off=0.2, payload=0.3, bodies=other)
    (found,) = judged(log, urdf, tmp_path)
    assert "the log of another robot" in found.detail


def test_a_motor_of_another_constant_is_no_wrong_column(root, tmp_path):
    log = leg.leg_log(3, 1.2)
    assert judged(pd.DataFrame(log), root / "urdf" / "leg.toml", tmp_path) == []


def test_drives_with_less_friction_than_stated_are_no_wrong_column(root, tmp_path):
    catalog = tmp_path / "actuators"
    shutil.copytree(root / "actuators" / "catalog", catalog)
    path = catalog / "rotor_re40.toml"
    stated = re.sub(r"(?m)^(interval|bounds) = .*$", r"\1 = [0, 999]", path.read_text("utf-8"))
    path.write_text(stated.replace("value = 3.6186055", "value = 36.0"), "utf-8")
    log = leg.leg_log(3, 1.2)
    robot = root / "urdf" / "leg.toml"
    assert judged(pd.DataFrame(log), robot, tmp_path, actuators=catalog) == []


#: Two legs of two links that carry a trunk.
LEGS = 2 * ((0.0, "0 1 0", 0.8, 0.1, 3e-3), (0.2, "0 1 0", 0.4, 0.1, 2e-3))
TWO_LEGS = ("base", "l0", "base", "l2")


def test_a_robot_that_stands_is_no_fixed_base(tmp_path):
    """Two legs carry a trunk that a bare URDF fixes: the ground pushes their ends up by 40 N."""
    urdf = tmp_path / "stands.urdf"
    model = pin.buildModelFromXML(arm_text(parents=TWO_LEGS, bodies=LEGS))
    urdf.write_text(arm_text("continuous", TWO_LEGS, LEGS), "utf-8")
    data, rng, t = model.createData(), np.random.default_rng(5), np.arange(2400) / RATE
    w = 2 * np.pi * rng.uniform(0.2, 0.6, 4)
    q, v, a = (0.4 * w**k * np.sin(w * t[:, None] + k * np.pi / 2) for k in range(3))
    q += np.array([0.7, -1.4, 0.7, -1.4])
    total = torques(model, q, v, a)
    for n, x in enumerate(q):
        pin.computeJointJacobians(model, data, x)
        for joint in (2, 4):
            arm = data.oMi[joint].act(np.array([0.2, 0.0, 0.0]))
            J = pin.getJointJacobian(model, data, joint, pin.WORLD)
            total[n] -= 40.0 * (J[:3] - pin.skew(arm) @ J[3:])[2]
    total += 0.2 * np.tanh(v / 0.02) + 0.02 * rng.standard_normal(q.shape)
    log = table(t, q + 1e-5 * rng.standard_normal(q.shape), total)
    (found,) = judged(log, urdf, tmp_path)
    assert "contact forces are missing" in found.detail


@pytest.mark.parametrize("turned", [[], pytest.param(["lr_joint_2"], marks=pytest.mark.slow)])
def test_a_walk_without_foot_forces_is_judged_by_its_legs_in_the_air(tmp_path, turned):
    """What squeezes the ground and a touch-down that no motion shows are no wrong columns."""
    log = pd.read_parquet("pipeline/identification/demo/walk.parquet")
    log = log[[n for n in log.columns if "__force" not in n and "__voltage" not in n]]
    for joint in turned:
        log[f"{joint}__current_A"] *= -1.0
    found = judged(log, Path("urdf/hexapod.toml"), tmp_path)
    assert [f.column.split("__")[0] for f in found if "sign" in f.detail] == turned
    assert len(found) == len(turned)


@pytest.mark.parametrize(("kind", "tilt"), [("flags", 0.0), ("neither", 0.06)])
def test_a_sound_walk_of_another_engine_is_not_blamed(tmp_path, kind, tilt):
    robot = robot_of("hexapod")
    walk = walked(robot, periods=(3.0, 2.6), tilt=tilt, kp=1500.0, noise=0.15)
    assert judged(frame_of(robot, walk, kind), Path("urdf/hexapod.toml"), tmp_path) == []


def test_a_band_too_wide_for_its_accelerations_is_told(urdf, tmp_path):
    log = logged(3, off=0.2, payload=0.3)
    for j in range(3):  # an encoder of 12 bits
        log[f"j{j}__position_rad"] = np.round(log[f"j{j}__position_rad"] / 1.5e-3) * 1.5e-3
    assert not judged(log, urdf, tmp_path, verdict="warning")
    told = judged(log, urdf, tmp_path, verdict="warning", cutoff=50.0)
    assert {f.check for f in told} == {"regressor_noise"}
    assert {f.column for f in told} >= {"j0__torque_Nm", "j1__torque_Nm"}
