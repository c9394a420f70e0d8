"""The verb `choose`: which motor, gear and brake for a robot's day."""

from __future__ import annotations

import argparse
from pathlib import Path

from actuators.errors import LegwattError
from actuators.loading.data_sheet import Entry, Number, read_entry
from actuators.loading.parts import DRIVER, PACK, PARTS
from actuators.units import quantity
from pipeline.cli.options import (
    DECIMAL,
    OUT,
    AddVerb,
    add_machine_options,
    add_out_option,
    machine_of,
    named,
    named_path,
)

#: The day that comes with the project, of any walking robot.
DAY = Path(__file__).parents[1] / "choice" / "missions" / "day.csv"
#: Draws beyond which an answer changes no more, and memory ends.
MOST_DRAWS = 100_000
_NUMBERS = {
    "idle": Entry("power", "of a driver that is on", "0.672 W"),
    "hotel": Entry("power", "of the electronics", "10 W"),
    "battery": Entry("energy", "when full, in place of the pack's", "500 Wh"),
    "voltage": Entry("voltage", "of the supply", "48 V"),
    "present": Entry("mass", "of an actuator that the bodies hold already", "0.48 kg"),
    "present-battery": Entry("mass", "of a battery that they hold; the pack's own", "0 kg"),
}


def add_verb(add: AddVerb) -> None:
    """Declare the verb."""
    sub = add("choose", "which motor, gear and brake: every combination over a day", run_choose)
    sub.description = (
        "Search every combination of the parts that can be bought over a robot's day, group of "
        "joints by group of joints: the least energy within limits, how sure, and what to measure."
    )
    add_machine_options(sub, "robot file or name", "change a number for this run: NAME=VALUE")
    text = "CSV of modes with their share of the time; columns in pipeline/choice/README.md"
    sub.add_argument("--mission", type=named_path, default=DAY, help=text)
    sub.add_argument("--parts", type=named_path, default=PARTS, help="folder with KIND/NAME.toml")
    for word, kind in (("kind", "kind of gears"), ("only", "parts"), ("without", "parts")):
        more = "these only" if word != "without" else "not these"
        sub.add_argument(
            f"--{word}", action="append", default=[], metavar="NAME", help=f"{kind}: {more}"
        )
    sub.add_argument("--no-brakes", action="store_true", help="no design with a brake")
    sub.add_argument(
        "--group",
        action="append",
        default=[],
        metavar="NAME=PATTERN,...",
        help="joints that are built alike; by default those alike in all legs",
    )
    for name, entry in _NUMBERS.items():
        usual = "0.672 W" if name == "idle" else None
        sub.add_argument(
            f"--{name}",
            default=usual,
            metavar="NUMBER",
            help=f"{entry.kind} {entry.words}, such as '{entry.example}'",
        )
    text = "spring beside actuators, such as '*_knee=3 N*m/rad@40 deg'"
    sub.add_argument(
        "--spring", action="append", default=[], metavar="PATTERN=STIFFNESS@ANGLE", help=text
    )
    for word, usual in (("driver", DRIVER), ("pack", PACK)):
        text = f"part that is the {'battery' if word == 'pack' else word}; {usual}"
        sub.add_argument(f"--{word}", default=usual, metavar="NAME", help=text)
    text = "none, bus, or a fraction of returned energy that is used again"
    sub.add_argument("--regeneration", default="none", metavar="POLICY", help=text)
    sub.add_argument("--draws", type=int, default=256, help="over what no sheet prints; 256")
    add_out_option(sub, OUT / "choose")


def run_choose(options: argparse.Namespace) -> int:
    """Search, write the tables, print three lines."""
    from pipeline.choice.answer.result import choice
    from pipeline.choice.asked import Wanted
    from pipeline.choice.track import Account
    from pipeline.simulation.settings import regeneration_of

    policy = regeneration_of(options.regeneration)
    if not 8 <= options.draws <= MOST_DRAWS:
        raise LegwattError(f"--draws {options.draws}: expected 8 to {MOST_DRAWS}")
    given = vars(options)
    numbers = {name: _number(name, given[name.replace("-", "_")]) for name in _NUMBERS}
    value = {name: None if x is None else x.value for name, x in numbers.items()}
    machine = machine_of(options)
    wanted = Wanted(
        **named(options, ("parts", "driver", "pack", "draws")),
        kinds=tuple(options.kind),
        only=tuple(options.only),
        without=tuple(options.without),
        voltage=value["voltage"],
        idle=numbers["idle"],
        brakes=not options.no_brakes,
        groups=tuple(options.group),
        account=Account(value["hotel"] or 0.0, policy.policy, policy.fraction),
        battery=value["battery"],
        present=value["present"],
        present_battery=value["present-battery"],
        springs=tuple(options.spring),
    )
    result = choice(machine, options.mission, wanted)
    result.save(options.out, decimal=DECIMAL[options.decimal])
    print(*result.lines, f"wrote {options.out}", sep="\n")
    return 0


def _number(name: str, words: str | None) -> Number | None:
    """An option with its unit, SI."""
    if words is None:
        return None
    nothing = words == "0" or (words[:1] == "0" and not quantity(words, _NUMBERS[name].kind))
    if nothing and name not in ("voltage", "battery"):
        return Number(0.0, 0.0, 0.0, "1", "0")
    return read_entry(name, words, _NUMBERS)
