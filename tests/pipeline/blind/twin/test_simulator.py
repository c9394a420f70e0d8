from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from pipeline.blind.twin.controller import Controller, Plan
from pipeline.blind.twin.errors import TwinError
from pipeline.blind.twin.laws.bristle import BristleLaw
from pipeline.blind.twin.laws.extra import QuadraticDrag, Ripple, Spring, StickingSpot
from pipeline.blind.twin.laws.ground import Ground
from pipeline.blind.twin.machine import Machine
from pipeline.blind.twin.plant import Heating, Plant, nominal_plant
from pipeline.blind.twin.simulator import Simulation
from pipeline.blind.twin.trajectories import leg_plan, multisine
from pipeline.blind.twin.walking import standing_plan
from pipeline.robot.robot import Robot

FREE = Controller(proportional=0.0, derivative=0.0)


def held(position: np.ndarray, duration: float, base: np.ndarray | None = None) -> Plan:
    n = round(duration / 1e-3) + 1
    target = np.repeat(np.asarray(position, dtype=float)[None], n, axis=0)
    zero = np.zeros_like(target)
    return Plan(1e-3, target, zero, zero.copy(), 0.0, base)


def swinging(robot: Robot, seconds: float = 1.5) -> Plan:
    rng = np.random.default_rng(4)
    path = multisine(rng, np.array([0.0, 0.2, 0.1]), np.full(3, 0.4), seconds, 1.0, 1e-3)
    return Plan(1e-3, path, np.gradient(path, 1e-3, axis=0), np.zeros_like(path), 0.0)


def everything(plant: Plant) -> Plant:
    gear = replace(
        plant.gear,
        coulomb=np.array([0.5, 1.0, 0.3]),
        excess=np.array([0.0, 0.8, 0.2]),
        viscous=np.array([0.5, 2.0, 0.0]),
        load_driving=np.array([0.0, 0.1, 0.2]),
        load_driven=np.array([0.0, 0.3, 0.1]),
        asymmetry=np.array([0.2, 0.0, -0.1]),
    )
    coupling = np.eye(3)
    coupling[1, 0], coupling[2, 1] = 0.3, -0.5
    return replace(
        plant,
        gear=gear,
        coupling=coupling,
        stiffness=np.array([np.inf, 6e3, 1e4]),
        damping=np.array([0.0, 3.0, 5.0]),
        gap=np.array([0.0, 0.0, 4e-3]),
        extra=(Spring(1, 0.1, 8.0, 5.0), Ripple(0, 0.4, 100.0, 0.3), QuadraticDrag(2, 1.0)),
        sticking=(StickingSpot(1, 0.2, 0.05, 1.0),),
        heating=Heating(np.full(3, 40.0), np.full(3, 6.6), 1.0),
        saturation_current=np.array([np.inf, 8.0, np.inf]),
    )


def test_energy_is_conserved_with_everything_switched_on(leg: Robot, machine: Machine) -> None:
    plant = everything(nominal_plant(leg, machine))
    errors = [
        abs(Simulation(plant, Controller(), swinging(leg), substeps=n).run().imbalance)
        for n in (2, 4)
    ]
    assert errors[0] < 2e-3
    assert errors[1] < errors[0]


def test_plain_leg_conserves_energy(leg: Robot, machine: Machine) -> None:
    record = Simulation(nominal_plant(leg, machine), Controller(), swinging(leg), substeps=2).run()
    assert abs(record.imbalance) < 1e-5
    assert record.work["rotor_friction"] > 1.0


def test_shin_swings_with_a_pendulums_period(leg: Robot, machine: Machine) -> None:
    plant = nominal_plant(leg, machine)
    shin = plant.model.inertias[3]
    mass, lever = shin.mass, -float(shin.lever[2])
    inertia = float(shin.inertia[0, 0]) + mass * lever**2
    plant = replace(
        plant,
        rotor=BristleLaw.none(3),
        rotor_inertia=np.array([1e7, 1e7, 0.0]),  # only the shin moves
    )
    angle = 0.1
    record = Simulation(plant, FREE, held(np.array([0, 0, angle]), 4.0), substeps=2).run()
    q = record.position[:, 2]
    down = np.flatnonzero((q[:-1] > 0) & (q[1:] <= 0))
    at = (down + q[down] / (q[down] - q[down + 1])) * record.dt
    expected = 2 * np.pi * np.sqrt(inertia / (mass * 9.81 * lever)) * (1 + angle**2 / 16)
    np.testing.assert_allclose(np.diff(at), expected, rtol=1e-4)
    assert q.max() == pytest.approx(angle, rel=2e-3)


def test_body_in_the_air_falls_freely(hexapod: Robot, machine: Machine) -> None:
    base = np.array([0.0, 0.0, 5.0])
    plan = held(standing_plan(hexapod).position[0], 0.3, base)
    plant = nominal_plant(hexapod, machine)
    record = Simulation(plant, Controller(), plan, substeps=2, ground=Ground()).run()
    assert record.base is not None
    t = np.arange(record.base.shape[0]) * record.dt
    # The legs keep their pose in free fall; semi-implicit steps run ahead by g t dt / 2.
    fallen = 5.0 - 0.5 * 9.81 * t**2
    np.testing.assert_allclose(record.base[:, 2], fallen - 0.5 * 9.81 * t * record.dt, atol=1e-5)


def test_elastic_joint_sags_by_load_over_stiffness(leg: Robot, machine: Machine) -> None:
    stiffness = 2000.0
    plant = replace(
        nominal_plant(leg, machine),
        stiffness=np.array([np.inf, stiffness, np.inf]),
        damping=np.array([0.0, 40.0, 0.0]),
    )
    record = Simulation(plant, Controller(), held(np.zeros(3), 2.0), substeps=4).run()
    gravity = pin.rnea(leg.model, leg.model.createData(), record.position[-1], *np.zeros((2, 3)))
    twist = record.motor[-1] - record.position[-1]
    assert twist[1] == pytest.approx(gravity[1] / stiffness, rel=1e-3)
    assert twist[[0, 2]] == pytest.approx([0, 0], abs=1e-12)
    np.testing.assert_allclose(record.torque[-1], gravity, atol=1e-3)


def test_backlash_lets_the_link_lag_by_half_its_width(leg: Robot, machine: Machine) -> None:
    width = 0.02
    plant = replace(
        nominal_plant(leg, machine),
        stiffness=np.array([np.inf, np.inf, 1e5]),
        damping=np.array([0.0, 0.0, 20.0]),
        gap=np.array([0.0, 0.0, width]),
    )
    for angle, side in ((0.6, 1.0), (-0.6, -1.0)):
        plan = held(np.array([0.0, 0.0, angle]), 1.0)
        record = Simulation(plant, Controller(), plan, substeps=8).run()
        # The shin hangs down, so that it rests on the flank below it.
        twist = (record.motor - record.position)[-200:, 2].mean()
        assert twist == pytest.approx(side * width / 2, rel=0.02)


def test_forces_of_a_sample_explain_its_acceleration(leg: Robot, machine: Machine) -> None:
    """Inverse dynamics by Pinocchio's RNEA of the simulated positions gives the currents back."""
    record = Simulation(
        nominal_plant(leg, machine),
        Controller(),
        leg_plan(leg, np.random.default_rng(1)),
        substeps=2,
    ).run()
    q = record.position[:16000]
    acceleration = (q[2:] - 2 * q[1:-1] + q[:-2]) / record.dt**2
    velocity = (q[1:-1] - q[:-2]) / record.dt
    data = leg.model.createData()
    rows = np.flatnonzero(np.abs(velocity).min(axis=1) > 0.2)[::7]  # bristles fully bent
    k = machine.ratio * machine.torque_constant
    worst = 0.0
    for i in rows:
        link = pin.rnea(leg.model, data, q[i + 1], velocity[i], acceleration[i])
        friction = machine.ratio * machine.rotor_coulomb * np.sign(velocity[i])
        friction = friction + machine.ratio**2 * machine.rotor_viscous * velocity[i]
        motor = link + machine.reflected_inertia * acceleration[i] + friction
        worst = max(worst, float(np.abs(motor - k * record.current[i + 1]).max()))
    assert rows.size > 500
    assert worst < 5e-3


def test_voltage_stays_inside_the_supply(leg: Robot, machine: Machine) -> None:
    plan = leg_plan(leg, np.random.default_rng(2), speed=1.6, sections=("fast",))
    record = Simulation(nominal_plant(leg, machine), Controller(), plan, substeps=2).run()
    assert np.abs(record.voltage).max() <= machine.supply * (1 + 1e-12)


def test_current_loop_gives_way_when_the_supply_is_low(leg: Robot, machine: Machine) -> None:
    weak = replace(machine, supply=8.0)
    plan = leg_plan(leg, np.random.default_rng(2), sections=("fast",))
    record = Simulation(nominal_plant(leg, weak), Controller(), plan, substeps=2).run()
    assert np.abs(record.voltage).max() == pytest.approx(8.0)


def test_windings_warm_towards_their_rise(leg: Robot, machine: Machine) -> None:
    plant = replace(
        nominal_plant(leg, machine),
        heating=Heating(np.array([30.0, 0.0, 0.0]), np.zeros(3), 0.5),
    )
    record = Simulation(plant, Controller(), held(np.zeros(3), 1.0), substeps=2).run()
    assert record.temperature_rise[-1, 0] == pytest.approx(30 * (1 - np.exp(-2.0)), rel=2e-3)
    assert not record.temperature_rise[:, 1:].any()


def test_standing_robot_carries_its_weight_as_published(hexapod: Robot, machine: Machine) -> None:
    plant = nominal_plant(hexapod, machine)
    record = Simulation(
        plant, Controller(), standing_plan(hexapod), substeps=2, ground=Ground()
    ).run()
    assert record.foot_force is not None
    force = record.foot_force[-1]
    weight = hexapod.spec.parameters["total_mass"] * 9.81
    np.testing.assert_allclose(force.sum(axis=0), [0, 0, weight], atol=0.01)
    load = dict(zip(hexapod.leg_names, force[:, 2], strict=True))
    # Section II.C: 192.6 N on the middle right foot; the body sinks and rolls a little.
    assert load["rm"] == pytest.approx(192.6, rel=0.01)
    assert load["lf"] == pytest.approx(load["lr"], rel=1e-3)
    assert load["lm"] == load["rf"] == load["rr"] == 0.0


def test_base_and_ground_must_match(leg: Robot, hexapod: Robot, machine: Machine) -> None:
    plan = held(np.zeros(3), 0.01)
    with pytest.raises(TwinError, match="floating base needs ground"):
        Simulation(nominal_plant(leg, machine), FREE, plan, substeps=1, ground=Ground())
    with pytest.raises(TwinError, match="floating base needs ground"):
        Simulation(nominal_plant(hexapod, machine), FREE, plan, substeps=1)


def test_a_machine_that_runs_away_says_so(leg: Robot, machine: Machine) -> None:
    wild = Controller(proportional=-1e6, derivative=0.0)
    plant = replace(nominal_plant(leg, replace(machine, supply=1e4, peak_current=1e4)))
    with pytest.raises(TwinError, match=r"joint 'rm_joint_\d' ran away at t ="):
        Simulation(plant, wild, swinging(leg), substeps=2).run()
