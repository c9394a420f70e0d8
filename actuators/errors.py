"""The exceptions of the actuator room: one root, a subclass for each kind of fact."""

import difflib
from collections.abc import Sequence
from typing import Final


class ActuatorError(Exception):
    """Root of every error raised by `actuators`; its message is one line: place and remedy."""


class UnitError(ActuatorError):
    """A unit that is not in the table, or a unit of another dimension than the one asked for."""


class ParameterError(ActuatorError):
    """A parameter that is missing, misspelt, malformed or outside its bounds."""


class CatalogError(ActuatorError):
    """A component or an alternative of the catalogue that does not fit together."""


class DataSheetError(ActuatorError):
    """What a data sheet is said to print: missing, unreadable, or at odds with itself."""


#: Names that one reads in a line.
_NAMES: Final = 40


def one_line(text: object) -> str:
    """Return the text on a single line of at most 200 characters."""
    line = " ".join(str(text).split())
    return line if len(line) <= 200 else line[:197] + "..."


def some(names: Sequence[str], most: int) -> str:
    """Return names in a row; where they are more than `most` and one, the first and a count."""
    if len(names) <= most + 1:
        return ", ".join(names)
    return f"{', '.join(names[:most])} and {len(names) - most} more"


def closest(name: str, known: Sequence[str]) -> str:
    """Return a hint: the closest known name, or the first of the known where none is close."""
    match = difflib.get_close_matches(one_line(name), known, n=1)
    if match:
        return f"did you mean '{match[0]}'?"
    names = sorted(known)
    more = f" and {len(names) - _NAMES} more" if len(names) > _NAMES else ""
    return "known: " + (", ".join(names[:_NAMES]) or "none") + more
