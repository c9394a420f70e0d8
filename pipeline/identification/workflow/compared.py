"""One run of `gap` up to the residuals: what it is asked, its logs loaded, simulated, compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, Self

import numpy as np
from pydantic import BeforeValidator, Field, Strict

from actuators.arrays import Array
from actuators.checked import Number, Table, checked
from actuators.errors import LegwattError
from pipeline.identification.residual import rows_left, shrunk, where
from pipeline.identification.wrong_columns import wrong_columns
from pipeline.logs.formats import is_log
from pipeline.logs.load import Asked, Logs, load, without_useless
from pipeline.logs.log import Expected, Finding, Log, expected_of_robot
from pipeline.logs.mapping import load_mapping
from pipeline.logs.read import plan_reading
from pipeline.machine.machine import MachineModel
from pipeline.simulation import equations
from pipeline.simulation.equations import is_on_legs, with_known_motion
from pipeline.simulation.machine import Machine
from pipeline.simulation.predict import Prediction, Simulator

if TYPE_CHECKING:
    from pandas import DataFrame

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
    """The machine with the drivetrain with which its logs are compared.

    Raises:
        LegwattError: The drivetrain contradicts the model file, or nothing says how the machine is
            driven.
    """
    spec, file, asked = machine.written, machine.model_file, order.alternative or ""
    if asked and file and file.edits and file.alternative not in ("", asked):
        raise LegwattError(
            f"the model's effects were found against '{file.alternative}', which alternative "
            f"'{asked}' contradicts; leave one of the two out"
        )
    alternative = asked or (file.alternative if file else "")
    out = replace(machine, alternative=alternative, tolerant=True)
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


@dataclass(frozen=True, eq=False)
class Compared:
    """Steps 1 and 2."""

    loaded: Logs  #: The logs, and what was found in them.
    predictions: tuple[Prediction, ...]  #: By the model as it is, one per log.
    where: DataFrame  #: The gap by joint and circumstance.

    @property
    def logs(self) -> tuple[Log, ...]:
        """The logs."""
        return self.loaded.logs

    def with_noise(self, noise: Array) -> Compared:
        """The same with logs whose noise is at least so much, shape (J, C)."""
        logs = tuple(replace(m, noise=np.maximum(m.noise, noise)) for m in self.logs)
        return replace(self, loaded=replace(self.loaded, logs=logs))

    def with_findings(self, findings: Sequence[Finding]) -> Compared:
        """The same with other findings in its logs."""
        return replace(self, loaded=replace(self.loaded, findings=tuple(findings)))

    @property
    def fitted(self) -> int:
        """How many of them may be fitted, the first ones."""
        return self.loaded.fitted


def load_logs(given: Machine, options: Order) -> Logs:
    """Step 1: read, check, reduce and split all logs.

    All scores are taken at one bandwidth: `--cutoff`, else where the encoders' noise is silent.

    Raises:
        LegwattError: Unusable input; one line.
    """
    robot = given.robot if given.robot.floating else None
    motors = [a.motor for a in given.model.actuators if a.motor is not None]
    expected = expected_of(given)
    if len(motors) == len(given.model.joints):
        current, voltage = (
            np.array([getattr(m, name) for m in motors])
            for name in ("peak_current", "supply_voltage")
        )
        largest = {"current": current, "voltage": voltage, "power": current * voltage}
        expected = replace(expected, largest=largest)
    asked = Asked(
        expected=expected,
        mapping=load_mapping(options.mapping) if options.mapping else None,
        effort=options.effort,
        supply=options.step == "power",
        motors=all(a.motor is not None for a in given.model.actuators[:1]),
        cutoff=options.cutoff,
        prove_last=options.prove_last,
        apart=options.step in ("power", "forward"),
        mimics=given.mimics,
        robot=robot,
        # By the machine as its files say: what a model file adds changes no bandwidth.
        felt=None if options.step == "read" else partial(motion_noise, given.bare_model),
    )
    return load((*options.logs, *options.holdout), len(options.logs), asked)


def motion_noise(model: MachineModel, log: Log) -> Array:
    """Standard deviation of the prediction from the noise of encoders and foot forces, (J, C).

    Velocity and acceleration noise are taken as independent of one another (an odd and an even
    kernel) and of other joints.
    """
    if is_on_legs(model, log):
        return equations.motion_noise(model, log)
    base = Simulator(log).predict(model).effort
    total = np.zeros(base.shape[1:])
    assert log.rate_noise is not None
    changes = (0.1, replace(log, v=log.v + 0.1)), (1.0, replace(log, a=log.a + 1.0))
    for noise, (size, moved) in zip(log.rate_noise, changes, strict=True):
        # In motion alone: the step of friction at a reversal is no noise.
        change = np.abs(Simulator(moved).predict(model).effort - base) / size
        total += (np.median(change, axis=0) * noise[:, None]) ** 2
    if log.foot_force is not None and log.standing is not None and log.foot_noise is not None:
        for axis in range(3):
            push = np.zeros_like(log.foot_force)
            push[..., axis] = log.standing * log.foot_noise
            pushed = replace(log, foot_force=log.foot_force + push)
            total += np.mean((Simulator(pushed).predict(model).effort - base) ** 2, axis=0)
    return np.asarray(np.sqrt(total))


def compare_logs(given: Machine, model: MachineModel, loaded: Logs) -> Compared:
    """Simulate every log's own motion and table the gap.

    Raises:
        LegwattError: No row is left to fit or to test on: what took most rows.
    """
    logs = [with_known_motion(given.bare_model, m) for m in loaded.logs]
    left = [rows_left(m) for m in logs]
    details = {k: f"{m.name}: {left[k][0].detail}" for k, m in enumerate(logs)}
    useless = {k: detail for k, detail in details.items() if left[k][0].verdict == "refused"}
    found = [*without_useless([m.name for m in logs], loaded.fitted, useless), *loaded.findings]
    kept = [k for k in range(len(logs)) if k not in useless]
    logs, fitted = [logs[k] for k in kept], sum(k < loaded.fitted for k in kept)
    predictions = tuple(Simulator(m).predict(model) for m in logs)
    first = logs[0].recording
    assert first is not None
    found += wrong_columns(given.bare_model, logs, first)
    found += [finding for k in kept for finding in left[k]]
    found += [f for m, one in zip(logs, predictions, strict=True) for f in shrunk(m, one)]
    loaded = replace(loaded, logs=tuple(logs), fitted=fitted, findings=tuple(found))
    return Compared(loaded, predictions, where(logs, predictions, _legs(given)))


def _legs(given: Machine) -> dict[str, int]:
    """Joint to its leg's column; empty without legs on the ground."""
    legs = given.robot.spec.legs if given.robot.floating else ()
    return {joint: k for k, leg in enumerate(legs) for joint in leg.joints}
