"""Options of the verbs `twin` and `blind`."""

from __future__ import annotations

import argparse
from pathlib import Path

from pipeline.cli.named_path import named_path


def add_twin_options(sub: argparse.ArgumentParser) -> None:
    """Declare the options of `twin`."""
    sub.add_argument("--seed", type=int, default=1, help="of the random numbers")
    sub.add_argument(
        "--hide", nargs="*", default=[], metavar="EFFECT", help="effects to hide; none by default"
    )
    sub.add_argument("--motion", default="leg", help="leg (on a stand; default) or walk (hexapod)")
    sub.add_argument("--noise", default="low", help="low (default) or high")
    sub.add_argument("--logs", type=int, default=1, help="number of logs of the machine; 1")
    sub.add_argument("--out", type=named_path, required=True, help="new folder for the trial")
    sub.add_argument("--sealed", type=named_path, help="file for the truth, outside of that folder")


def add_blind_options(sub: argparse.ArgumentParser) -> None:
    """Declare the options of `blind`."""
    sub.add_argument(
        "--trials", type=int, help="run only the first so many, a random sample of the matrix"
    )
    sub.add_argument(
        "--matrix",
        choices=["bench", "standard"],
        default="bench",
        help="bench: the paper's leg and hexapod with their actuators; standard: bare URDFs with "
        "friction, wrong bodies and coloured noise beside what is hidden",
    )
    sub.add_argument("--seed", type=int, default=1, help="of the random numbers")
    sub.add_argument("--workers", type=int, default=2, help="number of processes; 2")
    sub.add_argument("--resume", action="store_true", help="go on where a run was stopped")
    sub.add_argument(
        "--out",
        type=named_path,
        default=Path("reports/out/blind"),
        help="folder for everything written",
    )
