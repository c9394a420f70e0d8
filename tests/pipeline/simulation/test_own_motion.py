"""A motion of the user's own: the gait written out as one, a base on a stand, and bad input."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from actuators.errors import LegwattError
from pipeline.dynamics.joint_demand import motion_demand
from pipeline.motion.feet import base_in_world
from pipeline.motion.motion import Motion
from pipeline.motion.walking import walking_motion
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from pipeline.simulation.own_motion import ATTITUDE, PLACE, read_motion


def written(robot: Robot, motion: Motion, *, base: bool = False) -> pd.DataFrame:
    """A motion as a table with the columns of a file."""
    parts = []
    for segment in motion.segments:
        q = segment.configuration[:, robot.position_index]
        units = ["m" if joint in robot.sliding_joints else "rad" for joint in robot.joints]
        names = [f"{j}__position_{unit}" for j, unit in zip(robot.joints, units, strict=True)]
        part = pd.DataFrame({"time_s": segment.time}).join(pd.DataFrame(q, columns=names))
        for leg in robot.leg_names:
            part[f"{leg}__contact"] = int(leg in segment.stance)
        if base:
            world = base_in_world(segment)
            part[[*PLACE, *ATTITUDE]] = np.hstack([world["position"], world["angles"]])
        parts.append(part if segment is motion.segments[-1] else part[:-1])
    return pd.concat(parts, ignore_index=True)


@pytest.fixture(scope="module")
def table(hexapod: Robot) -> pd.DataFrame:
    return written(hexapod, walking_motion(hexapod, samples=51))


@pytest.mark.parametrize("base", [False, True], ids=["carried by its feet", "given"])
@pytest.mark.parametrize(
    "gait", [{}, {"yaw_rate": "8 deg/s"}, {"slope_forward": "2 deg", "body_pitch": "3 deg"}]
)
def test_a_gait_written_out_demands_what_the_gait_demands(
    hexapod: Robot, tmp_path: Path, gait: dict[str, str], base: bool
) -> None:
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


def test_an_arm_on_a_stand_needs_no_contacts(root: Path) -> None:
    robot = load_robot(load_robot_file(root / "urdf" / "leg.toml"))
    time = np.linspace(0.0, 2.0, 201)
    q = 0.2 * np.sin(np.pi * time)
    columns = {f"{joint}__position_rad": q for joint in robot.joints}
    (segment,) = read_motion(pd.DataFrame({"time_s": time, **columns}), robot).segments
    np.testing.assert_allclose(
        segment.acceleration[:, 0], -(np.pi**2) * q, atol=1e-5
    )  # at the ends, too
    (demand,) = motion_demand(robot, Motion((segment,))).segments
    assert np.isfinite(demand.torque).all()


#: Column, rows and what stands there instead, and the words of the refusal.
WRONG: list[tuple[str, int | slice, object, str]] = [
    ("rf_joint_1__position_rad", 7, "x", "row 9: rf_joint_1__position_rad is not a"),
    ("time_s", 4, 0.0, "row 6: time_s does not increase"),
    ("lm__contact", 9, 0.5, "neither 0 nor 1"),
    ("lf__contact", 9, 0, "the same feet stand for 2 rows; derivatives need 6"),
    ("lm__contact", slice(0, 40), 1, "until t = .* s feet that stand move by .* mm"),
]


def test_what_is_no_motion_is_refused_with_one_line(
    hexapod: Robot, table: pd.DataFrame, tmp_path: Path
) -> None:
    angles = [c for c in table.columns if c.endswith("position_rad")]
    trials = [
        (table.drop(columns="lm__contact"), "no column lm__contact$"),
        (table.rename(columns={"lm__contact": "lm__contakt"}), "did you mean 'lm__contakt'"),
        (table.assign(base__roll_rad=0.0), "columns base__roll_rad alone"),
        (table[:5], "5 rows; derivatives need 6"),
        (table.assign(**np.degrees(table[angles])), "deg; .* in degrees they would fit"),
    ]
    for column, rows, value, words in WRONG:
        other = table.astype({column: object})
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
            read_motion(source, hexapod)  # type: ignore[arg-type]
