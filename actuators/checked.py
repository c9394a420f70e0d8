"""Files: read as tables against their schema, in one line what is wrong; written whole or not.

pydantic says what is wrong; place and closest name come with it.
"""

import os
import re
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from itertools import accumulate, takewhile
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    Strict,
    TypeAdapter,
    ValidationError,
    model_validator,
)
from pydantic_core import ErrorDetails

from actuators.errors import LegwattError, closest, known, one_line

#: A parser would chew on more for minutes.
LARGEST: Final = 16 * 2**20  # [bytes]
#: Errors beyond so many characters are counted only: a line is to be read.
_LONGEST: Final = 400
_Table = TypeVar("_Table", bound=BaseModel)


class Table(BaseModel):
    """A table of a file: its fields are its keys but for those excluded, and it has no others."""

    model_config = ConfigDict(
        extra="forbid", strict=True, frozen=True, protected_namespaces=(), populate_by_name=True
    )

    noun: ClassVar[str] = "key"  #: What its keys are called.

    @model_validator(mode="before")
    @classmethod
    def _known_keys(cls, table: Any) -> Any:
        fields = {n: field for n, field in cls.model_fields.items() if not field.exclude}
        keys = [field.alias or name for name, field in fields.items()]
        if isinstance(table, Mapping) and cls.model_config["extra"] == "forbid":
            for key in table:
                if key not in fields:
                    known(f"unknown {cls.noun}", key, keys)
        return table


def _text(value: str) -> str:
    if not value.strip() or "\x00" in value:
        raise ValueError("is empty" if not value.strip() else "holds what no name can")
    return value


#: Text that says something.
Text = Annotated[str, AfterValidator(_text)]
#: A finite number.
Number = Annotated[float, Field(allow_inf_nan=False, strict=True)]
#: Two numbers.
Pair = Annotated[tuple[Number, Number], Strict(False)]
#: A list of names.
Names = Annotated[tuple[str, ...], Strict(False)]
_NUMBER: Final = TypeAdapter[float](Number)


def finite(value: object) -> float:
    """Return a finite float, or raise a ValueError; `true` is none, though Python says so."""
    try:
        return _NUMBER.validate_python(value)
    except ValidationError as wrong:
        raise ValueError(told(wrong)) from None


def checked(schema: type[_Table], table: object, where: str) -> _Table:
    """Return a file's table as its schema reads it; `where` is file and table, for the message.

    Raises:
        LegwattError: They do not fit; everything that is wrong in one line.
    """
    try:
        return schema.model_validate(table)
    except ValidationError as wrong:
        raise LegwattError(f"{where}: {told(wrong, table)}") from None


def told(wrong: ValidationError, table: object = None) -> str:
    """Return what is wrong with a table in one line: key (or number and name), reason, hint."""
    said = []
    for error in wrong.errors(include_url=False):
        place, here = [], table
        for part in takewhile(lambda x: x != "[key]", error["loc"]):  # of pydantic, for a key
            try:
                here = here[part]  # type: ignore[index]
            except (KeyError, IndexError, TypeError):
                here = None
            name = here.get("name", "") if isinstance(part, int) and isinstance(here, dict) else ""
            place.append(str(part + 1) if isinstance(part, int) else one_line(part))
            place[-1] += f" ({one_line(name)})" if name else ""
        words = _reason(error)
        joint = " " if words.startswith("= ") else ": "  # "'samples' = 0: at least 51"
        said.append(f"'{'.'.join(place)}'{joint}{words}" if place else words)
    said = list(dict.fromkeys(said))
    shown = max(1, sum(so_far <= _LONGEST for so_far in accumulate(map(len, said))))
    return "; ".join([*said[:shown], *[f"and {len(said) - shown} more"][: len(said) - shown]])


def _reason(error: ErrorDetails) -> str:
    words = re.sub(r"^Value error, | or instance of \w+", "", error["msg"]).replace("tuple", "list")
    value = repr(error["input"])
    if error["type"] == "literal_error":
        known = re.split(", | or ", str(error["ctx"]["expected"]).replace("'", ""))
        return f"{one_line(value)[:60]}: {closest(str(error['input']), known) or words}"
    if error["type"] not in ("missing", "value_error"):
        words += f", not {one_line(value)[:40]}"
    return one_line(words)


def read_bytes(path: Path, largest: int = LARGEST) -> bytes:
    """Return the bytes of a regular file; a LegwattError says why it cannot, not which file."""
    if path.is_dir() or (path.exists() and not path.is_file()):
        what = "a folder" if path.is_dir() else "no regular file"
        raise LegwattError(f"is {what}, a file is expected")
    try:
        with path.open("rb") as file:
            content = file.read(largest + 1)
    except FileNotFoundError:
        raise LegwattError("no such file") from None
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        raise LegwattError(f"cannot be read ({getattr(error, 'strerror', '') or error})") from None
    if len(content) > largest:
        raise LegwattError(f"has more than {largest / 1e6:.3g} MB")
    return content


def utf8(content: bytes) -> str:
    """Return the text of some bytes; a LegwattError says in which line they are no UTF-8."""
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        byte = f"line {line}: byte 0x{content[error.start]:02x}"
        raise LegwattError(f"{byte} is not UTF-8 text; save it as UTF-8") from None


def read_toml(path: str | Path) -> dict[str, Any]:
    """Return the contents of a TOML file; a LegwattError says which file, and why not."""
    try:
        return parsed_toml(utf8(read_bytes(Path(path))))
    except LegwattError as error:
        raise LegwattError(f"{one_line(path)}: {error}") from None


def parsed_toml(text: str) -> dict[str, Any]:
    """Return the contents of a TOML text; a LegwattError where it is not TOML."""
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # digits by the thousand, tables in tables
        raise LegwattError(f"malformed TOML: {one_line(error)}") from None


#: Of hidden files and folders that are there for the time being.
PREFIX = ".legwatt-"
_OWN = re.compile(rf"{re.escape(PREFIX)}(?:\d+-|[\w-]+(?:/|$))")


@contextmanager
def replacing(target: Path) -> Iterator[Path]:
    """Hand out a temporary file beside the target; when the block succeeds, it takes its place.

    Whatever stops the block, the old file stays as it was.

    Raises:
        LegwattError: The file cannot be written; names it and the reason.
    """
    temporary = target.with_name(f"{PREFIX}{os.getpid()}-{target.name}")
    with output_errors(target.parent):
        target.parent.mkdir(parents=True, exist_ok=True)
        try:
            yield temporary
            os.replace(temporary, target)
        finally:
            temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str, encoding: str = "utf-8") -> None:
    """Write a text file with LF line ends, whole or not at all.

    Raises:
        LegwattError: The file cannot be written.
    """
    with replacing(path) as temporary:
        temporary.write_bytes(text.encode(encoding))


@contextmanager
def output_errors(out: Path) -> Iterator[None]:
    """Turn a system's refusal to write into one line about the place that was asked for.

    Raises:
        LegwattError: In place of the refusal.
    """
    try:
        yield
    except BrokenPipeError:  # of the terminal
        raise
    except OSError as error:
        place = _OWN.sub("", str(error.filename or out)).rstrip("/")  # never a name of our own
        reason = error.strerror or str(error)
        if isinstance(error, FileExistsError | NotADirectoryError):
            reason = "is a file or lies below one, not a folder"
        raise LegwattError(
            f"{place}: cannot be written ({reason}); choose another folder"
        ) from None
