"""The option `--decimal`, the same for every verb that writes tables."""

from __future__ import annotations

import argparse


def add_decimal_option(sub: argparse.ArgumentParser) -> None:
    """Declare it."""
    sub.add_argument(
        "--decimal",
        choices=["dot", "comma"],
        default="dot",
        help="comma: write copies for a decimal-comma spreadsheet beside the plain files",
    )


def decimal_of(options: argparse.Namespace) -> str:
    """The decimal sign that was asked for."""
    return "," if options.decimal == "comma" else "."
