"""The verb `components`: parts that can be bought, listed, filtered and checked."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from actuators.errors import LegwattError, closest, one_line
from actuators.loading.data_sheet import EVERY, KINDS, read_entry
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
    """Declare the verb: names, kind, bounds and folder."""
    sub = add("components", "parts that can be bought: list, filter, check", run_components)
    sub.description = (
        "List parts that can be bought, with what their data sheets print; with names, all of "
        "each. `a to b` is not printed: a range of the part's class. Exit code 1: a part's "
        "numbers contradict each other."
    )
    sub.add_argument("names", nargs="*", metavar="NAME", help="parts to show in full")
    sub.add_argument("--kind", choices=[*KINDS], help="of this kind only")
    for word, text in (("least", "at least"), ("most", "at most")):
        sub.add_argument(
            f"--{word}",
            action="append",
            default=[],
            metavar="ENTRY=NUMBER",
            help=f"only parts with {text} so much, such as 'mass=0.5 kg'",
        )
    sub.add_argument(
        "--parts", type=named_path, default=PARTS, help="folder with KIND.csv of your own"
    )


def run_components(options: argparse.Namespace) -> int:
    """List, filter, check.

    Returns:
        The exit code: 1 where a part contradicts itself.

    Raises:
        LegwattError: The folder cannot be used, or has no part of a name. A file or a bound cannot
            be read.
    """
    parts = load_parts(options.parts)
    for name in options.names:
        if name not in parts:
            raise LegwattError(f"no part '{name}': {closest(name, [*parts])}")
    bounds = [(*_bound("--least", text), 1.0) for text in options.least]
    bounds += [(*_bound("--most", text), -1.0) for text in options.most]
    chosen = [parts[name] for name in options.names] or [
        p for p in parts.values() if options.kind in (None, p.kind) and _within(p, bounds)
    ]
    if not chosen:
        raise LegwattError("no part is left: widen --kind, --least or --most")
    if options.names:
        out = []
        for p in chosen:
            out.append(f"{p.name} ({p.kind}): {p.title}\n  {p.basis}: {p.source}")
            out += [f"  note: {p.note}"] * bool(p.note)
            for name, number in p.printed.items():
                basis = "range" if name in p.filled else p.bases.get(name, "")
                of = f"  ({basis})" if basis else ""
                out.append(f"  {name} = {number.words}{of}  {KINDS[p.kind][name].words}")
        print("\n".join(out) + "\n")
    else:
        for kind in dict.fromkeys(p.kind for p in chosen):
            print(_list([p for p in chosen if p.kind == kind]))
    wrong = [f"{p.where}: {line}" for p in chosen for line in odd(p)]
    print(f"{len(chosen)} of {len(parts)} parts; {len(wrong)} contradictions")
    print(*wrong, sep="\n", end="\n" if wrong else "")
    return int(bool(wrong))


def _bound(of: str, text: str) -> tuple[str, float]:
    """An entry and its bound, SI; `of` is the option that gives it."""
    name, _, written = text.partition("=")
    if not written:
        raise LegwattError(f"{of} '{one_line(text)}': expected ENTRY=NUMBER UNIT")
    try:
        return name, read_entry(name, written, EVERY).value
    except LegwattError as error:
        raise LegwattError(f"{of} {error}") from None


def _within(part: Part, bounds: Sequence[tuple[str, float, float]]) -> bool:
    """Whether a part keeps all bounds; one that does not print an entry does not."""
    return all(
        name in part.printed and sign * (part.printed[name].value - bound) >= 0.0
        for name, bound, sign in bounds
    )


def _list(parts: Sequence[Part]) -> str:
    shown = _SHOWN.get(parts[0].kind, _OF_GEARS)
    rows = [("name", *shown, "what it is")]
    for p in parts:
        words = (p.printed[name].words if name in p.printed else "" for name in shown)
        rows.append((p.name, *words, p.title))
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]) - 1)]
    lines = [
        "  ".join([*(cell.ljust(w) for cell, w in zip(row, widths, strict=False)), row[-1]])
        for row in rows
    ]
    return f"{parts[0].kind}\n" + "\n".join(lines) + "\n"
