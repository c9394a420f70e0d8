"""Tables of TOML files held against their schema; all that is wrong is said at once, in one line.

pydantic does the checking: it knows kinds, choices, nesting and defaults from the declaration of a
class, goes on after the first error, and says where each one is. What is added here: the project's
words for its errors, the closest known name, numbers without `nan`, and one line for all of them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from itertools import accumulate
from typing import Annotated, Any, ClassVar, Final, Self, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    ModelWrapValidatorHandler,
    Strict,
    ValidationError,
    model_validator,
)
from pydantic_core import ErrorDetails, InitErrorDetails, PydanticCustomError

from actuators.errors import closest, one_line

#: Errors beyond so many characters are counted only: a line is to be read.
_LONGEST: Final = 400
_KINDS: Final[Mapping[str, str]] = {
    "string_type": "must be text in quotation marks",
    "bool_type": "must be true or false",
    "int_type": "must be a whole number",
    "list_type": "must be a list",
    "tuple_type": "must be a list",
    "dict_type": "must be a table",
}
_NO_TABLE: Final = ("model_type", "model_attributes_type")
#: What goes on from the name of the key; anything else is a sentence of its own.
_OF_A_VALUE: Final = ("must ", "is ", "= ")
_Table = TypeVar("_Table", bound="Table")


class Table(BaseModel):
    """A table of a TOML file: its fields are its keys, and it has no others."""

    model_config = ConfigDict(
        extra="forbid", strict=True, frozen=True, protected_namespaces=(), populate_by_name=True
    )
    noun: ClassVar[str] = "key"  #: What its keys are called.
    expected: ClassVar[str] = ""  #: How it is written, where something else stands.

    @model_validator(mode="wrap")
    @classmethod
    def _in_words(cls, table: object, read: ModelWrapValidatorHandler[Self]) -> Self:
        """Say what is wrong in the words of this table: keys that it lacks, together."""
        try:
            return read(table)
        except ValidationError as wrong:
            errors = wrong.errors(include_url=False)
        missing = [f"'{e['loc'][-1]}'" for e in errors if e["type"] == "missing"]
        said = []
        for error in errors:
            kind, place = error["type"], error["loc"]
            if kind in ("missing", "extra_forbidden"):
                place, key = place[:-1], place[-1]
                plural = "s" if len(missing) > 1 else ""
                words = f"missing {cls.noun}{plural} {', '.join(missing)}"
            if kind == "extra_forbidden":
                known = [field.alias or name for name, field in cls.model_fields.items()]
                words = f"unknown {cls.noun} '{one_line(key)}': {closest(str(key), known)}"
            elif kind in _NO_TABLE:
                words = "must be a table" + f", expected {cls.expected}" * bool(cls.expected)
            elif kind != "missing":
                words = _words(error)
            told = PydanticCustomError("said", words)
            said.append(InitErrorDetails(type=told, loc=place, input=error["input"]))
        raise ValidationError.from_exception_data(cls.__name__, said)


def finite(value: object) -> float:
    """A finite float; `true` is none, though Python says so.

    Raises:
        ValueError: It is no number, or not a finite one.
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"must be a number, not {one_line(repr(value))[:40]}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise ValueError("must be a finite number")
    return number


def _pair(value: object) -> object:
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise ValueError("must be [low, high]")
    return tuple(value)


def _text(value: str) -> str:
    if not value.strip() or "\x00" in value:
        raise ValueError("is empty" if not value.strip() else "holds what no name can")
    return value


#: Text that says something.
Text = Annotated[str, AfterValidator(_text)]
#: A finite number.
Number = Annotated[float, BeforeValidator(finite)]
#: Two numbers.
Pair = Annotated[tuple[Number, Number], BeforeValidator(_pair)]
#: A list of names.
Names = Annotated[tuple[str, ...], Strict(False)]


def checked(schema: type[_Table], table: object, where: str, error: type[Exception]) -> _Table:
    """A TOML file's table as its schema reads it.

    Args:
        schema: What may stand in it.
        table: As the TOML file has it.
        where: File and table, for the message.
        error: Raised where they do not fit, with everything that is wrong in one line.
    """
    try:
        return schema.model_validate(table)
    except ValidationError as wrong:
        each = (_placed(e["loc"], table, _words(e)) for e in wrong.errors(include_url=False))
        said = list(dict.fromkeys(each))
    shown = max(1, sum(so_far <= _LONGEST for so_far in accumulate(map(len, said))))
    more = f"; and {len(said) - shown} more" if len(said) > shown else ""
    raise error(f"{where}: {'; '.join(said[:shown])}{more}")


def _words(error: ErrorDetails) -> str:
    """What is wrong with one value."""
    kind, value = error["type"], error["input"]
    if kind == "literal_error":
        expected = str(error["ctx"]["expected"])
        known = re.findall(r"'(.*?)'", expected)
        hint = closest(value, known) if isinstance(value, str) else f"expected {expected}"
        return f"= {one_line(repr(value))[:60]}: {hint}"
    if kind == "value_error":
        return str(error["ctx"]["error"])
    return _KINDS.get(kind, error["msg"] if kind == "said" else one_line(error["msg"]).lower())


def _placed(loc: tuple[int | str, ...], table: object, words: str) -> str:
    """Words behind their place: keys, and entries of a list by number from 1 and by name."""
    place, here = "", table
    for part in loc:
        if part == "[key]":  # of pydantic, for a key that is wrong
            break
        inside: Any = here if isinstance(here, Mapping | list | tuple) else {}
        here = inside[part] if isinstance(part, int) or part in inside else None
        if isinstance(part, int):
            name = here.get("name") if isinstance(here, Mapping) else None
            place += f" {part + 1}" + (f" ({one_line(name)})" if isinstance(name, str) else "")
        else:
            place += ("." if place else "") + one_line(part)
    joint = " " if words.startswith(_OF_A_VALUE) else ": "
    return f"'{place}'{joint}{words}" if place else words
