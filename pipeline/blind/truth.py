"""What was hidden, in the words of the workflow's catalogue, for judging its answers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from pipeline.blind.twin.effects.drive import FLANKS
from pipeline.blind.twin.trial import ROBOT_FILES, plan_of
from pipeline.effects.base import Place
from pipeline.effects.bodies.link_mass import own_mass
from pipeline.machine.machine import MachineModel
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import load_robot_file

#: Parameter of the twin to parameter of the workflow, where the names differ.
_NAMES: Final = {
    ("effort_offset", "current"): "offset",
    ("internal_foot_force", "commanded_lateral"): "lateral",
}
#: Parameters to which Coulomb friction of the same joint adds.
_LEVELS: Final = {
    "direction_dependent_friction": ("positive", "negative"),
    "stribeck_friction": ("coulomb",),
}


@dataclass(frozen=True)
class HiddenTruth:
    """One effect that was hidden.

    Attributes:
        effect: Name.
        place: Where.
        values: Parameters as the workflow calls them, of the effect alone.
        total: What an interval has to cover: the same with the machine's own tolerance of the same
            kind, which no log can tell from the effect, and as the log sees it.
        in_catalogue: Whether the workflow has a name for it.
        strength: RMS torque over noise.
    """

    effect: str
    place: Place
    values: Mapping[str, float]
    total: Mapping[str, float]
    in_catalogue: bool
    strength: float


def hidden_truths(truth: Mapping[str, Any], model: MachineModel) -> list[HiddenTruth]:
    """Read the truth of a trial.

    Args:
        truth: As the twin seals it.
        model: The nominal machine.
    """
    return [_hidden(item, truth, model) for item in truth["hidden"]]


def _hidden(item: Mapping[str, Any], truth: Mapping[str, Any], model: MachineModel) -> HiddenTruth:
    effect, place = item["effect"], tuple(item["place"])
    values = {
        _NAMES.get((effect, name), name): float(entry["value"])
        for name, entry in item["parameters"].items()
    }
    if effect == "internal_foot_force":
        # Inward or outward, what reached the ground counts, not what was commanded.
        values["lateral"] = float(truth["logs"]["log"]["outward_force_N"])
    if effect == "backlash":
        values["stiffness"] = FLANKS
    strength = item.get("strength")
    return HiddenTruth(
        effect=effect,
        place=place,
        values=values,
        total=_total(effect, place, values, truth, model),
        in_catalogue=bool(item["in_catalogue"]),
        strength=float("nan") if strength is None else float(strength),
    )


def _total(
    effect: str,
    place: Place,
    values: Mapping[str, float],
    truth: Mapping[str, Any],
    model: MachineModel,
) -> dict[str, float]:
    total, tolerances = dict(values), truth["tolerances"]
    if effect == "torque_constant_error":
        factor = tolerances["torque_constant_factor"][place[0]]
        total["relative"] = (1 + values["relative"]) * factor - 1
    elif effect == "position_offset":
        total["angle"] = values["angle"] + tolerances["encoder_zero_rad"][place[0]]
    elif effect == "link_mass":
        factor = tolerances["mass_factor"][model.carrier(place[0])]
        total["mass"] = values["mass"] + (factor - 1) * own_mass(model, place[0])
    elif effect == "winding_heating":
        # The machine runs a moment before its log starts: the log sees what is left of the rise.
        robot = load_robot(load_robot_file(ROBOT_FILES[truth["motion"]]))
        before = plan_of(robot, truth["seed"], 0).log_from
        total["rise"] = values["rise"] * math.exp(-before / values["time_constant"])
    for name in _LEVELS.get(effect, ()):
        # Coulomb friction of the same joint is a part of it that nothing can tell apart.
        total[name] += sum(
            float(other["parameters"]["torque"]["value"])
            for other in truth["hidden"]
            if other["effect"] == "coulomb_friction" and tuple(other["place"]) == place
        )
    return total


def place_text(place: Sequence[str]) -> str:
    """A place in one cell."""
    return " + ".join(place)
