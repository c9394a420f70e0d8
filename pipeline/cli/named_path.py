"""A file or folder as the command line names it."""

from __future__ import annotations

import argparse
from pathlib import Path


def named_path(text: str) -> Path:
    """The path that an option names.

    An empty one is what an unset variable of a shell leaves; taken for a path it would be the
    folder the command runs in.

    Raises:
        argparse.ArgumentTypeError: There is no name in it.
    """
    if not text.strip():
        raise argparse.ArgumentTypeError("expected a name, got an empty one")
    if "\x00" in text:
        raise argparse.ArgumentTypeError("no file can have this name")
    return Path(text)
