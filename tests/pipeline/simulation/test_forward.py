"""Forward simulation against another integrator, in closed form, and by its energies."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from actuators.chain import Chain
from actuators.elements.element import Friction, Inertia, Ratio
from actuators.elements.heating import Heating
from actuators.errors import LegwattError
from actuators.shaft import DCMotor
from pipeline.logs.log import Recording
from pipeline.machine.machine import MachineModel
from pipeline.simulation.forward import ForwardSimulator, Rollout, ServoInput, servo_input
from pipeline.simulation.machine import read_machine

Array = NDArray[np.float64]
URDF = Path(__file__).parents[1] / "data_files" / "xl330.urdf"
JOINT = "pendulum_joint"
MASS, LEVER, GRAVITY = 0.49, 0.1, 9.81
LINK = MASS * LEVER**2 + 1e-6  # [kg*m^2]
ROTOR, RATIO = 2e-6, 30.0
INERTIA = LINK + ROTOR * RATIO**2
CONSTANT, RESISTANCE = 0.013, 4.0
SUPPLY, GAIN = 7.0, 0.6


def machine(*friction: Friction, **changes: object) -> MachineModel:
    """The pendulum behind a gear of 30, friction at the joint."""
    elements = (*friction, Ratio(name="gear", ratio=RATIO), Inertia(name="rotor", inertia=ROTOR))
    motor = DCMotor("winding", CONSTANT, RESISTANCE)
    model = read_machine(URDF).model
    return model.with_actuator(Chain(JOINT, elements, motor, **changes))


def driven(goal, q=0.0, v=0.0, seconds=1.0):
    time = np.arange(round(seconds * 200) + 1) / 200
    on, supply = np.zeros((time.size, 1), dtype=np.bool_), np.full(time.size, SUPPLY)
    start = np.array([q]), np.array([v])
    return ServoInput(time, goal(time)[:, None], supply, GAIN, on, True, *start)


def free(q: float, seconds: float = 1.0) -> ServoInput:
    drive = driven(np.zeros_like, q, seconds=seconds)
    return replace(drive, off=np.ones_like(drive.off))


def test_another_integrator_gives_the_same_motion():
    viscous = 0.02

    def goal(t: Array) -> Array:
        return np.asarray(0.8 * np.sin(2.0 * t) + 0.3 * np.sin(5.1 * t))

    servo = driven(goal, q=0.3, v=-1.0)

    def rate(t: float, x: Array) -> list[float]:
        asked = float(np.interp(t, servo.time, servo.goal[:, 0]))
        voltage = SUPPLY * np.clip(GAIN * (asked - x[0]), -1.0, 1.0)
        current = (voltage - CONSTANT * RATIO * x[1]) / RESISTANCE
        torque = RATIO * CONSTANT * current - viscous * x[1]
        return [x[1], (torque - MASS * GRAVITY * LEVER * np.sin(x[0])) / INERTIA]

    other = solve_ivp(rate, (0, 1), [0.3, -1.0], t_eval=servo.time, rtol=1e-9, max_step=2e-3)
    own = ForwardSimulator(machine(Friction("f", viscous=viscous))).run(servo)
    assert np.abs(own.position[:, 0] - other.y[0]).max() < 2e-5
    assert np.abs(own.velocity[:, 0] - other.y[1]).max() < 2e-4


def test_load_friction_forward_is_its_inverse():
    """Along a driven motion the chain, asked backward, needs the motor's torque."""
    model = machine(
        Friction("load", load=0.35, coulomb=0.01), Friction("s", excess=0.02, stribeck_speed=0.3)
    )
    servo = driven(lambda t: np.asarray(1.2 * np.sin(3.0 * t)), seconds=2.0)
    run = ForwardSimulator(model).run(servo)
    a = np.gradient(run.velocity[:, 0], run.time)
    load = LINK * a + MASS * GRAVITY * LEVER * np.sin(run.position[:, 0])
    v = run.velocity[:, 0]
    loss = 0.01 + 0.35 * np.abs(load) + 0.02 * np.exp(-((v / 0.3) ** 2))
    needed = (load + np.sign(v) * loss) / RATIO + ROTOR * RATIO * a
    given = CONSTANT * run.current[:, 0]
    # Away from standstill, reversals and changes of the load's sign, where a is not what it seems.
    smooth = np.ones(v.size, dtype=np.bool_)
    for event in (v, load):
        for k in np.flatnonzero(np.diff(np.sign(event)) + (v[1:] == 0.0)):
            smooth[max(0, k - 2) : k + 4] = False
    smooth[:2] = smooth[-2:] = False
    assert smooth.mean() > 0.6
    assert np.abs(needed - given)[smooth].max() < 0.01 * np.abs(given).max()


def energy_of(run: Rollout) -> Array:
    """Of the pendulum at every row, (N,) [J]."""
    kinetic = 0.5 * INERTIA * run.velocity[:, 0] ** 2
    return np.asarray(kinetic - MASS * GRAVITY * LEVER * np.cos(run.position[:, 0]))


def test_a_free_swing_loses_what_friction_takes():
    coulomb = 0.05
    run = ForwardSimulator(machine(Friction("c", coulomb=coulomb))).run(free(1.0, 4.0))
    q, v, energy = run.position[:, 0], run.velocity[:, 0], energy_of(run)
    travel = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(q)))])
    assert np.abs(energy[0] - energy - coulomb * travel).max() < 0.01 * (energy[0] - energy[-1])
    # It comes to rest where gravity no longer overcomes friction, and stays.
    assert not v[-100:].any()
    assert np.ptp(q[-100:]) == 0.0
    assert MASS * GRAVITY * LEVER * abs(np.sin(q[-1])) <= coulomb
    assert np.isnan(run.voltage).all()
    assert not run.current.any()


@pytest.mark.parametrize(("torque", "moves"), [(0.95, False), (1.05, True)])
def test_a_held_joint_breaks_away_at_its_friction(torque, moves):
    share, coulomb, q = 0.3, 0.05, 0.6
    weight = MASS * GRAVITY * LEVER * np.sin(q)
    least = weight * (1 + share) + coulomb  # to lift it [N*m]
    voltage = torque * least / RATIO / CONSTANT * RESISTANCE
    servo = driven(lambda t: np.full_like(t, q + voltage / SUPPLY / GAIN), q=q, seconds=0.2)
    run = ForwardSimulator(machine(Friction("f", coulomb=coulomb, load=share))).run(servo)
    assert (run.position[-1, 0] > q + 1e-4) == moves
    if not moves:
        assert np.ptp(run.position) == 0.0


def test_energy_is_conserved_without_losses_and_a_shorted_winding_brakes():
    swing, simulator = free(1.2), ForwardSimulator(machine())
    assert np.ptp(energy_of(simulator.run(swing))) < 2e-4 * MASS * GRAVITY * LEVER
    short = simulator.run(replace(swing, open_bridge=False))
    energy = energy_of(short)
    assert (np.diff(energy) < 1e-6).all()
    assert energy[-1] < energy[0] - 0.05
    assert np.allclose(short.current, -CONSTANT * RATIO * short.velocity / RESISTANCE)


def test_a_sensor_that_reads_high_and_a_warm_motor():
    """The servo brings its sensor, not the joint, to the goal; a warm motor gives less."""
    servo = driven(lambda t: np.full_like(t, 0.5), q=0.45)
    warm = replace(servo, temperature=np.full((servo.time.size, 1), 45.0))
    stiff, node = Friction("v", viscous=0.05), Heating(sensor_gain=3.0)
    cold = ForwardSimulator(machine(stiff, encoder_offset=0.1)).run(servo)
    hot = ForwardSimulator(machine(stiff, encoder_offset=0.1, heating=node)).run(warm)
    weight = MASS * GRAVITY * LEVER * np.sin(cold.position[-1, 0] - 0.1) / RATIO
    assert cold.current[-1, 0] * CONSTANT == pytest.approx(weight, rel=1e-2)
    assert abs(0.5 - hot.position[-1, 0]) > 1.1 * abs(0.5 - cold.position[-1, 0])


def test_what_cannot_be_simulated_is_refused():
    for model, words in ((read_machine(URDF).model, "no motor"), (machine(backlash=0.01), "loose")):
        with pytest.raises(LegwattError, match=words):
            ForwardSimulator(model)
    names = [f"{JOINT}__{end}" for end in ("position_rad", "voltage_V")]
    table = pd.DataFrame({"time_s": np.arange(20) / 100, **dict.fromkeys(names, 0.0)})
    log = Recording("bare", table, (JOINT,), "voltage")
    with pytest.raises(LegwattError, match="goal positions, a supply voltage and the contr"):
        servo_input(log)
    off = {
        f"{JOINT}__goal_position_rad": 0.0,
        "supply__voltage_V": 5.0,
        f"{JOINT}__torque_off": True,
    }
    log = replace(log, gain=1.0, frame=table.assign(**off))
    with pytest.raises(LegwattError, match="torque_off_bridge"):
        servo_input(log)
