"""From a regression's result to findings: effects of the catalogue, like ones told as one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipeline.effects.bodies.link_mass import AXES, FARTHEST, LinkMass
from pipeline.effects.bodies.rigid_body_parameters import NAMES, UNITS, physical
from pipeline.effects.drive.rotor_inertia import RotorInertia
from pipeline.effects.friction.joint_friction import JointFrictionLaw
from pipeline.effects.registry import effect_named
from pipeline.identification import results as limits
from pipeline.identification.results import Estimate, Member
from pipeline.identification.whole.beside import besides, preloads
from pipeline.identification.whole.errors import NotWholeError
from pipeline.identification.whole.told import Told, estimate, exact
from pipeline.machine.machine import MachineModel
from pipeline.regression import Friction, Level, Result, Term
from pipeline.regression.laws.payload import Payload

Array = NDArray[np.float64]
#: Standard errors in half of a 95 % interval.
COVER: Final = 1.96
LAW: Final = (
    "no law of the catalogue predicts validation data as well as a smooth curve over speed and load"
)


def told(
    result: Result, model: MachineModel, carried: Mapping[str, Array], channel: str
) -> list[Told]:
    """Findings of a result in the order in which they are applied: bodies first.

    Args:
        result: Of the regression.
        model: Before it.
        carried: Inertial parameters (10,) that hang on a joint behind others that were held.
        channel: That is compared.

    Raises:
        NotWholeError: A body as fitted is none without what hangs on it.
    """
    out = [*bodies(result, model, carried), *payload(result, model)]
    out += couplings(result)
    out += frictions(result)
    out += inertias(result, model) + offsets(result, model)
    return out + besides(result, model, channel)


def bodies(result: Result, model: MachineModel, carried: Mapping[str, Array]) -> list[Told]:
    """Inertial parameters of every link that has any; see `told`."""
    if not result.refit:
        return []
    links = {joint: link for link, joint in model.links.items()}
    members = []
    for k, joint in enumerate(list(result.model.names)[1:]):
        ten, half = result.bodies[10 * k : 10 * k + 10], result.bodies_half[10 * k : 10 * k + 10]
        if ten[0] <= 0.0 or str(joint) not in links:
            continue
        weight = carries(result)
        if weight is not None and weight.body == k:
            ten = ten - weight.parameters
        if str(joint) in carried:
            ten = ten - carried[str(joint)]
            if not physical(ten):
                raise NotWholeError(
                    f"'{links[str(joint)]}' as fitted is no body without what hangs still on it"
                )
        parameters = tuple(
            estimate(n, float(x), float(h), unit, low=0.0 if n in ("mass", *_DIAGONAL) else -1e6)
            for n, x, h, unit in zip(NAMES, ten, half, UNITS, strict=True)
        )
        place = (links[str(joint)],)
        members.append(Member(place, parameters, limits.CONFIRMED, result.refit_share))
    return [Told("rigid_body_parameters", "", "", tuple(members))]


def carries(result: Result) -> Payload | None:
    """What a link carries, if what is left of it without is a body."""
    one = result.loaded
    if one is None:
        return None
    ten = result.bodies[10 * one.body : 10 * one.body + 10] - one.parameters
    return one if ten[0] > 0.0 and (ten[[4, 6, 9]] >= 0.0).all() and physical(ten) else None


def payload(result: Result, model: MachineModel) -> list[Told]:
    """What the one link carries that is far from its URDF, where all others are near theirs."""
    one = carries(result)
    if one is None:
        return []
    links = {joint: link for link, joint in model.links.items()}
    link = links[str(list(result.model.names)[1 + one.body])]
    t = COVER
    parameters = (
        estimate("mass", one.mass, t * one.mass_error, "kg", low=0.0),
        *(
            estimate(axis, float(c), t * float(e), "m", low=-FARTHEST, high=FARTHEST)
            for axis, c, e in zip(AXES, one.place, one.place_error, strict=True)
        ),
    )
    sure = one.mass > t * one.mass_error
    level = limits.CONFIRMED if sure else limits.APPROXIMATE
    member = Member((link,), parameters, level, result.refit_share)
    return [Told(LinkMass.name, "", "its mass is not sure", (member,))]


_DIAGONAL: Final = ("Ixx", "Iyy", "Izz")


def couplings(result: Result) -> list[Told]:
    """Motors that turn with another joint."""
    names = [f.joint for f in result.friction]
    out = []
    for c in result.couplings:
        terms = {t.term.split(":")[-1]: t for t in result.terms if t.term in c.names}
        terms = {n: t for n, t in terms.items() if t.level is not Level.SUSPECTED}
        if not terms:
            continue
        parameters = (
            Estimate("ratio", c.ratio, c.ratio, c.ratio, "1"),
            *(_of_term(n, terms.get(n), u) for n, u in _SHAFT.items()),
            *after_reversal(c.rise, c.travel),
        )
        place = (names[c.motor], names[c.other])
        share = max(t.share for t in terms.values())
        sure = any(t.level is Level.CONFIRMED for t in terms.values())
        level = limits.CONFIRMED if sure else limits.APPROXIMATE
        reason = "" if sure else "its size scatters from block to block"
        out.append(
            Told("transmission_coupling", "", reason, (Member(place, parameters, level, share),))
        )
    return out


_SHAFT: Final = {"inertia": "kg*m^2", "viscous": "N*m*s/rad", "coulomb": "N*m"}


def frictions(result: Result) -> list[Told]:
    """Friction of every joint that has any, joints with the same law together."""
    groups: dict[tuple[str, str], list[Member]] = {}
    for friction in result.friction:
        if not friction.terms:
            continue
        share = friction.share
        if any(t.startswith("odd@") for t in friction.terms):
            effect, law = "friction_curve", ""
            member = Member((friction.joint,), curve(friction, result), limits.APPROXIMATE, share)
        else:
            effect = JointFrictionLaw.name
            parameters = named(friction, result.at(friction.joint))
            level = str(friction.level)
            member = Member((friction.joint,), parameters, level, share)
            law = effect_named(effect).law(member.values)
        groups.setdefault((effect, law), []).append(member)
    return [
        Told(
            effect,
            law,
            LAW if effect == "friction_curve" else "other laws win in some draws of the blocks",
            tuple(members),
        )
        for (effect, law), members in groups.items()
    ]


def named(friction: Friction, terms: Sequence[Term]) -> tuple[Estimate, ...]:
    """Parameters of a law with a name, from the sizes of its terms."""
    by = {t.term: t for t in terms}
    units = {p.name: p.unit for p in effect_named(JointFrictionLaw.name).parameters}
    shape, out = friction.shape, []

    def of(term: str, name: str, factor: float = 1.0) -> Estimate:
        t = by[term]
        low = -1e3 if name == "asymmetry" else 0.0
        value, half = factor * t.value, factor * max(t.high - t.value, t.value - t.low)
        own = estimate(name, value, half, units[name], low=low)
        return replace(own, level=str(t.level), share=t.share)

    for term in friction.terms:
        kind, _, number = term.partition("@")
        k = int(number or 0)
        if kind == "stribeck":
            out += [of(term, "excess"), exact("stribeck_speed", shape.stribeck_speed(k))]
        elif kind == "saturating":
            out += [of(term, "saturating"), exact("saturation_speed", shape.saturation_speed(k))]
        elif kind == "motor":
            mu = shape.motor_share(k)
            out += [of(term, "driving", 1 / (1 - mu)), of(term, "driven", 1 / (1 + mu))]
        elif kind == "even":
            out.append(of(term, "asymmetry"))
        else:
            out.append(of(term, kind))
    out += after_reversal(shape.rise, shape.travel)
    return _passive(out)


def after_reversal(rise: float, travel: float) -> list[Estimate]:
    """Over which speed or travel dry friction rises, where it does not jump."""
    out = [exact("rise", rise)] if rise else []
    return [*out, *([exact("travel", travel, "rad")] if travel else [])]


def _passive(parameters: Sequence[Estimate]) -> tuple[Estimate, ...]:
    """With an asymmetry that gives no energy."""
    by = {p.name: p for p in parameters}
    if "asymmetry" in by:
        most = by["viscous"].value if "viscous" in by else 0.0
        p = by["asymmetry"]
        value = float(np.clip(p.value, -most, most))
        by["asymmetry"] = Estimate(p.name, value, min(p.low, value), max(p.high, value), p.unit)
    return tuple(by.values())


def curve(friction: Friction, result: Result) -> tuple[Estimate, ...]:
    """Knots of the general member: levels, asymmetries and shares, none of which gives energy."""
    joint = [f.joint for f in result.friction].index(friction.joint)
    terms, shape = friction.terms, friction.shape
    half = {t: result.halves.get((str(joint), t), 0.0) for t in terms}

    def sized(table: Mapping[str, float], *names: str) -> float:
        return sum(table.get(n, 0.0) for n in names)

    speeds, levels, skews, shares = [], [], [], []
    viscous = max(terms.get("viscous", 0.0), 0.0)
    lost = min(terms.get("viscous", 0.0), 0.0)
    load = np.array([terms.get(f"loaded@{k}", 0.0) for k in range(len(shape.knots))])
    for k, speed in enumerate(shape.knots.tolist()):
        number = k + 1
        level = sized(terms, "coulomb", f"odd@{k}") + lost * speed
        level = max(level, -viscous * speed)
        most = level + viscous * speed
        skew = float(np.clip(terms.get(f"evenly@{k}", 0.0), -most, most))
        share = float(np.clip(terms.get("load", 0.0) + load[k], 0.0, 0.99))
        speeds.append(exact(f"speed_{number}", speed))
        spread = float(np.hypot(half.get("coulomb", 0.0), half.get(f"odd@{k}", 0.0)))
        levels.append(estimate(f"level_{number}", level, spread, "N*m"))
        spread = half.get(f"evenly@{k}", 0.0)
        skews.append(estimate(f"asymmetry_{number}", skew, spread, "N*m"))
        spread = float(np.hypot(half.get("load", 0.0), half.get(f"loaded@{k}", 0.0)))
        shares.append(estimate(f"share_{number}", share, spread, "1", low=0.0, high=0.99))
    last = (
        estimate("viscous", viscous, half.get("viscous", 0.0), "N*m*s/rad", low=0.0),
        exact("rise", shape.rise),
        *([exact("travel", shape.travel, "rad")] if shape.travel else []),
    )
    return (*speeds, *levels, *skews, *shares, *last)


def inertias(result: Result, model: MachineModel) -> list[Told]:
    """Rotor inertia at the motors."""
    members = []
    for t in result.terms:
        if t.term != "rotor" or t.level is Level.SUSPECTED:
            continue
        ratio = model.actuator(t.place).ratio
        half = max(t.high - t.value, t.value - t.low) / ratio**2
        added = estimate("added", t.value / ratio**2, half, "kg*m^2", low=0.0)
        members.append(Member((t.place,), (added,), str(t.level), t.share))
    if not members:
        return []
    reason = "beside the bodies' inertia its size is not sure at every joint"
    return [Told(RotorInertia.name, "", reason, tuple(members))]


def offsets(result: Result, model: MachineModel) -> list[Told]:
    """A torque that is always there, as the zero of the sensor that shows it.

    A sensor's zero is added behind its scale, and the regression tells torques as they should be.
    """
    members, sprung = [], preloads(result)
    gain = dict(zip((f.joint for f in result.friction), result.gain, strict=True))
    for t in result.terms:
        if t.term != "offset" or t.level is Level.SUSPECTED or t.place in sprung:
            continue
        half = max(t.high - t.value, t.value - t.low)
        zero = estimate("offset", gain[t.place] * t.value, gain[t.place] * half, "N*m")
        members.append(Member((t.place,), (zero,), str(t.level), t.share))
    if not members or any(a.motor is not None for a in model.actuators):
        return []
    return [Told("effort_offset", "", "its size scatters from block to block", tuple(members))]


def suspected(result: Result) -> list[str]:
    """What was looked at and is not in the model, in words."""
    return [
        f"{t.kind} at {t.place} is suspected, not written: {t.value:.3g} {t.unit} closes "
        f"{100 * max(t.closes, 0.0):.1f} % of what stays unexplained there"
        for t in result.terms
        if t.level is Level.SUSPECTED
    ]


def _of_term(name: str, term: Term | None, unit: str) -> Estimate:
    if term is None:
        return Estimate(name, 0.0, 0.0, 0.0, unit)
    return estimate(name, max(term.value, 0.0), term.high - term.value, unit, low=0.0)
