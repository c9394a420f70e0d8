"""What a run of the workflow is asked to do, and the machine as it compares it with logs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Final, Literal, Self

import numpy as np
from pydantic import BeforeValidator, Field, Strict

from actuators.checked import Number, Table, checked
from actuators.errors import LegwattError
from actuators.loading.build import Catalog
from pipeline.effects.model_file import ModelFile
from pipeline.logs.formats import is_log
from pipeline.logs.log_format import Expected, expected_of_model, expected_of_robot
from pipeline.logs.mapping import load_mapping
from pipeline.logs.plan import plan_reading
from pipeline.machine.drivetrains import Actuators, drivetrains_of
from pipeline.simulation.machine import Machine

#: The steps; without one all but `forward` run, which needs goals and the servos' law.
STEPS: Final = {
    "read": "judge the logs: quality.csv",
    "where": "where model and machine disagree: where.csv",
    "name": "which effects the model lacks: candidates.csv, found.csv",
    "add": "the same, and write the effects into model.toml",
    "forward": "drive the model under its servos' law and compare positions: forward.csv",
    "power": "what the supply gives, against the sum over the drives: power.csv",
    "shrink": "the gap with and without the effects of a model file (--model)",
}
DEFAULT_OUT: Final = Path("reports/out/gap")
#: The alternative that holds nothing but a motor's data sheet: what gears lose is what a log shows.
DEFAULT_ALTERNATIVE: Final = "rotor"
#: The channel that is compared without an actuator, for a robot file as for a bare URDF.
AT_JOINT: Final = "torque"

_Path = Annotated[Path, BeforeValidator(lambda value: Path(value))]
_Paths = Annotated[tuple[Path, ...], Strict(False)]


class GapOptions(Table):
    """Choices of one run; names and defaults are the command line's."""

    noun = "option"
    base: Literal["fixed", "level", "measured"] | None = Field(
        default=None,
        description="how the base stands; measured where the log has roll or pitch, else level or "
        "fixed as the robot file says",
    )
    gait_start: Number | None = Field(
        default=None,
        description="time in the log [s] at which a period of the gait begins: tells which feet "
        "stand where the log has neither foot forces nor contacts; the lowest feet without it",
    )
    alternative: str | None = Field(
        default=None,
        description="drivetrain between joint and supply: ideal, rotor (default), reversible or "
        "irreversible, or one of the actuator files; a bare URDF has none by default",
    )
    mapping: _Path | None = Field(
        default=None, description="mapping file (TOML) for foreign columns"
    )
    effort: Literal["torque", "current", "voltage", "power"] | None = Field(
        default=None,
        description="measured quantity that is compared; the first of them in the log by default",
    )
    cutoff: Number | None = Field(
        default=None,
        description="cut-off frequency of the low-pass filter [Hz]; chosen from the noise by "
        "default",
    )
    prove_last: Number | None = Field(
        default=None,
        description="test on this last share of every log instead of on blocks in between",
    )

    @classmethod
    def of(cls, **options: Any) -> Self:
        """Options by name.

        Raises:
            LegwattError: One does not exist or is out of range.
        """
        return checked(cls, options, "gap")


class Order(GapOptions):
    """Logs, step and choices of one run."""

    logs: _Paths = ()  #: CSV or Parquet, to learn from.
    holdout: _Paths = ()  #: Test logs: nothing is fitted to them.
    step: str = "all"  #: One of `STEPS`, or ``all``.
    #: Folder for what is written; the model file names its robot relative to it.
    out: Path = DEFAULT_OUT


def refuse_missing(order: Order, machine: Machine | None = None) -> None:
    """Refuse files that do not exist, before anything is read.

    Raises:
        LegwattError: A log, the mapping, or the model file to check is missing.
    """
    if not order.logs:
        raise LegwattError(f"gap {order.step}: no log given; name a CSV or Parquet file")
    for path in (*order.logs, *order.holdout):
        if path.is_dir() and not is_log(path):
            raise LegwattError(f"{path}: is a folder; name its CSV or Parquet files")
        if not is_log(path):
            raise LegwattError(f"{path}: no such log; name a CSV or Parquet file")
    if order.mapping and not order.mapping.is_file():
        fact = "is a folder, expected a" if order.mapping.is_dir() else "no such"
        raise LegwattError(f"{order.mapping}: {fact} mapping file")
    if order.step == "shrink" and machine is not None and machine.model_file is None:
        raise LegwattError("gap shrink: name the model file to check")


def compared_machine(order: Order, machine: Machine) -> Machine:
    """The machine on the base and with the drivetrain with which its logs are compared.

    Raises:
        LegwattError: The base does not fit the robot, the drivetrain contradicts the model file, or
            nothing says how the machine is driven.
    """
    spec = machine.written
    if order.base == "fixed" and spec is not None and spec.floating:
        spec = replace(spec, floating=False)
    if order.base in ("level", "measured") and spec is None:
        raise LegwattError(
            f"{machine.path}: a bare URDF stands on a fixed base; base '{order.base}' needs a "
            "robot file"
        )
    if order.base in ("level", "measured") and spec is not None and not spec.floating:
        raise LegwattError(f"{machine.path}: its base is fixed, not '{order.base}'")
    alternative = _alternative(order, machine.model_file)
    out = replace(machine, written=spec, alternative=alternative, tolerant=True)
    if alternative or out.loaded is None:
        return out
    electrical = order.step == "power" or _channel(order, expected_of(out)) != AT_JOINT
    usual = out.own.usual or _default(out.catalog)
    return replace(out, alternative=usual, before=out) if electrical else out


def expected_of(machine: Machine) -> Expected:
    """What a log of the machine looks like."""
    if machine.loaded is None:
        bare = machine.bare_model
        chain = machine.own.actuators(machine.alternative) if machine.alternative else None
        ratio = _ratio(chain, bare.joints)
        return expected_of_model(bare.rigid, bare.name, joints=bare.joints, ratio=ratio)
    # Motor-side positions need a ratio whatever channel is compared.
    usual = machine.alternative or machine.own.usual or _default(machine.catalog)
    ratio = _ratio(machine.own.actuators(usual), machine.loaded.joints)
    return expected_of_robot(machine.loaded, ratio=ratio)


def _alternative(order: Order, file: ModelFile | None) -> str:
    """The drivetrain that options or model file name; empty where neither does."""
    asked: str = order.alternative or ""
    if file is None:
        return asked
    if asked and file.edits and file.alternative and asked != file.alternative:
        raise LegwattError(
            f"the model's effects were found against '{file.alternative}', which alternative "
            f"'{asked}' contradicts; leave one of the two out"
        )
    return asked or file.alternative


def _default(catalog: Catalog) -> str:
    """The alternative of a machine of which nobody says how it is built."""
    if DEFAULT_ALTERNATIVE not in catalog.alternatives:
        known = ", ".join(f"'{name}'" for name in catalog.alternatives)
        raise LegwattError(
            f"nothing says how the machine's joints are driven, and there is no alternative "
            f"'{DEFAULT_ALTERNATIVE}' to assume: name one as alternative: {known}"
        )
    return DEFAULT_ALTERNATIVE


def _channel(order: Order, expected: Expected) -> str:
    """The effort channel that will be compared, by the first log's header."""
    if order.effort:
        return order.effort
    mapping = load_mapping(order.mapping) if order.mapping else None
    return plan_reading(order.logs[0], expected, mapping).channel


def _ratio(actuators: Actuators | None, joints: tuple[str, ...]) -> np.ndarray | None:
    if actuators is None:
        return None
    return np.array([joint.ratio for joint in drivetrains_of(actuators, joints).joints])
