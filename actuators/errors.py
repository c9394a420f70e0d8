"""What can go wrong, in one line: place and remedy; and hints at the closest known name."""

import difflib
from collections.abc import Collection, Sequence
from typing import Final


class LegwattError(ValueError):
    """Input that cannot be used; the message is one line: place, fact and remedy."""


class StanceError(LegwattError):
    """No forces of the ground carry the robot, which tips or slides: a finding of its own."""


#: Names that one reads in a line.
_NAMES: Final = 40
#: Letters from which a name is taken for the beginning of a longer one.
_BEGINNING: Final = 4


def one_line(text: object) -> str:
    """Return the text on a single line of at most 200 characters."""
    line = " ".join(str(text).split())
    return line if len(line) <= 200 else line[:197] + "..."


def some(names: Sequence[str], most: int) -> str:
    """Return names in a row; where they are more than `most` and one, the first and a count."""
    if len(names) <= most + 1:
        return ", ".join(names)
    return f"{', '.join(names[:most])} and {len(names) - most} more"


def known(what: str, name: object, names: Collection[str], where: str = "") -> str:
    """Return a name that is one of some.

    Raises:
        LegwattError: It is none of them: `where`, `what` (``unknown unit``), name and the closest.
    """
    if not isinstance(name, str) or name not in names:
        hint = closest(str(name), [*names])
        raise LegwattError(f"{where}{': ' * bool(where)}{what} '{one_line(name)}': {hint}")
    return name


def closest(name: str, known: Sequence[str]) -> str:
    """Return a hint: the known name it begins or is closest to, or the known where none is."""
    longer = [full for full in known if len(name) >= _BEGINNING and full.startswith(f"{name}_")]
    match = longer or difflib.get_close_matches(one_line(name), known, n=1)
    if match:
        return f"did you mean '{match[0]}'?"
    names = sorted(known)
    more = f" and {len(names) - _NAMES} more" if len(names) > _NAMES else ""
    return "known: " + (", ".join(names[:_NAMES]) or "none") + more
