"""Measured logs against a machine: what it lacks, and what of a log can be believed."""

from __future__ import annotations

import argparse
import logging
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actuators.errors import LegwattError, closest, one_line
from pipeline.atomic import write_text
from pipeline.commands.options import (
    DECIMAL,
    AddVerb,
    add_machine_options,
    add_options,
    add_out_option,
    add_verbose_option,
    given_options,
    named_path,
    verb_of,
)
from pipeline.commands.robots import machine_of
from pipeline.effects.model_file import Edit, edits_in
from pipeline.identification.supply.account import Account, account
from pipeline.identification.workflow.changed import changes
from pipeline.identification.workflow.compared import Compared, compare_logs, load_logs
from pipeline.identification.workflow.forward import Drive, by_model, rms
from pipeline.identification.workflow.forward import forward as drive_forward
from pipeline.identification.workflow.options import (
    DEFAULT_OUT,
    STEPS,
    GapOptions,
    Order,
    compared_machine,
    refuse_missing,
)
from pipeline.identification.workflow.outcome import Outcome, check, identified
from pipeline.identification.workflow.tables import (
    Tables,
    candidates_table,
    forward_tables,
    found_table,
    records,
)
from pipeline.logs.errors import Finding
from pipeline.result import Result
from pipeline.simulation.found_bodies import FoundBodies, corrected_urdf, found_bodies, not_in_urdf
from pipeline.simulation.machine import Machine
from reports.page import plain
from reports.pages.gap_answer import URDF_FILE, answer, where_line
from reports.pages.power_page import power_answer

if TYPE_CHECKING:
    from pandas import DataFrame

logger = logging.getLogger("legwatt")


@dataclass(frozen=True, eq=False)
class LogResult(Result):
    """What one step finds in logs: their quality, where the gap is, what is missing."""

    machine: Machine  #: As the step compared it.
    findings: Sequence[Finding]  #: The quality of the logs.

    @property
    def quality(self) -> DataFrame:
        """The quality of the logs: one row per check."""
        return self.table("quality")

    @property
    def where(self) -> DataFrame:
        """The gap by joint and circumstance."""
        return self.table("where")

    @property
    def negative(self) -> bool:
        """Whether the finding is one that the exit code tells."""
        return False

    @property
    def notes(self) -> list[str]:
        """The first remark on files and data, and how many more there are."""
        worst = sorted(self.findings, key=lambda f: f.verdict != "suspected")
        lines = [*self.machine.warnings]
        lines += [
            f"{f.log}{' ' * bool(f.column)}{f.column}: {f.detail}"
            for f in worst
            if f.verdict in ("suspected", "warning")
        ]
        more = f" ({len(lines) - 1} more remarks in quality.csv)" if len(lines) > 1 else ""
        return [f"note: {lines[0]}{more}"] if lines else []

    @property
    def lines(self) -> list[str]:
        """What a person wants to know first."""
        return [*self.notes, where_line(self.where)]

    def __str__(self) -> str:
        """The lines that the command line prints."""
        return "\n".join(map(plain, self.lines))


@dataclass(frozen=True, eq=False)
class MeasuredLog(LogResult):
    """A log that was read and judged."""

    path: Path  #: CSV or Parquet.
    mapping: Path | None  #: Mapping file for foreign columns; None without.

    @property
    def lines(self) -> list[str]:
        """Every judgement with a remark."""
        odd = [f for f in self.findings if f.verdict != "ok"]
        said = [
            f"{f.log}{' ' * bool(f.column)}{f.column}: {f.verdict.replace('_', ' ')}: {f.detail}"
            for f in odd
        ]
        passed = len(self.findings) - len(odd)
        return [*said, f"{passed} of {len(self.findings)} checks passed without a remark"]


@dataclass(frozen=True, eq=False)
class Comparison(LogResult):
    """Where model and machine disagree."""

    shown = "where"
    residuals: Compared  #: The logs, and the predictions that the table rests on.


@dataclass(frozen=True, eq=False)
class Identified(LogResult):
    """What the model lacks, and what it leaves once that is written into it."""

    shown = "found"
    outcome: Outcome  #: Everything that the files say.
    bodies: FoundBodies  #: Those found to be others, and the corrected URDF.
    loaded: Machine = field(repr=False)  #: Before it was put on the logs' base.

    @property
    def model(self) -> Machine:
        """The machine with what was found and written; `save` writes it."""
        text = self.outcome.validated.text
        if not text or self.verb == "gap shrink":
            return self.loaded
        file = self.machine.stated_file.model_copy(update={"edits": edits_in(text)})
        return self.loaded.with_model(file)

    @property
    def found(self) -> DataFrame:
        """Effects with parameters, intervals, levels, and whether the model holds them."""
        return self.table("found")

    @property
    def candidates(self) -> DataFrame:
        """Every effect that was tried, with its verdict."""
        return self.table("candidates")

    @property
    def gap(self) -> tuple[float, float]:
        """Root mean square gap on test rows, before and with the model as written."""
        return self.outcome.gaps

    @property
    def negative(self) -> bool:
        """Whether more than noise is left, or the log may not say what it seems to."""
        return self.outcome.unexplained

    @property
    def lines(self) -> list[str]:
        """What a person wants to know first, in ten sentences."""
        return [*self.notes, *answer(self.outcome, self.bodies, self.tables)]

    def _write(self, out: Path, decimal: str) -> dict[str, Any]:
        """The tables; but for ``name`` the model file; for all steps or ``shrink`` a page."""
        about = super()._write(out, decimal)
        files = {"model.toml": self.outcome.validated.text, URDF_FILE: self.bodies.urdf}
        for name, text in files.items() if self.verb != "gap name" else ():
            if text:
                write_text(out / name, text)
        if self.verb in ("gap", "gap shrink"):
            from reports.pages.gap_page import write_gap_page

            write_gap_page(self.outcome, self.bodies, self.tables, out)
        return about


@dataclass(frozen=True, eq=False)
class Driven(LogResult):
    """A model that drove itself under its servos' law."""

    shown = "forward"
    drives: Sequence[Drive]  #: One for each log and model.

    @property
    def position_rms(self) -> float:
        """Root mean square position error with all effects [rad]."""
        return self.errors()[-1][1]

    def errors(self) -> list[tuple[str, float]]:
        """Models in order of their effects, each with its position error [rad]."""
        return [(model, rms(drives)) for model, drives in by_model(self.drives).items()]

    @property
    def negative(self) -> bool:
        """Whether effects bring positions no nearer."""
        errors = self.errors()
        return len(errors) > 1 and errors[-1][1] >= errors[0][1]

    @property
    def lines(self) -> list[str]:
        """Position error of each model."""
        logs = len({drive.log.name for drive in self.drives})
        return [
            f"{model}: position misses by {1e3 * error:.1f} mrad root mean square, {logs} logs"
            for model, error in self.errors()
        ]


@dataclass(frozen=True, eq=False)
class Powered(LogResult):
    """The supply's power, term by term."""

    shown = "power"
    account: Account  #: With every sample.

    @property
    def power(self) -> DataFrame:
        """Mean power of every term with its interval, what is unexplained last."""
        return self.table("power")

    @property
    def negative(self) -> bool:
        """Whether a part of the power stays unexplained."""
        return self.account.negative

    @property
    def lines(self) -> list[str]:
        """What a person wants to know first."""
        return [*self.notes, *power_answer(self.account)]

    def _write(self, out: Path, decimal: str) -> dict[str, Any]:
        from reports.pages.power_page import write_power_page

        about = super()._write(out, decimal)
        name, warnings = self.machine.model.name, self.machine.warnings
        write_power_page(self.account, name, self.tables, warnings, out)
        return about


def read_log(
    path: str | Path, machine: Machine, *, mapping: str | Path | None = None, **options: Any
) -> MeasuredLog:
    """Read a log and check its quality.

    Args:
        path: CSV, Parquet, bag or file of arrays.
        machine: Whose log it is.
        mapping: Mapping file for foreign columns.
        **options: See `pipeline.identification.workflow.options.GapOptions`.

    Raises:
        LegwattError: The log cannot be used; one line says which row or column and why.
    """
    result = gap(path, machine, step="read", mapping=mapping, **options)
    assert isinstance(result, MeasuredLog)
    return result


def gap(logs: Any, machine: Machine, *, test: Any = (), step: str = "all", **options: Any) -> Any:
    """What a machine's model lacks, from its logs.

    Args:
        logs: To learn from, one or several, from `read_log` or by path.
        machine: The model.
        test: Logs that are held out: nothing is fitted to them.
        step: All of them by default. ``read`` gives a `MeasuredLog`, ``where`` a `Comparison`,
            ``name``, ``add``, ``shrink`` and all an `Identified`, ``forward`` a `Driven`, ``power``
            a `Powered`.
        **options: See `pipeline.identification.workflow.options.GapOptions`; `out`, the folder
            beside which a model file names its robot.

    Raises:
        LegwattError: A log cannot be used, or does not fit the machine; no such step or option.
    """
    if step not in ("all", *STEPS):
        raise LegwattError(f"gap: no step '{one_line(step)}': {closest(step, ['all', *STEPS])}")
    if clash := [name for name in ("logs", "holdout") if name in options]:
        raise LegwattError(f"gap: no option '{clash[0]}'; held-out logs are `test`")
    given = [[x] if isinstance(x, str | Path | MeasuredLog) else list(x) for x in (logs, test)]
    own = [log.mapping for log in (*given[0], *given[1]) if isinstance(log, MeasuredLog)]
    mapping = options.pop("mapping", None) or next((path for path in own if path), None)
    learn, held = (
        tuple(x.path if isinstance(x, MeasuredLog) else Path(x) for x in some) for some in given
    )
    return analyse(
        Order.of(step=step, logs=learn, holdout=held, mapping=mapping, **options), machine
    )


def analyse(order: Order, machine: Machine) -> LogResult:
    """Run one step, or all of them.

    Raises:
        LegwattError: Unusable robot. Unusable actuators. Unusable log, mapping or model file.
    """
    refuse_missing(order, machine)
    given = compared_machine(order, machine)
    if (order.out / URDF_FILE).resolve() in {source.resolve() for source in given.inputs}:
        raise LegwattError(
            f"{order.out / URDF_FILE}: the robot's URDF lies where a corrected one is written; "
            "choose another folder, or copy it elsewhere"
        )
    step, joints = order.step, given.model.joints
    logger.info("reading and judging the logs")
    loaded = load_logs(given, order)
    if step in ("read", "power"):
        findings = loaded.findings
        tables = {"quality": records("quality", findings)}
        if step == "read":
            common = _common(order, given, tables, findings)
            return MeasuredLog(**common, path=order.logs[0], mapping=order.mapping)
        logger.info("adding up the drives")
        test = len(loaded.logs) - loaded.fitted
        balance = account(given, loaded.logs, test, order.prove_last)
        tables |= {"power": balance.power, "power_drives": balance.drives}
        tables |= {"power_samples": balance.samples}
        return Powered(**_common(order, given, tables, findings), account=balance)
    logger.info("simulating the logs' motion")
    compared = compare_logs(given, given.model, loaded)
    findings = compared.loaded.findings
    if step == "forward":
        logger.info("driving the model by its servos")
        drives = drive_forward(given, compared, order)
        tables = forward_tables(drives, joints)
        return Driven(**_common(order, given, tables, findings), drives=drives)
    tables = {
        "quality": records("quality", findings),
        "where": records("where", compared.rows),
    }
    if step == "where":
        return Comparison(**_common(order, given, tables, findings), residuals=compared)
    if step == "shrink":
        logger.info("validating the model file's effects")
        outcome = check(given, compared)
    else:
        outcome = identified(given, compared, order)
    text = outcome.validated.text
    edits = edits_in(text) if text else given.stated_file.edits
    others = found_bodies(given.bare_model, edits)
    urdf = ""
    if text and len(others):
        urdf = corrected_urdf(given.urdf, str(given.path), given.bare_model, edits)
    found = FoundBodies(others, not_in_urdf(edits), urdf)
    naming = outcome.naming
    tables |= {
        "candidates": candidates_table(naming.candidates, naming.found, given.model),
        "found": found_table(naming.found, given.model),
        **({"bodies": others} if len(others) else {}),
        **_changed(given, edits),
        **({} if outcome.rest is None or outcome.rest.empty else {"rest": outcome.rest}),
    }
    common = _common(order, given, tables, findings)
    return Identified(**common, outcome=outcome, bodies=found, loaded=machine)


def _changed(given: Machine, edits: Sequence[Edit]) -> Tables:
    """What is another than in the model file that was given, where there is one."""
    old = given.stated_file.edits
    if not old or len(edits) == len(old):
        return {}
    return {"changed": changes(given.model, old, edits[len(old) :])}


def _common(
    order: Order, given: Machine, tables: Tables, findings: Sequence[Finding]
) -> dict[str, Any]:
    """What every result of a step begins with."""
    said = {
        "options": {
            "step": order.step,
            "set": [f"{key}={value}" for key, value in given.changes.items()],
            "base": order.base or "as the log and the robot say",
            "alternative": given.alternative or "none: the torque is the joint's",
            "effort": order.effort or "the log's most direct",
            "cutoff_Hz": order.cutoff,
            "gait_start_s": order.gait_start,
            "prove_last": order.prove_last,
        },
        "conventions": "SI units; torque, velocity, current and voltage positive in the joint's "
        "direction; gap is measured minus predicted",
        "warnings": list(given.warnings),
    }
    return {
        "verb": "gap" if order.step == "all" else f"gap {order.step}",
        "_tables": {name: partial(tables.__getitem__, name) for name in tables},
        "_said": said,
        "inputs": (*order.logs, *order.holdout, *given.inputs, *filter(None, [order.mapping])),
        "machine": given,
        "findings": findings,
    }


def add_verbs(add: AddVerb) -> None:
    """Declare the verbs `gap` and `gap export`."""
    _add_export(add)
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
    step = verb_of(given).partition(" ")[2]
    return Order.of(
        step=step or "all",
        logs=tuple(Path(item) for item in given.items[bool(step) :]),
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
    refuse_missing(order)
    result = analyse(order, machine_of(given, guess=False))
    logger.info("writing tables")
    result.save(order.out, decimal=DECIMAL[given.decimal])
    print(result)
    if isinstance(result, Identified | Powered):
        print(f"written to {order.out}")
    return int(result.negative)


def _add_export(add: AddVerb) -> None:
    """What was found, as other tools read it."""
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
    sub.add_argument(
        "--mapping", type=named_path, help="mapping file with [pd_gains]: they become the gains"
    )


def run_export(given: argparse.Namespace) -> int:
    """Write the file and say what it cannot hold."""
    from pipeline.atomic import write_text
    from pipeline.simulation.export import exported

    files = {"robot": given.robot, "actuators": given.actuators, "mapping": given.mapping}
    text, left, remarks = exported(given.model, given.to, **files)
    write_text(given.out, text)
    print(f"written to {given.out}")
    for words in remarks:
        print(f"note: {words}")
    for words in left:
        print(f"not carried over: {one_line(words)}")
    return 0
