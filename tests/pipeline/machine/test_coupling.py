"""A motor that also turns with another joint, and one that leads its joint by play.

With motor angles theta = C q the power that the motors give is the power that the joints take,
for any motion: tau^T dq = tau_m^T C dq, so tau = C^T tau_m. Both are held here without the code's
own formulas: speeds from the definition of the ratio, torques from the balance of power.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from actuators.chain import Chain
from actuators.elements.element import Friction, Inertia, Ratio
from actuators.shaft import DCMotor, ShaftSeries
from pipeline.logs.log import Log
from pipeline.machine.drivetrains import Drivetrains
from pipeline.machine.machine import MachineModel
from pipeline.simulation.predict import Simulator
from tests.pipeline.identification import bench_leg as leg

RATIO, CONSTANT, TURNS = 50.0, 0.04, 0.3
#: theta = C q at the joint side: joint 3's motor turns with joint 2, too.
C = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, TURNS, 1.0]])
LOSSLESS = Chain(
    "lossless",
    (Ratio("gear", ratio=RATIO),),
    DCMotor("motor", torque_constant=CONSTANT, resistance=0.5),
    {"m": "gear"},
)


def actuators() -> tuple[Chain, ...]:
    names = leg.leg_model().joints
    plain = tuple(Chain(name, elements=LOSSLESS.elements, motor=LOSSLESS.motor) for name in names)
    return (*plain[:2], replace(plain[2], coupled_to=names[1], coupling=TURNS))


@pytest.fixture(scope="module")
def motion() -> Log:
    return leg.leg_motion(duration=4.0)


@pytest.fixture(scope="module")
def machine() -> MachineModel:
    return replace(leg.leg_model(), drivetrains=Drivetrains("coupled", actuators()))


def lossy() -> tuple[Chain, ...]:
    """Friction of every kind at the joint side, between frame and motor, and a rotor."""
    rubbing = Friction("friction", coulomb=2.0, load=0.1, viscous=1.5)
    rotor = Inertia("rotor", inertia=2e-4)
    return tuple(replace(a, elements=(rubbing, *a.elements, rotor)) for a in actuators())


def sealed() -> tuple[Chain, ...]:
    """And friction at joint 3's own side, which does not turn with the coupled motor."""
    *others, third = lossy()
    return (*others, third.with_output(Friction("seal", coulomb=0.2, viscous=0.3)))


def test_walking_with_a_coupling_and_losses_every_watt_is_accounted_for(
    motion: Log,
) -> None:
    torque = np.random.default_rng(1).normal(size=motion.q.shape) * 20.0
    joint = ShaftSeries.at_joint(motion.joints, motion.time, motion.q, motion.v, motion.a, torque)
    result = Drivetrains("lossy", sealed()).inverse(joint)
    seal = 0.2 * np.abs(joint.velocity[:, 2]) + 0.3 * joint.velocity[:, 2] ** 2
    np.testing.assert_allclose(result.losses["seal"][:, 2], seal)
    assert not result.losses["seal"][:, :2].any()
    lost = sum(x.sum(axis=1) for x in (*result.losses.values(), *result.stored.values()))
    taken = joint.power.sum(axis=1)
    drawn = result.electrical_power.sum(axis=1)
    np.testing.assert_allclose(drawn, taken + lost, atol=1e-9 * np.abs(drawn).max())


def test_walking_and_prediction_ask_the_same_of_coupled_motors(
    motion: Log, machine: MachineModel
) -> None:
    model = replace(machine, drivetrains=Drivetrains("sealed", sealed()))
    predicted = Simulator(motion).predict(model)
    walked = model.drivetrains.inverse(
        ShaftSeries.at_joint(
            motion.joints, motion.time, motion.q, motion.v, motion.a, predicted.torque
        )
    )
    least = np.minimum(np.abs(motion.v @ C.T), np.abs(motion.v))
    fast = (least > 20.0 * motion.rest_speed).all(axis=1)  # no sign in doubt
    assert fast.sum() > 100
    np.testing.assert_allclose(
        RATIO * walked.motor.torque[fast], predicted.motor_torque[fast], rtol=1e-12, atol=1e-9
    )


def test_standing_with_a_coupling_the_friction_of_a_motor_is_its_own() -> None:
    """What a joint's friction holds, its motor need not; the other joint feels the whole load."""
    torque = np.array([3.0, -7.0, 5.0])
    held = Drivetrains("lossy", lossy()).holding(torque)
    load = np.linalg.solve(C.T, torque)
    for k in range(3):
        friction = 2.0 + 0.1 * abs(load[k])
        ends = (load[k] - friction) / RATIO, (load[k] + friction) / RATIO
        np.testing.assert_allclose((held.low[k], held.high[k]), ends, atol=1e-12)
    assert held.motor_torque[0] == pytest.approx((3.0 - 2.3) / RATIO)


def test_play_is_odd_nothing_without_load_and_ends_at_its_flanks() -> None:
    width, stiffness, crossing = 0.01, 1e3, 0.2
    joint = Chain("a", compliance=1.0 / stiffness, backlash=width, crossing=crossing)
    lag = joint.deflection(np.array([-5.0, -0.05, 0.0, 0.05, 5.0]))
    np.testing.assert_allclose(lag, -lag[::-1], atol=1e-12)
    # On a flank: half the width and what the flank gives.
    assert lag[-1] == pytest.approx(0.5 * width + 5.0 / stiffness, rel=1e-6)
    # Between the flanks the slope is that of width / (2 crossing) beside the stiffness.
    assert lag[3] == pytest.approx(0.05 * (0.5 * width / crossing + 1.0 / stiffness), rel=0.03)
