"""What can be hidden: one table for both sources, a row per effect.

Each row draws place, size and values, and says what of the plant is changed; a source makes it by
reading the plant. Sizes are drawn over the noise: the root mean square of the torque that an effect
makes along the motion is `STRENGTH` times that of the torque's noise, inside what is physical.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from actuators.arrays import Array
from pipeline.blind.machines.chains import FIXED, Machine, tilted, with_payload
from pipeline.blind.machines.laws import cable, detents, hysteresis, ripple, spring
from pipeline.blind.machines.motions import Course
from pipeline.blind.machines.plant import Plant

Rng = np.random.Generator
STRENGTH: Final = (4.0, 60.0)
BOTH: Final = ("own", "mujoco")
EVERY: Final = (*FIXED, "walk")


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

    def with_friction(self, j: int, **values: float) -> Plant:
        """All friction of a joint is this."""
        friction = self.plant.friction.without(j).at(j, **values)
        return replace(self.plant, friction=friction)

    def with_law(self, j: int, begin: Any) -> Plant:
        """A further torque at a joint."""
        return replace(self.plant, extra=(*self.plant.extra, (j, begin)))


Values = dict[str, float]
Draw = Callable[[Rng, Case, int], tuple[Values, Plant]]


def _sign(rng: Rng) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _rest(rng: Rng, case: Case, j: int) -> float:
    return float(rng.uniform(*np.quantile(case.course.q[:, j], [0.1, 0.9])))


def _coulomb(rng: Rng, case: Case, j: int) -> tuple[Values, Plant]:
    size = case.size(rng, j, 1.0)
    return {"torque": size}, case.with_friction(j, coulomb=size)


def _viscous(rng: Rng, case: Case, j: int) -> tuple[Values, Plant]:
    size = case.size(rng, j, case.course.v[:, j])
    return {"coefficient": size}, case.with_friction(j, viscous=size)


def _stribeck(rng: Rng, case: Case, j: int) -> tuple[Values, Plant]:
    size = case.size(rng, j, 1.0)
    fast = float(np.quantile(np.abs(case.course.v[:, j]), 0.95))
    excess, slow = size * rng.uniform(0.4, 1.2), fast * rng.uniform(0.05, 0.2)
    plant = case.with_friction(j, coulomb=size, excess=excess, stribeck=slow)
    return {"coulomb": size, "excess": excess, "velocity": slow}, plant


def _share(rng: Rng, case: Case, j: int) -> float:
    return float(np.clip(case.size(rng, j, case.torque[:, j]), 0.01, 0.35))


def _load(rng: Rng, case: Case, j: int) -> tuple[Values, Plant]:
    """Per load, or per torque of the motor: mu |t_m| is mu / (1 -+ mu) of the load."""
    share = _share(rng, case, j)
    if rng.random() < 0.5:
        return {"share": share}, case.with_friction(j, driving=share, driven=share)
    pair = {"driving": share / (1 - share), "driven": share / (1 + share)}
    return {"share": share, **pair}, case.with_friction(j, **pair)


def _quadrants(rng: Rng, case: Case, j: int) -> tuple[Values, Plant]:
    pair = [_share(rng, case, j), 0.0]
    pair[1] = pair[0] * rng.uniform(0.0, 0.4)
    if rng.random() < 0.5:
        pair.reverse()
    values = {"driving": pair[0], "driven": pair[1]}
    return values, case.with_friction(j, **values)


def _directions(rng: Rng, case: Case, j: int) -> tuple[Values, Plant]:
    size = 1.5 * case.size(rng, j, 1.0)
    pair = [size, size * rng.uniform(0.1, 0.6)]
    if rng.random() < 0.5:
        pair.reverse()
    mean, half = 0.5 * (pair[0] + pair[1]), 0.5 * (pair[0] - pair[1])
    values = {"positive": pair[0], "negative": pair[1]}
    return values, case.with_friction(j, coulomb=mean, asymmetry=half)


def _quadratic(rng: Rng, case: Case, j: int) -> tuple[Values, Plant]:
    size = case.size(rng, j, case.course.v[:, j] ** 2)
    return {"quadratic": size}, case.with_friction(j, quadratic=size)


def _inertia(rng: Rng, case: Case, j: int) -> tuple[Values, Plant]:
    added = case.size(rng, j, case.course.a[:, j])
    return {"added": added}, case.plant.at("inertia", j, case.plant.inertia[j] + added)


def _payload(rng: Rng, case: Case, j: int) -> tuple[Values, Plant]:
    """A weight at the end of a link, of 20 to 150 % of the link's own mass."""
    joint = case.machine.joints[j]
    own = case.machine.model.inertias[case.machine.model.getJointId(joint)].mass
    mass = float(own * np.exp(rng.uniform(np.log(0.2), np.log(1.5))))
    far = -float(case.machine.lengths[j]) * rng.uniform(0.8, 1.3)
    at = np.array([rng.uniform(-0.05, 0.05), rng.uniform(-0.05, 0.05), far])
    values = {"mass": mass, **dict(zip("xyz", at.tolist(), strict=True))}
    return values, replace(case.plant, model=with_payload(case.plant.model, joint, mass, at))


def _tilt(rng: Rng, case: Case, j: int) -> tuple[Values, Plant]:
    roll, pitch = (_sign(rng) * float(rng.uniform(0.04, 0.15)) for _ in range(2))
    model = tilted(case.plant.model, roll, pitch)
    return {"roll": roll, "pitch": pitch}, replace(case.plant, model=model)


def _with_rotor(case: Case, j: int) -> Plant:
    """A motor that turns apart from its link has a rotor: a fiftieth of what it moves."""
    torque, rate = (float(np.abs(x[:, j]).mean()) for x in (case.torque, case.course.a))
    return case.plant.at("inertia", j, max(float(case.plant.inertia[j]), 0.02 * torque / rate))


def _sides(rng: Rng, plant: Plant) -> Plant:
    return replace(plant, sides=str(rng.choice(["both", "joint", "motor"], p=[0.6, 0.2, 0.2])))


def _elasticity(rng: Rng, case: Case, j: int) -> tuple[Values, Plant]:
    """A gear that winds up by 2 to 30 mrad at its largest torque."""
    wind = float(np.exp(rng.uniform(np.log(2e-3), np.log(3e-2))))
    compliance = wind / max(float(np.abs(case.torque[:, j]).max()), 1e-6)
    plant = _with_rotor(case, j).at("compliance", j, compliance)
    return {"stiffness": 1.0 / compliance}, _sides(rng, plant)


def _play(rng: Rng, case: Case, j: int) -> tuple[Values, Plant]:
    """Play of 2 to 30 mrad."""
    width = float(np.exp(rng.uniform(np.log(2e-3), np.log(3e-2))))
    return {"width": width}, _sides(rng, _with_rotor(case, j).at("play", j, width))


def _ripple(rng: Rng, case: Case, j: int) -> tuple[Values, Plant]:
    size, phase = case.size(rng, j, np.sqrt(0.5)), float(rng.uniform(0, 2 * np.pi))
    order = float(rng.choice([2, 4, 6, 9, 14, 20, 50, 100]))
    values = {"amplitude": size, "order": order, "phase": phase}
    return values, case.with_law(j, lambda dt: ripple(size, order, phase))


def _spring(rng: Rng, case: Case, j: int) -> tuple[Values, Plant]:
    rest = _rest(rng, case, j)
    size = case.size(rng, j, case.course.q[:, j] - rest)
    return {"stiffness": size, "rest": rest}, case.with_law(j, lambda dt: spring(rest, size))


def _coupling(rng: Rng, case: Case, j: int) -> tuple[Values, Plant]:
    """A motor whose friction and rotor feel the joint before its own, too."""
    ratio = _sign(rng)
    plant = case.with_friction(j, coulomb=case.size(rng, j, 1.0))
    coupling = plant.coupling.copy()
    coupling[j, j - 1] = ratio
    return {"ratio": ratio}, replace(plant, coupling=coupling)


def _gain(rng: Rng, case: Case, j: int) -> tuple[Values, Plant]:
    gain = 1.0 + _sign(rng) * float(rng.uniform(0.08, 0.4))
    return {"gain": gain}, case.plant.at("gain", j, gain)


def _offset(rng: Rng, case: Case, j: int) -> tuple[Values, Plant]:
    offset = case.size(rng, j, 1.0) * _sign(rng)
    return {"offset": offset}, case.plant.at("offset", j, offset)


def _zero(rng: Rng, case: Case, j: int) -> tuple[Values, Plant]:
    """An encoder mounted 20 to 200 mrad off."""
    zero = _sign(rng) * float(rng.uniform(0.02, 0.2))
    return {"angle": zero}, replace(case.plant.at("zero", j, zero), sides="joint")


def _delay(rng: Rng, case: Case, j: int) -> tuple[Values, Plant]:
    late = float(rng.uniform(5e-3, 3e-2))
    return {"delay": late}, replace(case.plant, delay=late)


def _cubic(rng: Rng, case: Case, j: int) -> tuple[Values, Plant]:
    rest = _rest(rng, case, j)
    size = case.size(rng, j, (case.course.q[:, j] - rest) ** 3)
    return {}, case.with_law(j, lambda dt: spring(rest, 0.0, size))


def _spot(rng: Rng, case: Case, j: int) -> tuple[Values, Plant]:
    """Dry friction that is higher over a stretch of the travel."""
    q = case.course.q[:, j]
    centre, width = _rest(rng, case, j), float(np.ptp(q)) * rng.uniform(0.05, 0.15)
    size = case.size(rng, j, np.exp(-0.5 * ((q - centre) / width) ** 2))
    friction = case.plant.friction

    def level(t: float, q: float) -> float:
        return size * float(np.exp(-0.5 * ((q - centre) / width) ** 2))

    return {}, replace(case.plant, friction=friction.with_spot(j, level))


def _drift(rng: Rng, case: Case, j: int) -> tuple[Values, Plant]:
    """Dry friction that falls to a third while the gear warms up."""
    size, slow = 2.0 * case.size(rng, j, 1.0), float(rng.uniform(3.0, 8.0))
    friction = case.plant.friction.without(j)

    def level(t: float, q: float) -> float:
        return size * (1 + 2 * float(np.exp(-t / slow))) / 3

    return {}, replace(case.plant, friction=friction.with_spot(j, level))


def _detents(rng: Rng, case: Case, j: int) -> tuple[Values, Plant]:
    size, count = case.size(rng, j, 0.5), float(rng.choice([8, 12, 24]))
    return {}, case.with_law(j, lambda dt: detents(size, count))


def _hysteresis(rng: Rng, case: Case, j: int) -> tuple[Values, Plant]:
    size = case.size(rng, j, 1.0)
    width = float(np.ptp(case.course.q[:, j])) * rng.uniform(0.1, 0.3)
    return {}, case.with_law(j, lambda dt: hysteresis(size, width, dt))


def _cable(rng: Rng, case: Case, j: int) -> tuple[Values, Plant]:
    start = _rest(rng, case, j)
    size = case.size(rng, j, np.maximum(case.course.q[:, j] - start, 0.0) ** 2)
    return {}, case.with_law(j, lambda dt: cable(start, size, dt))


@dataclass(frozen=True)
class Effect:
    """A row of the table."""

    name: str  #: As in the catalogue, or of its own.
    draw: Draw  #: Values and the changed plant.
    #: ``"joint"``, ``"link"``, ``"column"`` of the torque, ``"pair"`` of joints, or where the
    #: effect acts on everything.
    place: str = "joint"
    friction: bool = False  #: Whether it is all of its joint's friction.
    in_catalogue: bool = True  #: Whether the workflow has a name for it.
    sources: tuple[str, ...] = BOTH  #: That can make it.
    machines: tuple[str, ...] = EVERY  #: That can have it.

    def where(self, machine: Machine, j: int) -> list[str]:
        """Place in the workflow's words."""
        joint = machine.joints[j]
        return {
            "joint": [joint],
            "link": [machine.links[j]],
            "column": [f"{joint}__torque_Nm"],
            "pair": [joint, machine.joints[j - 1]],
        }.get(self.place, [self.place])


_ROWS: Final = (
    Effect("coulomb_friction", _coulomb, friction=True),
    Effect("viscous_friction", _viscous, friction=True),
    Effect("stribeck_friction", _stribeck, friction=True),
    Effect("load_dependent_friction", _load, friction=True),
    Effect("backdrive_loss", _quadrants, friction=True),
    Effect("direction_dependent_friction", _directions, friction=True),
    Effect("quadratic_drag", _quadratic, friction=True),
    Effect("rotor_inertia", _inertia),
    Effect("link_mass", _payload, "link", machines=FIXED),
    Effect("base_tilt", _tilt, "ground", machines=FIXED),
    Effect("joint_elasticity", _elasticity, machines=FIXED),
    Effect("backlash", _play, machines=FIXED),
    Effect("torque_ripple", _ripple),
    Effect("parallel_spring", _spring),
    Effect("transmission_coupling", _coupling, "pair", True, True, ("own",), ("leg", "arm")),
    Effect("effort_gain", _gain, "column"),
    Effect("effort_offset", _offset),
    Effect("position_offset", _zero),
    Effect("time_delay", _delay, "effort channels"),
    Effect("cubic_spring", _cubic, in_catalogue=False),
    Effect("friction_spot", _spot, in_catalogue=False),
    Effect("friction_drift", _drift, friction=True, in_catalogue=False),
    Effect("detents", _detents, in_catalogue=False),
    Effect("hysteresis", _hysteresis, in_catalogue=False),
    Effect("cable_drag", _cable, in_catalogue=False),
)
EFFECTS: Final = {effect.name: effect for effect in _ROWS}


def possible(source: str, machine: str, *, in_catalogue: bool) -> list[str]:
    """Effects that a source can make in a machine."""
    return [
        e.name
        for e in EFFECTS.values()
        if e.in_catalogue == in_catalogue and source in e.sources and machine in e.machines
    ]


def hide(rng: Rng, case: Case, name: str) -> tuple[dict[str, Any], Case]:
    """Hide one effect.

    Returns:
        What is written into the truth, and the changed case.
    """
    effect = EFFECTS[name]
    n = len(case.machine.joints)
    first = 1 if effect.place == "pair" else 0
    j = n - 1 if effect.place == "link" else int(rng.integers(first, n))
    values, plant = effect.draw(rng, case, j)
    row = {
        "effect": name,
        "place": effect.where(case.machine, j),
        "joint": j,
        "values": {key: float(value) for key, value in values.items()},
        "in_catalogue": effect.in_catalogue,
    }
    return row, replace(case, plant=plant)
