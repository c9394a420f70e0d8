"""What the short names of legs and actuators stand for, in words."""

from __future__ import annotations

from collections import Counter

from actuators.loading.build import Catalog
from pipeline.robot.robot import Robot
from pipeline.simulation.settings import Settings
from reports.pages.motor_words import ROBOT

#: The leg the paper follows; the first leg of a robot that has no such leg.
SHOWN_LEG = "rm"
#: What the letters of the paper's leg names stand for, the side first.
_SIDES = {"l": "left", "r": "right"}
_PLACES = {"f": "front", "m": "middle", "r": "rear"}


def shown_leg(robot: Robot) -> str:
    """The leg whose figures are drawn."""
    return SHOWN_LEG if SHOWN_LEG in robot.leg_names else robot.leg_names[0]


def leg_words(leg: str) -> str:
    """A leg's name with what it says: ``rm`` is the middle right leg."""
    if _is_two_letters(leg):
        return f"{_PLACES[leg[1]]} {_SIDES[leg[0]]} leg ({leg})"
    return f"leg {leg}"


def _is_two_letters(leg: str) -> bool:
    return len(leg) == 2 and leg[0] in _SIDES and leg[1] in _PLACES


def short_titles(catalog: Catalog) -> dict[str, str]:
    """Every alternative's title without its number; where two are alike, with the name."""
    titles = {n: a.title.split(": ", 1)[-1] for n, a in catalog.alternatives.items()}
    seen = Counter(titles.values())
    return {n: title if seen[title] == 1 else f"{title} ({n})" for n, title in titles.items()}


def names_text(given: Settings) -> str:
    """A paragraph for the first place where a reader meets the names."""
    legs = {joint for leg in given.robot.spec.legs for joint in leg.joints}
    outside = set(given.robot.joints) - legs
    titles, count = short_titles(given.catalog), len(given.robot.leg_names)
    return ROBOT("names", titles, legs_text(given.robot), count, bool(outside))


def legs_text(robot: Robot) -> str:
    """What the legs' names say and how their joints are numbered."""
    leg = shown_leg(robot)
    return ROBOT("legs", leg, leg_words(leg).split(" (")[0] if _is_two_letters(leg) else "")
