"""What is hidden in a fixed-base machine: place, size, and how it changes machine and sensors.

Sizes are drawn over the noise: the root mean square of the torque an effect makes along the motion
is `STRENGTH` times the torque noise, inside what is physical.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipeline.blind.twin.fixed.machines import FixedMachine, with_payload
from pipeline.blind.twin.fixed.motions import Course
from pipeline.blind.twin.fixed.sensing import FixedSensors
from pipeline.blind.twin.fixed.simulate import Truth, link_torque
from pipeline.blind.twin.laws.extra import CableDrag, QuadraticDrag, Ripple, Spring

Array = NDArray[np.float64]
STRENGTH: Final = (4.0, 60.0)


@dataclass(frozen=True)
class Case:
    """A machine and its sensors, with the motion that sizes are measured on.

    Attributes:
        machine: By its URDF.
        truth: As it is.
        sensors: Of it.
        course: Of the training log.
        torque: Of the true bodies along it, shape (N, J) [N*m].
        noise: Of the torque, shape (J,) [N*m].
    """

    machine: FixedMachine
    truth: Truth
    sensors: FixedSensors
    course: Course
    torque: Array
    noise: Array


@dataclass(frozen=True)
class Hidden:
    """One effect that was hidden.

    Attributes:
        effect: Name.
        place: As the workflow calls it.
        values: Parameters as the workflow calls them, SI.
        in_catalogue: Whether the workflow has a name for it.
    """

    effect: str
    place: tuple[str, ...]
    values: dict[str, float]
    in_catalogue: bool = True


Drawn = tuple[Hidden, Case]


def _joint(rng: np.random.Generator, case: Case) -> tuple[int, str]:
    """Any joint, all equally likely: its column and its name."""
    j = int(rng.integers(case.course.q.shape[1]))
    return j, case.machine.joints[j]


def _size(rng: np.random.Generator, case: Case, j: int, per_unit: Array) -> float:
    """A size whose torque is drawn over the noise."""
    wanted = float(np.exp(rng.uniform(*np.log(STRENGTH)))) * float(case.noise[j])
    return wanted / max(float(np.sqrt(np.mean(per_unit**2))), 1e-9)


def _friction(name: str, draw: Callable[..., dict[str, float]]) -> Callable[..., Drawn]:
    """An effect that is all of a joint's friction."""

    def hide(rng: np.random.Generator, case: Case) -> Drawn:
        j, joint = _joint(rng, case)
        size = _size(rng, case, j, np.sign(case.course.v[:, j]))
        values = draw(rng, case, j, size)
        clean = dict.fromkeys(
            ("coulomb", "excess", "viscous", "load_driving", "load_driven", "asymmetry"), 0.0
        )
        law = clean | _LAWS[name](values)
        dry = max(law["coulomb"] + law["excess"], 0.02 * float(np.abs(case.torque[:, j]).max()))
        law["stiffness"] = dry / 2e-4
        return Hidden(name, (joint,), values), replace(
            case, truth=case.truth.with_friction(j, **law)
        )

    return hide


_LAWS: Final[dict[str, Callable[[dict[str, float]], dict[str, float]]]] = {
    "coulomb_friction": lambda p: {"coulomb": p["torque"]},
    "viscous_friction": lambda p: {"viscous": p["coefficient"]},
    "stribeck_friction": lambda p: {
        "coulomb": p["coulomb"],
        "excess": p["excess"],
        "stribeck_velocity": p["velocity"],
    },
    "load_dependent_friction": lambda p: {"load_driving": p["share"], "load_driven": p["share"]},
    "backdrive_loss": lambda p: {"load_driving": p["driving"], "load_driven": p["driven"]},
    "direction_dependent_friction": lambda p: {
        "coulomb": 0.5 * (p["positive"] + p["negative"]),
        "asymmetry": 0.5 * (p["positive"] - p["negative"]),
    },
}


def _viscous(rng: np.random.Generator, case: Case, j: int, size: float) -> dict[str, float]:
    return {"coefficient": size / float(np.sqrt(np.mean(case.course.v[:, j] ** 2)))}


def _stribeck(rng: np.random.Generator, case: Case, j: int, size: float) -> dict[str, float]:
    fast = float(np.quantile(np.abs(case.course.v[:, j]), 0.95))
    return {
        "coulomb": size,
        "excess": size * rng.uniform(0.4, 1.2),
        "velocity": fast * rng.uniform(0.05, 0.2),
    }


def _share(case: Case, j: int, size: float) -> float:
    return float(np.clip(size / np.sqrt(np.mean(case.torque[:, j] ** 2)), 0.01, 0.35))


def _quadrants(rng: np.random.Generator, case: Case, j: int, size: float) -> dict[str, float]:
    pair = [_share(case, j, size), _share(case, j, size) * rng.uniform(0.0, 0.4)]
    if rng.random() < 0.5:
        pair.reverse()
    return {"driving": pair[0], "driven": pair[1]}


def _directions(rng: np.random.Generator, case: Case, j: int, size: float) -> dict[str, float]:
    pair = [1.5 * size, 1.5 * size * rng.uniform(0.1, 0.6)]
    if rng.random() < 0.5:
        pair.reverse()
    return {"positive": pair[0], "negative": pair[1]}


def _payload(rng: np.random.Generator, case: Case) -> Drawn:
    """A weight at the last link, away from its centre."""
    j = len(case.machine.joints) - 1
    own = case.machine.model.inertias[j + 1].mass
    reach = float(case.machine.lengths[j])
    mass = float(own * np.exp(rng.uniform(np.log(0.2), np.log(1.5))))
    at = np.array([rng.uniform(-0.05, 0.05), rng.uniform(-0.05, 0.05), -reach])
    at[2] *= rng.uniform(0.8, 1.4)
    model = with_payload(case.truth.model, case.machine.joints[j], mass, at)
    values = {"mass": mass, "x": float(at[0]), "y": float(at[1]), "z": float(at[2])}
    hidden = Hidden("link_mass", (case.machine.links[j],), values)
    return hidden, replace(case, truth=replace(case.truth, model=model))


def _inertia(rng: np.random.Generator, case: Case) -> Drawn:
    j, joint = _joint(rng, case)
    added = _size(rng, case, j, case.course.a[:, j])
    inertia = case.truth.inertia.copy()
    inertia[j] += added
    truth = replace(case.truth, inertia=inertia)
    return Hidden("rotor_inertia", (joint,), {"added": added}), replace(case, truth=truth)


def _elasticity(rng: np.random.Generator, case: Case) -> Drawn:
    """A gear that winds up by 2 to 20 mrad; both positions are logged."""
    j, joint = _joint(rng, case)
    wind = float(np.exp(rng.uniform(np.log(2e-3), np.log(2e-2))))
    compliance = case.truth.compliance.copy()
    compliance[j] = wind / max(float(np.abs(case.torque[:, j]).max()), 1e-6)
    values = {"stiffness": 1.0 / float(compliance[j])}
    sensors = replace(case.sensors, sides="both")
    truth = replace(case.truth, compliance=compliance)
    return Hidden("joint_elasticity", (joint,), values), replace(case, truth=truth, sensors=sensors)


def _play(rng: np.random.Generator, case: Case) -> Drawn:
    """Play of 2 to 30 mrad; both positions are logged."""
    j, joint = _joint(rng, case)
    width = float(np.exp(rng.uniform(np.log(2e-3), np.log(3e-2))))
    play = case.truth.play.copy()
    play[j] = width
    sensors = replace(case.sensors, sides="both")
    truth = replace(case.truth, play=play)
    return Hidden("backlash", (joint,), {"width": width}), replace(
        case, truth=truth, sensors=sensors
    )


def _ripple(rng: np.random.Generator, case: Case) -> Drawn:
    j, joint = _joint(rng, case)
    size = _size(rng, case, j, np.full(1, np.sqrt(0.5)))
    order = float(rng.choice([2, 4, 20, 50, 100, 200]))
    phase = float(rng.uniform(0, 2 * np.pi))
    law = Ripple(j, size, order, phase)
    values = {"amplitude": size, "order": order, "phase": phase}
    truth = replace(case.truth, extra=(*case.truth.extra, law))
    return Hidden("torque_ripple", (joint,), values), replace(case, truth=truth)


def _spring(rng: np.random.Generator, case: Case) -> Drawn:
    j, joint = _joint(rng, case)
    q = case.course.q[:, j]
    rest = float(rng.uniform(*np.quantile(q, [0.1, 0.9])))
    size = _size(rng, case, j, q - rest)
    law = Spring(j, rest=rest, linear=size)
    truth = replace(case.truth, extra=(*case.truth.extra, law))
    values = {"stiffness": size, "rest": rest}
    return Hidden("parallel_spring", (joint,), values), replace(case, truth=truth)


def _coupling(rng: np.random.Generator, case: Case) -> Drawn:
    """A motor whose friction feels the joint before its own, too."""
    n = len(case.machine.joints)
    j = int(rng.integers(1, n))
    ratio = float(rng.choice([-1.0, 1.0]))
    coupling = case.truth.coupling.copy()
    coupling[j, j - 1] = ratio
    size = _size(rng, case, j, np.sign(case.course.v[:, j]))
    truth = case.truth.with_friction(j, coulomb=size, stiffness=size / 2e-4)
    truth = replace(truth, coupling=coupling)
    place = (case.machine.joints[j], case.machine.joints[j - 1])
    return Hidden("transmission_coupling", place, {"ratio": ratio}), replace(case, truth=truth)


def _gain(rng: np.random.Generator, case: Case) -> Drawn:
    """A torque that reads 10 to 35 % too much or too little."""
    j, joint = _joint(rng, case)
    gain = case.sensors.gain.copy()
    gain[j] = 1.0 + float(rng.choice([-1.0, 1.0]) * rng.uniform(0.1, 0.35))
    hidden = Hidden("effort_gain", (f"{joint}__torque_Nm",), {"gain": float(gain[j])})
    return hidden, replace(case, sensors=replace(case.sensors, gain=gain))


def _offset(rng: np.random.Generator, case: Case) -> Drawn:
    j, joint = _joint(rng, case)
    offset = case.sensors.offset.copy()
    offset[j] = _size(rng, case, j, np.ones(1)) * float(rng.choice([-1.0, 1.0]))
    hidden = Hidden("effort_offset", (joint,), {"offset": float(offset[j])})
    return hidden, replace(case, sensors=replace(case.sensors, offset=offset))


def _zero(rng: np.random.Generator, case: Case) -> Drawn:
    """An encoder mounted 20 to 200 mrad off."""
    j, joint = _joint(rng, case)
    zero = case.sensors.zero.copy()
    zero[j] = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.02, 0.2))
    hidden = Hidden("position_offset", (joint,), {"angle": float(zero[j])})
    return hidden, replace(case, sensors=replace(case.sensors, zero=zero, sides="joint"))


def _delay(rng: np.random.Generator, case: Case) -> Drawn:
    """Torques that come 5 to 30 ms late, beside what each joint's own are late."""
    late = float(rng.uniform(5e-3, 3e-2))
    sensors = replace(case.sensors, delay=case.sensors.delay + late)
    return Hidden("time_delay", ("effort channels",), {"delay": late}), replace(
        case, sensors=sensors
    )


def _unknown(name: str, change: Callable[..., Truth]) -> Callable[..., Drawn]:
    """An effect for which the workflow has no name."""

    def hide(rng: np.random.Generator, case: Case) -> Drawn:
        j, joint = _joint(rng, case)
        truth = change(rng, case, j)
        return Hidden(name, (joint,), {}, in_catalogue=False), replace(case, truth=truth)

    return hide


def _and(case: Case, law: QuadraticDrag | CableDrag | Ripple | Spring) -> Truth:
    return replace(case.truth, extra=(*case.truth.extra, law))


def _drag(rng: np.random.Generator, case: Case, j: int) -> Truth:
    return _and(case, QuadraticDrag(j, _size(rng, case, j, case.course.v[:, j] ** 2)))


def _cable(rng: np.random.Generator, case: Case, j: int, cubic: float = 1.0) -> Truth:
    q = case.course.q[:, j]
    rest = float(rng.uniform(*np.quantile(q, [0.1, 0.9])))
    stiff = cubic * _size(rng, case, j, (q - rest) ** 3)
    loop = _size(rng, case, j, np.ones(1)) * rng.uniform(0.3, 0.8)
    width = float(np.ptp(q)) * rng.uniform(0.1, 0.3)
    return _and(case, CableDrag(j, rest=rest, cubic=stiff, hysteresis=loop, width=width))


def _hysteresis(rng: np.random.Generator, case: Case, j: int) -> Truth:
    return _cable(rng, case, j, 0.0)


def _detent(rng: np.random.Generator, case: Case, j: int) -> Truth:
    """Detents that are no sine: a torque of two orders that beat."""
    size, order = _size(rng, case, j, np.full(1, np.sqrt(0.5))), float(rng.choice([12, 24, 36]))
    truth = _and(case, Ripple(j, size, order, 0.0))
    truth = replace(truth, extra=(*truth.extra, Ripple(j, 0.8 * size, 2.0 * order, 1.0)))
    return replace(truth, extra=(*truth.extra, Ripple(j, 0.6 * size, 3.0 * order, 2.0)))


def _ringing(rng: np.random.Generator, case: Case, j: int) -> Truth:
    size = 4.0 * _size(rng, case, j, np.ones(1))
    play = case.truth.play.copy()
    play[j] = rng.uniform(2e-3, 1e-2)
    return replace(case.truth, play=play, rings={j: (size, float(rng.uniform(12.0, 40.0)))})


#: All of a joint's friction each: of two at one joint the later is the only one there.
LAWS_OF_FRICTION: Final = frozenset(_LAWS)
EFFECTS: Final[dict[str, Callable[[np.random.Generator, Case], Drawn]]] = {
    "coulomb_friction": _friction("coulomb_friction", lambda r, c, j, s: {"torque": s}),
    "viscous_friction": _friction("viscous_friction", _viscous),
    "stribeck_friction": _friction("stribeck_friction", _stribeck),
    "load_dependent_friction": _friction(
        "load_dependent_friction", lambda r, c, j, s: {"share": _share(c, j, s)}
    ),
    "direction_dependent_friction": _friction("direction_dependent_friction", _directions),
    "backdrive_loss": _friction("backdrive_loss", _quadrants),
    "rotor_inertia": _inertia,
    "link_mass": _payload,
    "joint_elasticity": _elasticity,
    "backlash": _play,
    "torque_ripple": _ripple,
    "parallel_spring": _spring,
    "transmission_coupling": _coupling,
    "effort_gain": _gain,
    "effort_offset": _offset,
    "position_offset": _zero,
    "time_delay": _delay,
}
UNKNOWN: Final[dict[str, Callable[[np.random.Generator, Case], Drawn]]] = {
    "quadratic_drag": _unknown("quadratic_drag", _drag),
    "detent": _unknown("detent", _detent),
    "cable_loom": _unknown("cable_loom", _cable),
    "hysteresis": _unknown("hysteresis", _hysteresis),
    "ringing_play": _unknown("ringing_play", _ringing),
}


def case_of(machine: FixedMachine, truth: Truth, sensors: FixedSensors, course: Course) -> Case:
    """Put together what sizes are drawn from."""
    torque = link_torque(truth.model, course)
    noise = np.hypot(sensors.white, sensors.coloured)
    return Case(machine, truth, sensors, course, torque, noise)
