"""A leg on its stand, moved by sines and measured without a filter: logs for tests of naming."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from actuators.loading.build import load_catalog
from pipeline.identification.answer import Identified
from pipeline.identification.residual import residuals
from pipeline.identification.results import Residual
from pipeline.logs.log import TEST, TRAIN, VALIDATION, Log
from pipeline.logs.speeds import near_rest
from pipeline.machine.machine import MachineModel, drivetrains_of
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import load_robot_file
from pipeline.simulation.predict import Simulator
from tests.blind.machines.machine import Machine, sines
from tests.blind.machines.own import run
from tests.blind.machines.plant import Plant

ROOT = Path(__file__).parents[3]
RATE = 200.0
CURRENT, VOLTAGE = 0.004, 0.003  # standard deviations of the noise [A], [V]


def leg_model() -> MachineModel:
    """The leg with a rotor at every joint."""
    robot = load_robot(load_robot_file(ROOT / "urdf" / "leg.toml"))
    return MachineModel(robot, drivetrains_of(load_catalog().chain("rotor"), robot.joints))


def leg_motion(seed: int = 0, duration: float = 16.0) -> Log:
    """Sines of several speeds; efforts are zero until `measured` fills them."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(duration * RATE)) / RATE
    model = leg_model()
    q, v, a = (np.zeros((t.size, 3)) for _ in range(3))
    for j in range(3):
        for f, size in ((0.11, 0.3), (0.31, 0.15), (0.7, 0.06), (1.3, 0.025)):
            w = 2 * np.pi * f * rng.uniform(0.85, 1.15)
            phase = rng.uniform(0, 2 * np.pi)
            q[:, j] += size * np.sin(w * t + phase)
            v[:, j] += size * w * np.cos(w * t + phase)
            a[:, j] -= size * w * w * np.sin(w * t + phase)
    block = (np.arange(t.size) * 40) // t.size
    part = np.array([TRAIN, VALIDATION, TRAIN, TEST], dtype=np.int8)[block % 4]
    rest = np.full(3, 2e-3)
    whole = (slice(0, t.size),)
    noise = np.tile([CURRENT, VOLTAGE], (3, 1))
    return Log(
        name="sines",
        time=t,
        joints=model.joints,
        q=q,
        v=v,
        a=a,
        channels=("current", "voltage"),
        effort=np.zeros((t.size, 3, 2)),
        noise=noise,
        mask=~near_rest(v, rest, whole, RATE, 50.0),
        part=part,
        pieces=whole,
        rest_speed=rest,
    )


def warmed(motion: Log) -> Log:
    """The same motion while the gears warm from 20 to 50 degrees."""
    warm = 20.0 + 30.0 * (1.0 - np.exp(-motion.time / 6.0)) / (1.0 - np.exp(-motion.time[-1] / 6.0))
    return replace(motion, temperature=np.tile(warm[:, None], (1, 3)))


def measured(truth: MachineModel, motion: Log, seed: int = 1) -> Log:
    """The log of a machine on a motion.

    Voltage is predicted from the measured current, so the current comes first.
    """
    rng = np.random.default_rng(seed)
    current = Simulator(motion).predict(truth).effort[..., 0]
    effort = np.zeros_like(motion.effort)
    effort[..., 0] = current + CURRENT * rng.standard_normal(current.shape)
    with_current = replace(motion, effort=effort)
    voltage = Simulator(with_current).predict(truth).effort[..., 1]
    effort[..., 1] = voltage + VOLTAGE * rng.standard_normal(current.shape)
    return replace(motion, effort=effort)


def only(log: Log, channels: tuple[str, ...]) -> Log:
    """The same log with some of its channels."""
    keep = [log.channels.index(c) for c in channels]
    model = leg_model()
    effort = log.effort[..., keep].copy()
    if channels == ("voltage",):
        # Without a current beside it, voltage has the part of the current too.
        bare = replace(log, channels=channels, effort=effort, noise=log.noise[:, keep])
        noise = VOLTAGE * np.random.default_rng(5).standard_normal(effort.shape)
        effort = Simulator(bare).predict(model).effort + noise
    return replace(log, channels=channels, effort=effort, noise=log.noise[:, keep])


def left_by(model: MachineModel, logs: Sequence[Log]) -> tuple[Residual, ...]:
    """What a model leaves."""
    predictions = [Simulator(m).predict(model) for m in logs]
    return residuals(logs, predictions)


def stays(result: Identified, effect: str, joint: str) -> float:
    """Estimate of what stays in every estimate."""
    design = result.answer.fit.design
    number = [t.key for t in design.terms].index((effect, (joint,)))
    return float(result.answer.fit.x[design.columns[number]][0])


def leg_log(seed: int, gain: float = 1.0) -> dict[str, np.ndarray]:
    """Columns of a log of the leg with a rotor, which shares no law with the product.

    Args:
        seed: Of its sensors' noise and its motion.
        gain: Of the second motor's torque constant on that of the files.
    """
    robot, catalog, rng = leg_model().robot, load_catalog(), np.random.default_rng([seed, 0])
    model, n = robot.model.copy(), len(robot.joints)
    rotor = catalog.components["rotor_re40"].parameters
    motor = catalog.components["motor_re40_24v"].parameters
    ratio = catalog.parameter("requirement.ratio").value
    plant = replace(
        Plant.rigid(model, n),
        coulomb=np.full(n, ratio * rotor["coulomb"]),
        viscous=np.full(n, ratio**2 * rotor["viscous"]),
        inertia=np.full(n, ratio**2 * rotor["inertia"]),
    )
    course, reach = sines(rng, n, 8.0, 2e-3), model.upperPositionLimit - model.lowerPositionLimit
    q = 0.5 * (model.lowerPositionLimit + model.upperPositionLimit) + 0.3 * reach * course.q
    course = replace(course, q=q, v=0.3 * reach * course.v, a=0.3 * reach * course.a)
    machine = Machine("leg", "", model, robot.joints, np.ones(n), np.full(n, 0.3))
    per_ampere = ratio * motor["torque_constant"] * np.where(np.arange(n) == 1, gain, 1.0)
    current = run(machine, plant, course).torque / per_ampere
    voltage = motor["resistance"] * current + per_ampere * course.v
    columns, step = {"time_s": course.time}, 2 * np.pi / 2**20
    for j, joint in enumerate(robot.joints):
        columns[f"{joint}__position_rad"] = np.rint(course.q[:, j] / step) * step
        for name, values in (("current_A", current), ("voltage_V", voltage)):
            noise = 0.005 * rng.standard_normal(course.time.size)
            columns[f"{joint}__{name}"] = values[:, j] + noise
    return columns
