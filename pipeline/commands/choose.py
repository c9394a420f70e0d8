"""The verbs `components` and `choose`: parts that can be bought, and which for a robot's day."""

import argparse
from pathlib import Path

from actuators.errors import known
from actuators.loading.data_sheet import KINDS
from actuators.loading.parts import PARTS, Part, load_parts, odd
from pipeline.choice.options import ChooseOptions
from pipeline.choice.result import DAY, choice
from pipeline.commands.main import (
    OUT,
    AddVerb,
    add_machine_options,
    add_options,
    add_out_option,
    given_options,
    named_path,
)
from pipeline.commands.robots import machine_of


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
    """Declare the verbs."""
    sub = add("components", "parts that can be bought: list and check", run_components)
    sub.description = (
        "List parts that can be bought; with names, all that their data sheets print. `a to b` is "
        "not printed: a range of the part's class. Exit code 1: a part's numbers contradict each "
        "other."
    )
    sub.add_argument("names", nargs="*", metavar="NAME", help="parts to show in full")
    sub.add_argument(
        "--parts", type=named_path, default=PARTS, help="folder with KIND.csv of your own"
    )

    sub = add("choose", "which motor, gear and brake: every combination over a day", run_choose)
    sub.description = (
        "Search every combination of the parts that can be bought over a robot's day, group of "
        "joints by group of joints: the least energy within limits, how sure, and what to measure."
    )
    add_machine_options(sub, "robot file or name")
    text = "CSV of modes with their share of the time; columns in pipeline/choice/README.md"
    sub.add_argument("--mission", type=named_path, default=DAY, help=text)
    add_options(sub, ChooseOptions)
    add_out_option(sub, OUT / "choose")


def run_components(options: argparse.Namespace) -> int:
    """List and check.

    Returns:
        The exit code: 1 where a part contradicts itself.

    Raises:
        LegwattError: The folder cannot be used, or has no part of a name. A file cannot be read.
    """
    parts = load_parts(options.parts)
    names = [known("no part", name, parts) for name in options.names] or [*parts]
    chosen = [parts[name] for name in names]
    for p in chosen:
        print(f"{p.name} ({p.kind}): {p.title}")
        if not options.names:
            continue
        print(f"  {p.basis}: {p.source}\n" + f"  note: {p.note}\n" * bool(p.note), end="")
        for name, number in p.printed.items():
            basis = "range" if name in p.filled else p.bases.get(name, "")
            of = f"  ({basis})" if basis else ""
            print(f"  {name} = {number.words}{of}  {KINDS[p.kind][name].words}")
    wrong = [f"{p.where}: {line}" for p in chosen for line in odd(p)]
    print(f"{len(chosen)} of {len(parts)} parts; {len(wrong)} contradictions")
    print(*wrong, sep="\n", end="\n" if wrong else "")
    return int(bool(wrong))


def run_choose(options: argparse.Namespace) -> int:
    """Search, write the tables, print the answer."""
    asked = ChooseOptions.of(**given_options(options, ChooseOptions))  # refused before files
    machine = machine_of(options)
    result = choice(machine, options.mission, **asked.model_dump())
    result.save(options.out)
    print(result, f"wrote {options.out}", sep="\n")
    return 0
