"""Three bare URDFs, drawn anew for every trial, and the bodies the machine really has."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

Array = NDArray[np.float64]
#: By machine: joint axes, and link lengths [m] and masses [kg] before they are drawn.
_LAYOUT = {
    "pendulum": (("y",), (0.4,), (1.2,)),
    "leg": (("x", "y", "y"), (0.1, 0.35, 0.35), (1.5, 1.2, 0.5)),
    "arm": (
        ("z", "y", "y", "z", "y", "z"),
        (0.2, 0.4, 0.3, 0.15, 0.12, 0.08),
        (6.0, 5.0, 3.0, 2.0, 1.0, 0.5),
    ),
}
MACHINES = tuple(_LAYOUT)
_AXIS = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}


@dataclass(frozen=True)
class FixedMachine:
    """A machine as its URDF says.

    Attributes:
        name: Key of `MACHINES`.
        urdf: Text of the file.
        model: Of it.
        ratio: Motor turns per joint turn, shape (J,).
        lengths: Of the links [m], shape (J,).
    """

    name: str
    urdf: str
    model: pin.Model
    ratio: Array
    lengths: Array

    @property
    def joints(self) -> tuple[str, ...]:
        """Names, base to tip."""
        return tuple(str(n) for n in list(self.model.names)[1:])

    @property
    def links(self) -> tuple[str, ...]:
        """Link each joint carries."""
        return tuple(f"link_{k + 1}" for k in range(len(self.joints)))


def draw_machine(rng: np.random.Generator, name: str) -> FixedMachine:
    """A machine with lengths, masses and ratios of its own."""
    axes, lengths, masses = _LAYOUT[name]
    n = len(axes)
    length = np.array(lengths) * rng.uniform(0.8, 1.25, n)
    mass = np.array(masses) * rng.uniform(0.7, 1.4, n)
    ratio = rng.choice([30.0, 50.0, 100.0, 120.0], n)
    parts = ['<robot name="machine">', '  <link name="base"/>']
    parent = "base"
    for k, axis in enumerate(axes):
        reach = length[k - 1] if k else 0.0
        # The first axis of the arm leans, so that gravity acts on it.
        roll = 0.35 if axis == "z" and k == 0 else 0.0
        m, r = mass[k], length[k]
        swing, spin = m * r**2 / 12 + m * 0.02**2, m * 0.03**2
        parts += [
            f'  <joint name="joint_{k + 1}" type="revolute">',
            f'    <parent link="{parent}"/><child link="link_{k + 1}"/>',
            f'    <origin xyz="0 0 {-reach:.6g}" rpy="{roll} 0 0"/><axis xyz="{_AXIS[axis]}"/>',
            '    <limit lower="-2.9" upper="2.9" effort="1000" velocity="30"/>',
            "  </joint>",
            f'  <link name="link_{k + 1}"><inertial>',
            f'    <origin xyz="0.01 0 {-0.5 * r:.6g}"/><mass value="{m:.6g}"/>',
            f'    <inertia ixx="{swing:.6g}" iyy="{swing:.6g}" izz="{spin:.6g}" ixy="0" ixz="0"'
            ' iyz="0"/>',
            "  </inertial></link>",
        ]
        parent = f"link_{k + 1}"
    text = "\n".join([*parts, "</robot>", ""])
    return FixedMachine(name, text, pin.buildModelFromXML(text), ratio, length)


def true_bodies(
    machine: FixedMachine, rng: np.random.Generator, off: float
) -> tuple[pin.Model, dict[str, list[float]]]:
    """Bodies whose masses and centres are off the URDF's.

    Args:
        machine: The nominal one.
        rng: For what they are off by.
        off: Largest relative error; at least half of it for every link.

    Returns:
        The model, and factors on masses and shifts of centres [m] by joint.
    """
    model = machine.model.copy()
    drawn = {}
    for k, name in enumerate(machine.joints):
        index = model.getJointId(name)
        body = model.inertias[index]
        factor = 1.0 + rng.choice([-1.0, 1.0]) * rng.uniform(0.5 * off, off)
        way = rng.standard_normal(3)
        shift = way / np.linalg.norm(way) * rng.uniform(0.5 * off, off) * 0.5 * machine.lengths[k]
        spread = factor * rng.uniform(1.0 - off, 1.0 + off)
        model.inertias[index] = pin.Inertia(
            factor * body.mass, body.lever + shift, spread * body.inertia
        )
        drawn[name] = [float(factor), *(float(s) for s in shift)]
    return model, drawn


def with_payload(model: pin.Model, joint: str, mass: float, at: Array) -> pin.Model:
    """The same with a point mass fixed at a place of a joint's frame [m]."""
    out = model.copy()
    index = out.getJointId(joint)
    out.inertias[index] = out.inertias[index] + pin.Inertia(mass, at, np.zeros((3, 3)))
    return out
