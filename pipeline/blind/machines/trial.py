"""One trial: a machine with its background, what is hidden in it, two logs, and the truth.

Everything that is drawn hangs on source, seed and number alone, each purpose on random numbers of
its own. `make` writes a folder::

    given/      all that the workflow gets to see: URDF or robot files, log.csv, test.csv, mapping
    truth.json  what is in the machine, what its log could show, and the command's options
"""

from __future__ import annotations

import json
import shutil
import zlib
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
from pyarrow import csv

from actuators.errors import closest
from pipeline.atomic import write_text
from pipeline.blind.machines import forward, own
from pipeline.blind.machines.chains import Machine, draw_chain, true_bodies
from pipeline.blind.machines.hidden import BOTH, EFFECTS, Case, hide, possible
from pipeline.blind.machines.motions import MOTIONS, Course
from pipeline.blind.machines.plant import Plant, rigid_plant
from pipeline.blind.machines.sensors import draw_sensors, measure
from pipeline.blind.machines.visible import THRESHOLD, judge
from pipeline.blind.machines.walk import draw_walker, gait_course
from pipeline.errors import PipelineError, TippingError

#: Kinds of ten trials in a row: 4 single, 2 several, 2 outside the catalogue, 2 empty.
KINDS: Final = tuple(["single", "outside", "empty", "single", "several"] * 2)
#: Shares of machines, by source: an answer about an arm takes several times as long as one about a
#: leg; the engine has no walking machine.
MACHINES: Final = {
    "own": {"pendulum": 0.25, "leg": 0.35, "arm": 0.25, "walk": 0.15},
    "mujoco": {"pendulum": 0.3, "leg": 0.4, "arm": 0.3},
}
#: How far bodies are off the URDF's.
OFF: Final = {0.0: 0.5, 0.03: 0.25, 0.2: 0.25}
_SECONDS: Final = (12.0, 9.0)
_STEP: Final = 1e-3  # of the own source, and of what is looked at for visibility [s]
#: Machines that are drawn until one does not run away under its controller.
_AGAIN: Final = 5
_PLAIN: Final = csv.WriteOptions(quoting_style="none")
Random = Callable[[str], np.random.Generator]


def stream(source: str, seed: int, k: int, again: int, purpose: str) -> np.random.Generator:
    """Random numbers for one purpose, so that drawing one thing never moves another."""
    words = [zlib.crc32(f"{source} {purpose}".encode()), seed, k, again]
    return np.random.default_rng(np.random.SeedSequence(words))


def make(
    source: str,
    seed: int,
    k: int,
    folder: Path,
    *,
    machine: str | None = None,
    effects: tuple[str, ...] | None = None,
) -> dict[str, Any]:
    """Make a trial.

    Args:
        source: ``"own"`` or ``"mujoco"``.
        seed: Of all trials, not negative.
        k: Number of the trial.
        folder: Its own; made anew.
        machine: ``"pendulum"``, ``"leg"``, ``"arm"`` or ``"walk"``; drawn by default.
        effects: What to hide; drawn by default.

    Returns:
        The truth, as written.

    Raises:
        PipelineError: An unknown source, machine or effect, one that the source cannot make, or
            MuJoCo is missing.
    """
    if source not in BOTH:
        raise PipelineError(f"source '{source}' is not known; {closest(source, BOTH)}")
    rng = stream(source, seed, k, 0, "trial")
    shares = MACHINES[source]
    name = machine or str(rng.choice(list(shares), p=list(shares.values())))
    if name not in shares:
        raise PipelineError(f"source '{source}' has no machine '{name}'; {', '.join(shares)}")
    kind = KINDS[k % len(KINDS)] if effects is None else "given"
    for effect in effects or ():
        if effect not in EFFECTS:
            raise PipelineError(f"effect '{effect}' is not known; {closest(effect, list(EFFECTS))}")
        if source not in EFFECTS[effect].sources or name not in EFFECTS[effect].machines:
            raise PipelineError(f"'{effect}' cannot be hidden in a {name} of the source '{source}'")
    hidden = _drawn(rng, kind, source, name) if effects is None else effects
    for again in range(_AGAIN):
        try:
            truth = _run(source, name, hidden, partial(stream, source, seed, k, again), folder)
            break
        except (forward.RanAwayError, TippingError):  # bodies far off may tip a walking robot
            if again == _AGAIN - 1:
                raise
    truth = {"source": source, "seed": seed, "trial": k, "kind": kind} | truth
    write_text(folder / "truth.json", json.dumps(truth, indent=1, default=float) + "\n")
    return truth


def _drawn(rng: np.random.Generator, kind: str, source: str, machine: str) -> tuple[str, ...]:
    """What is hidden: at most one law of friction, none twice."""
    if kind == "empty":
        return ()
    names = possible(source, machine, in_catalogue=kind != "outside")
    if kind != "several":
        return (str(rng.choice(names)),)
    count = int(rng.integers(2, 4))
    while True:
        chosen = tuple(str(name) for name in rng.choice(names, count, replace=False))
        if sum(EFFECTS[name].friction for name in chosen) < 2:
            return chosen


def _run(
    source: str, name: str, effects: tuple[str, ...], random: Random, folder: Path
) -> dict[str, Any]:
    """Draw the machine, hide effects, run it twice, write what is given; the truth."""
    machine = draw_walker() if name == "walk" else draw_chain(random("machine"), name)
    rng = random("background")
    off = float(rng.choice(list(OFF), p=list(OFF.values())))
    plant = rigid_plant(machine, true_bodies(machine, random("bodies"), off))
    sides = str(rng.choice(["joint", "motor", "both"], p=[0.7, 0.2, 0.1]))
    # The walking robot's motors have no gear of their own in its files.
    plant = replace(plant, sides="joint" if name == "walk" else sides)
    motions, courses = _courses(machine, random, _STEP)
    torque = own.link_torque(machine, plant.model, courses[0])[0]
    sensors = draw_sensors(random("sensors"), torque)
    empty = Case(machine, plant, courses[0], torque, np.hypot(sensors.white, sensors.coloured))
    if rng.random() < 0.5:
        empty = replace(empty, plant=_with_friction(empty, random("friction")))
    background = empty.plant.friction.terms(machine.joints)
    case, rows = _hidden(empty, effects, random)
    if source == "mujoco":
        _, courses = _courses(machine, random, forward.step_of(case.plant))
    run = own.run if source == "own" else forward.run
    shutil.rmtree(folder, ignore_errors=True)
    options = write_given(machine, folder / "given")
    for number, (log, course) in enumerate(zip(("log", "test"), courses, strict=True)):
        happened = run(machine, case.plant, course)
        columns = measure(machine, case.plant, happened, sensors, random(f"noise {number}"))
        sink = pa.BufferOutputStream()
        csv.write_csv(pa.table(columns), sink, _PLAIN)
        (folder / "given" / f"{log}.csv").write_bytes(sink.getvalue())
        if number == 0:
            for row in rows:
                others = tuple(effect for effect in effects if effect != row["effect"])
                without = _hidden(empty, others, random)[0].plant
                row["z"], row["alike"] = judge(
                    case, without, row, off, happened.every(_STEP), sensors
                )
                row["visible"] = row["z"] >= THRESHOLD
    return {
        "machine": name,
        "joints": machine.joints,
        "off": off,
        "background": [name for own in background.values() for name in own],
        "motions": motions,
        "rate_Hz": sensors.rate,
        "bits": sensors.bits,
        "sides": case.plant.sides,
        "hidden": rows,
        "friction": case.plant.friction.terms(machine.joints),
        "rotors": [j for j, x in zip(machine.joints, case.plant.inertia, strict=True) if x > 0],
        "options": options,
    }


def _hidden(
    case: Case, effects: tuple[str, ...], random: Random
) -> tuple[Case, list[dict[str, Any]]]:
    rows = []
    for effect in effects:
        row, case = hide(random(f"hide {effect}"), case, effect)
        rows.append(row)
    return case, rows


def _courses(machine: Machine, random: Random, dt: float) -> tuple[list[str], list[Course]]:
    """To learn from and to validate on: never the same kind of motion."""
    rng, robot = random("motion"), machine.robot
    if robot is not None:
        first, second, third = rng.uniform([2.6, 3.8, 3.0], [3.4, 5.0, 4.5])
        paces = ((first, second), (third,))
        return ["walk", "walk"], [gait_course(robot, periods, dt) for periods in paces]
    kinds = [str(kind) for kind in rng.choice(list(MOTIONS), 2, replace=False)]
    return kinds, [
        MOTIONS[kind](random(f"course {i}"), len(machine.joints), seconds, dt)
        for i, (kind, seconds) in enumerate(zip(kinds, _SECONDS, strict=True))
    ]


def _with_friction(case: Case, rng: np.random.Generator) -> Plant:
    """Coulomb and viscous friction of 3 to 20 % of its torque at every joint; some have more."""
    plant = case.plant
    for j in range(len(case.machine.joints)):
        rms = float(np.sqrt(np.mean(case.torque[:, j] ** 2)))
        level = max(rms, 5.0 * float(case.noise[j])) * float(np.exp(rng.uniform(-3.5, -1.6)))
        fast = float(np.sqrt(np.mean(case.course.v[:, j] ** 2)))
        law = {"coulomb": level, "viscous": level / fast * rng.uniform(0.2, 1.0)}
        kind = rng.choice(["plain", "stribeck", "load", "uneven"], p=[0.7, 0.1, 0.1, 0.1])
        if kind == "stribeck":
            law |= {"excess": level * rng.uniform(0.3, 1.0), "stribeck": 0.15 * fast}
        if kind == "load":
            law |= dict.fromkeys(("driving", "driven"), rng.uniform(0.03, 0.2))
        if kind == "uneven":
            law["asymmetry"] = 0.3 * level
        plant = replace(plant, friction=plant.friction.at(j, **law))
    return plant


def write_given(machine: Machine, folder: Path) -> list[str]:
    """Write robot files and mapping; the options of the command, relative to the folder."""
    folder.mkdir(parents=True)
    options = ["log.csv", "--holdout", "test.csv", "--robot"]
    if machine.robot is not None:
        (folder / "urdf").mkdir()
        for path in (*machine.robot.spec.sources, machine.robot.spec.urdf):
            shutil.copyfile(path, folder / "urdf" / path.name)
        return [*options, f"urdf/{machine.robot.spec.path.name}", "--alternative", "ideal"]
    write_text(folder / "machine.urdf", machine.urdf)
    pairs = zip(machine.joints, machine.ratio, strict=True)
    lines = [f"{joint} = {ratio:g}\n" for joint, ratio in pairs]
    write_text(folder / "mapping.toml", "[gear_ratio]\n" + "".join(lines))
    return [*options, "machine.urdf", "--mapping", "mapping.toml"]
