"""What can be hidden: one table for both sources, a row per effect.

Each row draws size and values, and says what of the plant is changed; a source makes it by reading
the plant. Sizes are drawn over the noise: the root mean square of the torque that an effect makes
along the motion is `STRENGTH` times that of the torque's noise, inside what is physical.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import pinocchio as pin

from tests.blind.machines.machine import FIXED, Course, Machine, tilted
from tests.blind.machines.plant import Array, Law, Plant, hysteresis

Rng = np.random.Generator
STRENGTH: Final = (4.0, 60.0)
BOTH: Final = ("own", "mujoco")


@dataclass(frozen=True)
class Case:
    """A machine and the motion that sizes are measured on."""

    machine: Machine  #: By its files.
    plant: Plant  #: As it is.
    course: Course  #: Of the training log, as planned.
    torque: Array  #: Of the true bodies along it, shape (N, J) [N*m].
    noise: Array  #: Of the torque, shape (J,) [N*m].

    def size(self, rng: Rng, j: int, per_unit: Array | float) -> float:
        """A size whose torque is drawn over the noise."""
        wanted = float(np.exp(rng.uniform(*np.log(STRENGTH)))) * float(self.noise[j])
        return wanted / max(float(np.sqrt(np.mean(np.square(per_unit)))), 1e-9)

    def with_law(self, j: int, begin: Callable[[float], Law]) -> Plant:
        """A further torque at a joint."""
        return replace(self.plant, extra=(*self.plant.extra, (j, begin)))


Drawn = tuple[dict[str, float], Plant]  # values, and the changed plant
Draw = Callable[[Rng, Case, int], Drawn]


def _sign(rng: Rng) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _log(rng: Rng, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _rest(rng: Rng, case: Case, j: int) -> float:
    return float(rng.uniform(*np.quantile(case.course.q[:, j], [0.1, 0.9])))


def _term(name: str, term: str, per_unit: Callable[[Array], Array | float]) -> Draw:
    """One term of friction, whose torque per unit hangs on the joint's speed."""

    def draw(rng: Rng, case: Case, j: int) -> Drawn:
        size = case.size(rng, j, per_unit(case.course.v[:, j]))
        return {name: size}, case.plant.rubbing(j, **{term: size})

    return draw


def _stribeck(rng: Rng, case: Case, j: int) -> Drawn:
    size = case.size(rng, j, 1.0)
    fast = float(np.quantile(np.abs(case.course.v[:, j]), 0.95))
    excess, slow = size * rng.uniform(0.4, 1.2), fast * rng.uniform(0.05, 0.2)
    plant = case.plant.rubbing(j, coulomb=size, excess=excess, stribeck=slow)
    return {"coulomb": size, "excess": excess, "velocity": slow}, plant


def _share(rng: Rng, case: Case, j: int) -> float:
    return float(np.clip(case.size(rng, j, case.torque[:, j]), 0.01, 0.35))


def _load(rng: Rng, case: Case, j: int) -> Drawn:
    """Per load, or per torque of the motor: mu |t_m| is mu / (1 -+ mu) of the load."""
    share = _share(rng, case, j)
    if rng.random() < 0.5:
        return {"share": share}, case.plant.rubbing(j, driving=share, driven=share)
    pair = {"driving": share / (1 - share), "driven": share / (1 + share)}
    return {"share": share, **pair}, case.plant.rubbing(j, **pair)


def _quadrants(rng: Rng, case: Case, j: int) -> Drawn:
    pair = [_share(rng, case, j), 0.0]
    pair[1] = pair[0] * rng.uniform(0.0, 0.4)
    if rng.random() < 0.5:
        pair.reverse()
    values = {"driving": pair[0], "driven": pair[1]}
    return values, case.plant.rubbing(j, **values)


def _directions(rng: Rng, case: Case, j: int) -> Drawn:
    size = 1.5 * case.size(rng, j, 1.0)
    pair = [size, size * rng.uniform(0.1, 0.6)]
    if rng.random() < 0.5:
        pair.reverse()
    mean, half = 0.5 * (pair[0] + pair[1]), 0.5 * (pair[0] - pair[1])
    plant = case.plant.rubbing(j, coulomb=mean, asymmetry=half)
    return {"positive": pair[0], "negative": pair[1]}, plant


def _inertia(rng: Rng, case: Case, j: int) -> Drawn:
    added = case.size(rng, j, case.course.a[:, j])
    return {"added": added}, case.plant.at(j, inertia=case.plant.inertia[j] + added)


def _payload(rng: Rng, case: Case, j: int) -> Drawn:
    """A weight at the end of a link, of 20 to 150 % of the link's own mass."""
    index = case.machine.model.getJointId(case.machine.joints[j])
    mass = case.machine.model.inertias[index].mass * _log(rng, 0.2, 1.5)
    far = -float(case.machine.lengths[j]) * rng.uniform(0.8, 1.3)
    at = np.array([rng.uniform(-0.05, 0.05), rng.uniform(-0.05, 0.05), far])
    model = case.plant.model.copy()
    model.inertias[index] = model.inertias[index] + pin.Inertia(mass, at, np.zeros((3, 3)))
    return {"mass": mass, "x": at[0], "y": at[1], "z": at[2]}, replace(case.plant, model=model)


def _tilt(rng: Rng, case: Case, j: int) -> Drawn:
    roll, pitch = (_sign(rng) * float(rng.uniform(0.04, 0.15)) for _ in range(2))
    model = tilted(case.plant.model, roll, pitch)
    return {"roll": roll, "pitch": pitch}, replace(case.plant, model=model)


def _gives(rng: Rng, case: Case, j: int, **values: float) -> Plant:
    """A motor that turns apart from its link has a rotor: a fiftieth of what it moves."""
    torque, rate = (float(np.abs(x[:, j]).mean()) for x in (case.torque, case.course.a))
    rotor = max(float(case.plant.inertia[j]), 0.02 * torque / rate)
    sides = str(rng.choice(["both", "joint", "motor"], p=[0.6, 0.2, 0.2]))
    return replace(case.plant.at(j, inertia=rotor, **values), sides=sides)


def _elasticity(rng: Rng, case: Case, j: int) -> Drawn:
    """A gear that winds up by 2 to 30 mrad at its largest torque."""
    compliance = _log(rng, 2e-3, 3e-2) / max(float(np.abs(case.torque[:, j]).max()), 1e-6)
    return {"stiffness": 1.0 / compliance}, _gives(rng, case, j, compliance=compliance)


def _play(rng: Rng, case: Case, j: int) -> Drawn:
    """Play of 2 to 30 mrad."""
    width = _log(rng, 2e-3, 3e-2)
    return {"width": width}, _gives(rng, case, j, play=width)


def _ripple(rng: Rng, case: Case, j: int) -> Drawn:
    size, phase = case.size(rng, j, np.sqrt(0.5)), float(rng.uniform(0, 2 * np.pi))
    order = float(rng.choice([2, 4, 6, 9, 14, 20, 50, 100]))
    plant = case.with_law(j, lambda dt: lambda t, q, v: size * float(np.sin(order * q + phase)))
    return {"amplitude": size, "order": order, "phase": phase}, plant


def _spring(rng: Rng, case: Case, j: int) -> Drawn:
    rest = _rest(rng, case, j)
    size = case.size(rng, j, case.course.q[:, j] - rest)
    plant = case.with_law(j, lambda dt: lambda t, q, v: -(q - rest) * size)
    return {"stiffness": size, "rest": rest}, plant


def _coupling(rng: Rng, case: Case, j: int) -> Drawn:
    """A motor whose friction and rotor feel the joint before its own, too."""
    ratio, coupling = _sign(rng), case.plant.coupling.copy()
    coupling[j, j - 1] = ratio
    plant = case.plant.rubbing(j, coulomb=case.size(rng, j, 1.0))
    return {"ratio": ratio}, replace(plant, coupling=coupling)


def _gain(rng: Rng, case: Case, j: int) -> Drawn:
    gain = 1.0 + _sign(rng) * float(rng.uniform(0.08, 0.4))
    return {"gain": gain}, case.plant.at(j, gain=gain)


def _offset(rng: Rng, case: Case, j: int) -> Drawn:
    offset = case.size(rng, j, 1.0) * _sign(rng)
    return {"offset": offset}, case.plant.at(j, offset=offset)


def _zero(rng: Rng, case: Case, j: int) -> Drawn:
    """An encoder mounted 20 to 200 mrad off."""
    zero = _sign(rng) * float(rng.uniform(0.02, 0.2))
    return {"angle": zero}, replace(case.plant.at(j, zero=zero), sides="joint")


def _delay(rng: Rng, case: Case, j: int) -> Drawn:
    late = float(rng.uniform(5e-3, 3e-2))
    return {"delay": late}, replace(case.plant, delay=late)


def _cubic(rng: Rng, case: Case, j: int) -> Drawn:
    rest = _rest(rng, case, j)
    size = case.size(rng, j, (case.course.q[:, j] - rest) ** 3)
    return {}, case.with_law(j, lambda dt: lambda t, q, v: -(q - rest) * (size * (q - rest) ** 2))


def _spot(rng: Rng, case: Case, j: int) -> Drawn:
    """Dry friction that is higher over a stretch of the travel."""
    travel = case.course.q[:, j]
    centre, width = _rest(rng, case, j), float(np.ptp(travel)) * rng.uniform(0.05, 0.15)

    def bump(q: Any) -> Any:
        return np.exp(-0.5 * ((q - centre) / width) ** 2)

    size = case.size(rng, j, bump(travel))
    spot = (j, lambda t, q: size * float(bump(q)))
    return {}, replace(case.plant, spots=(*case.plant.spots, spot))


def _drift(rng: Rng, case: Case, j: int) -> Drawn:
    """Dry friction that falls to a third while the gear warms up."""
    size, slow = 2.0 * case.size(rng, j, 1.0), float(rng.uniform(3.0, 8.0))
    spot = (j, lambda t, q: size * (1 + 2 * float(np.exp(-t / slow))) / 3)
    return {}, replace(case.plant.rubbing(j), spots=(*case.plant.spots, spot))


def _detents(rng: Rng, case: Case, j: int) -> Drawn:
    """Notches: narrow wells between flat stretches, n per turn; no sine."""
    size, count = case.size(rng, j, 0.5), float(rng.choice([8, 12, 24]))

    def law(t: float, q: float, v: float) -> float:
        x = float(np.sin(count * q))
        return -size * x * abs(x) ** 3 * (1.0 + float(np.cos(count * q)))

    return {}, case.with_law(j, lambda dt: law)


def _hysteresis(rng: Rng, case: Case, j: int) -> Drawn:
    size = case.size(rng, j, 1.0)
    width = float(np.ptp(case.course.q[:, j])) * rng.uniform(0.1, 0.3)
    return {}, case.with_law(j, lambda dt: hysteresis(size, width, dt))


def _cable(rng: Rng, case: Case, j: int) -> Drawn:
    """A cable that pulls from an angle on, harder outward than back: -k max(0, q - q0)^2."""
    start = _rest(rng, case, j)
    size = case.size(rng, j, np.maximum(case.course.q[:, j] - start, 0.0) ** 2)

    def begin(dt: float) -> Law:
        drag = hysteresis(0.3, 0.1, dt)
        return lambda t, q, v: -size * max(0.0, q - start) ** 2 * (1.0 - drag(t, q, v))

    return {}, case.with_law(j, begin)


@dataclass(frozen=True)
class Effect:
    """A row of the table."""

    name: str  #: As in the catalogue, or of its own.
    draw: Draw  #: Values and the changed plant.
    #: Where it acts, in the workflow's words, of the joint, the joint before it and its number.
    place: tuple[str, ...] = ("{joint}",)
    friction: bool = False  #: Whether it is all of its joint's friction.
    in_catalogue: bool = True  #: Whether the workflow has a name for it.
    sources: tuple[str, ...] = BOTH  #: That can make it.
    machines: tuple[str, ...] = (*FIXED, "walk")  #: That can have it.


LINK, PAIR = ("link_{number}",), ("{joint}", "{before}")
_ROWS: Final = (
    Effect("coulomb_friction", _term("torque", "coulomb", lambda v: 1.0), friction=True),
    Effect("viscous_friction", _term("coefficient", "viscous", lambda v: v), friction=True),
    Effect("stribeck_friction", _stribeck, friction=True),
    Effect("load_dependent_friction", _load, friction=True),
    Effect("backdrive_loss", _quadrants, friction=True),
    Effect("direction_dependent_friction", _directions, friction=True),
    Effect("quadratic_drag", _term("quadratic", "quadratic", lambda v: v**2), friction=True),
    Effect("rotor_inertia", _inertia),
    Effect("link_mass", _payload, LINK, machines=FIXED),
    Effect("base_tilt", _tilt, ("ground",), machines=FIXED),
    Effect("joint_elasticity", _elasticity, machines=FIXED),
    Effect("backlash", _play, machines=FIXED),
    Effect("torque_ripple", _ripple),
    Effect("parallel_spring", _spring),
    Effect("transmission_coupling", _coupling, PAIR, True, True, ("own",), ("leg", "arm")),
    Effect("effort_gain", _gain, ("{joint}__torque_Nm",)),
    Effect("effort_offset", _offset),
    Effect("position_offset", _zero),
    Effect("time_delay", _delay, ("effort channels",)),
    Effect("cubic_spring", _cubic, in_catalogue=False),
    Effect("friction_spot", _spot, in_catalogue=False),
    Effect("friction_drift", _drift, friction=True, in_catalogue=False),
    Effect("detents", _detents, in_catalogue=False),
    Effect("hysteresis", _hysteresis, in_catalogue=False),
    Effect("cable_drag", _cable, in_catalogue=False),
)
EFFECTS: Final = {effect.name: effect for effect in _ROWS}


def hide(rng: Rng, case: Case, name: str) -> tuple[dict[str, Any], Case]:
    """Hide one effect: what is written into the truth, and the changed case."""
    effect, joints = EFFECTS[name], case.machine.joints
    j = len(joints) - 1
    if effect.place != LINK:
        j = int(rng.integers(1 if effect.place == PAIR else 0, len(joints)))
    values, plant = effect.draw(rng, case, j)
    words = {"joint": joints[j], "before": joints[j - 1], "number": j + 1}
    row = {
        "effect": name,
        "place": [place.format(**words) for place in effect.place],
        "joint": j,
        "values": {key: float(value) for key, value in values.items()},
        "in_catalogue": effect.in_catalogue,
    }
    return row, replace(case, plant=plant)
