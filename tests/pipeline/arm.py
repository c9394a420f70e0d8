"""An arm of three joints by Pinocchio alone, its motions and the torques that they take."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pinocchio as pin

from actuators.arrays import Array

LINK = """<link name="l{k}"><inertial><origin xyz="{x} 0.02 0.01"/><mass value="{m}"/>
<inertia ixx="{i}" ixy="0" ixz="0" iyy="{i}" iyz="0" izz="{i}"/></inertial></link>
<joint name="j{k}" type="{kind}"><parent link="{parent}"/><child link="l{k}"/>
<origin xyz="{at} 0 0"/><axis xyz="{axis}"/>{limit}</joint>"""
LIMIT = '<limit lower="-9" upper="9" effort="90" velocity="60"/>'
#: Place, axis, mass, centre of mass and inertia.
BODIES = (
    (0.0, "0 1 0", 3.0, 0.2, 0.04),
    (0.4, "0.6 0.8 0", 2.0, 0.15, 0.02),
    (0.3, "0 1 0", 1.0, 0.1, 0.005),
)


def arm_text(
    kind: str = "revolute",
    parents: Sequence[str] = ("base", "l0", "l1"),
    bodies: Sequence[tuple[float, str, float, float, float]] = BODIES,
) -> str:
    """The URDF, of joints with limits or ``continuous`` ones."""
    limit = LIMIT if kind == "revolute" else ""
    links = [
        LINK.format(k=k, parent=parent, at=at, axis=axis, m=m, x=x, i=i, kind=kind, limit=limit)
        for k, ((at, axis, m, x, i), parent) in enumerate(zip(bodies, parents, strict=True))
    ]
    return f'<robot name="arm"><link name="base"/>{"".join(links)}</robot>'


def arm_file(folder: Path, kind: str = "revolute") -> Path:
    """The URDF as a file."""
    path = folder / "arm.urdf"
    path.write_text(arm_text(kind), "utf-8")
    return path


def sines(
    rng: np.random.Generator, t: Array, hz: Sequence[float], size: Sequence[float]
) -> tuple[Array, Array, Array]:
    """Position, speed and acceleration of sums of three sines about a bent posture, (N, 3)."""
    w = 2 * np.pi * np.array(hz)[:, None] * rng.uniform(0.8, 1.2, (3, 3))
    phase, amplitude = rng.uniform(0, 6, (3, 3)), np.array(size)[:, None]
    q, v, a = (
        (
            (amplitude * w**k)[:, None]
            * np.sin(w[:, None] * t[:, None] + phase[:, None] + k * np.pi / 2)
        ).sum(0)
        for k in range(3)
    )
    return np.array([0.3, 0.5, -0.6]) + q, v, a


def torques(model: pin.Model, q: Array, v: Array, a: Array) -> Array:
    """Of rigid bodies along a motion, (N, J) [N*m]."""
    data = model.createData()
    return np.array([pin.rnea(model, data, *x) for x in zip(q, v, a, strict=True)])


def table(t: Array, q: Array, torque: Array) -> pd.DataFrame:
    """Columns of a log."""
    out = pd.DataFrame({"time_s": t})
    for k in range(q.shape[1]):
        out[f"j{k}__position_rad"] = q[:, k]
        out[f"j{k}__torque_Nm"] = torque[:, k]
    return out
