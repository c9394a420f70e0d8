"""A motion of the user's own, read from CSV: joint positions over time and which feet stand.

Columns: ``time_s``; ``JOINT__position_rad`` of every joint (``JOINT__position_m`` where it slides);
on a floating base ``LEG__contact`` of every leg (1 where its foot carries load, else 0) and, where
it is known, the base in the world: ``base__x_m``, ``base__y_m``, ``base__z_m`` and its attitude
``base__roll_rad``, ``base__pitch_rad``, ``base__yaw_rad`` (yaw after pitch after roll). A contact
holds from its row to the next row that says otherwise. An array has the columns without the base's
pose in this order: time, joints and contacts as the robot file has them (`needed_columns`).

Without a pose the base moves so that standing feet stay where they are, in the sense of least
squares (Kabsch, Acta Cryst. A32, 1976); it begins at the origin as ``[gait]`` tilts it.

Velocity and acceleration are those of a quintic spline through the samples of one contact phase,
with knots left out next to its ends ("not a knot"): one-sided at every change of contact, where
accelerations may jump, and at the motion's two ends, where they are least certain. Nothing is
smoothed; what noise the positions have, accelerations have many times over.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation

from actuators.arrays import Array
from actuators.errors import LegwattError, closest, one_line
from pipeline.motion.feet import base_quaternions, one_sign
from pipeline.motion.gait import body_rotation, gait_table
from pipeline.motion.motion import Ground, Motion, Segment, level_ground
from pipeline.robot.kinematics import foot_positions
from pipeline.robot.postures import refuse_beyond_limits
from pipeline.robot.robot import Robot

PLACE: Final = ("base__x_m", "base__y_m", "base__z_m")
ATTITUDE: Final = ("base__roll_rad", "base__pitch_rad", "base__yaw_rad")
#: Quantities of joints and feet that a log has, too, and a motion does not need.
_OTHERS: Final = (
    *("velocity", "acceleration", "torque", "force", "friction", "goal", "motor"),
    *("current", "voltage", "power", "temperature"),
)
#: Degree of the spline, and rows of a contact phase that it needs.
DEGREE: Final = 5
FEWEST_ROWS: Final = DEGREE + 1
#: By how much feet that stand may move against each other or over the ground [m].
MOST_SLIP: Final = 0.01


def needed_columns(robot: Robot) -> list[str]:
    """Columns that every motion of a robot has: time, joint positions and contacts of its feet."""
    units = ["m" if joint in robot.sliding_joints else "rad" for joint in robot.joints]
    joints = [f"{j}__position_{unit}" for j, unit in zip(robot.joints, units, strict=True)]
    return ["time_s", *joints, *(f"{leg}__contact" for leg in robot.leg_names if robot.floating)]


def read_motion(source: Path | pd.DataFrame | Array, robot: Robot) -> Motion:
    """A motion from a CSV file, a table or an array; see the module for its columns.

    Raises:
        LegwattError: It cannot be read; a column is missing, unknown or not a number; time does not
            increase; a position lies beyond its limits; contacts do not fit the motion.
    """
    if isinstance(source, np.ndarray):
        columns = needed_columns(robot)
        if source.shape[1:] != (len(columns),):
            raise LegwattError(
                f"an array of shape {source.shape}; a column for each of {', '.join(columns)} is "
                "expected"
            )
        return _motion(pd.DataFrame(source, columns=columns), robot)
    if isinstance(source, pd.DataFrame):
        return _motion(source, robot)
    if not isinstance(source, str | Path):
        raise LegwattError(
            f"a motion is a CSV file, a DataFrame or an array, not {type(source).__name__}"
        )
    try:
        table = pd.read_csv(source, comment="#")
    except OSError as error:
        raise LegwattError(f"{source}: no CSV that can be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise LegwattError(f"{source}: no CSV that can be read: it is not UTF-8") from None
    except ValueError as error:
        why = one_line(error).removeprefix("Error tokenizing data. C error: ")
        raise LegwattError(
            f"{source}: no CSV that can be read, with commas and decimal dots: {why}"
        ) from None
    try:
        return _motion(table, robot)
    except LegwattError as error:
        raise LegwattError(f"{source}: {error}") from None


def _motion(table: pd.DataFrame, robot: Robot) -> Motion:
    needed = needed_columns(robot)
    joints, feet = needed[1 : 1 + len(robot.joints)], needed[1 + len(robot.joints) :]
    given = [column for column in (*PLACE, *ATTITUDE) if column in table.columns]
    if given and given not in ([*PLACE, *ATTITUDE], [*ATTITUDE]):
        raise LegwattError(
            f"columns {', '.join(given)} alone; give the base's attitude {', '.join(ATTITUDE)}, "
            f"with or without its place {', '.join(PLACE)}"
        )
    _refuse_other_columns(table, robot, needed)
    columns = [*needed, *given]
    values = table[columns].apply(pd.to_numeric, errors="coerce").astype(np.float64)
    if len(values) == 0:
        raise LegwattError("no rows")
    bad = ~np.isfinite(values.to_numpy())
    if bad.any():
        row, column = np.argwhere(bad)[0]
        raise LegwattError(f"row {row + 2}: {columns[column]} is not a finite number")
    time, q = values["time_s"].to_numpy(), values[joints].to_numpy()
    if np.any(np.diff(time) <= 0):
        row = int(np.argmax(np.diff(time) <= 0)) + 1
        raise LegwattError(f"row {row + 2}: time_s does not increase; sort the rows")
    turned, (lower, upper) = np.radians(q), robot.limits
    fits = np.all((turned >= lower) & (turned <= upper))
    why = "in degrees they would fit: give them in rad" if fits else "correct them or the limits"
    try:
        refuse_beyond_limits(robot, q, time, f"positions are read in rad and m; {why}")
    except LegwattError as error:
        raise LegwattError(str(error)) from None
    contact = values[feet].to_numpy()
    if not np.isin(contact, (0.0, 1.0)).all():
        raise LegwattError("a LEG__contact is neither 0 nor 1: 1 where the foot carries load")
    phases = _phases(time, contact.astype(np.bool_))
    if not robot.floating:
        return Motion((_segment(robot, "motion on a fixed base", time, q, None, None, ()),))
    table_of_gait = gait_table(robot.spec)
    ground = Ground(table_of_gait.slope_forward, table_of_gait.slope_left)
    start = base_quaternions(ground, body_rotation(table_of_gait), np.zeros(1))
    turn = Rotation.from_quat(start)[np.zeros(len(time), dtype=np.intp)]
    known = ATTITUDE[0] in given
    if known:
        turn = Rotation.from_euler("xyz", values[[*ATTITUDE]].to_numpy())
    place = values[[*PLACE]].to_numpy() if PLACE[0] in given else None
    points = foot_positions(robot.chains, robot.layout.by_leg(q))
    place, turn = _base(time, points, phases, turn, place, known=known)
    quaternion = one_sign(turn.as_quat())
    segments = []
    for rows, standing in phases:
        stance = tuple(np.array(robot.leg_names)[standing].tolist())
        name = "support of " + ", ".join(stance)
        at = (time[rows], q[rows], place[rows], quaternion[rows])
        segments.append(_segment(robot, name, *at, stance, ground.normal))
    return Motion(tuple(segments))


def _refuse_other_columns(table: pd.DataFrame, robot: Robot, needed: list[str]) -> None:
    owners = {*robot.joints, *robot.leg_names}
    for column in map(str, table.columns):
        known = [*needed, *PLACE, *ATTITUDE]
        owner, apart, quantity = column.partition("__")
        other = owner in owners and quantity.startswith(_OTHERS)
        if column not in known and column != "segment" and not (apart and other):
            raise LegwattError(
                f"column '{one_line(column)}' is not known; {closest(column, known)}"
            )
    missing = [column for column in needed if column not in table.columns]
    if missing:
        why = (
            "" if "position" in missing[0] else "; a robot on the ground needs its feet's contacts"
        )
        raise LegwattError(f"no column {', '.join(missing)}{why}")


def _phases(time: Array, contact: NDArray[np.bool_]) -> list[tuple[slice, NDArray[np.bool_]]]:
    """Rows of every contact phase, the first row of the next one included, and which feet stand."""
    n = len(time)
    changes = (1 + np.flatnonzero((contact[1:] != contact[:-1]).any(axis=1))).tolist()
    if changes and changes[-1] == n - 1:
        changes.pop()  # the last row ends a phase; what it begins has no length
    starts, ends = [0, *changes], [*(at + 1 for at in changes), n]
    for start, end in zip(starts, ends, strict=True):
        if end - start < FEWEST_ROWS:
            raise LegwattError(
                f"from t = {time[start]:.4g} s to {time[end - 1]:.4g} s the same feet stand for "
                f"{end - start} rows; derivatives need {FEWEST_ROWS}, sample more often"
            )
    return [(slice(a, b), contact[a]) for a, b in zip(starts, ends, strict=True)]


def _base(
    time: Array,
    feet: Array,
    phases: list[tuple[slice, NDArray[np.bool_]]],
    turn: Rotation,
    place: Array | None,
    *,
    known: bool,
) -> tuple[Array, Rotation]:
    """Place (N, 3) and attitude of the base: as given, else as standing feet leave it.

    `feet`: in the base frame [m], shape (N, L, 3). `turn`: attitude, or that of the first row where
    it is not `known`. `place`: as given [m], shape (N, 3).
    """
    matrix = turn.as_matrix()
    origin = np.zeros((len(time), 3)) if place is None else np.array(place)
    anchor = np.full(feet.shape[1:], np.nan)  # in the world, of the feet that stand
    for rows, standing in phases:
        if not standing.any():
            raise LegwattError(f"at t = {time[rows.start]:.4g} s no foot stands")
        world = origin[rows.start] + feet[rows.start] @ matrix[rows.start].T
        fresh = standing & np.isnan(anchor[:, 0])
        anchor[fresh], anchor[~standing] = world[fresh], np.nan
        own, ground = feet[rows, standing], anchor[standing]
        if place is None:
            if not known:
                # What turns the standing feet most nearly onto where they stood.
                a, b = own - own.mean(axis=1, keepdims=True), ground - ground.mean(axis=0)
                left, _, right = np.linalg.svd(np.einsum("fi,nfj->nij", b, a))
                left[:, :, 2] *= np.linalg.det(left @ right)[:, None]
                matrix[rows] = left @ right
            turned = np.einsum("nij,nfj->nfi", matrix[rows], own)
            origin[rows] = (ground - turned).mean(axis=1)
        reached = np.einsum("nij,nfj->nfi", matrix[rows], own) + origin[rows, None]
        slip = np.linalg.norm(reached - ground, axis=2)
        if slip.max() > MOST_SLIP:
            at = time[rows][int(slip.max(axis=1).argmax())]
            raise LegwattError(
                f"contacts do not fit the motion: until t = {at:.4g} s feet that stand move by "
                f"{1e3 * slip.max():.0f} mm; correct LEG__contact, positions or the base's pose"
            )
    return origin, Rotation.from_matrix(matrix)


def _segment(
    robot: Robot,
    name: str,
    time: Array,
    q: Array,
    place: Array | None,
    quaternion: Array | None,
    stance: tuple[str, ...],
    normal: Array | None = None,
) -> Segment:
    """Samples of one contact phase with their derivatives."""
    spline = make_interp_spline(time, q, k=DEGREE)
    configuration = robot.configuration(q)
    velocity, acceleration = (robot.tangent(spline(time, order)) for order in (1, 2))
    if place is not None and quaternion is not None:
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
