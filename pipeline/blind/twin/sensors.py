"""From what happened to what was measured: sampling, quantisation, noise, bias, delay."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from pipeline.blind.twin.errors import TwinError
from pipeline.blind.twin.simulator import Record
from pipeline.robot.robot import Robot

Array = NDArray[np.float64]


@dataclass(frozen=True)
class NoiseLevel:
    """Standard deviations of one sample, and the joint encoder's resolution.

    Attributes:
        current: [A].
        voltage: [V].
        torque: [N*m].
        force: Of a foot sensor, per axis [N].
        attitude: [rad].
        encoder_bits: Of the joint's absolute encoder.
    """

    current: float
    voltage: float
    torque: float
    force: float
    attitude: float
    encoder_bits: int

    @property
    def encoder_step(self) -> float:
        """[rad]."""
        return 2 * np.pi / 2**self.encoder_bits


NOISE_LEVELS = {
    "low": NoiseLevel(0.005, 0.005, 0.05, 0.3, 3e-4, 20),
    "high": NoiseLevel(0.020, 0.020, 0.20, 1.0, 1e-3, 18),
}
#: What no sensor is: for telling what a log could show at best.
NO_NOISE = NoiseLevel(0.0, 0.0, 0.0, 0.0, 0.0, 48)


@dataclass(frozen=True)
class Sensors:
    """What the log's columns are and how they err.

    Attributes:
        rate: Of the log [Hz].
        noise: Its level.
        position_offset: Reads high by this, shape (J,) [rad].
        current_offset: Reads high by this, shape (J,) [A].
        delay: Of the effort channels behind the positions [s].
        efforts: Which of ``"current"``, ``"voltage"``, ``"torque"`` are logged.
        motor_encoder: Whether the motor's angle is logged beside the joint's.
        foot_force: ``"full"``, ``"normal"`` or ``"none"``.
    """

    rate: float
    noise: NoiseLevel
    position_offset: Array
    current_offset: Array
    delay: float = 0.0
    efforts: tuple[str, ...] = ("current", "voltage")
    motor_encoder: bool = False
    foot_force: str = "full"


def measure(
    robot: Robot,
    record: Record,
    sensors: Sensors,
    log_from: float,
    motor_step: float,
    rng: np.random.Generator,
) -> dict[str, Array]:
    """The log.

    Efforts and forces are averaged over one period of the log, centred on the sample, as an
    anti-aliasing filter without phase does; encoders are read at the sample.

    Args:
        robot: For names.
        record: What happened.
        sensors: How it is measured.
        log_from: Start of the log [s]; its own time starts at zero.
        motor_step: Resolution of the motor's encoder at the joint [rad].
        rng: For noise.

    Returns:
        Columns of the measured log, each (N,).

    Raises:
        TwinError: The rate does not divide the simulation's, or an unknown channel.
    """
    every = round(1 / (sensors.rate * record.dt))
    if every < 1 or abs(every * sensors.rate * record.dt - 1) > 1e-6:
        raise TwinError(
            f"a log rate of {sensors.rate:g} Hz does not divide the simulation's "
            f"{1 / record.dt:g} Hz; choose one that does"
        )
    behind = round(sensors.delay / record.dt)
    first = max(round(log_from / record.dt), every + behind)
    last = record.position.shape[0] - every
    at = np.arange(first, last, every)
    noise = sensors.noise
    out: dict[str, Array] = {"time_s": np.arange(at.size) / sensors.rate}

    offset = np.asarray(sensors.position_offset)
    position = _quantised(record.position[at] + offset, noise.encoder_step)
    per_joint: dict[str, Array] = {"position_rad": position}
    if sensors.motor_encoder:
        per_joint["motor_position_rad"] = _quantised(record.motor[at] + offset, motor_step)
    channels: dict[str, tuple[str, Array, Array | float, float]] = {
        "current": ("current_A", record.current, sensors.current_offset, noise.current),
        "voltage": ("voltage_V", record.voltage, 0.0, noise.voltage),
        "torque": ("torque_Nm", record.torque, 0.0, noise.torque),
    }
    for effort in sensors.efforts:
        if effort not in channels:
            raise TwinError(f"effort channel '{effort}' is not known: {', '.join(channels)}")
        column, truth, bias, sigma = channels[effort]
        exact = _averaged(truth, at - behind, every)
        per_joint[column] = exact + bias + sigma * rng.standard_normal(exact.shape)
    for j, joint in enumerate(robot.joints):
        for column, values in per_joint.items():
            out[f"{joint}__{column}"] = values[:, j]
    if record.base is not None and record.foot_force is not None:
        _measure_body(out, robot, record, sensors, at, every, rng)
    return out


def _measure_body(
    out: dict[str, Array],
    robot: Robot,
    record: Record,
    sensors: Sensors,
    at: NDArray[np.intp],
    every: int,
    rng: np.random.Generator,
) -> None:
    assert record.base is not None
    assert record.foot_force is not None
    axes = {"full": (0, 1, 2), "normal": (2,), "none": ()}
    if sensors.foot_force not in axes:
        raise TwinError(f"foot sensor '{sensors.foot_force}' is not known: {', '.join(axes)}")
    force = _averaged(record.foot_force, at, every)
    for i, leg in enumerate(robot.spec.legs):
        for axis in axes[sensors.foot_force]:
            sensed = force[:, i, axis] + sensors.noise.force * rng.standard_normal(at.size)
            out[f"{leg.foot}__force_{'xyz'[axis]}_N"] = sensed
    # Towards the ground: the inertial sensor was tared on it and does not know of a slope.
    angles: Array = np.array([attitude(record.base[k]) for k in at])
    angles = angles + sensors.noise.attitude * rng.standard_normal(angles.shape)
    out["base__roll_rad"], out["base__pitch_rad"] = angles[:, 0], angles[:, 1]


def attitude(base: Array) -> Array:
    """Roll and pitch of a base towards the ground, shape (2,) [rad]."""
    x, y, z, w = base[3:]
    result: Array = pin.rpy.matrixToRpy(pin.Quaternion(w, x, y, z).matrix())[:2]
    return result


def _averaged(values: Array, at: NDArray[np.intp], every: int) -> Array:
    """Mean over `every` steps around each sample; ends weigh half where that number is even."""
    if every == 1:
        return np.asarray(values[at])
    half = every // 2
    weight = np.ones(2 * half + 1)
    if every % 2 == 0:
        weight[[0, -1]] = 0.5
    total = np.zeros((at.size, *values.shape[1:]))
    for w, shift in zip(weight, range(-half, half + 1), strict=True):
        total += float(w) * values[at + shift]
    return total / float(weight.sum())


def _quantised(values: Array, step: float) -> Array:
    result: Array = np.rint(values / step) * step
    return result
