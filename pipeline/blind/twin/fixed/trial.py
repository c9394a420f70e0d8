"""One trial of the standard matrix: a machine with its background, what is hidden, two logs.

The background is what any machine has: bodies that are not the URDF's, friction of some law at
every joint, torques that are late by joint, noise in colour. A bare background, for empty trials,
is a machine almost as drawn.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pipeline.blind.twin.errors import TwinError
from pipeline.blind.twin.fixed.hidden import EFFECTS, UNKNOWN, Case, Hidden, case_of
from pipeline.blind.twin.fixed.machines import FixedMachine, draw_machine, true_bodies
from pipeline.blind.twin.fixed.motions import Course, sines, strokes
from pipeline.blind.twin.fixed.sensing import FixedSensors, Measured, measure
from pipeline.blind.twin.fixed.simulate import Truth, link_torque, rigid_truth, simulate
from pipeline.blind.twin.fixed.visible import Own, misfit, misfit_of_sides
from pipeline.blind.twin.setup import stream

Array = NDArray[np.float64]
STEP: Final = 2e-3  # of the simulation [s]
_SECONDS: Final = (10.0, 8.0)
#: How far bodies are off: as machines are, as a weighed machine is, and of a machine as drawn.
OFF: Final = {"machine": 0.2, "weighed": 0.03, "bare": 0.01}


@dataclass(frozen=True)
class FixedTrial:
    """What one trial leaves.

    Attributes:
        machine: By its URDF.
        log: Columns to learn from.
        test: Columns of another motion, to validate on.
        mapping: Text of a mapping file.
        truth: Everything that was drawn; for the sealed file.
    """

    machine: FixedMachine
    log: dict[str, Array]
    test: dict[str, Array]
    mapping: str
    truth: dict[str, Any]


def make_fixed_trial(seed: int, name: str, effects: tuple[str, ...], background: str) -> FixedTrial:
    """Draw a machine, hide effects in it, run it twice and measure it.

    Args:
        seed: Of everything drawn.
        name: Of `MACHINES`.
        effects: To hide.
        background: Key of `OFF`.

    Raises:
        TwinError: An unknown effect or background.
    """
    for effect in effects:
        if effect not in EFFECTS and effect not in UNKNOWN:
            raise TwinError(f"effect '{effect}' cannot be hidden in a fixed-base machine")
    if background not in OFF:
        raise TwinError(f"background '{background}' is not known: {', '.join(OFF)}")
    machine = draw_machine(stream(seed, "machine"), name)
    courses = _courses(seed, len(machine.joints))
    model, bodies = true_bodies(machine, stream(seed, "bodies"), OFF[background])
    plain = rigid_truth(model)
    case = case_of(machine, plain, _sensors(seed, plain, courses[0], machine), courses[0])
    if background != "bare":
        case = replace(case, truth=_with_friction(case, stream(seed, "friction")))
    empty, hidden = case, []
    for effect in effects:
        drawn, case = (EFFECTS | UNKNOWN)[effect](stream(seed, f"hide {effect}"), case)
        hidden.append(drawn)
    log, test = (_run(seed, k, case, course) for k, course in enumerate(courses))
    seen = [_misfit(case, _without(effects, k, empty, seed), h, seed) for k, h in enumerate(hidden)]
    truth = {
        "seed": seed,
        "machine": name,
        "background": background,
        "bodies": bodies,
        "friction": [] if background == "bare" else list(machine.joints),
        "uneven": [
            joint
            for joint, size in zip(machine.joints, empty.truth.friction.asymmetry, strict=True)
            if size
        ],
        "delays_s": case.sensors.delay.tolist(),
        "sides": case.sensors.sides,
        "hidden": [
            {
                "effect": h.effect,
                "place": list(h.place),
                "values": h.values,
                "in_catalogue": h.in_catalogue,
                "misfit": z,
            }
            for h, z in zip(hidden, seen, strict=True)
        ],
    }
    pairs = zip(machine.joints, machine.ratio, strict=True)
    ratios = "".join(f"{joint} = {ratio:g}\n" for joint, ratio in pairs)
    return FixedTrial(machine, log.columns, test.columns, f"[gear_ratio]\n{ratios}", truth)


def _courses(seed: int, joints: int) -> tuple[Course, Course]:
    """To learn from and to validate on: never the same kind of motion."""
    rng = stream(seed, "motion")
    kinds = [sines, strokes]
    if rng.random() < 0.3:
        kinds.reverse()
    first, second = (
        kind(rng, joints, seconds, STEP) for kind, seconds in zip(kinds, _SECONDS, strict=True)
    )
    return first, second


def _sensors(seed: int, truth: Truth, course: Course, machine: FixedMachine) -> FixedSensors:
    rng = stream(seed, "sensors")
    torque = simulate(truth, course).torque
    # A wrist that carries next to nothing has the noise of its drive, not of its load.
    size = np.maximum(torque.std(axis=0), 0.02 * float(torque.std(axis=0).max()))
    white = size * np.exp(rng.uniform(np.log(0.004), np.log(0.03), size.size))
    n = size.size
    late = rng.random() < 0.4
    return FixedSensors(
        every=int(rng.choice([1, 2])),
        white=white,
        coloured=white * rng.uniform(0.2, 0.8, n),
        memory=float(rng.uniform(0.01, 0.05)),
        step=white * rng.uniform(0.2, 1.5, n),
        bits=int(rng.integers(15, 20)),
        counts=int(rng.choice([2048, 4096])),
        delay=rng.uniform(0.0, 3e-3, n) * late,
        sides=str(rng.choice(["joint", "joint", "motor", "both"])),
        velocity=float(rng.choice([0.0, 0.01])),
        gain=np.ones(n),
        offset=np.zeros(n),
        zero=np.zeros(n),
    )


def _with_friction(case: Case, rng: np.random.Generator) -> Truth:
    """Friction of some law at every joint, 3 to 25 % of its torque."""
    truth = case.truth
    for j in range(len(case.machine.joints)):
        torque = case.torque[:, j]
        fast = float(np.sqrt(np.mean(case.course.v[:, j] ** 2)))
        rms = max(float(np.sqrt(np.mean(torque**2))), 5.0 * float(case.noise[j]))
        level = rms * float(np.exp(rng.uniform(np.log(0.03), np.log(0.25))))
        law: dict[str, float] = {"coulomb": level * rng.uniform(0.5, 1.0)}
        kind = rng.choice(["dry", "viscous", "stribeck", "load", "quadrants", "uneven"])
        if kind in ("viscous", "load", "quadrants"):
            law["viscous"] = level / fast * rng.uniform(0.2, 0.8)
        if kind == "stribeck":
            law |= {"excess": level * rng.uniform(0.2, 0.8), "stribeck_velocity": 0.1 * fast}
        if kind == "load":
            law |= dict.fromkeys(("load_driving", "load_driven"), rng.uniform(0.03, 0.2))
        if kind == "quadrants":
            law |= {"load_driving": rng.uniform(0.05, 0.2), "load_driven": rng.uniform(0.0, 0.05)}
        if kind == "uneven":
            law["asymmetry"] = 0.3 * law["coulomb"]
        truth = truth.with_friction(j, **law, stiffness=(level + 0.02 * rms) / 2e-4)
    return truth


def _run(seed: int, number: int, case: Case, course: Course) -> Measured:
    rng = stream(seed, f"noise {number}")
    happened = simulate(case.truth, course)
    return measure(happened, case.sensors, case.machine.joints, case.machine.ratio, rng)


def _without(effects: tuple[str, ...], k: int, empty: Case, seed: int) -> Case:
    """The same machine with all hidden effects but one."""
    case = empty
    for i, effect in enumerate(effects):
        if i != k:
            case = (EFFECTS | UNKNOWN)[effect](stream(seed, f"hide {effect}"), case)[1]
    return case


def _misfit(case: Case, without: Case, hidden: Hidden, seed: int) -> float:
    """How far the training log shows an effect, in standard deviations."""
    whole, less = (_run(seed, 0, c, c.course) for c in (case, without))
    joints = case.machine.joints
    at = frozenset(joints.index(p) for p in hidden.place if p in joints)
    dry = hidden.effect.endswith("friction") or hidden.effect == "backdrive_loss"
    own = Own(
        friction=at if dry else frozenset(),
        offset=at if hidden.effect == "effort_offset" else frozenset(),
        bodies=hidden.effect == "link_mass",
    )
    sensors, change = case.sensors, whole.exact - less.exact
    if hidden.effect == "position_offset":
        turned = replace(case.course, q=case.course.q + sensors.zero - without.sensors.zero)
        change = change + _gravity(case, case.course) - _gravity(case, turned)
    noise = (sensors.white, sensors.coloured, sensors.memory, STEP * sensors.every)
    z = misfit(case.machine.model, case.course, whole.rows, change, noise, own)
    if sensors.sides == "both" and hidden.effect in ("joint_elasticity", "backlash"):
        j = joints.index(hidden.place[0])
        fine = 2 * np.pi / 2**sensors.bits
        z = max(z, misfit_of_sides((whole.ahead - less.ahead)[:, j], fine))
    return z


def _gravity(case: Case, course: Course) -> Array:
    """Torque that the URDF's bodies would need along a course, at the log's rows."""
    return link_torque(case.machine.model, course)[:: case.sensors.every]
