"""Text files as they lie on a disk: UTF-8, with or without a byte-order mark, of a sane size."""

from __future__ import annotations

import stat
import tomllib
from pathlib import Path
from typing import Any, Final

from actuators.errors import LegwattError, one_line

#: Robot, actuator and mapping files have some kilobytes; a parser would chew on more for minutes.
LARGEST_TOML: Final = 16 * 2**20  # [bytes]
_UTF16: Final = (b"\xff\xfe", b"\xfe\xff")


def read_file(path: Path, largest: int) -> bytes:
    """The bytes of a regular file of at most so many bytes.

    Raises:
        LegwattError: There is none, it is a folder or a device, too large, or not readable.
    """
    try:
        status = path.stat()
        if stat.S_ISDIR(status.st_mode):
            raise LegwattError("is a folder, a file is expected")
        if not stat.S_ISREG(status.st_mode):
            raise LegwattError("is no regular file; save it to one")
        if status.st_size > largest:
            raise LegwattError(
                f"has {status.st_size / 1e6:.3g} MB, expected at most {largest / 1e6:.3g} MB"
            )
        return path.read_bytes()
    except FileNotFoundError:
        raise LegwattError("no such file") from None
    except OSError as error:
        raise LegwattError(f"cannot be read ({error.strerror or error})") from None
    except LegwattError:
        raise
    except ValueError:  # a NUL in the name
        raise LegwattError("no file can have this name") from None


def utf8(content: bytes) -> str:
    """The text of some bytes; a byte-order mark is left out.

    Raises:
        LegwattError: Another encoding; the message says which line.
    """
    if content.startswith(_UTF16):
        raise LegwattError("is UTF-16 text; save it as UTF-8")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise LegwattError(
            f"line {line}: byte 0x{content[error.start]:02x} is not UTF-8 text; save it as UTF-8"
        ) from None


def read_toml_file(path: Path) -> dict[str, Any]:
    """The contents of a TOML file.

    Raises:
        LegwattError: As for `read_file`, or the text is not TOML.
    """
    return parsed(utf8(read_file(path, LARGEST_TOML)))


def parsed(text: str) -> dict[str, Any]:
    """The contents of a TOML text.

    Raises:
        LegwattError: It is not TOML.
    """
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise LegwattError(f"malformed TOML: {one_line(error)}") from None
    except RecursionError:
        raise LegwattError("malformed TOML: tables are nested too deeply") from None
    except ValueError:  # Python converts no integer of more than 4300 digits
        raise LegwattError("malformed TOML: a number has thousands of digits") from None
