"""Electrical power of measured robots over everything that is not published, before any fit.

What decides the demand (gait, stance, direction of the ground's forces) is taken in every
combination of its ways; numbers of the actuators at the middle and at every combination of the ends
of their intervals. The range is the least and the greatest of all of these, the nominal value that
of the likeliest ways and the middles. What one unknown moves is told with all others nominal.
"""

from __future__ import annotations

import itertools
import logging
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from actuators.units import from_si
from pipeline.api.demand import demand, energy
from pipeline.api.machine import Machine, load
from pipeline.api.motion import stand
from pipeline.dynamics.force_rules import LEAST_TANGENTIAL
from pipeline.errors import PipelineError, RobotFileError
from pipeline.measured.facts import Facts, Quantity, Spring, Unknown, Way

logger = logging.getLogger("legwatt")

#: Robot files, from the project's own folder.
ROBOTS: Final = Path(__file__).resolve().parents[2] / "urdf"
SAMPLES: Final = 51  # per half period: energies within 1 %
#: Of the numbers, the index of the middle, the low and the high end.
MIDDLE, LOW, HIGH = 0, 1, 2

#: Which way of every unknown with ways, and which end of every one with numbers.
Choice = tuple[int, ...]


@dataclass(frozen=True)
class Prediction:
    """Power of one quantity by every choice [W]."""

    #: By choice; a choice that the robot cannot walk or stand in has none.
    power: Mapping[Choice, float]
    nominal: Choice  #: The choice of the likeliest ways and the middles.
    refused: str = ""  #: Of a choice that cannot be, in one line; empty where all can.

    @property
    def range(self) -> tuple[float, float, float]:
        """Least, nominal and greatest [W]."""
        values = self.power.values()
        return min(values), self.power[self.nominal], max(values)

    def ends(self, at: int) -> list[tuple[int, float]]:
        """What one unknown does with all others nominal: its ways or ends and the power [W]."""
        changed = {
            choice[at]: watts
            for choice, watts in self.power.items()
            if (*choice[:at], *choice[at + 1 :]) == (*self.nominal[:at], *self.nominal[at + 1 :])
        }
        return sorted(changed.items(), key=lambda item: item[1])


def predicted(facts: Facts, quantity: Quantity) -> Prediction:
    """Power of a quantity that is computed, over everything that is not published.

    Raises:
        PipelineError: The facts name what the robot does not have, or it cannot do the nominal.
        ActuatorError: Likewise of its actuators.
    """
    machine = load(ROBOTS / facts.robot, changes={**facts.set, **quantity.set})
    built = {
        ends: machine.with_values(_numbers(machine, facts.unknown, ends))
        for ends in _ends(facts.unknown)
    }
    ways = [range(len(u.way)) if u.way else (MIDDLE,) for u in facts.unknown]
    power: dict[Choice, float] = {}
    refused = ""
    logger.info("%s: %s", facts.title, quantity.name)
    for chosen in itertools.product(*ways):
        try:
            power.update(_over_numbers(facts, quantity, machine, chosen, built))
        except PipelineError as error:
            if not any(chosen):
                raise
            refused = refused or str(error)
    return Prediction(power, (0,) * len(facts.unknown), refused)


def _over_numbers(
    facts: Facts,
    quantity: Quantity,
    machine: Machine,
    chosen: Choice,
    built: Mapping[Choice, Machine],
) -> Iterator[tuple[Choice, float]]:
    """Power of one combination of ways, at the middle and all ends of the numbers.

    Numbers change what the actuators answer, not what is asked of them.
    """
    ways = [u.way[k] for u, k in zip(facts.unknown, chosen, strict=True) if u.way]
    springs = [s for s in (quantity.spring, *(w.spring for w in ways)) if s is not None]
    posed = _sprung(_posed(facts, machine, ways), facts, springs)
    forces = next((w.forces for w in ways if w.forces), LEAST_TANGENTIAL)
    walked = demand(posed, samples=SAMPLES, forces=forces) if quantity.does == "walk" else None
    less = walked is not None and any(w.less_standing for w in ways)
    stood = None
    if walked is None or less:
        stood = stand(posed, facts.actuator, forces=forces).result.demand
    for ends, other in built.items():
        watts = 0.0
        if stood is not None:
            held = other.ready.chain(facts.actuator).holding(stood.torque[0], stood.position[0])
            watts = (-1.0 if less else 1.0) * float(held.power.sum())
        if walked is not None:
            taken = energy(other, walked, facts.actuator, regeneration=facts.regeneration)
            watts += float(taken[facts.actuator].sum()) / walked.joints.duration
        yield tuple(max(pair) for pair in zip(chosen, ends, strict=True)), watts


def _posed(facts: Facts, machine: Machine, ways: list[Way]) -> Machine:
    """The machine with gait and stance as chosen."""
    spread = float(np.prod([way.spread for way in ways]))
    if spread != 1.0:
        spec = machine.files.spec
        assert spec is not None
        legs = tuple(
            replace(leg, neutral_foot=(spread * x, spread * y, z))
            for leg in spec.legs
            for x, y, z in (leg.neutral_foot,)
        )
        files = replace(machine.files, spec=replace(spec, legs=legs))
        machine = replace(machine, files=files, loaded=None)
    return machine.with_values({key: value for way in ways for key, value in way.set.items()})


def _ends(unknowns: tuple[Unknown, ...]) -> Iterator[Choice]:
    """The middle, each number alone at its ends, and every combination of ends."""
    free = [k for k, u in enumerate(unknowns) if u.numbers]
    none = (MIDDLE,) * len(unknowns)
    seen = [none]
    for k in free:
        seen += [(*none[:k], end, *none[k + 1 :]) for end in (LOW, HIGH)]
    for ends in itertools.product((LOW, HIGH), repeat=len(free)):
        at = dict(zip(free, ends, strict=True))
        seen.append(tuple(at.get(k, MIDDLE) for k in range(len(unknowns))))
    yield from dict.fromkeys(seen)


def _numbers(machine: Machine, unknowns: tuple[Unknown, ...], ends: Choice) -> dict[str, float]:
    """Numbers of the actuators at the chosen ends of their intervals, in their files' units."""
    out = {}
    for unknown, end in zip(unknowns, ends, strict=True):
        for name in unknown.numbers if end != MIDDLE else ():
            number = machine.ready.catalog.parameter(name)
            if number.interval is None:
                raise RobotFileError(f"unknown '{unknown.name}': {name} has no interval")
            out[name] = from_si(number.interval[end == HIGH], number.unit)
    return out


def _sprung(machine: Machine, facts: Facts, springs: list[Spring]) -> Machine:
    """The machine with springs beside its joints."""
    for spring in springs:
        for joint in machine.ready.robot.joints:
            if joint.endswith(spring.joints):
                values = {"stiffness": spring.stiffness, "rest": spring.rest}
                machine = machine.with_effect(
                    "parallel_spring", joint, values, alternative=facts.actuator
                )
    return machine
