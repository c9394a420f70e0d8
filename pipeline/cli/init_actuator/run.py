"""The verb `init-actuator`: options in, questions on a terminal, a folder out."""

from __future__ import annotations

import argparse
import shlex
import sys

from actuators.errors import DataSheetError
from actuators.loading.data_sheet import ENTRIES, idle, missing, option, read_entry
from actuators.loading.own_folder import init_actuator


def run_init_actuator(options: argparse.Namespace) -> int:
    """Write the folder; say what stands in it and how it is used.

    Raises:
        DataSheetError: Something is missing, unreadable or contradicts the rest.
    """
    words = {name: text for name in ENTRIES if (text := getattr(options, name)) is not None}
    source = options.source
    if sys.stdin.isatty() and (source is None or missing(words)):
        source = source or _answer("source: which data sheet")
        _ask(words)
        given = [f"{option(name)} {shlex.quote(text)}" for name, text in words.items()]
        print("the same without questions: python -m pipeline init-actuator", options.name, end="")
        print("", "--source", shlex.quote(source), *given)
    if source is None:
        lacking = [" or ".join(map(option, group)) for group in (("source",), *missing(words))]
        raise DataSheetError(f"missing: {', '.join(lacking)}; --help says what each is")
    folder, parameters = init_actuator(options.name, options.out, source=source, **words)
    for key, p in parameters.items():
        why = f": {p.reason}" if p.reason else ""
        print(f"  {key} = {p.value_as_written:.6g} {p.unit} ({p.basis}{why})")
    print(f"{folder}: 4 files; python -m pipeline reports --robot ROBOT.toml --actuators {folder}")
    return 0


def _ask(words: dict[str, str]) -> None:
    """Ask for every entry that is not known, until none is missing."""
    print("Number and unit each; 'LOW to HIGH UNIT' or nothing where none is printed.")
    names = [name for name in ENTRIES if name not in words]
    while names:
        for name in names:
            if not idle(name, words):
                _ask_for(name, words)
        names = [name for group in missing(words) for name in group]
        if names:
            print("needed still:", ", ".join(" or ".join(group) for group in missing(words)))


def _ask_for(name: str, words: dict[str, str]) -> None:
    entry = ENTRIES[name]
    while text := _answer(f"{name.replace('_', ' ')} ({entry.words}), as {entry.example}"):
        try:
            read_entry(name, text)
        except DataSheetError as error:
            print(error)
        else:
            words[name] = text
            return


def _answer(question: str) -> str:
    try:
        return input(f"{question}: ").strip()
    except EOFError:
        raise DataSheetError("the answers end here; nothing is written") from None
