"""Measured logs against a machine: what it lacks, and what of a log can be believed."""

from __future__ import annotations

import argparse
import logging
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actuators.checked import write_text
from actuators.errors import LegwattError, known, one_line
from pipeline.columns import frame
from pipeline.commands.main import (
    AddVerb,
    add_machine_options,
    add_options,
    add_out_option,
    add_verbose_option,
    given_options,
    named_path,
)
from pipeline.commands.robots import machine_of
from pipeline.identification.supply.account import account
from pipeline.identification.workflow.changed import changes
from pipeline.identification.workflow.compared import (
    DEFAULT_OUT,
    STEPS,
    Compared,
    GapOptions,
    Order,
    compare_logs,
    compared_machine,
    load_logs,
    refuse_missing,
)
from pipeline.identification.workflow.forward import forward
from pipeline.identification.workflow.outcome import (
    Outcome,
    candidates_table,
    check,
    found_table,
    identified,
)
from pipeline.logs.first_mapping import first_mapping
from pipeline.logs.formats import is_log
from pipeline.logs.log import Finding, expected_of_robot
from pipeline.logs.mapping import load_mapping
from pipeline.logs.read import plan_reading
from pipeline.result import Result, of_table
from pipeline.robot.robot import load_robot, read_spec
from pipeline.simulation.export import exported, found_bodies
from pipeline.simulation.machine import Machine
from reports.page import plain
from reports.pages.gap_page import (
    answer,
    power_answer,
    where_line,
    write_gap_page,
    write_power_page,
)

if TYPE_CHECKING:
    from pandas import DataFrame

logger = logging.getLogger("legwatt")
MAPPING = Path("mapping.toml")

Page = Callable[[Mapping[str, "DataFrame"], Path], None]


@dataclass(frozen=True, eq=False)
class LogResult(Result):
    """What one step finds in logs: their quality, where the gap is, what is missing."""

    machine: Machine  #: As the step compared it.
    findings: Sequence[Finding]  #: The quality of the logs.
    told: Sequence[str]  #: What a person wants to know first, in ten sentences.
    negative: bool = False  #: Whether the finding is one that the exit code tells.
    compared: Compared | None = field(default=None, repr=False)  #: Logs, and their predictions.
    files: Mapping[str, str] = field(default_factory=dict, repr=False)  #: Texts to write by name.
    page: Page | None = field(default=None, repr=False)  #: Writes the page, where there is one.
    path: Path = Path()  #: Of a log that was read: CSV or Parquet.
    mapping: Path | None = None  #: Mapping file for its foreign columns; None without.

    quality = of_table("quality")  #: The quality of the logs: one row per check.
    where = of_table("where")  #: The gap by joint and circumstance.

    #: Mean power of every term with its interval, what is unexplained last.
    power = of_table("power")

    def __str__(self) -> str:
        """The first remark on files and data and how many more there are, then what is told.

        Of a log that was read every judgement with a remark.
        """
        if self.verb == "gap read":
            odd = [f for f in self.findings if f.verdict != "ok"]
            lines = [_remark(f, f"{f.verdict.replace('_', ' ')}: ") for f in odd]
            count = len(self.findings)
            lines.append(f"{count - len(odd)} of {count} checks passed without a remark")
        else:
            worst = sorted(self.findings, key=lambda f: f.verdict != "suspected")
            odd = [f for f in worst if f.verdict in ("suspected", "warning")]
            notes = [*self.machine.warnings, *map(_remark, odd)]
            more = f" ({len(notes) - 1} more remarks in quality.csv)" if len(notes) > 1 else ""
            lines = [*(f"note: {note}{more}" for note in notes[:1]), *self.told]
        return "\n".join(map(plain, lines))

    def _write(self, out: Path) -> dict[str, Any]:
        about = super()._write(out)
        for name, text in self.files.items():
            write_text(out / name, text)
        if self.page:
            self.page(self.tables, out)
        return about


def _remark(f: Finding, verdict: str = "") -> str:
    return f"{f.log}{' ' * bool(f.column)}{f.column}: {verdict}{f.detail}"


@dataclass(frozen=True, eq=False, kw_only=True)
class Identified(LogResult):
    """What the model lacks, and what it leaves once that is written into it."""

    outcome: Outcome  #: Everything that the files say.
    loaded: Machine = field(repr=False)  #: Before it was put on the logs' base.

    @property
    def model(self) -> Machine:
        """The machine with what was found and written; `save` writes it."""
        if not self.outcome.text:
            return self.loaded
        file = self.machine.stated_file.model_copy(update={"edits": self.outcome.edits})
        return self.loaded.with_model(file)

    #: Effects with parameters, intervals, levels, and whether the model holds them.
    found = of_table("found")
    candidates = of_table("candidates")  #: Every effect that was tried, with its verdict.

    @property
    def gap(self) -> tuple[float, float]:
        """Root mean square gap on test rows, before and with the model as written."""
        return self.outcome.gaps


def read_log(
    path: str | Path, machine: Machine, *, mapping: str | Path | None = None, **options: Any
) -> LogResult:
    """Read a log and check its quality.

    Args:
        path: CSV, Parquet, bag or file of arrays.
        machine: Whose log it is.
        mapping: Mapping file for foreign columns.
        **options: See `pipeline.identification.workflow.compared.GapOptions`.

    Raises:
        LegwattError: The log cannot be used; one line says which row or column and why.
    """
    result: LogResult = gap(path, machine, step="read", mapping=mapping, **options)
    return result


def gap(logs: Any, machine: Machine, *, test: Any = (), step: str = "all", **options: Any) -> Any:
    """What a machine's model lacks, from its logs.

    Args:
        logs: To learn from, one or several, from `read_log` or by path.
        machine: The model.
        test: Logs that are held out: nothing is fitted to them.
        step: All of them by default. ``name``, ``add``, ``shrink`` and all give an `Identified`,
            the others a `LogResult`.
        **options: See `pipeline.identification.workflow.compared.GapOptions`; `out`, the folder
            beside which a model file names its robot.

    Raises:
        LegwattError: A log cannot be used, or does not fit the machine; no such step or option.
    """
    known("no step", step, ("all", *STEPS), "gap")
    if clash := [name for name in ("logs", "holdout") if name in options]:
        raise LegwattError(f"gap: no option '{clash[0]}'; held-out logs are `test`")
    given = [[x] if isinstance(x, str | Path | LogResult) else list(x) for x in (logs, test)]
    own = [log.mapping for log in (*given[0], *given[1]) if isinstance(log, LogResult)]
    mapping = options.pop("mapping", None) or next((path for path in own if path), None)
    learn, held = (
        tuple(x.path if isinstance(x, LogResult) else Path(x) for x in some) for some in given
    )
    return analyse(
        Order.of(step=step, logs=learn, holdout=held, mapping=mapping, **options), machine
    )


def analyse(order: Order, machine: Machine) -> LogResult:
    """Run one step, or all of them.

    Raises:
        LegwattError: Unusable robot. Unusable actuators. Unusable log, mapping or model file.
    """
    refuse_missing(order)
    if order.step == "shrink" and machine.model_file is None:
        raise LegwattError("gap shrink: name the model file to check")
    given = compared_machine(order, machine)
    said = {
        "options": {
            **order.model_dump(mode="json", exclude={"logs", "holdout", "out", "mapping"}),
            "set": [f"{key}={value}" for key, value in given.changes.items()],
            "alternative": given.alternative or "none: the torque is the joint's",
        },
        "conventions": "SI units; torque, velocity, current and voltage positive in the joint's "
        "direction; gap is measured minus predicted",
        "warnings": list(given.warnings),
    }

    def common(tables: Mapping[str, DataFrame], findings: Sequence[Finding]) -> dict[str, Any]:
        """What every result of a step begins with."""
        return {
            "verb": "gap" if order.step == "all" else f"gap {order.step}",
            "_tables": {name: partial(tables.__getitem__, name) for name in tables},
            "_said": said,
            "inputs": (*order.logs, *order.holdout, *given.inputs, *filter(None, [order.mapping])),
            "machine": given,
            "findings": findings,
        }

    logger.info("reading and judging the logs")
    loaded = load_logs(given, order)
    quality = {"quality": frame("quality", map(vars, loaded.findings))}
    if order.step == "read":
        first = common(quality, loaded.findings)
        return LogResult(**first, told=(), path=order.logs[0], mapping=order.mapping)
    if order.step == "power":
        logger.info("adding up the drives")
        balance = account(given, loaded.logs, len(loaded.logs) - loaded.fitted, order.prove_last)
        tables = {**quality, "power": balance.power, "power_drives": balance.drives}
        tables["power_samples"] = balance.samples
        page = partial(write_power_page, balance, given.model.name, given.warnings)
        lines, negative = power_answer(balance), balance.negative
        first = common(tables, loaded.findings)
        return LogResult(**first, told=lines, negative=negative, page=page)
    logger.info("simulating the logs' motion")
    compared = compare_logs(given, given.model, loaded)
    findings = compared.loaded.findings
    if order.step == "forward":
        logger.info("driving the model by its servos")
        tables = forward(given, compared, order)
        lines, negative = _driven(tables["forward"])
        return LogResult(**common(tables, findings), told=lines, negative=negative)
    tables = {"quality": frame("quality", map(vars, findings)), "where": compared.where}
    if order.step == "where":
        lines = [where_line(compared.where)]
        return LogResult(**common(tables, findings), told=lines, compared=compared)
    if order.step == "shrink":
        logger.info("validating the model file's effects")
        outcome = check(given, compared)
    else:
        outcome = identified(given, compared, order)
    edits, old = outcome.edits, given.stated_file.edits
    tables |= {"candidates": candidates_table(outcome), "found": found_table(outcome)}
    more = {"bodies": found_bodies(given.bare_model, edits), "rest": outcome.rest}
    tables |= {name: table for name, table in more.items() if table is not None and len(table)}
    if old and len(edits) > len(old):
        tables["changed"] = changes(given.model, old, edits[len(old) :])
    written = outcome.text and order.step != "name"
    return Identified(
        **common(tables, findings),
        told=answer(outcome, tables),
        negative=outcome.unexplained,
        files={"model.toml": outcome.text} if written else {},
        page=partial(write_gap_page, outcome) if order.step in ("all", "shrink") else None,
        outcome=outcome,
        loaded=machine,
    )


def _driven(errors: DataFrame) -> tuple[list[str], bool]:
    """Position error of each model, and whether effects bring positions no nearer."""
    logs = errors["log"].nunique() - 1
    every = errors[errors["log"] == "all"]
    squares = (every["position_rms_rad"] ** 2 * every["rows"]).groupby(every["model"], sort=False)
    rows = every["rows"].groupby(every["model"], sort=False)
    rms = (squares.sum() / rows.sum()) ** 0.5
    told = [
        f"{model}: position misses by {1e3 * error:.1f} mrad root mean square, {logs} logs"
        for model, error in rms.items()
    ]
    return told, len(rms) > 1 and bool(rms.iloc[-1] >= rms.iloc[0])


def add_verbs(add: AddVerb) -> None:
    """Declare the verbs `gap`, `gap export` and `gap mapping`."""
    text = "write a model file's machine as MJCF or URDF, and what these leave out"
    sub = add("gap export", text, run_export)
    sub.add_argument("model", type=named_path, help="model file that `gap` wrote")
    sub.add_argument("--to", choices=("mjcf", "urdf"), required=True, help="what to write")
    sub.add_argument("--out", type=named_path, required=True, help="the file")
    sub.add_argument(
        "--robot", type=named_path, help="robot file or URDF; the one that the model file names"
    )
    text = "folder of actuator files that the model was found with; actuators/catalog by default"
    sub.add_argument("--actuators", type=named_path, metavar="DIR", help=text)

    text = "write a first mapping file for a foreign log, every line a guess with its reason"
    sub = add("gap mapping", text, run_mapping)
    sub.add_argument("log", type=named_path, help="CSV, Parquet, bag, or file of arrays")
    robot = "robot file, or URDF of a fixed robot: its joints' names"
    sub.add_argument("--robot", type=named_path, required=True, help=robot)
    sub.add_argument(
        "--out",
        type=named_path,
        default=MAPPING,
        help=f"the mapping file, never overwritten; {MAPPING}",
    )

    sub = add("gap", "find what the model lacks: from a measured log to a named effect", run_gap)
    sub.add_argument(
        "items",
        nargs="+",
        metavar="[STEP] LOG",
        help="logs (CSV or Parquet) to learn from; a step in front of them does that step only: "
        + "; ".join(f"{name}: {text}" for name, text in STEPS.items()),
    )
    add_machine_options(sub, "robot file, or URDF of a fixed robot")
    sub.add_argument(
        "--holdout",
        type=named_path,
        nargs="+",
        default=[],
        metavar="LOG",
        help="logs on which the result is tested; nothing is fitted to them",
    )
    add_options(sub, GapOptions)
    add_out_option(sub, DEFAULT_OUT)
    add_verbose_option(sub)


def order_of(given: argparse.Namespace) -> Order:
    """What the command line asks for."""
    first = given.items[0]  # a log file that is called like a step is a log
    step = first if first in STEPS and not Path(first).is_file() else ""
    return Order.of(
        step=step or "all",
        logs=tuple(map(Path, given.items[bool(step) :])),
        holdout=tuple(given.holdout),
        out=given.out,
        **given_options(given, GapOptions),
    )


def run_gap(given: argparse.Namespace) -> int:
    """Compute what is asked for, write it, say what a person wants to know first.

    Returns:
        0 where the gap is down to noise, 1 where a part stays unexplained.
    """
    order = order_of(given)
    result = analyse(order, machine_of(given, guess=False))
    logger.info("writing tables")
    result.save(order.out)
    print(result)
    print(f"written to {order.out}")
    return int(result.negative)


def run_mapping(given: argparse.Namespace) -> int:
    """Write the file, say what is open and what to run next."""
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
        return 1
    log, mapping, robot = (shlex.quote(str(p)) for p in (given.log, given.out, given.robot))
    metered = bool(plan.quantities & {"supply_power", "supply_current"})
    for step in [""] * (not plan.supply_alone) + ["power "] * metered:
        print(f"next: python -m pipeline gap {step}{log} --mapping {mapping} --robot {robot}")
    return 0


def run_export(given: argparse.Namespace) -> int:
    """Write the file and say what it cannot hold."""
    files = {"robot": given.robot, "actuators": given.actuators}
    text, left, remarks = exported(given.model, given.to, **files)
    write_text(given.out, text)
    print(f"written to {given.out}")
    for words in remarks:
        print(f"note: {words}")
    for words in left:
        print(f"not carried over: {one_line(words)}")
    return 0
