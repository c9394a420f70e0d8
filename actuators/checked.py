"""Tables of TOML files held against their schema; all that is wrong is said at once, in one line.

pydantic does the checking. It knows kinds, choices, nesting and defaults from the declaration of a
class, goes on after the first error, and reports where each one is; written by hand that takes a
hundred lines a file and ends at the first. What is added here: the project's words for its errors,
the closest known name, numbers without `nan`, and one line for all of them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import accumulate
from types import NoneType, UnionType
from typing import (
    Annotated,
    Any,
    ClassVar,
    Final,
    Literal,
    TypeVar,
    Union,
    get_args,
    get_origin,
)

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Strict, ValidationError
from pydantic_core import ErrorDetails

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
    "model_type": "must be a table",
    "model_attributes_type": "must be a table",
}
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
    """A table as its schema reads it.

    Args:
        schema: What may stand in it.
        table: As the TOML file has it.
        where: File and table, for the message.
        error: Raised where they do not fit.

    Raises:
        Exception: `error`, with everything that is wrong in one line.
    """
    try:
        return schema.model_validate(table)
    except ValidationError as wrong:
        raise error(f"{where}: {_line(schema, table, wrong)}") from None


def _line(schema: type[Table], table: object, wrong: ValidationError) -> str:
    """As many errors as one reads, and how many more there are."""
    said = list(dict.fromkeys(_said(schema, table, wrong.errors(include_url=False))))
    length = accumulate(map(len, said))
    shown = max(1, sum(so_far <= _LONGEST for so_far in length))
    more = f"; and {len(said) - shown} more" if len(said) > shown else ""
    return "; ".join(said[:shown]) + more


def _said(schema: type[Table], table: object, errors: Sequence[ErrorDetails]) -> Iterator[str]:
    """Each error in words; keys that one table lacks, together."""
    missing: dict[tuple[int | str, ...], list[str]] = {}
    for error in errors:
        if error["type"] == "missing":
            missing.setdefault(error["loc"][:-1], []).append(str(error["loc"][-1]))
    for error in errors:
        above, key = error["loc"][:-1], str(error["loc"][-1]) if error["loc"] else ""
        kind, own = error["type"], _at(schema, above)
        noun = own.noun if _is_table(own) else "key"
        if kind == "missing":
            names = missing[above]
            plural = "s" if len(names) > 1 else ""
            words = f"missing {noun}{plural} " + ", ".join(f"'{name}'" for name in names)
        elif kind == "extra_forbidden":
            known = [f.alias or n for n, f in own.model_fields.items()] if _is_table(own) else []
            words = f"unknown {noun} '{one_line(key)}': {closest(key, known)}"
        else:
            place, words = _place(error["loc"], table), _wrong(error, _at(schema, error["loc"]))
            joint = " " if words.startswith(_OF_A_VALUE) else ": "
            yield (place + joint if place else "") + words
            continue
        yield (f"{_place(above, table)}: " if above else "") + words


def _wrong(error: ErrorDetails, what: Any) -> str:
    """What is wrong with one value."""
    kind, value = error["type"], error["input"]
    if kind in ("model_type", "dict_type") and _is_table(what) and what.expected:
        return f"must be a table, expected {what.expected}"
    if kind == "literal_error" and get_origin(what) is Literal:
        written = one_line(repr(value))[:60]
        if not isinstance(value, str):
            return f"= {written}: expected " + " or ".join(map(repr, get_args(what)))
        return f"= {written}: {closest(value, list(get_args(what)))}"
    if kind == "value_error":
        return str(error["ctx"]["error"])
    return _KINDS.get(kind, one_line(error["msg"]).lower())


def _place(loc: tuple[int | str, ...], table: object) -> str:
    """Keys as they stand in a table, entries of a list by number from 1 and by name."""
    out = ""
    here: Any = table
    for part in loc:
        if part == "[key]":  # of pydantic, for a key that is wrong
            break
        here = here[part] if _has(here, part) else None
        if isinstance(part, int):
            name = here.get("name") if isinstance(here, Mapping) else None
            out += f" {part + 1}" + (f" ({one_line(name)})" if isinstance(name, str) else "")
        else:
            out += ("." if out else "") + one_line(part)
    return f"'{out}'" if out else ""


def _has(here: Any, part: int | str) -> bool:
    return part in here if isinstance(here, Mapping) else isinstance(here, list | tuple)


def _is_table(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, Table)


def _at(schema: type[Table], loc: tuple[int | str, ...]) -> Any:
    """What is declared at a place of a schema: a table, a kind, or None where nothing is."""
    here: Any = schema
    for part in loc:
        here = _below(here, part)
    return _plain(here)


def _plain(annotation: Any) -> Any:
    """An annotation without its validators and without `None`."""
    while get_origin(annotation) is Annotated:
        annotation = get_args(annotation)[0]
    if get_origin(annotation) in (Union, UnionType):
        kept = [a for a in get_args(annotation) if a is not NoneType]
        return _plain(kept[0])
    return annotation


def _below(annotation: Any, part: int | str) -> Any:
    annotation = _plain(annotation)
    if _is_table(annotation):
        names = {field.alias or name: field for name, field in annotation.model_fields.items()}
        return names[str(part)].annotation if str(part) in names else None
    arguments = get_args(annotation)
    if not arguments:
        return None
    return arguments[-1] if isinstance(part, str) else arguments[0]
