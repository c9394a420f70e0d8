"""The sentences of section IV.A, on the energy through each stage of each actuator, as numbers.

The paper draws these energies (Fig. 14, 16, 18 and 20) and says in words how they compare. *Much
higher* has no number in it: here it means at least `MUCH` times as high, at the joint in question.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from actuators.elements.inertia import Inertia
from actuators.energy.energy import integral, stage_energies
from actuators.loading.build import WINDING
from pipeline.paper.calibration.machine import PUBLISHED_LEG, ActuatorPart, leg_joints
from pipeline.paper.judgement.conclusions import FOLLOWS, Sentence, Values
from pipeline.robot.robot_file import RobotSpec

#: Times as high that count as "much higher".
MUCH = 2.0
#: By which two energies may differ and be the same: what integration leaves, and more [1].
_SAME = 1e-3
_JOINTS = ("1", "2", "3")
_ROTOR, _ROTOR_INERTIA = "rotor", "rotor_inertia"
_DISSIPATED = "dissipated"
_WITHOUT_INERTIA = "rotor without inertia"


@dataclass(frozen=True)
class _Claim:
    """A sentence about a ratio of two energies, joint by joint.

    Attributes:
        where: Section.
        text: In the paper's terms.
        quantity: The ratio in words.
        printed: What the paper says of it: a key of `_TESTS`.
        over: Above the line: alternative, and stage with sense or `_DISSIPATED`.
        under: Below the line.
        joints: Of the middle right leg.
    """

    where: str
    text: str
    quantity: str
    printed: str
    over: tuple[str, str]
    under: tuple[str, str]
    joints: tuple[str, ...] = _JOINTS


_TESTS = {
    "the same": lambda ratio: abs(ratio - 1.0) <= _SAME,
    "higher": lambda ratio: ratio > 1.0 + _SAME,
    "much higher": lambda ratio: ratio >= MUCH,
}
_CLAIMS = (
    _Claim(
        "Section IV.A.1",
        "as much energy comes back from the joint as goes to it",
        "ideal actuator, E_out(+) over E_out(-)",
        "the same",
        ("ideal", "out+"),
        ("ideal", "out-"),
    ),
    _Claim(
        "Section IV.A.1",
        "an ideal transmission takes in what it gives out",
        "ideal actuator, E_m(+) over E_out(+)",
        "the same",
        ("ideal", "m+"),
        ("ideal", "out+"),
    ),
    _Claim(
        "Section IV.A.1",
        "at joint 2 the ideal motor is given much more than it passes on",
        "ideal actuator, E_el(+) over E_m(+)",
        "much higher",
        ("ideal", "el+"),
        ("ideal", "m+"),
        ("2",),
    ),
    _Claim(
        "Section IV.A.2",
        "the ideal transmission takes in the same behind a real rotor",
        "E_mt(+) behind the rotor over E_m(+) of the ideal actuator",
        "the same",
        (_ROTOR, "mt+"),
        ("ideal", "m+"),
    ),
    _Claim(
        "Section IV.A.2",
        "with a real rotor the motor has to provide much more",
        "E_m(+), actuator with ideal transmission over ideal actuator",
        "much higher",
        (_ROTOR, "m+"),
        ("ideal", "m+"),
    ),
    _Claim(
        "Section IV.A.2",
        "the fluctuation of the rotor's kinetic energy increases the dissipation in it",
        "friction loss of the rotor, over the same without inertia",
        "higher",
        (_ROTOR, _DISSIPATED),
        (_WITHOUT_INERTIA, _DISSIPATED),
    ),
    _Claim(
        "Section IV.A.3",
        "the Harmonic Drive takes in much more than it gives out",
        "reversible actuator, E_wg(+) over E_out(+)",
        "much higher",
        ("reversible", "wg+"),
        ("reversible", "out+"),
    ),
    _Claim(
        "Section IV.A.3",
        "so does the timing belt",
        "reversible actuator, E_m(+) over E_wg(+)",
        "much higher",
        ("reversible", "m+"),
        ("reversible", "wg+"),
    ),
    _Claim(
        "Section IV.A.4",
        "the irreversible actuator dissipates more than the reversible one",
        "heat of friction, irreversible over reversible",
        "higher",
        ("irreversible", _DISSIPATED),
        ("reversible", _DISSIPATED),
    ),
    _Claim(
        "Section IV.A.4",
        "so its motor has to provide more",
        "E_m(+), irreversible over reversible",
        "higher",
        ("irreversible", "m+"),
        ("reversible", "m+"),
    ),
)


def _key(alternative: str, what: str, joint: str) -> str:
    return f"{alternative}:{what}:{joint}"


def _sentence(claim: _Claim, joint: str) -> Sentence:
    above, below = (_key(*side, joint) for side in (claim.over, claim.under))

    def ratio(values: Values) -> float:
        return values[above] / values[below] if values[below] else math.nan

    much = f" (at least {MUCH:g} times)" if claim.printed == "much higher" else ""
    return Sentence(
        f"{above} / {below}",
        claim.text,
        claim.quantity,
        "1",
        claim.printed + much,
        FOLLOWS,
        "",
        ratio,
        lambda values: _TESTS[claim.printed](ratio(values)),
        (above, below),
        claim.where,
        joint,
    )


#: Every sentence of section IV.A at every joint it speaks of.
STAGE_SENTENCES = tuple(_sentence(claim, joint) for claim in _CLAIMS for joint in claim.joints)


def stage_values(actuators: ActuatorPart, spec: RobotSpec) -> dict[str, float]:
    """What the sentences of section IV.A compare: energies of the middle right leg per cycle [J].

    Args:
        actuators: The middle legs' walk with the paper's alternatives, or some of them.
        spec: The robot, for the leg's joints.
    """
    walks = dict(actuators.walking)
    if _ROTOR in walks:
        chain = actuators.chains[_ROTOR]
        rotor = chain.element(_ROTOR_INERTIA)
        assert isinstance(rotor, Inertia)
        light = chain.replaced(replace(rotor, inertia=0.0))
        walks[_WITHOUT_INERTIA] = light.moving(walks[_ROTOR].joint)
    out: dict[str, float] = {}
    for name, walk in walks.items():
        energies = stage_energies(walk)
        losses = [power for element, power in walk.losses.items() if element != WINDING]
        heat = integral(walk.joint.time, np.sum(losses, axis=0)) if losses else None
        for number, joint in enumerate(leg_joints(spec, PUBLISHED_LEG), start=1):
            column, at = walk.joint.joints.index(joint), str(number)
            for energy in energies:
                out[_key(name, f"{energy.stage}+", at)] = float(energy.forward[column])
                out[_key(name, f"{energy.stage}-", at)] = float(energy.reverse[column])
            if heat is not None:
                out[_key(name, _DISSIPATED, at)] = float(heat[column])
    return out
