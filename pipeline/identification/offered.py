"""What competes on a log: what every machine has, in blocks, and the names of the catalogue."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Final

import numpy as np
from scipy.linalg import cho_solve
from scipy.optimize import least_squares

from actuators.arrays import Array
from actuators.elements.element import Friction
from pipeline.effects.base import COMPETING, EFFECTS, EVERY, Effect, Measured, Place, observable
from pipeline.effects.bodies import ALIKE, AXES, last_links, point_mass
from pipeline.effects.drivetrain import COMPLIANCE_TOLERANCE, REVERSAL
from pipeline.effects.motor_sensors import (
    CONSTANT_TOLERANCE,
    ENCODER_TOLERANCE,
    SKEW_TOLERANCE,
    TorqueRipple,
)
from pipeline.identification.design import DataSet, Design, Term, make_design
from pipeline.identification.fit import Fit, independent
from pipeline.identification.settings import (
    BODY_MOST,
    MARGIN,
    RESISTANCE,
    STATED_FRICTION,
    STATED_MOST,
    TIGHT,
)
from pipeline.identification.tolerances import (
    STRAINS,
    BodyStrain,
    Resistance,
    Tolerance,
    inertial,
    slope,
)
from pipeline.machine.machine import MachineModel

#: Laws that every machine has at all joints, each a block of one scale.
COMMON: Final = (
    *("viscous_friction", "coulomb_friction", "load_dependent_friction"),
    *("rotor_inertia", "effort_offset"),
)
#: Multiples of the small steps across which a column looks where the prediction bends.
_REACHES: Final = {"time_delay": (1.0, 20.0, 100.0), "joint_elasticity": (1.0, 100.0, 600.0)}
#: Place of a delay that all joints share.
EVERY_CHANNEL: Final = ("effort channels",)
#: Orders of a ripple that compete at a joint.
_PEAKS: Final = 4
#: Speeds, in those at which a joint's encoder tells motion from rest, over which dry friction may
#: change its sense; a servo at rest creeps, and so does another engine's friction.
_RISES: Final = (2.0, 4.0, 8.0, 16.0, 32.0)
#: ... or travels [rad]: bearings, seals and teeth give by up to some milliradians before they slide
#: (Armstrong, Dupont and Canudas de Wit, Automatica 30, 1994).
TRAVELS: Final = (3e-4, 1e-3, 3e-3, 1e-2)
#: Factors about the best of these, then of those: the last differ by a twentieth of an octave.
_FINER: Final = (2.0 ** np.linspace(-0.75, 0.75, 7), 2.0 ** np.linspace(-0.15, 0.15, 7))
Reversals = Mapping[str, Mapping[str, float]]
NOTHING_KNOWN: Final[Reversals] = MappingProxyType({})
#: Of a payload, where a log does not show it: no robot carries more than itself, robots reach about
#: a metre, and a thing that is mounted has a radius of gyration of some centimetres.
_REACH: Final = 1.0  # [m]
_GYRATION: Final = 0.05  # [m]
#: Places about a link's joint from which that of a payload is looked for [m].
_AROUND: Final = np.vstack([np.zeros(3), *(0.2 * np.eye(3)), *(-0.2 * np.eye(3))])


def block_terms(
    model: MachineModel, m: Measured, reversals: Reversals = NOTHING_KNOWN
) -> list[Term]:
    """What stays in every estimate: bodies, tolerances, common laws.

    Args:
        model: The files'.
        m: What one of its logs holds.
        reversals: From `reversals`.
    """
    out = []
    for link, joint in model.robot.links.items():
        if observable(model, m, joint):
            unit = tuple(STRAINS.values())
            bound = float(np.clip(model.known.get(link, TIGHT), TIGHT, BODY_MOST))
            out.append(Term(BodyStrain(), (link,), block=f"body {link}", bound=bound, unit=unit))

    def stays(effect: Effect | Tolerance, place: Place, block: str, size: float) -> None:
        out.append(Term(effect, place, block=block, bound=1.0, unit=(size,)))

    factor = EFFECTS["friction_factor"]
    for actuator in model.actuators:
        place, motor = (actuator.name,), actuator.motor
        stays(EFFECTS["position_offset"], place, "zeros", ENCODER_TOLERANCE)
        if any(isinstance(e, Friction) for e in actuator.elements):
            wide = min(max(model.known.get(actuator.name, 0.0), STATED_FRICTION), STATED_MOST)
            stays(factor, place, "friction", wide)
        if motor is not None and "torque" not in m.channels:
            stays(EFFECTS["joint_elasticity"], place, "wind-up", COMPLIANCE_TOLERANCE)
            wide = max(CONSTANT_TOLERANCE, motor.torque_constant_spread)
            stays(EFFECTS["torque_constant_error"], place, f"constant {wide:g}", wide)
            if "voltage" in m.channels or "power" in m.channels:
                wide = max(RESISTANCE, motor.resistance_spread)
                stays(Resistance(), place, f"resistance {wide:g}", wide)
    if model.known and (EVERY,) in factor.places(model, m):
        # What a log showed of friction is another with every day's temperature.
        unit = tuple(c.size for c in factor.coordinates if c.size)
        out.append(Term(factor, (EVERY,), block="all friction", unit=unit))
    stays(EFFECTS["time_delay"], EVERY_CHANNEL, "skew", SKEW_TOLERANCE)
    for name in COMMON:
        unit = (1.0,) if name == "load_dependent_friction" else ()
        for joint in model.joints:
            shape = _reversed(EFFECTS[name], (joint,), reversals)
            out.append(Term(EFFECTS[name], (joint,), shape, block=name, unit=unit))
    return out


def _reversed(effect: Effect, place: Place, found: Reversals) -> Mapping[str, float]:
    """How an effect's dry friction changes its sense, if it has any."""
    own = found.get(place[0], {}) if place else {}
    dry = getattr(effect, "fixed", ()) == REVERSAL and "rise" in {p.name for p in effect.parameters}
    return own if dry else {}


def reversals(model: MachineModel, data_sets: Sequence[DataSet]) -> Reversals:
    """Over which speed or travel each joint's dry friction changes its sense, where not at once.

    A joint at rest or about to turn tells nothing of Coulomb's level where that is not known, and
    its rows would be explained by any law that differs there. Each joint's own equation decides, by
    least squares with all that it may hold beside.
    """
    m, out = data_sets[0].simulator.measured, dict[str, Mapping[str, float]]()
    blocks = make_design(model, data_sets, block_terms(model, m))
    laws = [
        (joint, {name: float(value)})
        for j, joint in enumerate(model.joints)
        for name, values in (("rise", m.rest_speed[j] * np.array(_RISES)), ("travel", TRAVELS))
        for value in values
    ]
    beside = dict(_beside(blocks))
    out = _likeliest_reversals(blocks, beside, laws)
    for finer in _FINER:
        laws = [
            (joint, {name: value * factor})
            for joint, law in out.items()
            for name, value in law.items()
            for factor in finer
        ]
        out = _likeliest_reversals(blocks, beside, laws)
    return out


def _beside(blocks: Design) -> Iterator[tuple[int, Array]]:
    """Orthonormal columns of each joint's own equation but for its dry friction, (R, n)."""
    for e in blocks.equations:
        if e.channel or e.joint >= len(blocks.model.joints):
            continue
        own = ("coulomb_friction", (blocks.model.joints[e.joint],))
        kept = np.array([blocks.terms[blocks.owner[c]].key != own for c in e.ids], np.bool_)
        Q, size, _ = np.linalg.svd(e.X[kept][:, e.chunk >= 0].T, full_matrices=False)
        yield e.joint, Q[:, size > 1e-9 * size.max(initial=1e-300)]


def _likeliest_reversals(
    blocks: Design, beside: Mapping[int, Array], laws: Sequence[tuple[str, Mapping[str, float]]]
) -> dict[str, Mapping[str, float]]:
    dry, out = EFFECTS["coulomb_friction"], dict[str, Mapping[str, float]]()
    design = blocks.extended([Term(dry, (joint,), law) for joint, law in laws])
    for e in design.equations:
        if e.channel or e.joint not in beside:
            continue
        known, joint = e.chunk >= 0, design.model.joints[e.joint]
        owner = [design.terms[design.owner[c]] for c in e.ids]
        own = np.array([t.key == (dry.name, (joint,)) for t in owner], np.bool_)
        if own.sum() < 2:
            continue
        X = np.vstack([e.X[own][:, known], e.r[None, known]])
        X = X - (X @ beside[e.joint]) @ beside[e.joint].T
        x, r = X[:-1], X[-1]
        told = np.maximum(x @ r, 0.0) ** 2 / np.maximum((x**2).sum(axis=1), 1e-300)
        left = np.maximum(r @ r - told, 1e-300)
        best = int(left.argmin())
        if told[best] == 0.0:  # nothing of it is seen here
            continue
        rest = r - x[best] * (x[best] @ r) / (x[best] @ x[best])
        rise = 0.5 * independent(rest) * r.size * np.log(left[0] / left[best])
        if rise > MARGIN + np.log(r.size):
            out[joint] = owner[int(np.flatnonzero(own)[best])].shape
    return out


def name_terms(
    model: MachineModel, m: Measured, reversals: Reversals = NOTHING_KNOWN
) -> list[Term]:
    """Names of the catalogue but for those whose nonlinear parameters a residual has to tell."""
    out = []
    for effect in COMPETING:
        if effect.name in (*COMMON, "torque_ripple"):
            continue
        places = effect.places(model, m)
        if effect.name == "friction_factor" and model.known:
            places = [place for place in places if place != (EVERY,)]
        if effect.name == "time_delay" and len(model.joints) > 1:
            places = [*places, *((joint,) for joint in model.joints)]
        for place in places:
            for shape in effect.shapes(model, m, place):
                shape = {**shape, **_reversed(effect, place, reversals)}
                for reach in _REACHES.get(effect.name, (1.0,)):
                    out.append(Term(effect, place, shape, reach=reach))
    return out


def ripple_terms(fit: Fit) -> Iterator[Term]:
    """Ripples of each joint at the orders of its angle that are left most of.

    Not on a floating base: what feet leave that touch down has every order, and the largest of
    hundreds is one of them.
    """
    design, effect = fit.design, EFFECTS["torque_ripple"]
    assert isinstance(effect, TorqueRipple)
    if design.model.robot.floating:
        return
    for e in design.equations:
        if e.channel or e.joint >= len(design.model.joints):
            continue
        orders = effect.orders(design.data_sets[0].simulator.measured, e.joint)
        if orders.size == 0:
            continue
        q = np.concatenate(
            [d.measurement.q[d.rows[d.good(e.joint)], e.joint] for d in design.data_sets]
        )
        known = e.chunk >= 0
        rest, q = e.left(fit.x)[known], q[known]
        power = np.array([abs(np.exp(-1j * order * q) @ rest) for order in orders.tolist()])
        spacing = orders[1] - orders[0] if orders.size > 1 else 1.0
        chosen: list[float] = []
        for order in orders[np.argsort(power)[::-1]]:
            if all(abs(order - o) > 3 * spacing for o in chosen):
                chosen.append(float(order))
            if len(chosen) == _PEAKS:
                break
        for order in chosen:
            yield Term(effect, (design.model.joints[e.joint],), {"order": order})


def payload_terms(fit: Fit) -> Iterator[Term]:
    """Payloads of the last links, where what is left of a fit would have them."""
    design = fit.design
    number = {t.key: k for k, t in enumerate(design.terms) if t.block}
    most = sum(body.mass for body in design.model.robot.model.inertias)
    for link in last_links(design.model):
        k = number.get((BodyStrain.name, (link,)))
        if k is None:
            continue
        # Torques are linear in ten inertial parameters: their columns follow from the strains'.
        ids = design.columns[k]
        to_ten = np.linalg.pinv(slope(inertial(design.model, link), np.zeros(ids.size)))
        h = fit.weights @ design.rights
        # What stays may take its part: the bodies of tight links, the common laws.
        beside = design.between(fit.weights, fit.active, ids) @ to_ten
        own = np.column_stack([beside, h[fit.active]])
        taken = cho_solve((fit.solved[0], True), own)
        rest = to_ten.T @ design.between(fit.weights, ids, ids) @ to_ten
        rest = rest - beside.T @ taken[:, :-1]
        mass, *place = _payload(rest, to_ten.T @ h[ids] - beside.T @ taken[:, -1], most)
        if mass > 0.0 and np.abs(place).max() < 5.0:
            yield Term(EFFECTS["link_mass"], (link,), dict(zip(AXES, place, strict=True)))


def _payload(H: Array, h: Array, most: float) -> list[float]:
    """Mass [kg] and place [m] of the payload by which a log is likeliest, (4,).

    Args:
        H: X^T X of ten inertial parameters, what stands beside them taken out.
        h: X^T r.
        most: Mass of the robot [kg].
    """
    size, axes = np.linalg.eigh(0.5 * (H + H.T))
    kept = size > 1e-9 * max(float(size[-1]), 1e-300)
    # A pendulum, say, does not show where along its axis, nor a mass apart from its extent.
    known = np.array([most, *(_REACH,) * 3, most * _GYRATION**2])
    A = np.sqrt(size[kept])[:, None] * axes[:, kept].T
    b = axes[:, kept].T @ h / np.sqrt(size[kept])

    def left(p: Array) -> Array:
        rest = A @ (point_mass(p[0], p[1:4]) + p[4] * ALIKE) - b
        return np.append(rest, p / known)

    # Free of each other the ten parameters tell mass and first moment, where the log shows both.
    ten = axes[:, kept] @ (b / np.sqrt(size[kept]))
    starts = [[float(ten[0]), *(ten[1:4] / ten[0]), 0.0]] if ten[0] > 0.0 else []
    for centre in _AROUND:
        unit = A @ point_mass(1.0, centre)
        starts.append([float(unit @ b) / max(float(unit @ unit), 1e-300), *centre, 0.0])
    found = [least_squares(left, start, x_scale="jac") for start in starts if start[0] > 0.0]
    if not found:
        return [0.0] * 4
    best = min(found, key=lambda f: float(f.cost))
    return np.asarray(best.x[:4]).tolist()
