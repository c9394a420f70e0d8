"""What a run wrote into its folder: the names of its files and the hash of each.

By it a later run knows which files are an earlier run's, unchanged, and which are a person's own.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from reports.errors import OutputError

#: Lies in the folder it describes; hidden, because it is no result.
MANIFEST = ".legwatt.json"
_FORMAT = 1


@dataclass(frozen=True)
class Manifest:
    """Files of one run.

    Attributes:
        verb: The command that wrote them, e.g. ``"walk"`` or ``"gap add"``.
        files: Name relative to the folder, with slashes, to the SHA-256 of its bytes.
    """

    verb: str
    files: Mapping[str, str]

    def text(self) -> str:
        """As JSON; the same files give the same text."""
        content = {
            "about": "files of one run; the next run into this folder replaces them",
            "format": _FORMAT,
            "verb": self.verb,
            "files": dict(sorted(self.files.items())),
        }
        return json.dumps(content, indent=1, ensure_ascii=False) + "\n"


def read_manifest(folder: Path) -> Manifest:
    """What the last run left in a folder; no files where there was none.

    Raises:
        OutputError: There is a manifest that this program did not write.
    """
    path = folder / MANIFEST
    try:
        content = json.loads(path.read_bytes())
        files = {_inside(name): str(digest) for name, digest in content["files"].items()}
        if content["format"] != _FORMAT:
            raise ValueError
        return Manifest(str(content["verb"]), files)
    except FileNotFoundError:
        return Manifest("", {})
    except OSError as error:
        raise OutputError(f"{path}: cannot be read ({error.strerror})") from None
    except (ValueError, KeyError, TypeError, AttributeError):
        raise OutputError(
            f"{path}: damaged, so it is not known which files are an earlier run's; choose another "
            "folder, or remove this one"
        ) from None


def _inside(name: str) -> str:
    """A name that cannot leave the folder."""
    parts = PurePosixPath(name).parts
    if not parts or name.startswith("/") or ".." in parts:
        raise ValueError(name)
    return name


def sha256(path: Path) -> str:
    """Of a file's bytes."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
