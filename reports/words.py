"""Words of the pages, from one template each: a macro is a paragraph."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any

from reports.page import cell_text

TEMPLATES = Path(__file__).parent / "templates"


class Words:
    """The paragraphs of one template."""

    def __init__(self, template: str, **names: Any) -> None:
        """Keep what to load when a paragraph is first asked for.

        Args:
            template: Name of the file, without its ending.
            names: What its macros use besides their arguments.
        """
        self._template, self._names = template, names

    def __call__(self, paragraph: str, *arguments: Any) -> str:
        """A paragraph on one line; empty where there is nothing to say.

        Args:
            paragraph: Name of the macro.
            arguments: Of the macro.
        """
        module = _environment().get_template(f"{self._template}.jinja").make_module(self._names)
        return " ".join(getattr(module, paragraph)(*arguments).split())


@cache
def _environment() -> Any:
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(number=number, percent=percent, listed=listed, few=few)
    return environment


def number(value: float, digits: int = 3) -> str:
    """A rounded number."""
    return cell_text(float(value), digits)


def percent(share: float, digits: int = 0) -> str:
    """A share in percent."""
    return f"{100 * share:.{digits}f} %"


def listed(items: Iterable[str]) -> str:
    """One, two and three."""
    *most, last = items
    return f"{', '.join(most)} and {last}" if most else last


def few(count: int) -> str:
    """A small number as a word."""
    return {1: "one", 2: "two", 3: "three", 4: "four"}.get(count, str(count))
