"""Joint demand against bare inverse dynamics and against the loop one would write first."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin

from pipeline.dynamics.force_rules import LEAST_TANGENTIAL, LEAST_TORQUE, GroundForces
from pipeline.dynamics.joint_demand import MotionDemand, motion_demand
from pipeline.motion.motion import Motion, Segment
from pipeline.robot.inverse.inverse_kinematics import solve_positions, solve_rates
from pipeline.robot.inverse.start_posture import neutral_postures
from pipeline.robot.robot import Robot
from tests.bench_timing import Call, ratio, spread, timed

#: Aims of the project: (most, least).
DEMAND_OVER_RNEA = 2.2
LOOP_OVER_DEMAND = 7.0


def bare_rnea(robot: Robot, motion: Motion) -> Call:
    """Pinocchio's batch alone, on the same samples."""
    pool = pin.ModelPool(robot.model, 1)
    inputs = [(s.configuration.T, s.velocity.T, s.acceleration.T) for s in motion.segments]

    def call() -> None:
        for q, v, a in inputs:
            pin.rneaInParallel(1, pool, q, v, a)

    return call


def user_loop(
    robot: Robot, motion: Motion, *, torques_only: bool
) -> Callable[[], list[np.ndarray]]:
    """What one would write first: rnea, frame Jacobians and lstsq, sample by sample.

    With feet on one plane least squares over all forces is least squares over the tangential ones
    and over the normal ones. The batch returns joint torques, foot forces and foot points of all
    legs; the loop returns the same, or, to be strict, does the least that gives torques.
    """
    model, data = robot.model, robot.model.createData()
    frames = [model.getFrameId(leg.foot) for leg in robot.spec.legs]
    world = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED

    def call() -> list[np.ndarray]:
        torques, forces, points = [], [], []
        for segment in motion.segments:
            stance = [robot.leg_names.index(leg) for leg in segment.stance]
            for q, v, a in zip(
                segment.configuration, segment.velocity, segment.acceleration, strict=True
            ):
                tau = pin.rnea(model, data, q, v, a)
                pin.computeJointJacobians(model, data, q)
                pin.updateFramePlacements(model, data)
                jacobian = np.vstack(
                    [pin.getFrameJacobian(model, data, frames[i], world)[:3] for i in stance]
                )
                force, *_ = np.linalg.lstsq(jacobian[:, :6].T, tau[:6], rcond=None)
                torques.append((tau - jacobian.T @ force)[robot.velocity_index])
                if not torques_only:
                    forces.append(np.zeros((len(frames), 3)))
                    forces[-1][stance] = force.reshape(-1, 3)
                    points.append(np.array([data.oMf[i].translation for i in frames]) - q[:3])
        return [np.array(torques), np.array(forces), np.array(points)]

    return call


def check_same(loop: list[np.ndarray], demand: MotionDemand) -> None:
    """Both ways give the same numbers, or the comparison means nothing."""
    contacts = [part for part in demand.contacts if part is not None]
    ours = (
        np.concatenate([part.torque for part in demand.segments]),
        np.concatenate([part.force_world for part in contacts]),
        np.concatenate([part.position for part in contacts]),
    )
    for theirs, own in zip(loop, ours, strict=True):
        np.testing.assert_allclose(theirs, own, atol=1e-8)


def support(robot: Robot, samples: int) -> Motion:
    """The body glides over all feet: more than three stand, and the normal forces are open."""
    p = robot.spec.parameters
    phase = np.linspace(0.0, 1.0, samples)
    time = p["gait_period"] * phase
    feet = np.repeat(np.array([leg.neutral_foot for leg in robot.spec.legs])[None], samples, axis=0)
    rate = np.zeros_like(feet)
    feet[..., 0] += (p["foot_stroke"] * (0.5 - phase))[:, None]
    rate[..., 0] = -p["foot_stroke"] / p["gait_period"]
    q = solve_positions(robot.chains, feet, neutral_postures(robot), time)
    q_dot, q_ddot = solve_rates(robot.chains, q, rate, np.zeros_like(rate), time)
    along = -rate[:, 0]
    segment = Segment(
        "support of all",
        time,
        robot.configuration(robot.joint_positions(q), along * time[:, None]),
        robot.tangent(robot.joint_rates(q_dot), along),
        robot.tangent(robot.joint_rates(q_ddot)),
        robot.leg_names,
    )
    return Motion((segment,))


def demand_ratios(name: str, robot: Robot, motion: Motion) -> None:
    """Batch demand against bare RNEA and the user's loop; other rules against the demand."""
    check_same(user_loop(robot, motion, torques_only=False)(), motion_demand(robot, motion))
    rules = {
        "friction 0.6": GroundForces(LEAST_TANGENTIAL, 0.6),
        "least_torque": GroundForces(LEAST_TORQUE),
    }
    calls: dict[str, Call] = {
        "rnea": bare_rnea(robot, motion),
        "demand": lambda: motion_demand(robot, motion),
        "loop": user_loop(robot, motion, torques_only=True),
        "full loop": user_loop(robot, motion, torques_only=False),
    }
    for rule, forces in rules.items():
        calls[rule] = lambda forces=forces: motion_demand(  # type: ignore[misc]
            robot, motion, forces=forces
        )
    seconds = timed(calls)
    us = {key: [1e6 * s / motion.samples for s in values] for key, values in seconds.items()}
    print(f"{name}, free-flyer, {motion.samples} samples, us per sample: median (range)")
    print(f"  bare rneaInParallel                  {spread(us['rnea'])}")
    print(f"  batch demand (contacts and RNEA)     {spread(us['demand'])}")
    print(f"  Python loop, torques only            {spread(us['loop'])}")
    print(f"  the same with foot forces and points {spread(us['full loop'])}")
    over_rnea = ratio(us["demand"], us["rnea"])
    over_demand = ratio(us["loop"], us["demand"])
    like = ratio(us["full loop"], us["demand"])
    print(f"  batch demand / bare rnea   {spread(over_rnea)}   aim: below {DEMAND_OVER_RNEA}")
    print(f"  torque loop / batch demand {spread(over_demand)}   aim: at least {LOOP_OVER_DEMAND}")
    print(f"  full loop / batch demand   {spread(like)}   the same results")
    for rule in rules:
        print(f"  with {rule:12s} / batch demand {spread(ratio(us[rule], us['demand']))}")
