"""What a log could show of a hidden effect, by its own numbers and without the workflow.

An effect's *change* is the torque that was logged less what the same machine without it needs
along the positions that were logged. Taken out of it are the bodies, where they are 20 % off (else
they are the URDF's, or next to it), and, unless friction or the torque's zero is what is hidden,
Coulomb and viscous friction and an offset at its joint. *z* is what remains over the noise of its
rows, in standard deviations; an effect is visible from `THRESHOLD` on. Names whose own columns
leave less than `THRESHOLD` of the change, or 3 % of z, are *alike*: there the class is the answer.
More general laws are not among them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tests.blind.machines.hidden import FRICTION, Case
from tests.blind.machines.machine import Course, tilted
from tests.blind.machines.own import link_torque
from tests.blind.machines.own import run as inverse
from tests.blind.machines.plant import Array, Plant
from tests.blind.machines.sensors import exact_torque, sampled

THRESHOLD: Final = 6.0
#: Rows looked at; more tell the same.
_ROWS: Final = 500
#: Share of z below which what a rival leaves is a matter of its form at rest, e.g. of presliding.
_ALIKE: Final = 0.03
#: Errors of a URDF from which on its bodies are taken for unknown [1].
_UNKNOWN_BODIES: Final = 0.1


def judge(
    case: Case, without: Plant, row: dict[str, Any], off: float, log: Course
) -> tuple[float, list[str]]:
    """Z of an effect and names that look like it to what happened; bodies may be `off` [1]."""
    machine, plant, j, effect = case.machine, case.plant, row["joint"], row["effect"]
    seen = log
    if plant.sides == "motor" and plant.parted.any():
        v = np.gradient(log.motor, log.dt, axis=0)
        seen = Course(log.time, log.motor, v, np.gradient(v, log.dt, axis=0))
    elif (shift := plant.zero - without.zero).any():
        seen = replace(log, q=log.q + shift)
    whole = exact_torque(inverse(machine, plant, log), plant)
    y = whole - exact_torque(inverse(machine, without, seen), without)
    rows = sampled(log, plant)
    every = max(1, rows.size // _ROWS)
    y, rows = y[::every], rows[::every]
    repeated = max(1.0, 2.0 * plant.memory * plant.rate / every)
    sigma = np.sqrt(plant.white**2 / every + plant.coloured**2 * repeated)
    known = _columns(case, seen, rows, j)
    free = [] if effect in (*FRICTION, "effort_offset") else ["dry", "viscous", "one"]
    if off >= _UNKNOWN_BODIES and effect not in ("link_mass", "base_tilt"):
        free.append("bodies")
    base = [known[name] for name in free if name in known]
    z = _left(y, base, sigma)
    if effect in ("joint_elasticity", "backlash") and plant.sides == "both":
        # Motor less joint over the encoders' resolution: nothing else parts the two positions.
        ahead = (log.motor - log.q)[:, j]
        between = float(ahead.std() * np.sqrt(12.0 * min(ahead.size, _ROWS)) / plant.resolution)
        if between >= THRESHOLD:
            return max(z, between), []
    enough = max(THRESHOLD, _ALIKE * z)
    same = [
        name
        for name, needed in _RIVALS.items()
        if name != effect
        and not set(_RIVALS.get(effect, ("none",))) < set(needed)  # no more general law
        and all(column in known for column in needed)
        and _left(y, [*base, *(known[column] for column in needed)], sigma) < enough
    ]
    return z, same if z >= THRESHOLD else []


#: Names, and the columns that they are made of.
_RIVALS: Final = {
    "coulomb_friction": ("dry",),
    "viscous_friction": ("viscous",),
    "stribeck_friction": ("dry", "slow"),
    "load_dependent_friction": ("load",),
    "backdrive_loss": ("driving", "driven"),
    "direction_dependent_friction": ("dry", "one"),
    "effort_offset": ("one",),
    "parallel_spring": ("one", "angle"),
    "rotor_inertia": ("acceleration",),
    "effort_gain": ("torque",),
    "torque_constant_error": ("torque",),
    "time_delay": ("rate",),
    "position_offset": ("turned",),
    "base_tilt": ("roll", "pitch"),
    "rigid_body_parameters": ("bodies",),
    "link_mass": ("body",),
    "center_of_mass_offset": ("centre",),
}


def _columns(case: Case, course: Course, rows: NDArray[np.intp], j: int) -> dict[str, Array]:
    """Columns by name, each (N, J, P)."""
    machine, model = case.machine, case.plant.model
    n = len(machine.joints)
    torque = link_torque(machine, model, course)[0]
    speed, load = course.v[rows, j], torque[rows, j]
    way, drives = np.tanh(speed / 0.01), load * speed > 0
    slow = 0.1 * float(np.quantile(np.abs(speed), 0.95))
    single = {
        "one": np.ones(rows.size),
        "dry": way,
        "viscous": speed,
        "slow": way * np.exp(-((speed / max(slow, 1e-3)) ** 2)),
        "load": way * np.abs(load),
        "driving": way * np.abs(load) * drives,
        "driven": way * np.abs(load) * ~drives,
        "angle": course.q[rows, j],
        "acceleration": course.a[rows, j],
        "torque": torque[rows, j],
    }
    out = {}
    for name, values in single.items():
        out[name] = np.zeros((rows.size, n, 1))
        out[name][:, j, 0] = values
    out["rate"] = np.gradient(torque, course.dt, axis=0)[rows][:, :, None]
    if machine.robot is not None:
        return out
    q, v, a, step = course.q[rows], course.v[rows], course.a[rows], 1e-3
    for name, other, angle in (
        ("turned", model, step * (np.arange(n) == j)),
        ("roll", tilted(model, step, 0.0), 0.0),
        ("pitch", tilted(model, 0.0, step), 0.0),
    ):
        moved = link_torque(machine, other, Course(course.time[rows], q + angle, v, a))[0]
        out[name] = ((moved - torque[rows]) / step)[:, :, None]
    data = model.createData()
    bodies = np.stack(
        [
            pin.computeJointTorqueRegressor(model, data, *row).copy().reshape(n, -1)
            for row in zip(q, v, a, strict=True)
        ]
    )
    out["bodies"] = bodies
    out["body"] = bodies[:, :, 10 * j : 10 * j + 10]
    out["centre"] = bodies[:, :, 10 * j + 1 : 10 * j + 4]
    return out


def _left(y: Array, columns: list[Array], sigma: Array) -> float:
    """What columns leave of a change, in standard deviations."""
    target = (y / sigma).ravel()
    if columns:
        design = np.concatenate(columns, axis=2) / sigma[None, :, None]
        x = design.reshape(-1, design.shape[2])
        scale = np.linalg.norm(x, axis=0)
        x = x[:, scale > 0] / scale[scale > 0]
        target = target - x @ np.linalg.lstsq(x, target, rcond=1e-9)[0]
    return float(np.linalg.norm(target))
