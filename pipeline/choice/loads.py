"""What the modes of a mission ask of the joints, from the one demand that all commands have."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations
from typing import Any, Final

import numpy as np
import pinocchio as pin

from actuators.arrays import Array
from actuators.errors import LegwattError
from actuators.parameters import quantity
from actuators.shaft import ShaftSeries
from pipeline.choice.mission import PAYLOAD, Mode
from pipeline.effects.bodies import point_mass
from pipeline.motion.motion import Motion
from pipeline.motion.walking import DEFAULT_SAMPLES, standing_posture, walking_motion
from pipeline.robot.robot import Robot
from pipeline.simulation.machine import Machine
from pipeline.simulation.walk_stand import LEAST_SAMPLES


@dataclass(frozen=True, eq=False)
class Load:
    """One mode at the joints."""

    mode: Mode  #: What the robot does.
    series: ShaftSeries  #: Of all joints; standing is two samples a second apart, at rest.


def loads_of(
    machine: Machine, modes: Sequence[Mode], masses: Sequence[Mapping[str, float]] = ({},)
) -> list[list[Load]]:
    """Every mode's demand, with each of some masses, along the motions planned for the first.

    `masses`: in addition to the bodies', by joint whose actuator it is [kg].

    Raises:
        LegwattError: A mode cannot be done; its row is named.
    """
    out: list[list[Load]] = [[] for _ in masses]
    for mode in modes:
        try:
            changed, motion = _stood(machine, tuple(mode.changes.items()), mode.stands)
            robots = [with_masses(changed, added) for added in masses]
            if motion is None:
                samples = DEFAULT_SAMPLES if mode.motion else LEAST_SAMPLES
                own = robots[0].walking(motion=mode.motion, samples=samples)
                motion = own.motion or walking_motion(own.edited, samples=samples)
            for loads, robot in zip(out, robots, strict=True):
                loads.append(_load(robot, mode, motion))
        except LegwattError as error:
            raise type(error)(f"{mode.where}: {error}") from None
    return out


@lru_cache(maxsize=128)  # stances of a choice, held with many masses, which move no foot
def _stood(machine: Machine, changes: tuple[Any, ...], stands: bool) -> tuple[Machine, Any]:
    """The machine with other numbers, and the posture that it has where it stands."""
    changed = machine.with_values(dict(changes))
    return changed, Motion((standing_posture(changed.edited),)) if stands else None


def with_masses(machine: Machine, added: Mapping[str, float]) -> Machine:
    """The machine with point masses [kg] at joints, on the link before each, or on the base."""
    if not any(added.values()):
        return machine

    def heavier(robot: Robot) -> Robot:
        model = robot.model.copy()
        for joint, mass in added.items():
            at = model.getJointId(joint)
            body = model.parents[at] or (at if machine.robot.floating else 0)
            more = point_mass(mass, model.jointPlacements[at].translation)
            total = model.inertias[body].toDynamicParameters() + more
            model.inertias[body] = pin.Inertia.FromDynamicParameters(total)
        return robot.with_bodies(model)

    return machine.with_robot(heavier)


#: Tilts of the ground in the load cases: a push of a tenth of the weight at the centre of mass is
#: a tilt of atan(0.1), and slopes are tried from the steepest on.
_PUSH: Final = "5.71 deg"
_SLOPES: Final = ("20 deg", "15 deg", "10 deg", "5 deg")
_SIDES: Final = ("slope_forward", "slope_left")


def cases_of(
    machine: Machine, modes: Sequence[Mode], masses: Sequence[Mapping[str, float]]
) -> list[list[Load]]:
    """Loads beside the mission's that an actuator has to bear for a moment, with its payload.

    All feet on the ground, any three of them, a push, the steepest slope of `_SLOPES` on which the
    robot stands whichever way it faces, and the forces that an optimal controller would choose; of
    each the stances that do not tip, with each of the added masses. None on a stand.
    """
    spec = machine.robot.spec
    if not machine.robot.floating or not spec.legs:
        return []
    stated = [str(m.changes[PAYLOAD]) for m in modes if PAYLOAD in m.changes]
    carried = {PAYLOAD: max(stated, key=lambda text: quantity(text, "mass"))} if stated else {}

    def stances(changes: Sequence[Mapping[str, str]], forces: str = "") -> list[list[Load]]:
        out = []
        for own in changes:
            mode = Mode("", 0.0, True, None, {**carried, **own}, "motor", True, "", forces)
            with contextlib.suppress(LegwattError):
                out.append([own for (own,) in loads_of(machine, [mode], masses)])
        return out

    def tilted(angle: str) -> list[Mapping[str, str]]:
        return [{f"gait.{side}": sign + angle} for side in _SIDES for sign in ("", "-")]

    three = combinations([leg.name for leg in spec.legs], 3)
    found = {
        "all feet": stances([{"standing.feet": "all"}]),
        "three feet": stances([{"standing.feet": ",".join(own)} for own in three]),
        "push": stances(tilted(_PUSH)),
        "least torque": stances([{}], "least_torque"),
    }
    slopes = (stances(tilted(angle)) for angle in _SLOPES)
    found["slope"] = next((own for own in slopes if len(own) == 4), [])
    return [
        [_in_a_row(name, loads) for loads in zip(*own, strict=True)]
        for name, own in found.items()
        if own
    ]


def _in_a_row(name: str, loads: Sequence[Load]) -> Load:
    """One load of the stances of a case."""
    first = loads[0]
    every = [load.series for load in (*loads, first)]  # two samples at least
    parts = (np.concatenate([getattr(x, f)[:1] for x in every]) for f in ("position", "torque"))
    return Load(replace(first.mode, name=name), _at_rest(first.series.joints, *parts))


def _at_rest(joints: tuple[str, ...], position: Array, torque: Array) -> ShaftSeries:
    """Samples a second apart, (N, J)."""
    zero, time = np.zeros_like(torque), np.arange(len(torque), dtype=float)
    return ShaftSeries.at_joint(joints, time, position, zero, zero, torque)


def _load(machine: Machine, mode: Mode, motion: Motion) -> Load:
    if not mode.stands:
        return Load(mode, machine.demand(motion).series)
    (held,) = machine.walking(forces=mode.forces or None).demand(motion).segments
    position, torque = (np.repeat(x, 2, axis=0) for x in (held.position, held.torque))
    return Load(mode, _at_rest(held.joints, position, torque * (mode.hold != "none")))
