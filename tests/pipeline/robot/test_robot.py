"""A loaded robot: columns, a base that is not level, and limits of its joints."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from pipeline.errors import GaitError, OutOfReachError, UrdfError
from pipeline.motion.motion import Motion, Segment
from pipeline.motion.support import stability_margins, standing_posture
from pipeline.motion.walking import walking_motion
from pipeline.robot.inverse.inverse_kinematics import solve_positions, solve_rates
from pipeline.robot.kinematics import foot_positions
from pipeline.robot.leg_chains import leg_chains
from pipeline.robot.robot import Robot


def turned(segment: Segment, rotation: np.ndarray) -> Segment:
    """The same posture with the base turned; every 50th sample."""
    part = slice(None, None, 50)
    q = segment.configuration[part].copy()
    q[:, 3:7] = pin.Quaternion(rotation).coeffs()
    return replace(
        segment,
        time=segment.time[part],
        configuration=q,
        velocity=segment.velocity[part],
        acceleration=segment.acceleration[part],
    )


def test_columns_go_where_pinocchio_has_them(hexapod: Robot) -> None:
    rng = np.random.default_rng(1)
    joints, base = rng.normal(size=(3, 18)), rng.normal(size=(3, 3))
    q, v = hexapod.configuration(joints, base), hexapod.tangent(joints, base)
    for k, name in enumerate(hexapod.joints):
        joint = hexapod.model.joints[hexapod.model.getJointId(name)]
        np.testing.assert_array_equal(q[:, joint.idx_q], joints[:, k])
        np.testing.assert_array_equal(v[:, joint.idx_v], joints[:, k])
    np.testing.assert_array_equal(q[:, :3], base)
    np.testing.assert_array_equal(v[:, :3], base)
    assert not v[:, 3:6].any()
    np.testing.assert_array_equal(hexapod.leg_positions(q), joints.reshape(3, 6, 3))


def test_a_tilt_moves_the_centre_of_mass_over_the_feet(hexapod: Robot, walk: Motion) -> None:
    """Held against the hull's edges from Pinocchio's own foot frames in the world."""
    segment = turned(walk.segments[0], pin.rpy.rpyToMatrix(0.08, -0.05, 0.3))
    margins = stability_margins(hexapod, segment)
    data = hexapod.model.createData()
    for n, q in enumerate(segment.configuration):
        centre = pin.centerOfMass(hexapod.model, data, q)[:2].copy()
        pin.framesForwardKinematics(hexapod.model, data, q)
        feet = np.array(
            [
                data.oMf[hexapod.model.getFrameId(leg.foot)].translation[:2]
                for leg in hexapod.spec.legs
                if leg.name in segment.stance
            ]
        )
        edges = []
        for k in range(3):
            a, b = feet[k], feet[(k + 1) % 3]
            along = (b - a) / np.linalg.norm(b - a)
            normal = np.array([-along[1], along[0]])
            inward = np.sign(normal @ (feet[(k + 2) % 3] - a))
            edges.append(inward * float(normal @ (centre - a)))
        assert margins[n] == pytest.approx(min(edges), abs=1e-12)


@pytest.mark.parametrize("what", ["walking", "standing"])
def test_joints_stay_within_their_limits(hexapod: Robot, what: str) -> None:
    """Both limits count, to a billionth of a radian, and the message names joint and instant."""

    def make(robot: Robot) -> list[Segment]:
        if what == "walking":
            return list(walking_motion(robot, samples=51).segments)
        return [standing_posture(robot)]

    reached = np.concatenate([s.configuration[:, hexapod.position_index] for s in make(hexapod)])
    column = hexapod.joints.index("lr_joint_2")
    place = hexapod.position_index[column]
    for end, sign in (("upperPositionLimit", 1.0), ("lowerPositionLimit", -1.0)):
        extreme = sign * (sign * reached[:, column]).max()
        for slack, good in ((1e-6, True), (0.0, True), (-1e-6, False)):
            model = hexapod.model.copy()
            limits = getattr(model, end).copy()
            limits[place] = extreme + sign * slack
            setattr(model, end, limits)
            robot = replace(hexapod, model=model)
            if good:
                make(robot)
                continue
            with pytest.raises(GaitError, match=f"'lr_joint_2' .* {np.degrees(extreme):.1f} deg"):
                make(robot)


def test_a_foot_hardly_out_of_reach_is_refused_with_leg_and_instant(hexapod: Robot) -> None:
    """Legs stretched along a line, and a target 4 mm further out."""
    stretched = np.zeros((1, 6, 3))
    stretched[:, :, 2] = np.pi / 2  # the tibia in line with the femur
    foot = foot_positions(hexapod.chains, stretched)
    target = foot + [0.0, 0.004, 0.0] * np.array([[[1.0]] * 3 + [[-1.0]] * 3])
    start = hexapod.start_posture
    with pytest.raises(OutOfReachError, match=r"leg 'l\w' at t = 7 s: .* mm beyond") as caught:
        solve_positions(hexapod.chains, target, start, np.array([7.0]))
    (miss,) = re.findall(r"lies ([\d.]+) mm", str(caught.value))
    assert 4.0 <= float(miss) < 40.0


def test_a_stretched_leg_has_no_rates(hexapod: Robot) -> None:
    q = np.tile([0.1, 0.2, 0.3], (2, 6, 1))
    still = np.zeros_like(q)
    time = np.array([0.0, 0.5])
    velocity, acceleration = solve_rates(hexapod.chains, q, still, still, time)
    assert not velocity.any()
    assert not acceleration.any()
    q[1, 4, 2] = np.pi / 2
    with pytest.raises(OutOfReachError, match="leg 'rm' is stretched .* t = 0.5 s"):
        solve_rates(hexapod.chains, q, still, still, time)


LEG = """<robot name="r"><link name="base"/>
<joint name="a" type="{kind}"><parent link="base"/><child link="l1"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint><link name="l1">{mass}</link>
<joint name="b" type="revolute"><parent link="l1"/><child link="l2"/><axis xyz="{axis}"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint><link name="l2">{mass}</link>
<joint name="c" type="revolute"><parent link="l2"/><child link="l3"/><axis xyz="1 0 0"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint><link name="l3">{mass}</link>
<joint name="f" type="fixed"><parent link="l3"/><child link="foot"/></joint><link name="foot"/>
<joint name="g" type="fixed"><parent link="l2"/><child link="knee"/></joint><link name="knee"/>
</robot>"""
MASS = (
    '<inertial><mass value="1"/>'
    '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
)


@pytest.mark.parametrize(
    ("kind", "joints", "foot", "message"),
    [
        ("planar", ("a", "b", "c"), "foot", "'a' is of several coordinates; .* revolute"),
        ("revolute", (), "foot", "names 0 joints; a leg has 1 to 7"),
        ("revolute", ("a", "b", "c"), "knee", "foot 'knee' is not carried by 'c'"),
    ],
)
def test_what_is_no_leg(kind: str, joints: tuple[str, ...], foot: str, message: str) -> None:
    model = pin.buildModelFromXML(LEG.format(kind=kind, mass=MASS, axis="0 1 0"))
    with pytest.raises(UrdfError, match=message):
        leg_chains(model, [("leg", joints, foot)], 0)


def test_axes_are_those_of_the_urdf() -> None:
    model = pin.buildModelFromXML(LEG.format(kind="revolute", mass=MASS, axis="0 0.6 -0.8"))
    chains = leg_chains(model, [("leg", ("a", "b", "c"), "foot")], 0)
    np.testing.assert_allclose(chains.axis[:, 0], [[0, 0, 1], [0, 0.6, -0.8], [1, 0, 0]])
    assert [None if a is None else a[0] for a in chains.along] == [2, None, 0]
    assert chains.turned == (False, False, False)
