"""Logs of the leg on its stand, for tests of what reads logs: currents and voltages, one effect."""

from dataclasses import replace

import numpy as np

from actuators.loading.build import load_catalog
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import load_robot_file
from tests.blind.machines.machine import MOTIONS, Machine
from tests.blind.machines.own import FOLDER, run
from tests.blind.machines.plant import Plant

RATE = 500.0  # [Hz]


def leg_logs(seed: int, effects: list[str], count: int = 1) -> dict[str, dict[str, np.ndarray]]:
    """Logs of one machine with the actuator "rotor", each with a motion of its own.

    Args:
        seed: Of its encoders' noise and motions.
        effects: Of ``viscous_friction``, ``rotor_inertia``, ``torque_constant_error``.
        count: How many.
    """
    robot = load_robot(load_robot_file(FOLDER / "leg.toml"))
    n, model = len(robot.joints), robot.model.copy()
    machine = Machine("leg", "", model, robot.joints, np.ones(n), np.full(n, 0.3))
    catalog = load_catalog()
    rotor = catalog.components["rotor_re40"].parameters
    motor = catalog.components["motor_re40_24v"].parameters
    ratio = catalog.parameter("requirement.ratio").value
    more = {name: 1.5 if name in effects else 0.0 for name in ("viscous_friction", "rotor_inertia")}
    gain = np.where(np.arange(n) == 1, 1.2 if "torque_constant_error" in effects else 1.0, 1.0)
    second = np.arange(n) == 1
    plant = replace(
        Plant.rigid(model, n),
        coulomb=np.full(n, ratio * rotor["coulomb"]),
        viscous=ratio**2 * rotor["viscous"] * (1 + 20 * more["viscous_friction"] * second),
        inertia=ratio**2 * rotor["inertia"] * (1 + more["rotor_inertia"] * second),
    )
    out = {}
    low, high = model.lowerPositionLimit, model.upperPositionLimit
    for k in range(count):
        rng = np.random.default_rng([seed, k])
        course = MOTIONS["sines" if k % 2 == 0 else "strokes"](rng, n, 8.0, 1 / RATE)
        reach = 0.3 * (high - low)
        course = replace(
            course, q=0.5 * (low + high) + reach * course.q, v=reach * course.v, a=reach * course.a
        )
        happened = run(machine, plant, course)
        current = happened.torque / (ratio * motor["torque_constant"] * gain)
        voltage = motor["resistance"] * current
        voltage += ratio * motor["torque_constant"] * gain * course.v
        columns = {"time_s": course.time}
        step = 2 * np.pi / 2**20
        for j, joint in enumerate(robot.joints):
            columns[f"{joint}__position_rad"] = np.rint(course.q[:, j] / step) * step
            for name, values in (("current_A", current), ("voltage_V", voltage)):
                noise = 0.005 * rng.standard_normal(course.time.size)
                columns[f"{joint}__{name}"] = values[:, j] + noise
        out[f"log_{k + 1}"] = columns
    return out
