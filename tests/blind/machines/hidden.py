"""What can be hidden: values of an effect, and what of the plant it changes, for both sources.

Sizes are drawn over the noise: the root mean square of the torque that an effect makes along the
motion is `STRENGTH` times that of the torque's noise, inside what is physical.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import pinocchio as pin

from tests.blind.machines.machine import Course, Machine, tilted
from tests.blind.machines.plant import Array, Law, Plant, hysteresis

STRENGTH: Final = (4.0, 60.0)
BOTH: Final = ("own", "mujoco")
_FRICTION: Final = (
    *("coulomb_friction", "viscous_friction", "stribeck_friction", "load_dependent_friction"),
    *("backdrive_loss", "direction_dependent_friction", "quadratic_drag"),
)
#: All of their joint's friction.
FRICTION: Final = (*_FRICTION, "transmission_coupling", "friction_drift")
#: The workflow has names for them.
IN_CATALOGUE: Final = (
    *_FRICTION,
    *("rotor_inertia", "link_mass", "base_tilt", "joint_elasticity", "backlash", "torque_ripple"),
    *("parallel_spring", "transmission_coupling", "effort_gain", "effort_offset"),
    *("position_offset", "time_delay"),
)
OUTSIDE: Final = (
    *("cubic_spring", "friction_spot", "friction_drift", "detents", "hysteresis", "cable_drag"),
)
FIXED_BASE_ONLY: Final = ("link_mass", "base_tilt", "joint_elasticity", "backlash")
#: Where an effect acts, in the workflow's words; at a joint by default.
PLACES: Final = {
    "link_mass": ("link_{number}",),
    "base_tilt": ("ground",),
    "transmission_coupling": ("{joint}", "{before}"),
    "effort_gain": ("{joint}__torque_Nm",),
    "time_delay": ("effort channels",),
}


def possible(source: str, machine: str) -> list[str]:
    """Effects that a source can make in a machine."""
    lacks = {*FIXED_BASE_ONLY} if machine == "walk" else set()
    if source != "own" or machine not in ("leg", "arm"):
        lacks.add("transmission_coupling")
    return [name for name in (*IN_CATALOGUE, *OUTSIDE) if name not in lacks]


@dataclass(frozen=True)
class Case:
    """A machine and the motion that sizes are measured on."""

    machine: Machine  #: By its files.
    plant: Plant  #: As it is.
    course: Course  #: Of the training log, as planned.
    torque: Array  #: Of the true bodies along it, shape (N, J) [N*m].

    @property
    def noise(self) -> Array:
        """Of the torque, shape (J,) [N*m]."""
        return np.hypot(self.plant.white, self.plant.coloured)


def draw(rng: np.random.Generator, case: Case, name: str, j: int) -> tuple[dict[str, float], Plant]:
    """Values of an effect at a joint, none for what has no name; and the changed plant."""
    plant, torque = case.plant, case.torque[:, j]
    q, v, a = (x[:, j] for x in (case.course.q, case.course.v, case.course.a))

    def size(per_unit: Array | float) -> float:
        wanted = log(*STRENGTH) * float(case.noise[j])
        return wanted / max(float(np.sqrt(np.mean(np.square(per_unit)))), 1e-9)

    def log(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(*np.log((low, high)))))

    def sign() -> float:
        return float(rng.choice([-1.0, 1.0]))

    def rest() -> float:
        return float(rng.uniform(*np.quantile(q, [0.1, 0.9])))

    def pair(first: float, *least: float) -> list[float]:
        both = [first, first * rng.uniform(*least)]
        return both[::-1] if rng.random() < 0.5 else both

    def share() -> float:
        return float(np.clip(size(torque), 0.01, 0.35))

    def with_law(begin: Any) -> Plant:
        return replace(plant, extra=(*plant.extra, (j, begin)))

    def giving(**values: float) -> Plant:
        """A motor that turns apart from its link has a rotor: a fiftieth of what it moves."""
        least = 0.02 * float(np.abs(torque).mean()) / float(np.abs(a).mean())
        sides = str(rng.choice(["both", "joint", "motor"], p=[0.6, 0.2, 0.2]))
        inertia = max(float(plant.inertia[j]), least)
        return replace(plant.at(j, inertia=inertia, **values), sides=sides)

    match name:
        case "coulomb_friction":
            x = size(1.0)
            return {"torque": x}, plant.rubbing(j, coulomb=x)
        case "viscous_friction":
            x = size(v)
            return {"coefficient": x}, plant.rubbing(j, viscous=x)
        case "stribeck_friction":
            x, fast = size(1.0), float(np.quantile(np.abs(v), 0.95))
            more, slow = x * rng.uniform(0.4, 1.2), fast * rng.uniform(0.05, 0.2)
            values = {"coulomb": x, "excess": more, "velocity": slow}
            return values, plant.rubbing(j, coulomb=x, excess=more, stribeck=slow)
        case "load_dependent_friction":
            x = share()
            values = {"driving": x, "driven": x}
            if rng.random() < 0.5:
                return {"share": x}, plant.rubbing(j, **values)
            # Per torque of the motor: mu |t_m| is mu / (1 -+ mu) of the load.
            values = {"driving": x / (1 - x), "driven": x / (1 + x)}
            return {"share": x, **values}, plant.rubbing(j, **values)
        case "backdrive_loss":
            values = dict(zip(("driving", "driven"), pair(share(), 0.0, 0.4), strict=True))
            return values, plant.rubbing(j, **values)
        case "direction_dependent_friction":
            up, down = pair(1.5 * size(1.0), 0.1, 0.6)
            plant = plant.rubbing(j, coulomb=0.5 * (up + down), asymmetry=0.5 * (up - down))
            return {"positive": up, "negative": down}, plant
        case "quadratic_drag":
            x = size(v**2)
            return {"quadratic": x}, plant.rubbing(j, quadratic=x)
        case "rotor_inertia":
            x = size(a)
            return {"added": x}, plant.at(j, inertia=plant.inertia[j] + x)
        case "link_mass":  # a weight at its end, of 20 to 150 % of the link's own mass
            index = case.machine.model.getJointId(case.machine.joints[j])
            mass = case.machine.model.inertias[index].mass * log(0.2, 1.5)
            far = -float(case.machine.lengths[j]) * rng.uniform(0.8, 1.3)
            at = np.array([rng.uniform(-0.05, 0.05), rng.uniform(-0.05, 0.05), far])
            model = plant.model.copy()
            model.inertias[index] = model.inertias[index] + pin.Inertia(mass, at, np.zeros((3, 3)))
            values = {"mass": mass, "x": at[0], "y": at[1], "z": at[2]}
            return values, replace(plant, model=model)
        case "base_tilt":
            roll, pitch = (sign() * float(rng.uniform(0.04, 0.15)) for _ in range(2))
            model = tilted(plant.model, roll, pitch)
            return {"roll": roll, "pitch": pitch}, replace(plant, model=model)
        case "joint_elasticity":  # winds up by 2 to 30 mrad at its largest torque
            x = log(2e-3, 3e-2) / max(float(np.abs(torque).max()), 1e-6)
            return {"stiffness": 1.0 / x}, giving(compliance=x)
        case "backlash":
            x = log(2e-3, 3e-2)
            return {"width": x}, giving(play=x)
        case "torque_ripple":
            x, phase = size(np.sqrt(0.5)), float(rng.uniform(0, 2 * np.pi))
            order = float(rng.choice([2, 4, 6, 9, 14, 20, 50, 100]))
            plant = with_law(lambda dt: lambda t, q, v: x * float(np.sin(order * q + phase)))
            return {"amplitude": x, "order": order, "phase": phase}, plant
        case "parallel_spring":
            start = rest()
            x = size(q - start)
            plant = with_law(lambda dt: lambda t, q, v: -(q - start) * x)
            return {"stiffness": x, "rest": start}, plant
        case "transmission_coupling":  # friction and rotor feel the joint before their own, too
            ratio, coupling = sign(), plant.coupling.copy()
            coupling[j, j - 1] = ratio
            plant = replace(plant.rubbing(j, coulomb=size(1.0)), coupling=coupling)
            return {"ratio": ratio}, plant
        case "effort_gain":
            x = 1.0 + sign() * float(rng.uniform(0.08, 0.4))
            return {"gain": x}, plant.at(j, gain=x)
        case "effort_offset":
            x = size(1.0) * sign()
            return {"offset": x}, plant.at(j, offset=x)
        case "position_offset":  # an encoder mounted 20 to 200 mrad off
            x = sign() * float(rng.uniform(0.02, 0.2))
            return {"angle": x}, replace(plant.at(j, zero=x), sides="joint")
        case "time_delay":
            x = float(rng.uniform(5e-3, 3e-2))
            return {"delay": x}, replace(plant, delay=x)
        case "cubic_spring":
            start = rest()
            x = size((q - start) ** 3)
            return {}, with_law(lambda dt: lambda t, q, v: -(q - start) * (x * (q - start) ** 2))
        case "friction_spot":  # dry friction that is higher over a stretch of the travel
            centre, width = rest(), float(np.ptp(q)) * rng.uniform(0.05, 0.15)
            x = size(np.exp(-0.5 * ((q - centre) / width) ** 2))
            law = lambda t, q: x * float(np.exp(-0.5 * ((q - centre) / width) ** 2))  # noqa: E731
            return {}, replace(plant, spots=(*plant.spots, (j, law)))
        case "friction_drift":  # to a third while the gear warms up
            x, slow = 2.0 * size(1.0), float(rng.uniform(3.0, 8.0))
            law = lambda t, q: x * (1 + 2 * float(np.exp(-t / slow))) / 3  # noqa: E731
            return {}, replace(plant.rubbing(j), spots=(*plant.spots, (j, law)))
        case "detents":  # narrow wells between flat stretches, n per turn; no sine
            x, count = size(0.5), float(rng.choice([8, 12, 24]))

            def notches(t: float, q: float, v: float) -> float:
                s = float(np.sin(count * q))
                return -x * s * abs(s) ** 3 * (1.0 + float(np.cos(count * q)))

            return {}, with_law(lambda dt: notches)
        case "hysteresis":
            x, width = size(1.0), float(np.ptp(q)) * rng.uniform(0.1, 0.3)
            return {}, with_law(lambda dt: hysteresis(x, width, dt))
        case "cable_drag":  # pulls from an angle on, harder outward than back
            start = rest()
            x = size(np.maximum(q - start, 0.0) ** 2)

            def begin(dt: float) -> Law:
                drag = hysteresis(0.3, 0.1, dt)
                return lambda t, q, v: -x * max(0.0, q - start) ** 2 * (1.0 - drag(t, q, v))

            return {}, with_law(begin)
    raise AssertionError(name)


def hide(rng: np.random.Generator, case: Case, name: str) -> tuple[dict[str, Any], Case]:
    """Hide one effect: what is written into the truth, and the changed case."""
    joints = case.machine.joints
    j = len(joints) - 1
    if name != "link_mass":
        j = int(rng.integers(1 if name == "transmission_coupling" else 0, len(joints)))
    values, plant = draw(rng, case, name, j)
    words = {"joint": joints[j], "before": joints[j - 1], "number": j + 1}
    row = {
        "effect": name,
        "place": [place.format(**words) for place in PLACES.get(name, ("{joint}",))],
        "joint": j,
        "values": {key: float(value) for key, value in values.items()},
        "in_catalogue": name in IN_CATALOGUE,
    }
    return row, replace(case, plant=plant)
