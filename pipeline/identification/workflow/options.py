"""What a run of the workflow is asked to do, and the machine as it compares it with logs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Final, Literal, Self

import numpy as np
from pydantic import BeforeValidator, Field, Strict

from actuators.checked import Number, Table, checked
from actuators.errors import LegwattError
from pipeline.logs.formats import is_log
from pipeline.logs.log_format import Expected, expected_of_robot
from pipeline.logs.mapping import load_mapping
from pipeline.logs.plan import plan_reading
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


def refuse_missing(order: Order) -> None:
    """Refuse logs that do not exist, before anything is read.

    Raises:
        LegwattError: Names one.
    """
    if not order.logs:
        raise LegwattError(f"gap {order.step}: no log given; name a CSV or Parquet file")
    for path in (*order.logs, *order.holdout):
        if not is_log(path):
            fact = "is a folder; name its CSV or Parquet files"
            raise LegwattError(f"{path}: {fact if path.is_dir() else 'no such log'}")


def compared_machine(order: Order, machine: Machine) -> Machine:
    """The machine on the base and with the drivetrain with which its logs are compared.

    Raises:
        LegwattError: The base does not fit the robot, the drivetrain contradicts the model file, or
            nothing says how the machine is driven.
    """
    spec, file, asked = machine.written, machine.model_file, order.alternative or ""
    if order.base in ("level", "measured") and not spec.floating:
        raise LegwattError(f"{machine.path}: its base is fixed, not '{order.base}'")
    if order.base == "fixed":
        spec = replace(spec, floating=False)
    if asked and file and file.edits and file.alternative not in ("", asked):
        raise LegwattError(
            f"the model's effects were found against '{file.alternative}', which alternative "
            f"'{asked}' contradicts; leave one of the two out"
        )
    alternative = asked or (file.alternative if file else "")
    out = replace(machine, written=spec, alternative=alternative, tolerant=True)
    if alternative or not spec.sources:  # a URDF says nothing of motors
        return out
    channel: str | None = order.effort
    if channel is None:  # by the first log's header
        mapping = load_mapping(order.mapping) if order.mapping else None
        channel = plan_reading(order.logs[0], expected_of(out), mapping).channel
    electrical = order.step == "power" or channel != AT_JOINT
    return replace(out, alternative=_usual(out), before=out) if electrical else out


def expected_of(machine: Machine) -> Expected:
    """What a log of the machine looks like."""
    robot, ratio = machine.robot, None
    # Motor-side positions need a ratio whatever channel is compared.
    if name := machine.alternative or (robot.spec.sources and _usual(machine)):
        chains = machine.own.actuators(name).joints
        ratio = np.array([joint.ratio for joint in chains])
    return expected_of_robot(robot, ratio=ratio)


def _usual(machine: Machine) -> str:
    """The drivetrain of a machine of which no option says how it is built."""
    known = machine.catalog.alternatives
    if not machine.own.usual and DEFAULT_ALTERNATIVE not in known:
        raise LegwattError(
            f"nothing says how the machine's joints are driven, and there is no alternative "
            f"'{DEFAULT_ALTERNATIVE}' to assume: name one as alternative: {', '.join(known)}"
        )
    return machine.own.usual or DEFAULT_ALTERNATIVE
