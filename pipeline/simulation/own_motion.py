"""A motion of the user's own: joint positions over time and which feet stand, as README.md says.

Without a pose the base moves so that standing feet stay where they are, in the sense of least
squares (Kabsch, Acta Cryst. A32, 1976); it begins at the origin as ``[gait]`` tilts it. Velocity
and acceleration are those of a quintic spline through the samples of one contact phase with knots
left out next to its ends ("not a knot"): one-sided where accelerations may jump. Nothing is
smoothed; what noise the positions have, accelerations have many times over.
"""

from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation

from actuators.arrays import Array, Mask
from actuators.errors import LegwattError, closest, one_line
from pipeline.motion.gait import gait_table
from pipeline.motion.motion import Motion, Segment, base_quaternions, level_ground, one_sign
from pipeline.robot.kinematics import foot_positions, refuse_beyond_limits
from pipeline.robot.robot import Robot

PLACE: Final = ("base__x_m", "base__y_m", "base__z_m")
ATTITUDE: Final = ("base__roll_rad", "base__pitch_rad", "base__yaw_rad")
#: Degree of the spline, and rows of a contact phase that it needs.
DEGREE: Final = 5
FEWEST_ROWS: Final = DEGREE + 1
#: By how much feet that stand may move against each other or over the ground [m].
MOST_SLIP: Final = 0.01
#: Rows of a contact phase, and which feet stand in it.
Phase = tuple[slice, Mask]


def read_motion(source: Path | pd.DataFrame, robot: Robot) -> Motion:
    """A motion from a CSV file or a table; see the module for its columns.

    Raises:
        LegwattError: It cannot be read; a column is missing or not a number; time does not
            increase; a position lies beyond its limits; contacts do not fit the motion.
    """
    if isinstance(source, pd.DataFrame):
        return _motion(source, robot)
    if not isinstance(source, str | Path):
        raise LegwattError(f"a motion is a CSV file or a DataFrame, not {type(source).__name__}")
    try:
        return _motion(pd.read_csv(source, comment="#"), robot)
    except LegwattError as error:
        raise LegwattError(f"{source}: {error}") from None
    except (OSError, ValueError) as error:  # pandas' own
        reason = one_line(getattr(error, "strerror", None) or error)
        raise LegwattError(f"{source}: no CSV that can be read: {reason}") from None


def _motion(table: pd.DataFrame, robot: Robot) -> Motion:
    units = ["m" if joint in robot.sliding_joints else "rad" for joint in robot.joints]
    joints = [f"{j}__position_{unit}" for j, unit in zip(robot.joints, units, strict=True)]
    feet = [f"{leg}__contact" for leg in robot.leg_names if robot.floating]
    values = _numbers(table, ["time_s", *joints, *feet])
    time, q = values["time_s"].to_numpy(), values[joints].to_numpy()
    lower, upper = robot.limits
    fits = np.all((np.radians(q) >= lower) & (np.radians(q) <= upper))
    why = "in degrees they would fit: give them in rad" if fits else "correct them or the limits"
    refuse_beyond_limits(robot, q, time, f"positions are read in rad and m; {why}")
    if not robot.floating:
        return Motion((_segment(robot, "motion on a fixed base", time, q),))
    contact = values[feet].to_numpy()
    if not np.isin(contact, (0.0, 1.0)).all():
        raise LegwattError("a LEG__contact is neither 0 nor 1: 1 where the foot carries load")
    phases, gait = _phases(time, contact.astype(np.bool_)), gait_table(robot.spec)
    place, posed = np.zeros((len(time), 3)), PLACE[0] in values
    start = Rotation.from_quat(base_quaternions(gait.ground, gait.body, np.zeros(1))[0])
    turn = np.tile(start.as_matrix(), (len(time), 1, 1))
    if posed:
        place = values[[*PLACE]].to_numpy()
        turn = Rotation.from_euler("xyz", values[[*ATTITUDE]].to_numpy()).as_matrix()
    own = foot_positions(robot.chains, robot.chains.by_leg(q))
    place, turn = _base(time, own, phases, place, turn, posed=posed)
    quaternion = one_sign(Rotation.from_matrix(turn).as_quat())
    segments = []
    for rows, standing in phases:
        stance = tuple(np.array(robot.leg_names)[standing].tolist())
        base = (place[rows], quaternion[rows])
        name = "support of " + ", ".join(stance)
        normal = gait.ground[:, 2]
        segments.append(_segment(robot, name, time[rows], q[rows], base, stance, normal))
    return Motion(tuple(segments))


def _numbers(table: pd.DataFrame, needed: list[str]) -> pd.DataFrame:
    """The columns that are needed and the base's pose where it is given, finite numbers all."""
    pose = [*PLACE, *ATTITUDE]
    needed += pose if not table.columns.intersection(pose).empty else []
    spare = [str(column) for column in table.columns if column not in needed]
    for column in needed:
        if column not in table.columns:  # another joint's column is no hint
            hint = f"; {closest(column, spare)}" if spare else ""
            raise LegwattError(f"no column {column}{hint}")
    values = table[needed].apply(pd.to_numeric, errors="coerce").astype(np.float64)
    if len(values) < FEWEST_ROWS:
        raise LegwattError(f"{len(values)} rows; derivatives need {FEWEST_ROWS}")
    for row, k in np.argwhere(~np.isfinite(values.to_numpy())).tolist():
        raise LegwattError(f"row {row + 2}: {values.columns[k]} is not a finite number")
    for row in np.flatnonzero(np.diff(values["time_s"]) <= 0).tolist():
        raise LegwattError(f"row {row + 3}: time_s does not increase; sort the rows")
    return values


def _phases(time: Array, contact: Mask) -> list[Phase]:
    """Rows of every contact phase, the first row of the next one included, and which feet stand."""
    n = len(time)
    changes = (1 + np.flatnonzero((contact[1:] != contact[:-1]).any(axis=1))).tolist()
    # The last row ends a phase; what it begins has no length.
    changes = [at for at in changes if at < n - 1]
    spans = list(zip([0, *changes], [*(at + 1 for at in changes), n], strict=True))
    for start, end in spans:
        if end - start < FEWEST_ROWS:
            raise LegwattError(
                f"from t = {time[start]:.4g} s to {time[end - 1]:.4g} s the same feet stand for "
                f"{end - start} rows; derivatives need {FEWEST_ROWS}, sample more often"
            )
        if not contact[start].any():
            raise LegwattError(f"at t = {time[start]:.4g} s no foot stands")
    return [(slice(start, end), contact[start]) for start, end in spans]


def _base(
    time: Array, feet: Array, phases: list[Phase], place: Array, turn: Array, *, posed: bool
) -> tuple[Array, Array]:
    """Place (N, 3) and rotation (N, 3, 3) of the base: as given, else as standing feet leave it.

    `feet`: in the base frame [m], shape (N, L, 3). Where it is not `posed`, the first row counts.
    """
    anchor = np.full(feet.shape[1:], np.nan)  # in the world, of the feet that stand
    for rows, standing in phases:
        world = place[rows.start] + feet[rows.start] @ turn[rows.start].T
        fresh = standing & np.isnan(anchor[:, 0])
        anchor[fresh], anchor[~standing] = world[fresh], np.nan
        own, ground = feet[rows, standing], anchor[standing]
        if not posed:
            # What turns the standing feet most nearly onto where they stood.
            a, b = own - own.mean(axis=1, keepdims=True), ground - ground.mean(axis=0)
            left, _, right = np.linalg.svd(np.einsum("fi,nfj->nij", b, a))
            left[:, :, 2] *= np.linalg.det(left @ right)[:, None]
            turn[rows] = left @ right
            place[rows] = (ground - np.einsum("nij,nfj->nfi", turn[rows], own)).mean(axis=1)
        reached = np.einsum("nij,nfj->nfi", turn[rows], own) + place[rows, None]
        slip = np.linalg.norm(reached - ground, axis=2).max(axis=1)
        if slip.max() > MOST_SLIP:
            raise LegwattError(
                f"contacts do not fit the motion: until t = {time[rows][int(slip.argmax())]:.4g} s "
                f"feet that stand move by {1e3 * slip.max():.0f} mm; correct LEG__contact, "
                "positions or the base's pose"
            )
    return place, turn


def _segment(
    robot: Robot,
    name: str,
    time: Array,
    q: Array,
    base: tuple[Array, Array] | None = None,
    stance: tuple[str, ...] = (),
    normal: Array | None = None,
) -> Segment:
    """Samples of one contact phase with their derivatives; `base`: its places and quaternions."""
    spline = make_interp_spline(time, q, k=DEGREE)
    configuration = robot.configuration(q)
    velocity, acceleration = (robot.tangent(spline(time, order)) for order in (1, 2))
    if base is not None:
        place, quaternion = base
        configuration[:, :3], configuration[:, 3:7] = place, quaternion
        back = Rotation.from_quat(quaternion).inv()
        course = make_interp_spline(time, place, k=DEGREE)
        attitude = make_interp_spline(time, quaternion, k=DEGREE)
        linear, rate = back.apply(course(time, 1)), _spin(quaternion, attitude(time, 1))
        velocity[:, :3], velocity[:, 3:6] = linear, rate
        # Pinocchio's acceleration is the derivative of the components in the base's axes.
        acceleration[:, :3] = back.apply(course(time, 2)) - np.cross(rate, linear)
        acceleration[:, 3:6] = _spin(quaternion, attitude(time, 2))
    normal = level_ground() if normal is None else normal
    return Segment(name, time, configuration, velocity, acceleration, stance, normal)


def _spin(q: Array, rate: Array) -> Array:
    """Twice the vector part of q* q', or of q* q'': angular velocity or its derivative, (N, 3)."""
    vector = q[:, 3:] * rate[:, :3] - rate[:, 3:] * q[:, :3] - np.cross(q[:, :3], rate[:, :3])
    return np.asarray(2.0 * vector)
