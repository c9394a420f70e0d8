"""Foot forces by linear algebra on their definition; rules for them; two feet and a surge."""

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import null_space

import pipeline as lw
from actuators.errors import StanceError
from pipeline.dynamics.contact_forces import (
    LEAST_TANGENTIAL,
    LEAST_TORQUE,
    FeetOnGround,
    GroundForces,
    least_tangential_forces,
    out_of_bounds,
    refuse_falling,
)
from pipeline.dynamics.joint_demand import segment_demand
from pipeline.motion.motion import Segment
from pipeline.motion.walking import standing_posture, walking_motion
from pipeline.robot.robot import Robot, load_robot
from tests.pipeline.robot.walkers import MIXED, walker

TRIPOD = np.array([[0.30, 0.25, -0.31], [-0.24, 0.26, -0.31], [0.02, -0.27, -0.31]])
SIX = np.array([[x, y, -0.3] for x in (-0.27, 0.0, 0.27) for y in (-0.26, 0.26)])
STEPS = SIX + [[0, 0, 0], [0, 0, 0.1], [0.02, 0, -0.1], [0, 0.03, 0], [0, 0, 0.05], [0, 0, 0.07]]
STANCES = {"three": TRIPOD, "four": SIX[:4], "steps": STEPS}


def wrench_of(feet: np.ndarray, force: np.ndarray) -> np.ndarray:
    return np.concatenate([force.sum(axis=0), np.cross(feet, force).sum(axis=0)])


def weight_over(point: object) -> np.ndarray:
    weight = np.array([0.0, 0.0, 400.0])
    return np.concatenate([weight, np.cross(np.asarray(point, dtype=float), weight)])


@pytest.mark.parametrize("feet", STANCES.values(), ids=STANCES)
def test_no_other_distribution_has_less_tangential_force(feet):
    """Held against the definition: all forces that meet the wrench are one of them plus the null
    space of the six equations, and among those a linear least-squares problem has the answer.
    """
    rng = np.random.default_rng(2)
    unit = np.eye(feet.size).reshape(-1, *feet.shape)
    meets = np.array([wrench_of(feet, force) for force in unit]).T  # (6, 3 F)
    other = null_space(meets)
    tangential = np.array([k for k in range(feet.size) if k % 3 < 2])
    for _ in range(20):
        wrench = wrench_of(feet, rng.normal(size=feet.shape) * [5, 5, 10] + [0, 0, 100])
        ours = least_tangential_forces(wrench[None], feet[None])[0]
        one = np.linalg.lstsq(meets, wrench)[0]
        step = np.linalg.lstsq(other[tangential], -one[tangential])[0]
        least = one[tangential] + other[tangential] @ step
        np.testing.assert_allclose(ours[:, :2].ravel(), least, atol=1e-9)
        np.testing.assert_allclose(wrench_of(feet, ours), wrench, atol=1e-9)


@pytest.mark.parametrize("feet", [SIX, STEPS[:5]], ids=["six", "five"])
def test_normals_that_only_push_are_those_of_least_squares(feet):
    """Held against every choice of unloaded feet: of those without a pull, the least sum."""
    rng = np.random.default_rng(4)
    lift = np.vstack([np.ones(len(feet)), feet[:, 1], -feet[:, 0]])
    several, every = 0, range(len(feet))
    choices = [list(c) for k in every for c in combinations(every, k + 1) if k]
    for _ in range(30):
        corner = feet[rng.integers(len(feet))]
        inward = feet.mean(axis=0) - corner
        wrench = weight_over(corner + inward * rng.uniform(0.05, 0.6))
        force = least_tangential_forces(wrench[None], feet[None])[0]
        best = np.inf
        for kept in choices:
            normal = np.linalg.lstsq(lift[:, kept], wrench[2:5])[0]
            met = np.allclose(lift[:, kept] @ normal, wrench[2:5], atol=1e-9)
            if met and normal.min() >= -1e-12:
                best = min(best, float(normal @ normal))
        assert force[:, 2].min() >= 0
        assert force[:, 2] @ force[:, 2] == pytest.approx(best, rel=1e-9)
        np.testing.assert_allclose(wrench_of(feet, force), wrench, atol=1e-7)
        several += int((force[:, 2] == 0).any())
    assert several > 10


def test_a_foot_that_bears_nothing_holds_nothing():
    """The others share its part of the horizontal force, and none needs endless friction."""
    wrench = weight_over([0.26, 0.2, 0.0]) + [20.0, 0.0, 0.0, 0.0, -0.3 * 20.0, 0.0]
    force = least_tangential_forces(wrench[None], SIX[None])[0]
    idle = force[:, 2] == 0
    assert idle.any()
    assert not force[idle].any()


def test_on_a_slope_the_ground_carries_the_weight_with_the_friction_of_its_angle(hexapod):
    robot = load_robot(hexapod.spec.with_gait(slope_forward="12 deg"))
    segment = standing_posture(robot)
    _, contacts = segment_demand(robot, segment)
    weight = hexapod.mass * hexapod.spec.parameters["gravity"]
    np.testing.assert_allclose(contacts.force_world.sum(axis=1), [[0, 0, weight]], atol=1e-9)
    normal, tangential = contacts.normal_force, contacts.friction_needed * contacts.normal_force
    assert normal.sum() == pytest.approx(weight * np.cos(np.radians(12)))
    assert np.nansum(tangential) >= weight * np.sin(np.radians(12)) - 1e-9
    segment_demand(robot, segment, forces=GroundForces(friction_coefficient=0.2127))  # tan 12 deg
    with pytest.raises(StanceError, match=r"slides at t = 0 s .* leg '\w+' .* of 0\.212;"):
        segment_demand(robot, segment, forces=GroundForces(friction_coefficient=0.212))


@pytest.mark.parametrize("force", [[0.0, 0.0, -1e-2], [0.51, 0.0, 1.0]], ids=["pull", "slide"])
def test_a_foot_pulls_or_slides_by_rounding_alone(hexapod, force):
    """One of them by a ten-thousandth of what the others bear, or by next to nothing."""
    segment = standing_posture(hexapod)
    every = np.tile([0.0, 0.0, 100.0], (1, len(segment.stance), 1))
    every[0, 0] = force
    with pytest.raises(StanceError):
        refuse_falling(hexapod, segment, every, 0.5)
    every[0, 0] = [0.0, 0.0, -1e-8]
    refuse_falling(hexapod, segment, every, 0.5)


def internal(feet: np.ndarray) -> np.ndarray:
    """Forces on F feet (F, 3) that add up to no force and no moment, shape (F, 3, D)."""
    unit = np.eye(feet.size).reshape(-1, *feet.shape)
    wrench = np.hstack([unit.sum(axis=1), np.cross(feet, unit).sum(axis=1)])
    return null_space(wrench.T, rcond=1e-9).reshape(*feet.shape, -1)


def swinging(robot: Robot, samples: int = 9) -> Segment:
    """All feet down, joints moving: four feet or six, so that normal forces are open, too."""
    rng = np.random.default_rng(3)
    angle = rng.uniform(-0.05, 0.05, (samples, len(robot.joints)))
    return Segment(
        name="swinging",
        time=np.arange(samples) / 10,
        configuration=robot.configuration(angle, np.zeros((samples, 3))),
        velocity=rng.uniform(-0.2, 0.2, (samples, robot.model.nv)),
        acceleration=rng.uniform(-0.2, 0.2, (samples, robot.model.nv)),
        stance=robot.leg_names,
    )


@pytest.fixture(scope="module", params=["hexapod", "mixed legs"])
def robot(request, hexapod, tmp_path_factory):
    """Six legs of three joints; four legs of two to seven that turn and slide."""
    if request.param == "hexapod":
        return hexapod
    return walker(Path(tmp_path_factory.mktemp("walker")), MIXED, arm=True)


@pytest.mark.parametrize(
    ("rule", "limit"),  # 0.025 binds the mixed legs in the paper's rule, 0.15 both in the other
    [
        (LEAST_TANGENTIAL, None),
        (LEAST_TANGENTIAL, 0.025),
        (LEAST_TORQUE, None),
        (LEAST_TORQUE, 0.15),
    ],
)
def test_no_forces_of_the_same_wrench_within_bounds_have_less(robot, rule, limit):
    """Less of the tangential forces' squares, or of the joint torques'."""
    segment = swinging(robot)  # upright on level ground: the base's axes are the ground's
    (_, start), (demand, contacts) = (
        segment_demand(robot, segment, forces=GroundForces(own, limit))
        for own in (LEAST_TANGENTIAL, rule)
    )
    wrenches = [
        (c.force_world.sum(axis=1), np.cross(c.position, c.force_world).sum(axis=1))
        for c in (contacts, start)
    ]
    np.testing.assert_allclose(*wrenches, atol=1e-7)
    turn = robot.base_rotation(segment.configuration)
    feet = FeetOnGround(robot.chains, robot.leg_positions(segment.configuration), turn)
    loaded = robot.chains.columns[robot.chains.real]

    def squares(force: np.ndarray) -> np.ndarray:
        if rule == LEAST_TANGENTIAL:
            return (force[..., :2] ** 2).sum(axis=(1, 2))
        less = robot.chains.by_joint(feet.torque(force - contacts.force_world))
        return ((demand.torque - less)[:, loaded] ** 2).sum(axis=1)

    least = squares(contacts.force_world)
    assert np.all(least <= squares(start.force_world) * (1 + 1e-9))
    assert not out_of_bounds(contacts.force_world, limit).any()
    basis = np.stack([internal(feet) for feet in contacts.position])
    rng, tried = np.random.default_rng(4), 0
    for _ in range(120):
        step = rng.normal(size=basis.shape[-1]) * 10.0 ** rng.uniform(-3, 2)
        other = contacts.force_world + basis @ step
        inside = ~out_of_bounds(other, limit)
        tried += int(inside.sum())
        assert np.all(squares(other)[inside] >= least[inside] * (1 - 1e-6))
    assert tried > 40


TROT = {
    "gait.phase": "{LF = 0.0, RH = 0.0, RF = 0.5, LH = 0.5}",
    "gait.duty_factor": 0.55,
    "gait.speed": "0.8 m/s",
    "gait.period": "0.7 s",
}


def test_two_feet_meet_all_of_a_wrench_but_the_moment_about_their_line():
    rng = np.random.default_rng(1)
    feet = rng.normal(size=(20, 2, 3))
    wrench = rng.normal(size=(20, 6)) + [0, 0, 50, 0, 0, 0]
    feet[..., 2] = -0.5  # on level ground
    force = least_tangential_forces(wrench, feet)
    assert np.allclose(force.sum(axis=1), wrench[:, :3])
    left = wrench[:, 3:] - np.cross(feet, force).sum(axis=1)
    along = feet[:, 1] - feet[:, 0]
    along /= np.linalg.norm(along, axis=1)[:, None]
    assert np.allclose(left, np.einsum("ni,ni->n", left, along)[:, None] * along, atol=1e-9)
    assert np.abs(left).max() > 0.1


def test_a_surge_makes_the_ground_push_towards_the_hips(root):
    """Impulse over a period is nothing, and the hips' torque falls towards its least."""
    torque = {}
    for surge in (0.0, 1.0):
        changes = TROT | {"gait.least_feet": 2, "gait.surge": surge}
        machine = lw.load(root / "urdf" / "tytan.toml", changes=changes)
        walked = lw.demand(machine, samples=51)
        hips = [k for k, name in enumerate(walked.joints) if name.endswith("joint_2")]
        values = np.concatenate([part.torque[:, hips] for part in walked.segments])
        torque[surge] = float(np.sqrt(np.mean(values**2)))
        motion = walking_motion(machine.robot, samples=51)
        first, last = motion.segments[0], motion.segments[-1]
        gone = last.configuration[-1, 0] - first.configuration[0, 0]
        assert gone == pytest.approx(0.8 * 0.7, rel=1e-9)
        assert last.velocity[-1, 0] == pytest.approx(first.velocity[0, 0], rel=1e-9)
        fastest = max(
            np.abs(np.gradient(s.configuration[:, 0], s.time)).max() for s in motion.segments
        )
        assert (fastest > 0.81) == bool(surge)
    assert torque[1.0] < 0.8 * torque[0.0]
