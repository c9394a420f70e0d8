"""The alternatives as written in the catalogue: elements, laws and where arguments come from."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from actuators.chain import JOINT_STAGE, SUPPLY_STAGE
from actuators.elements.element import Element
from actuators.elements.friction import Friction
from actuators.elements.hypoid import Hypoid
from actuators.elements.inertia import Inertia
from actuators.elements.ratio import Ratio
from actuators.errors import CatalogError, closest, one_line

ALTERNATIVES_FILE: Final = "alternatives.toml"
_ALTERNATIVE_KEYS: Final = ("title", "motor", "ratio", "element")
_ELEMENT_KEYS: Final = ("name", "law", "stage", "shaft")  # what else it has are arguments

# law -> class, arguments it must have, arguments it may have
LAWS: Final[Mapping[str, tuple[Callable[..., Element], frozenset[str], frozenset[str]]]] = {
    "ratio": (Ratio, frozenset({"ratio"}), frozenset()),
    "inertia": (Inertia, frozenset({"inertia"}), frozenset()),
    "friction": (Friction, frozenset(), frozenset({"coulomb", "load", "viscous"})),
    "hypoid": (
        Hypoid,
        frozenset({"ratio", "pinion_angle", "wheel_angle", "wheel_radius", "friction"}),
        frozenset(),
    ),
}


@dataclass(frozen=True)
class ElementEntry:
    """One element of an alternative as written: a law and where its arguments come from.

    Attributes:
        name: The element's name.
        law: Key of the table of laws.
        arguments: Argument to `component.parameter`.
        stage: Name of the shaft on its motor side, or empty.
        shaft: Where that shaft is, in words, or empty.
    """

    name: str
    law: str
    arguments: Mapping[str, str]
    stage: str
    shaft: str = ""


@dataclass(frozen=True)
class Alternative:
    """One alternative as written.

    Attributes:
        name: Its key, such as `reversible`.
        title: In words.
        motor: Component of the motor.
        ratio: `component.parameter` that the product of all ratios has to equal.
        elements: From the joint to the motor.
    """

    name: str
    title: str
    motor: str
    ratio: str
    elements: tuple[ElementEntry, ...]

    @property
    def stage_names(self) -> Mapping[str, str]:
        """Every stage from the joint to the supply in words, by its short name."""
        *inner, last = [e for e in self.elements if e.stage]
        names = {e.stage: e.shaft or f"motor side of {e.name}" for e in inner}
        return {
            JOINT_STAGE: "joint",
            **names,
            last.stage: last.shaft or "motor",
            SUPPLY_STAGE: "supply",
        }

    @property
    def references(self) -> tuple[str, ...]:
        """Every `component.parameter` it names outside its motor."""
        return (self.ratio, *(r for e in self.elements for r in e.arguments.values()))


def read_alternative(name: str, entry: object) -> Alternative:
    """Return one alternative from its table.

    Args:
        name: Its key.
        entry: What stands under it.

    Raises:
        CatalogError: A key, law or argument is unknown or missing, or a stage is named twice.
    """
    where = f"{ALTERNATIVES_FILE} [{one_line(name)}]"
    if not isinstance(entry, Mapping):
        raise CatalogError(f"{where}: expected a table")
    for key in entry:
        if key not in _ALTERNATIVE_KEYS:
            raise CatalogError(
                f"{where}: unknown key '{one_line(key)}': {closest(key, _ALTERNATIVE_KEYS)}"
            )
    for key in _ALTERNATIVE_KEYS:
        if key not in entry:
            raise CatalogError(f"{where}: missing key '{key}'")
    for key in ("title", "motor", "ratio"):
        if not isinstance(entry[key], str):
            raise CatalogError(f"{where}: '{key}' must be text in quotation marks")
    if not isinstance(entry["element"], list) or not entry["element"]:
        raise CatalogError(f"{where}: expected at least one [[{one_line(name)}.element]]")
    elements = tuple(_element(item, where) for item in entry["element"])
    stages = [e.stage for e in elements if e.stage]
    if len(set(stages)) != len(stages):
        raise CatalogError(f"{where}: a stage is named twice among {', '.join(stages)}")
    return Alternative(name, entry["title"], entry["motor"], entry["ratio"], elements)


def _element(entry: object, where: str) -> ElementEntry:
    """Return one element of an alternative from its table."""
    if not isinstance(entry, Mapping) or not all(isinstance(v, str) for v in entry.values()):
        raise CatalogError(f"{where}: an element is a table of texts: name, law and arguments")
    for key in ("name", "law"):
        if key not in entry:
            raise CatalogError(f"{where}: an element lacks its '{key}'")
    place, law = f"{where}: element '{one_line(entry['name'])}'", entry["law"]
    if law not in LAWS:
        raise CatalogError(f"{place}: unknown law '{one_line(law)}': {closest(law, list(LAWS))}")
    arguments = {k: v for k, v in entry.items() if k not in _ELEMENT_KEYS}
    _, needed, possible = LAWS[law]
    for argument in arguments:
        if argument not in needed | possible:
            raise CatalogError(
                f"{place}: law '{law}' has no argument '{one_line(argument)}': "
                f"{closest(argument, sorted(needed | possible))}"
            )
    for argument in sorted(needed - set(arguments)):
        raise CatalogError(f"{place}: law '{law}' lacks its argument '{argument}'")
    stage, shaft = entry.get("stage", ""), entry.get("shaft", "")
    if shaft and not stage:
        raise CatalogError(f"{place}: 'shaft' says where a stage is; name the stage, too")
    return ElementEntry(entry["name"], law, MappingProxyType(arguments), stage, shaft)
