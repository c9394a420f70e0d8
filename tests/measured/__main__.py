"""Electrical power of robots that others measured, over what is predicted of it.

What decides the demand (gait, stance, direction of the ground's forces) is taken in every
combination of its *ways*, the likeliest first; *numbers* of the actuators at the middle and at
every combination of the ends of their intervals. Predicted are the least and the greatest of all
of these, and that of the likeliest ways and the middles. Nothing is fitted.
"""

import hashlib
import itertools
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from actuators.errors import LegwattError
from actuators.parameters import from_si
from pipeline.commands.robots import load
from pipeline.commands.walking import demand, energy, stand
from pipeline.dynamics.contact_forces import LEAST_TANGENTIAL
from pipeline.simulation.machine import Machine

ROOT = Path(__file__).resolve().parents[2]
FACTS = Path(__file__).parent / "facts"
#: The committed table, which the page of `choose` shows.
TABLE = ROOT / "pipeline" / "choice" / "measured_robots.csv"
SAMPLES = 51  # per half period: energies within 1 %
#: Of the numbers, the index of the middle, the low and the high end.
MIDDLE, LOW, HIGH = 0, 1, 2

Facts = Mapping[str, Any]
#: Which way of every unknown with ways, and which end of every one with numbers.
Choice = tuple[int, ...]
#: Power by choice [W]; a choice that the robot cannot walk or stand in has none.
Power = dict[Choice, float]


def read_facts(folder: Path = FACTS) -> dict[str, Facts]:
    """Every robot by the name of its file."""
    files = sorted(folder.glob("*.toml"))
    return {path.stem: tomllib.loads(path.read_text(encoding="utf-8")) for path in files}


def predicted(facts: Facts, quantity: Mapping[str, Any]) -> Power:
    """Power of a quantity by every choice [W]."""
    unknown = facts["unknown"]
    machine = load(
        ROOT / "urdf" / facts["robot"], changes=facts.get("set", {}) | quantity.get("set", {})
    )
    built = {
        ends: machine.with_values(dict(_numbers(machine, unknown, ends))) for ends in _ends(unknown)
    }
    power: Power = {}
    for chosen in itertools.product(*(range(len(u.get("way", "1"))) for u in unknown)):
        try:
            power |= _over_numbers(facts, quantity, machine, chosen, built)
        except LegwattError:
            if not any(chosen):  # the likeliest has to be possible
                raise
    return power


def _over_numbers(
    facts: Facts,
    quantity: Mapping[str, Any],
    machine: Machine,
    chosen: Choice,
    built: Mapping[Choice, Machine],
) -> Power:
    """Power of one combination of ways; numbers change what actuators answer, not what is asked."""
    name, walks = facts["actuator"], quantity["does"] == "walk"
    ways = [u["way"][k] for u, k in zip(facts["unknown"], chosen, strict=True) if "way" in u]
    posed = _posed(machine, ways)
    for joint in posed.robot.joints:
        if (spring := quantity.get("spring")) and joint.endswith(spring["joints"]):
            values = {"stiffness": spring["stiffness"], "rest": 0.0}
            posed = posed.with_effect("parallel_spring", joint, values, alternative=name)
    forces = next((way["forces"] for way in ways if "forces" in way), LEAST_TANGENTIAL)
    walked = demand(posed, samples=SAMPLES, forces=forces) if walks else None
    stands = not walks or any(way.get("less_standing") for way in ways)
    stood = stand(posed, name, forces=forces).result.demand if stands else None
    power: Power = {}
    for ends, other in built.items():
        watts = 0.0
        if stood is not None:
            held = other.chains(name)[name].holding(stood.torque[0], stood.position[0])
            watts = float(held.power.sum()) * (-1.0 if walks else 1.0)
        if walked is not None:
            taken = energy(other, walked, name, regeneration=facts.get("regeneration", "none"))
            watts += float(taken[name].sum()) / walked.duration
        power[tuple(max(pair) for pair in zip(chosen, ends, strict=True))] = watts
    return power


def _posed(machine: Machine, ways: Sequence[Mapping[str, Any]]) -> Machine:
    """The machine with gait and stance as chosen."""
    spread = float(np.prod([way.get("spread", 1.0) for way in ways]))
    spec = machine.robot.spec  # legs as the files state them, which no change touches
    feet = [np.array([spread, spread, 1.0]) * leg.neutral_foot for leg in spec.legs]
    legs = tuple(
        leg.model_copy(update={"neutral_foot": tuple(foot.tolist())})
        for leg, foot in zip(spec.legs, feet, strict=True)
    )
    if spread != 1.0 and machine.written is not None:
        machine = replace(machine, written=machine.written.model_copy(update={"legs": legs}))
    return machine.with_values({k: v for way in ways for k, v in way.get("set", {}).items()})


def _ends(unknown: Sequence[Mapping[str, Any]]) -> list[Choice]:
    """The middle, each number alone at its ends, and every combination of ends."""
    free = [k for k, u in enumerate(unknown) if "numbers" in u]
    every = itertools.product((MIDDLE, LOW, HIGH), repeat=len(free))
    picked = [
        dict(zip(free, e, strict=True)) for e in every if e.count(MIDDLE) in (0, len(e) - 1, len(e))
    ]
    return [tuple(own.get(k, MIDDLE) for k in range(len(unknown))) for own in picked]


def _numbers(
    machine: Machine, unknown: Sequence[Mapping[str, Any]], ends: Choice
) -> Iterator[tuple[str, float]]:
    """Numbers of the actuators at the chosen ends of their intervals, in their files' units."""
    for own, end in zip(unknown, ends, strict=True):
        for name in own.get("numbers", ()) if end != MIDDLE else ():
            number = machine.catalog.parameter(name)
            assert number.interval is not None, name
            yield name, from_si(number.interval[end == HIGH], number.unit)


def fingerprint(name: str, folder: Path = FACTS) -> str:
    """The first digits of the SHA-256 of a file of facts."""
    return hashlib.sha256((folder / f"{name}.toml").read_bytes()).hexdigest()[:12]


def of_robot(name: str, facts: Facts, folder: Path = FACTS) -> pd.DataFrame:
    """Measured over predicted, of every quantity and quotient that is both."""
    power = {q["name"]: predicted(facts, q) for q in facts["quantity"] if "does" in q}
    told = {
        q["name"]: ("W", q["watts"], power.get(q["name"]))
        for q in facts["quantity"]
        if "watts" in q
    }
    for ratio in facts.get("ratio", ()):
        over, under = power[ratio["over"]], power[ratio["under"]]
        both = {choice: over[choice] / under[choice] for choice in over if choice in under}
        told[ratio["name"]] = ("1", [ratio["measured"]], both)
    rows = [
        {
            "robot": facts["title"],
            "quantity": what,
            "measured": min(measured),
            "measured_to": max(measured),
            "unit": unit,
            "least": min(measured) / max(own.values()),
            "likeliest": float(np.mean(measured)) / own[(0,) * len(facts["unknown"])],
            "greatest": max(measured) / min(own.values()),
        }
        for what, (unit, measured, own) in told.items()
        if own is not None
    ]
    return pd.DataFrame(rows).assign(source=facts["source"], facts=fingerprint(name, folder))


def main(table: Path = TABLE, folder: Path = FACTS) -> None:
    """Predict every robot and write the table."""
    every = [of_robot(name, facts, folder) for name, facts in read_facts(folder).items()]
    pd.concat(every).to_csv(table, index=False, float_format="%.4g")


if __name__ == "__main__":
    main()
