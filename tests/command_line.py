"""The command line in this process, what it loads and leaves, robot files made by one edit."""

import csv
import json
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from pipeline.commands.gap import order_of
from pipeline.commands.main import main, parser
from pipeline.commands.robots import machine_of, walking_machine
from pipeline.effects.base import EFFECTS
from pipeline.effects.model_file import Edit, ModelFile
from pipeline.identification.workflow.compared import Order, compared_machine
from pipeline.machine.machine import MachineModel
from pipeline.robot.robot_file import load_robot_file
from pipeline.simulation.machine import Machine, read_machine

Rows = list[dict[str, str]]
#: Runs a verb on the hexapod with `--out`, and returns the exit code, argparse's own included.
Command = Callable[..., int]
#: The log that `make gap` reads, of the hexapod with the catalogue's alternative "rotor", ...
DEMO = Path(__file__).parents[1] / "pipeline" / "identification" / "demo" / "walk.parquet"
#: ... and what is hidden in it: dry friction in the right middle hip, SI.
HIDDEN = SimpleNamespace(
    effect="coulomb_friction", place=("rm_joint_1",), parameters={"torque": 2.0}
)
#: Runs a command that is refused, and returns its one line.
Refused = Callable[..., str]


def exit_code(arguments: Sequence[str]) -> int:
    try:
        return main(arguments)
    except SystemExit as stop:  # argparse refuses by leaving
        return int(str(stop.code))


def rows_of(path: Path, delimiter: str = ",") -> Rows:
    with path.open(encoding="utf-8-sig", newline="") as file:
        return list(csv.DictReader(file, delimiter=delimiter))


def record_of(path: Path) -> dict[str, Any]:
    """What a run's record says of the run and of one of its files."""
    record = json.loads((path.parent / "datapackage.json").read_text(encoding="utf-8"))
    (own,) = (one for one in record["resources"] if one["path"] == path.name)
    return {**record, **own}


#: Parameters that a robot file with a URDF of the user's own still gives.
GAIT = ("total_mass", "foot_stroke", "foot_lift", "walking_speed", "gait_period", "gravity")


def changed(text: str, pattern: str, replacement: str) -> str:
    """A text with the first match of a pattern replaced; there must be one."""
    text, count = re.subn(pattern, replacement, text, count=1, flags=re.S | re.M)
    assert count == 1, pattern
    return text


def own_robot(root: Path, folder: Path, pattern: str, replacement: str) -> Path:
    """A robot file that names a URDF of its own: the hexapod's, with one match replaced."""
    spec = load_robot_file(root / "urdf" / "hexapod.toml")
    urdf = changed(spec.urdf.read_text(encoding="utf-8"), pattern, replacement)
    (folder / "own.urdf").write_text(urdf, encoding="utf-8")
    head, *tables = re.split(r"(?m)^(?=\[parameters\.)", spec.path.read_text(encoding="utf-8"))
    head = head.replace('build = "hexapod"\n', "").replace('"hexapod.urdf"', '"own.urdf"')
    for leg in spec.legs:
        foot = f"neutral_foot = {list(leg.neutral_foot)}"
        head = re.sub(rf'(\[legs\.{leg.name}\].*?)station = "\w+"', rf"\1{foot}", head, flags=re.S)
    kept = [t for t in tables if t.split("]")[0].removeprefix("[parameters.") in GAIT]
    path = folder / "own.toml"
    path.write_text(head + "".join(kept), encoding="utf-8")
    return path


def as_compared(
    *logs: Path, robot: Path | None = None, actuators: Path | None = None, **options: Any
) -> tuple[Order, Machine]:
    """What `gap` is asked, and the machine as it compares it with the logs."""
    order = Order.of(logs=logs, **options)
    return order, compared_machine(order, read_machine(robot, actuators=actuators))


def as_asked(words: Sequence[str]) -> tuple[Order, Machine]:
    """The same by the words of a command line behind ``gap``."""
    given = parser("gap").parse_args(["gap", *words])
    order = order_of(given)
    return order, compared_machine(order, machine_of(given))


def walked_by(verb: str, *words: str) -> Machine:
    """A machine as ``walk`` or ``reports`` has it."""
    return walking_machine(parser(verb).parse_args([verb, *words]))


def edit_of(
    effect: str, *place: str, within: float = 0.1, unit: str = "current", **values: float
) -> Edit:
    """An effect as a log would have shown it, in a unit of efforts, each value within a share."""
    rows = {
        name: {
            "value": x,
            "unit": EFFECTS[effect].unit(name, unit),
            "interval": (x - within * abs(x), x + within * abs(x)),
        }
        for name, x in values.items()
    }
    made = {"effect": effect, "place": place, "source": "log.csv", "parameters": rows}
    return Edit.model_validate(made)


def base_model(file: ModelFile) -> MachineModel:
    """The machine of a model file before its edits."""
    return read_machine(file.robot, alternative=file.alternative, tolerant=True).bare_model
