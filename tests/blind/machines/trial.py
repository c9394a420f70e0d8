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

from actuators.errors import LegwattError, StanceError
from tests.blind.machines import forward, own
from tests.blind.machines.hidden import FRICTION, OUTSIDE, Case, hide, possible
from tests.blind.machines.machine import MOTIONS, Course, Machine, draw_chain, true_bodies
from tests.blind.machines.plant import Plant
from tests.blind.machines.sensors import measure, with_sensors
from tests.blind.machines.visible import THRESHOLD, judge

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
#: Of the log and of the test log [s]; the hexapod walks cycles between these periods.
SECONDS = (12.0, 9.0)
PERIODS = (((2.6, 3.4), (3.8, 5.0)), ((3.0, 4.5),))
_STEP: Final = 1e-3  # of the own source, and of what is looked at for visibility [s]
#: Machines that are drawn until one does not run away under its controller.
_AGAIN: Final = 5
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
    """Make trial number k of a source and a seed in a new folder; machine and effects are drawn.

    Returns:
        The truth, as written.

    Raises:
        LegwattError: A machine or effect that the source cannot make, or MuJoCo is missing.
    """
    rng = stream(source, seed, k, 0, "trial")
    shares = MACHINES[source]
    name = machine or str(rng.choice(list(shares), p=list(shares.values())))
    if name not in shares:
        raise LegwattError(f"source '{source}' has no machine '{name}': {', '.join(shares)}")
    can = possible(source, name)
    for effect in effects or ():
        if effect not in can:
            known = ", ".join(can)
            raise LegwattError(f"'{effect}' cannot be hidden in a {name} of '{source}': {known}")
    kind = KINDS[k % len(KINDS)] if effects is None else "given"
    if effects is None:
        effects = ()
        names = [effect for effect in can if (effect in OUTSIDE) == (kind == "outside")]
        if kind in ("single", "outside"):
            effects = (str(rng.choice(names)),)
        count = int(rng.integers(2, 4)) if kind == "several" else 0
        # Several are at most one law of friction, and none twice.
        while len(effects) < count or len({*effects} & {*FRICTION}) > 1:
            effects = tuple(str(e) for e in rng.choice(names, count, replace=False))
    for again in range(_AGAIN):
        try:
            truth = _run(source, name, effects, partial(stream, source, seed, k, again), folder)
            break
        except (forward.RanAwayError, StanceError):  # bodies far off may tip a walking robot
            if again == _AGAIN - 1:
                raise
    truth = {"source": source, "seed": seed, "trial": k, "kind": kind} | truth
    (folder / "truth.json").write_text(json.dumps(truth, indent=1, default=float) + "\n", "utf-8")
    return truth


def _run(
    source: str, name: str, effects: tuple[str, ...], random: Random, folder: Path
) -> dict[str, Any]:
    """Draw the machine, hide effects, run it twice, write what is given; the truth."""
    machine = own.draw_walker() if name == "walk" else draw_chain(random("machine"), name)
    rng = random("background")
    off = float(rng.choice(list(OFF), p=list(OFF.values())))
    plant = Plant.rigid(true_bodies(machine, random("bodies"), off), len(machine.joints))
    sides = str(rng.choice(["joint", "motor", "both"], p=[0.7, 0.2, 0.1]))
    # The walking robot's motors have no gear of their own in its files.
    plant = replace(plant, sides="joint" if name == "walk" else sides)
    motions, courses = _courses(machine, random, _STEP)
    torque = own.link_torque(machine, plant.model, courses[0])[0]
    empty = Case(machine, with_sensors(random("sensors"), plant, torque), courses[0], torque)
    if rng.random() < 0.5:
        empty = replace(empty, plant=_with_friction(empty, random("friction")))
    background = empty.plant.terms(machine.joints)

    def hidden(names: tuple[str, ...]) -> tuple[Plant, list[dict[str, Any]]]:
        case, rows = empty, []
        for effect in names:
            row, case = hide(random(f"hide {effect}"), case, effect)
            rows.append(row)
        return case.plant, rows

    plant, rows = hidden(effects)
    if source == "mujoco":
        _, courses = _courses(machine, random, forward.step_of(plant))
    run = own.run if source == "own" else forward.run
    shutil.rmtree(folder, ignore_errors=True)
    options = write_given(machine, folder / "given")
    for number, (log, course) in enumerate(zip(("log", "test"), courses, strict=True)):
        happened = run(machine, plant, course)
        columns = measure(machine, plant, happened, random(f"noise {number}"))
        sink = pa.BufferOutputStream()
        csv.write_csv(pa.table(columns), sink, csv.WriteOptions(quoting_style="none"))
        (folder / "given" / f"{log}.csv").write_bytes(sink.getvalue())
        for row in rows if number == 0 else ():
            without, _ = hidden(tuple(effect for effect in effects if effect != row["effect"]))
            step = round(_STEP / course.dt)
            rows_of = ("time", "q", "v", "a", "motor", "torque")
            seen = replace(happened, **{key: vars(happened)[key][::step] for key in rows_of})
            row["z"], row["alike"] = judge(replace(empty, plant=plant), without, row, off, seen)
            row["visible"] = row["z"] >= THRESHOLD
    return {
        "machine": name,
        "joints": machine.joints,
        "off": off,
        "background": [name for terms in background.values() for name in terms],
        "motions": motions,
        "rate_Hz": plant.rate,
        "bits": plant.bits,
        "sides": plant.sides,
        "hidden": rows,
        "friction": plant.terms(machine.joints),
        "rotors": [j for j, x in zip(machine.joints, plant.inertia, strict=True) if x > 0],
        "options": options,
    }


def _courses(machine: Machine, random: Random, dt: float) -> tuple[list[str], list[Course]]:
    """To learn from and to validate on: never the same kind of motion."""
    rng = random("motion")
    if machine.robot is not None:
        periods = [tuple(rng.uniform(*ends) for ends in log) for log in PERIODS]
        return ["walk", "walk"], [own.gait_course(machine.robot, p, dt) for p in periods]
    kinds = [str(kind) for kind in rng.choice(list(MOTIONS), 2, replace=False)]
    return kinds, [
        MOTIONS[kind](random(f"course {i}"), len(machine.joints), seconds, dt)
        for i, (kind, seconds) in enumerate(zip(kinds, SECONDS, strict=True))
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
        plant = plant.at(j, **law)
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
    (folder / "machine.urdf").write_text(machine.urdf, "utf-8")
    pairs = zip(machine.joints, machine.ratio, strict=True)
    lines = [f"{joint} = {ratio:g}\n" for joint, ratio in pairs]
    (folder / "mapping.toml").write_text("[gear_ratio]\n" + "".join(lines), "utf-8")
    return [*options, "machine.urdf", "--mapping", "mapping.toml"]
