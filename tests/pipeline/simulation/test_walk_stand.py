"""Standing, walking, a motion of one's own: sampling, support, and effects in closed form."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
import pinocchio as pin
import pytest

from actuators.energy import Supply, stage_energies
from actuators.errors import LegwattError
from actuators.loading.build import load_catalog
from actuators.loading.parts import PARTS
from pipeline.dynamics.contact_forces import ContactForces
from pipeline.dynamics.joint_demand import JointDemand, MotionDemand, motion_demand
from pipeline.effects.base import effect_named
from pipeline.effects.model_file import assumed, new_model_file
from pipeline.motion.motion import Motion, base_in_world
from pipeline.motion.walking import walking_motion
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import DEFAULT_ROBOT, load_robot_file
from pipeline.simulation.machine import Machine, read_machine
from pipeline.simulation.own_motion import ATTITUDE, PLACE, read_motion
from pipeline.simulation.walk_stand import (
    COST_SAMPLES,
    DRIVER_IDLE,
    LEAST_SAMPLES,
    Walking,
    energy_change,
    leg_energies,
    support_energy,
)
from tests.pipeline.identification import bench_leg as leg

CHAINS = load_catalog().chains()
SAMPLES = 751


def walked(samples: int) -> Walking:
    return read_machine().walking(samples=samples).walk(CHAINS)


def test_the_least_samples_are_enough_and_few_and_more_come_within_a_thousandth():
    """Of eight times finer sampling: every joint's energy within the 0.7 % that the option
    promises, a third of it not; every stage's E(+) and E(-) of the usual samples.
    """
    least, own, fine = (walked(n) for n in (LEAST_SAMPLES, SAMPLES, 8 * (SAMPLES - 1) + 1))
    apart = []
    for name, result in own.results.items():
        finer = stage_energies(fine.results[name])
        for stage, energies in stage_energies(result).items():
            floor = 1e-3 * np.add(*finer[stage])
            for coarse, exact in zip(energies, finer[stage], strict=True):
                assert (np.abs(coarse - exact) <= 1e-3 * np.maximum(exact, floor)).all()
        few, usual, most = (w.supplies[name].supplied_energy for w in (least, own, fine))
        np.testing.assert_allclose(usual, most, rtol=1e-3)
        apart.append(np.abs(few / most - 1.0).max())
    assert 0.0023 < max(apart) < 0.007


LEGS = {"a": ("a1", "a2"), "b": ("b1",)}
JOINTS = ("a1", "a2", "b1")


@pytest.mark.parametrize("recovered", [0.0, 0.5], ids=["dissipated", "half comes back"])
def test_support_is_the_energy_of_joints_whose_foot_stands(recovered):
    """Leg a stands for one second, then leg b for two, in which joint a1 returns 4 J."""
    first, second = [10.0, 5.0, 1.0], [-2.0, 3.0, 20.0]  # [W]
    power = np.array([first, first, second, second])
    drawn = Supply(JOINTS, np.array([0.0, 1.0, 1.0, 3.0]), power, recovered)
    segments, contacts = [], []
    for stance, start, end in (("a", 0.0, 1.0), ("b", 1.0, 3.0)):
        time, still, force = np.array([start, end]), np.zeros((2, 3)), np.zeros((2, 2, 3))
        segments.append(JointDemand(JOINTS, time, still, still, still, still, f"{stance} stands"))
        contacts.append(ContactForces(("a", "b"), (stance,), time, force, force))
    demand = MotionDemand(tuple(segments), tuple(contacts))
    transfer = 1.0 * 1.0 + 3.0 * 2.0 - recovered * 4.0  # [J]
    assert support_energy(demand, drawn, LEGS) == pytest.approx(15.0 * 1.0 + 20.0 * 2.0)
    assert leg_energies(drawn, LEGS)["robot"] == pytest.approx(55.0 + transfer)


def test_the_range_of_drivers_is_that_of_the_parts():
    """What `walk` says beside its watts is what `choose` draws."""
    drivers = pd.read_csv(PARTS / "driver.csv")
    ends = drivers["idle_power_low_W"].min(), drivers["idle_power_high_W"].max()
    assert ends == pytest.approx(DRIVER_IDLE)


JOINT = "rm_joint_2"
Given = tuple[str, str, Mapping[str, float]]
FRICTION: Given = ("coulomb_friction", JOINT, {"torque": 4.0})
SPRING: Given = ("parallel_spring", JOINT, {"stiffness": 40.0, "rest": 0.1})


@pytest.fixture(scope="module")
def machine() -> Machine:
    return read_machine().walking(samples=COST_SAMPLES)


@pytest.fixture
def column(machine: Machine) -> int:
    return machine.robot.joints.index(JOINT)


def with_effect(machine: Machine, edit: Given, found_with: str = "reversible") -> Machine:
    effect, place, values = edit
    own = assumed(effect, (place,), values, "a test")
    file = new_model_file(DEFAULT_ROBOT, found_with).with_edits([own])
    return machine.with_model(file)


def test_coulomb_friction_loses_torque_times_travel_and_helps_to_hold(machine, column):
    chains = [m.chains()["reversible"] for m in (machine, with_effect(machine, FRICTION))]
    result = machine.walk({"x": chains[1]}).results["x"]
    loss = result.losses["coulomb_friction"]
    assert not np.delete(loss, column, axis=1).any()
    travel = np.abs(np.diff(result.joint.position[:, column])).sum()
    energy = np.trapezoid(loss[:, column], result.joint.time)
    assert energy == pytest.approx(4.0 * travel, rel=1e-3)
    before, after = machine.stand(dict(zip("ab", chains, strict=True))).holding.values()
    held = np.abs(after.motor_torque) - np.abs(before.motor_torque)
    assert held[column] < 0.0
    assert not np.delete(held, column).any()


def test_a_payload_weighs_on_the_feet_and_a_spring_adds_to_the_demand(machine, column):
    loaded = with_effect(machine, ("link_mass", "base_link", {"mass": 5.0}))
    plain, heavy, held = (m.stand({}) for m in (machine, loaded, with_effect(machine, SPRING)))
    weight = (heavy.contacts.force_world - plain.contacts.force_world)[0, :, 2].sum()
    assert weight == pytest.approx(5.0 * 9.81, rel=1e-3)
    added = (held.demand.torque - plain.demand.torque)[0]
    assert added[column] == pytest.approx(40.0 * (plain.demand.position[0, column] - 0.1))
    assert not np.delete(added, column).any()


def test_a_found_friction_costs_in_the_actuator_it_was_found_against_and_motors_in_each(machine):
    rubbing = with_effect(machine, FRICTION)
    every = rubbing.own.every.items()
    assert [name for name, chain in every if rubbing.chains()[name] is not chain] == ["reversible"]
    change = energy_change(machine, rubbing)
    assert set(change.dropna().index) == {"ideal", "reversible"}
    assert change.loc["ideal", "cycle_J"] == change.loc["ideal", "cycle_J_after"]
    row = change.loc["reversible"]
    assert row["cycle_J_after"] > row["cycle_J"]
    assert row["standing_W_after"] < row["standing_W"]
    weak = ("torque_constant_error", JOINT, {"relative": -0.2})
    geared = energy_change(machine, with_effect(machine, weak, "rotor")).drop(index="ideal")
    assert (geared["cycle_J_after"] > geared["cycle_J"]).all()


LAST = ("rm_tibia_link",)
FAR = {"x": 0.1, "y": 0.25, "z": -0.4}  # outside of the link's own size


@pytest.mark.parametrize(("place", "inertia"), [(FAR, 0.0), (FAR, 0.004), ({}, 0.004)])
def test_a_payload_is_where_it_is_said_to_be(place, inertia):
    model = leg.leg_model()
    payload = {"mass": 1.5, "inertia": inertia, **place}
    loaded = effect_named("link_mass").apply(model, LAST, payload)
    joint = model.rigid.getJointId(model.carrier(LAST[0]))
    before, found = (m.rigid.inertias[joint] for m in (model, loaded))
    at = np.array([*place.values()] or before.lever)
    expected = (before + pin.Inertia(1.5, at, inertia * np.eye(3))).toDynamicParameters()
    np.testing.assert_allclose(found.toDynamicParameters(), expected, atol=1e-12)


def written(robot: Robot, motion: Motion, *, base: bool = False) -> pd.DataFrame:
    """A motion as a moved with the columns of a file."""
    parts = []
    for segment in motion.segments:
        q = segment.configuration[:, robot.position_index]
        units = ["m" if joint in robot.sliding_joints else "rad" for joint in robot.joints]
        names = [f"{j}__position_{unit}" for j, unit in zip(robot.joints, units, strict=True)]
        part = pd.DataFrame({"time_s": segment.time}).join(pd.DataFrame(q, columns=names))
        for foot in robot.leg_names:
            part[f"{foot}__contact"] = int(foot in segment.stance)
        if base:
            world = base_in_world(segment)
            part[[*PLACE, *ATTITUDE]] = np.hstack([world["position"], world["angles"]])
        parts.append(part if segment is motion.segments[-1] else part[:-1])
    return pd.concat(parts, ignore_index=True)


@pytest.fixture(scope="module")
def moved(hexapod: Robot) -> pd.DataFrame:
    return written(hexapod, walking_motion(hexapod, samples=51))


@pytest.mark.parametrize("base", [False, True], ids=["carried by its feet", "given"])
@pytest.mark.parametrize(
    "gait", [{}, {"yaw_rate": "8 deg/s"}, {"slope_forward": "2 deg", "body_pitch": "3 deg"}]
)
def test_a_gait_written_out_demands_what_the_gait_demands(hexapod, tmp_path, gait, base):
    """Within the error of differentiation, which falls with the fourth power of the step."""
    robot = load_robot(hexapod.spec.with_gait(**gait))
    for samples, least in ((51, 5e-6), (101, 3e-7)):
        motion = walking_motion(robot, samples=samples)
        written(robot, motion, base=base).to_csv(tmp_path / "walk.csv", index=False)
        found = read_motion(tmp_path / "walk.csv", robot)
        pairs = zip(
            motion_demand(robot, motion).segments, motion_demand(robot, found).segments, strict=True
        )
        for own, other in pairs:
            largest = np.abs(own.torque).max()
            np.testing.assert_allclose(other.torque, own.torque, atol=least * largest)
        for part, other_part in zip(motion.segments, found.segments, strict=True):
            assert set(part.stance) == set(other_part.stance)
            np.testing.assert_allclose(other_part.velocity, part.velocity, atol=1e-4)


def test_an_arm_on_a_stand_needs_no_contacts(root):
    robot = load_robot(load_robot_file(root / "urdf" / "leg.toml"))
    time = np.linspace(0.0, 2.0, 201)
    q = 0.2 * np.sin(np.pi * time)
    columns = {"time_s": time} | {f"{joint}__position_rad": q for joint in robot.joints}
    (segment,) = read_motion(pd.DataFrame(columns), robot).segments
    expected = -(np.pi**2) * q  # at the ends, too
    np.testing.assert_allclose(segment.acceleration[:, 0], expected, atol=1e-5)
    assert np.isfinite(motion_demand(robot, Motion((segment,))).segments[0].torque).all()


#: Column, rows and what stands there instead, and the words of the refusal.
WRONG: list[tuple[str, int | slice, object, str]] = [
    ("rf_joint_1__position_rad", 7, "x", "row 9: rf_joint_1__position_rad is not a"),
    ("time_s", 4, 0.0, "row 6: time_s does not increase"),
    ("lm__contact", 9, 0.5, "neither 0 nor 1"),
    ("lf__contact", 9, 0, "the same feet stand for 2 rows; derivatives need 6"),
    ("lm__contact", slice(0, 40), 1, "until t = .* s feet that stand move by .* mm"),
]


def test_what_is_no_motion_is_refused_with_one_line(hexapod, moved, tmp_path):
    angles = [c for c in moved.columns if c.endswith("position_rad")]
    trials = [
        (moved.drop(columns="lm__contact"), "no column lm__contact$"),
        (moved.rename(columns={"lm__contact": "lm__contakt"}), "did you mean 'lm__contakt'"),
        (moved.assign(base__roll_rad=0.0), "no column base__x_m"),
        (moved[:5], "5 rows; derivatives need 6"),
        (moved.assign(**np.degrees(moved[angles])), "deg; .* in degrees they would fit"),
    ]
    for column, rows, value, words in WRONG:
        other = moved.astype({column: object})
        other.loc[rows, column] = value
        trials.append((other, words))
    path = tmp_path / "motion.csv"
    for other, words in trials:
        other.to_csv(path, index=False)
        with pytest.raises(LegwattError, match=words) as refused:
            read_motion(path, hexapod)
        assert str(refused.value).startswith(f"{path}: ")
    path.write_text("time_s;lf_joint_1__position_rad\n0;0\n", encoding="utf-8")
    for source in (Path("none.csv"), path, [1.0, 2.0]):
        with pytest.raises(LegwattError):
            read_motion(source, hexapod)
