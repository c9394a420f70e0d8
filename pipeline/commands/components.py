"""The verb `components`: parts that can be bought, listed and checked."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from actuators.errors import known
from actuators.loading.data_sheet import KINDS
from actuators.loading.parts import PARTS, Part, load_parts, odd
from pipeline.commands.options import AddVerb, named_path

#: Columns of a list, by kind; a part without such an entry leaves its place empty.
_SHOWN: Final[Mapping[str, Sequence[str]]] = {
    "motor": ("supply_voltage", "torque_constant", "resistance", "continuous_current", "mass"),
    "driver": ("most_voltage", "continuous_current", "idle_power", "mass"),
    "brake": ("holding_torque", "release_power", "mass"),
    "battery": ("specific_energy", "energy", "mass"),
}
_OF_GEARS: Final = ("gear_ratio", "gear_continuous_torque", "gear_efficiency", "gear_load", "mass")


class Parts(dict[str, Part]):
    """Parts by name, printed by kind."""

    def __str__(self) -> str:
        """How many there are of each kind, and the first."""
        kinds: dict[str, list[str]] = {}
        for part in self.values():
            kinds.setdefault(part.kind, []).append(part.name)
        return "\n".join(f"{kind}: {len(of)}, {', '.join(of[:3])}" for kind, of in kinds.items())


def components(folder: str | Path = PARTS) -> Parts:
    """Parts that can be bought, by name.

    Args:
        folder: With ``KIND.csv`` files of your own; the project's by default.

    Raises:
        LegwattError: The folder or a file cannot be used.
    """
    return Parts(load_parts(Path(folder)))


def add_verbs(add: AddVerb) -> None:
    """Declare the verb: names and folder."""
    sub = add("components", "parts that can be bought: list and check", run_components)
    sub.description = (
        "List parts that can be bought, with what their data sheets print; with names, all of "
        "each. `a to b` is not printed: a range of the part's class. Exit code 1: a part's "
        "numbers contradict each other."
    )
    sub.add_argument("names", nargs="*", metavar="NAME", help="parts to show in full")
    sub.add_argument(
        "--parts", type=named_path, default=PARTS, help="folder with KIND.csv of your own"
    )


def run_components(options: argparse.Namespace) -> int:
    """List and check.

    Returns:
        The exit code: 1 where a part contradicts itself.

    Raises:
        LegwattError: The folder cannot be used, or has no part of a name. A file cannot be read.
    """
    import pandas as pd  # not above: the command line starts without it

    parts = load_parts(options.parts)
    names = [known("no part", name, parts) for name in options.names] or [*parts]
    chosen = [parts[name] for name in names]
    if options.names:
        for p in chosen:
            print(f"{p.name} ({p.kind}): {p.title}\n  {p.basis}: {p.source}")
            print(f"  note: {p.note}\n" if p.note else "", end="")
            for name, number in p.printed.items():
                basis = "range" if name in p.filled else p.bases.get(name, "")
                of = f"  ({basis})" if basis else ""
                print(f"  {name} = {number.words}{of}  {KINDS[p.kind][name].words}")
    for kind in dict.fromkeys(p.kind for p in chosen if not options.names):
        shown = _SHOWN.get(kind, _OF_GEARS)
        rows = [
            [p.name, *(p.printed[e].words if e in p.printed else "" for e in shown), p.title]
            for p in chosen
            if p.kind == kind
        ]
        print(
            kind, pd.DataFrame(rows, columns=["name", *shown, "what it is"]).to_string(), sep="\n"
        )
    wrong = [f"{p.where}: {line}" for p in chosen for line in odd(p)]
    print(f"{len(chosen)} of {len(parts)} parts; {len(wrong)} contradictions")
    print(*wrong, sep="\n", end="\n" if wrong else "")
    return int(bool(wrong))
