"""The joint demand against the mechanical energy of the robot: power in equals power stored."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from pipeline.dynamics.joint_demand import MotionDemand, motion_demand, segment_demand
from pipeline.motion.motion import Motion, Segment
from pipeline.motion.walking import walking_motion
from pipeline.robot.kinematics import foot_jacobians
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file


@pytest.fixture(scope="module", params=["hexapod.toml", "hexapod_axis90.toml"])
def robot(request: pytest.FixtureRequest, root: Path) -> Robot:
    return load_robot(load_robot_file(root / "urdf" / request.param))


def mechanical_energy(robot: Robot, segment: Segment) -> np.ndarray:
    data = robot.model.createData()
    return np.array(
        [
            pin.computeKineticEnergy(robot.model, data, q, v)
            + pin.computePotentialEnergy(robot.model, data, q)
            for q, v in zip(segment.configuration, segment.velocity, strict=True)
        ]
    )


def test_joint_power_is_rate_of_energy_minus_contact_power(robot: Robot) -> None:
    """sum(tau q_dot) = dE/dt - sum(f . v_foot) at every sample; dE/dt by differences of pin's E."""
    speed = robot.spec.parameters["walking_speed"]
    for segment in walking_motion(robot, samples=1501).segments:
        demand, contacts = segment_demand(robot, segment)
        assert contacts is not None
        energy = mechanical_energy(robot, segment)
        dt = segment.time[1] - segment.time[0]
        rate = (energy[:-4] - 8 * energy[1:-3] + 8 * energy[3:-1] - energy[4:]) / (12 * dt)
        q = robot.leg_positions(segment.configuration)
        _, jacobian = foot_jacobians(robot.chains, q)
        foot = np.einsum("nlij,nlj->nli", jacobian, demand.velocity.reshape(q.shape))
        contact_power = (contacts.force * (foot + [speed, 0, 0])).sum(axis=(1, 2))
        joint_power = (demand.torque * demand.velocity).sum(axis=1)
        scale = np.abs(demand.torque * demand.velocity).max()
        np.testing.assert_allclose(joint_power[2:-2], rate - contact_power[2:-2], atol=1e-6 * scale)


def test_over_a_cycle_the_joints_do_no_net_work(robot: Robot) -> None:
    demand = motion_demand(robot, walking_motion(robot))
    work = sum(
        np.trapezoid(part.torque * part.velocity, part.time, axis=0) for part in demand.segments
    )
    given = sum(
        np.trapezoid(np.abs(part.torque * part.velocity), part.time, axis=0)
        for part in demand.segments
    )
    assert abs(work.sum()) < 1e-5 * given.sum()


@pytest.mark.parametrize("leg", ["lm", "rm"])
def test_each_joint_of_a_middle_leg_gives_back_what_it_takes(
    hexapod: Robot, walk_demand: MotionDemand, leg: str
) -> None:
    """E_out(+) equals E_out(-) (section IV.A.1), here within 1e-5."""
    for joint in range(1, 4):
        column = walk_demand.joints.index(f"{leg}_joint_{joint}")
        forward = reverse = 0.0
        for part in walk_demand.segments:
            power = part.torque[:, column] * part.velocity[:, column]
            forward += float(np.trapezoid(np.maximum(power, 0), part.time))
            reverse += float(np.trapezoid(np.minimum(power, 0), part.time))
        assert forward > 0
        assert abs(forward + reverse) < 1e-5 * forward


def test_demand_agrees_with_a_loop_over_pinocchio(hexapod: Robot, walk: Motion) -> None:
    """Batch RNEA minus the contact term against pin.rnea, frame Jacobians and the same forces."""
    segment = walk.segments[0]
    demand, contacts = segment_demand(hexapod, segment)
    assert contacts is not None
    data = hexapod.model.createData()
    for n in range(0, segment.time.size, 150):
        q, v, a = segment.configuration[n], segment.velocity[n], segment.acceleration[n]
        tau = pin.rnea(hexapod.model, data, q, v, a).copy()
        pin.computeJointJacobians(hexapod.model, data, q)
        pin.updateFramePlacements(hexapod.model, data)
        for i, leg in enumerate(hexapod.spec.legs):
            jacobian = pin.getFrameJacobian(
                hexapod.model,
                data,
                hexapod.model.getFrameId(leg.foot),
                pin.ReferenceFrame.LOCAL_WORLD_ALIGNED,
            )
            tau -= jacobian[:3].T @ contacts.force_world[n, i]
        np.testing.assert_allclose(tau[:6], 0, atol=1e-9)  # the ground supplies the base's wrench
        np.testing.assert_allclose(tau[hexapod.velocity_index], demand.torque[n], atol=1e-9)


def test_quasi_static_is_the_limit_of_slow_walking(hexapod: Robot) -> None:
    """At a hundredth of the speed full inverse dynamics comes down to gravity and contact."""
    slow = load_robot(hexapod.spec.with_parameters({"gait_period": 300.0, "walking_speed": 0.0016}))
    motion = walking_motion(slow, samples=101)
    full = motion_demand(slow, motion)
    static = motion_demand(hexapod, walking_motion(hexapod, samples=101), quasi_static=True)
    for a, b in zip(full.segments, static.segments, strict=True):
        np.testing.assert_allclose(a.torque, b.torque, atol=1e-3)


def test_two_threads_give_the_same_torques(hexapod: Robot, walk: Motion) -> None:
    one, _ = segment_demand(hexapod, walk.segments[0])
    two, _ = segment_demand(hexapod, walk.segments[0], threads=2)
    np.testing.assert_array_equal(one.torque, two.torque)
