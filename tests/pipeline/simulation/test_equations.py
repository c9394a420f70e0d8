"""Equations of motion along logs of robots that walk and stand in another engine."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import signal
from scipy.spatial.transform import Rotation

from pipeline.dynamics.residual import EquationsOfMotion, body_columns
from pipeline.logs.log import Log
from pipeline.machine.machine import MachineModel
from pipeline.robot.kinematics import foot_positions
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from pipeline.simulation import equations as module
from pipeline.simulation.equations import equations_of
from tests.pipeline.dynamics.walking_engine import COUNTS, TORQUE_NOISE, Walked, walked

CUTOFF = 8.0  # [Hz]
FORCE_NOISE = 0.25  # after the filter [N]
KINDS = ("forces", "flags", "neither")
LOAD = (3.0, (0.12, 0.05, 0.0))


def machine(robot: Robot) -> MachineModel:
    left = tuple(leg.side == "left" for leg in robot.spec.legs)
    return MachineModel("walker", robot.model, robot.joints, robot.chains, left, floating=True)


def measured(robot: Robot, log: Walked, kind: str) -> Any:
    """A log at its bandwidth with foot forces, contact flags, or neither and no orientation."""
    dt = log.time[1] - log.time[0]
    sos = signal.butter(4, CUTOFF * 2 * dt, output="sos")

    def smooth(x: np.ndarray) -> np.ndarray:
        return np.asarray(signal.sosfiltfilt(sos, x, axis=0))

    impulse = np.zeros(401)
    impulse[200] = 1.0
    kernel = [smooth(impulse)]
    for _ in range(2):
        kernel.append(np.gradient(kernel[-1], dt))
    gain = np.array([np.sqrt(np.sum(h**2)) for h in kernel])
    q = smooth(log.q)
    v = np.gradient(q, dt, axis=0)
    yaw, pitch, roll = Rotation.from_quat(log.orientation).as_euler("ZYX").T
    ahead = Rotation.from_euler("Z", -yaw[:, None])
    force = smooth(np.stack([ahead.apply(f) for f in log.force.swapaxes(0, 1)], axis=1))
    force += np.random.default_rng(3).normal(0.0, FORCE_NOISE, force.shape)
    weight = 9.81 * sum(body.mass for body in robot.model.inertias)
    standing = smooth(log.force[..., 2]) > 0.04 * weight
    if kind == "neither":
        height = foot_positions(robot.chains, robot.chains.by_leg(q))[..., 2]
        standing = height < height.min(axis=1, keepdims=True) + 5e-3
    rows = np.arange(100, len(q) - 100, max(1, int(1 / (10 * CUTOFF * dt))))
    time = log.time[rows]
    told = kind != "neither"
    return SimpleNamespace(
        name="walk",
        time=time,
        joints=robot.joints,
        q=q[rows],
        v=v[rows],
        a=np.gradient(v, dt, axis=0)[rows],
        channels=("torque",),
        effort=smooth(log.torque)[rows, :, None],
        noise=np.full((q.shape[1], 1), TORQUE_NOISE * gain[0]),
        mask=np.ones((rows.size, q.shape[1]), dtype=np.bool_),
        known=None,
        unsure=None,
        rate=1 / (time[1] - time[0]),
        bandwidth=CUTOFF,
        pieces=(slice(0, rows.size),),
        rate_noise=2 * np.pi / COUNTS / np.sqrt(12) * np.outer(gain[1:], np.ones(q.shape[1])),
        base_roll=smooth(roll)[rows] if told else None,
        base_pitch=smooth(pitch)[rows] if told else None,
        base_yaw=None,
        base_rate=None,
        standing=standing[rows],
        foot_force=force[rows] if kind == "forces" else None,
        foot_noise=FORCE_NOISE,
        derivative=lambda x: np.gradient(x, time, axis=0),
        smooth=lambda x: x,
    )


def freedom(equations: EquationsOfMotion) -> float:
    """Independent equations of all samples."""
    W = equations.whitening
    covariance = equations.noise.copy()
    feet = equations.feet
    J = (
        feet.rows
        * np.sqrt(np.where(feet.precision > 0, 1 / np.maximum(feet.precision, 1e-12), 0))[..., None]
    )
    covariance += J.swapaxes(1, 2) @ J
    return float(np.einsum("nij,njk,nik->", W, covariance, W, optimize=True))


def known_rows(equations: EquationsOfMotion) -> EquationsOfMotion:
    return equations.at(np.flatnonzero(equations.known))


def left_over(equations: EquationsOfMotion, load: tuple = (0.0, (0.0, 0.0, 0.0))) -> float:
    """Variance of the whitened residual with the payload put in."""
    mass, place = load
    truth = body_columns(equations.model, equations.motion)[..., :4] @ [
        mass,
        *(mass * np.array(place)),
    ]
    left = equations.whitened(equations.residual - truth)
    return float(np.sum(left**2) / freedom(equations))


def payload(equations: EquationsOfMotion) -> tuple[float, np.ndarray]:
    """Its mass [kg] and place along and across the base [m], by least squares."""
    X = equations.whitened(body_columns(equations.model, equations.motion)[..., :3]).reshape(-1, 3)
    x = np.linalg.lstsq(X, equations.whitened(equations.residual).ravel())[0]
    return float(x[0]), x[1:] / x[0]


@pytest.fixture(scope="module")
def loaded(hexapod: Robot) -> Walked:
    return walked(hexapod, periods=(3.0, 3.4, 4.2, 2.6), payload=LOAD)


@pytest.mark.parametrize("kind", KINDS)
def test_payload_of_a_hexapod_that_walks(hexapod: Robot, loaded: Walked, kind: str) -> None:
    equations = known_rows(equations_of(machine(hexapod), measured(hexapod, loaded, kind)))
    mass, place = payload(equations)
    share, near = (0.05, 0.01) if kind != "neither" else (0.15, 0.03)
    assert mass == pytest.approx(3.0, rel=share)
    assert np.abs(place - [0.12, 0.05]).max() < near
    assert 0.7 < left_over(equations, LOAD) < 1.5


@pytest.mark.slow
@pytest.mark.parametrize("name", ["solo12", "anymal_c"])
def test_quadrupeds_that_walk(name: str) -> None:
    robot = load_robot(load_robot_file(Path("urdf") / f"{name}.toml"))
    light = name == "solo12"
    stiffness, contact = (60.0, (4e-3, 0.9995)) if light else (2000.0, (1e-2, 0.95))
    log = walked(robot, periods=(1.7, 2.0) if light else (2.7, 3.0), kp=stiffness, contact=contact)
    for kind in KINDS:
        equations = known_rows(equations_of(machine(robot), measured(robot, log, kind)))
        assert 0.7 < left_over(equations) < 1.5


def test_two_feet_need_what_the_base_turns_by(hexapod: Robot, loaded: Walked) -> None:
    m = measured(hexapod, loaded, "flags")
    m.standing = m.standing & (np.arange(6) < 2)
    m.base_roll = m.base_pitch = None
    assert not equations_of(machine(hexapod), m).known.any()
    m.base_rate = np.zeros((len(m.q), 3))
    assert equations_of(machine(hexapod), m).known.any()


@pytest.mark.parametrize(
    ("name", "value", "kind"),
    [("REACH", 0.1, "flags"), ("SOLE", 1e-6, "forces"), ("LEVEL", 1e-5, "neither")],
)
def test_thresholds_matter(
    hexapod: Robot,
    loaded: Walked,
    name: str,
    value: float,
    kind: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each covers something that real feet and ground do."""
    m = measured(hexapod, loaded, kind)
    own = left_over(known_rows(equations_of(machine(hexapod), m)), LOAD)
    monkeypatch.setattr(module, name, value)
    assert left_over(known_rows(equations_of(machine(hexapod), m)), LOAD) > 1.15 * own


def test_a_joint_without_torque_leaves_the_others(hexapod: Robot, loaded: Walked) -> None:
    m = measured(hexapod, loaded, "flags")
    m.mask[:, 4] = False
    m.effort[:, 4] = np.nan
    equations = known_rows(equations_of(machine(hexapod), m))
    assert (
        0.7 < left_over(equations, LOAD) * freedom(equations) / len(equations.torque) / 14.0 < 1.6
    )


def as_log(m: Any) -> Log:
    """A log of the arrays of one."""
    own = {k: x for k, x in vars(m).items() if k not in ("rate", "derivative", "smooth")}
    n = len(m.q)
    part, block = np.zeros(n, np.int8), np.zeros(n, np.intp)
    return Log(**own, part=part, block=block, rest_speed=np.full(m.q.shape[1], 1e-3))
