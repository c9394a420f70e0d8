"""The verb `gap mapping`: a first mapping file for a foreign log."""

import argparse
import shlex
from pathlib import Path

from actuators.errors import LegwattError, one_line
from pipeline.commands.options import AddVerb, named_path

OUT = Path("mapping.toml")


def add_verbs(add: AddVerb) -> None:
    """Declare the verb."""
    text = "write a first mapping file for a foreign log, every line a guess with its reason"
    sub = add("gap mapping", text, run_mapping)
    sub.add_argument("log", type=named_path, help="CSV, Parquet, bag, or file of arrays")
    robot = "robot file, or URDF of a fixed robot: its joints' names"
    sub.add_argument("--robot", type=named_path, required=True, help=robot)
    sub.add_argument(
        "--out", type=named_path, default=OUT, help=f"the mapping file, never overwritten; {OUT}"
    )


def run_mapping(given: argparse.Namespace) -> int:
    """Write the file, say what is open and what to run next."""
    from pipeline.atomic import write_text
    from pipeline.logs.first_mapping import first_mapping
    from pipeline.logs.formats import is_log
    from pipeline.logs.log import expected_of_robot
    from pipeline.logs.mapping import load_mapping
    from pipeline.logs.read import plan_reading
    from pipeline.robot.robot import load_robot, read_spec

    if not is_log(given.log):
        raise LegwattError(f"{one_line(given.log)}: no such log; name a file or a folder of a bag")
    if given.out.exists():
        raise LegwattError(f"{one_line(given.out)}: is there already; name another with --out")
    expected = expected_of_robot(load_robot(read_spec(given.robot)))
    made = first_mapping(given.log, expected)
    write_text(given.out, made.text)
    out = one_line(given.out)
    print(f"written to {out}: {len(made.mapped)} columns mapped, {len(made.open)} left for you")
    if made.open:
        print(f"look at: {one_line(', '.join(made.open))}")
    try:
        plan = plan_reading(given.log, expected, load_mapping(given.out))
    except LegwattError as error:
        print(f"still missing: {' '.join(str(error).split())}")
        if made.asks_gains:
            print(f"gains: take the # off [pd_gains] at the end of {out}, put your own")
        return 1
    log, mapping, robot = (shlex.quote(str(p)) for p in (given.log, given.out, given.robot))
    metered = bool(plan.quantities & {"supply_power", "supply_current"})
    for step in [""] * (not plan.supply_alone) + ["power "] * metered:
        print(f"next: python -m pipeline gap {step}{log} --mapping {mapping} --robot {robot}")
    return 0
