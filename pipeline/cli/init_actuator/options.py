"""Options of `init-actuator`: what a data sheet prints, one each."""

from __future__ import annotations

import argparse

from actuators.loading.data_sheet import ENTRIES, option
from pipeline.cli.named_path import named_path


def add_actuator_options(sub: argparse.ArgumentParser) -> None:
    """Name, folder, source and every entry of a sheet."""
    sub.description = (
        "Write a folder of actuator files from a data sheet. Each number is given with its unit; "
        "'LOW to HIGH UNIT' says what no sheet prints. On a terminal, what is missing is asked for."
    )
    sub.add_argument("name", metavar="NAME", help="what tables call the actuator, e.g. ak80_9")
    sub.add_argument("--out", type=named_path, help="folder; NAME here by default")
    sub.add_argument("--source", metavar="TEXT", help="which data sheet, for every number")
    for name, entry in ENTRIES.items():
        words = f"{entry.kind} {entry.words}".strip()
        sub.add_argument(option(name), metavar=f"'{entry.example}'", help=words)
