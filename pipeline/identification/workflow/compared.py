"""One run of `gap` up to the residuals: its logs loaded, simulated and compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from actuators.arrays import Array
from pipeline.identification.column_findings import wrong_columns
from pipeline.identification.model_check import against_model, rows_left
from pipeline.identification.where import where
from pipeline.identification.workflow.options import Order, expected_of
from pipeline.logs.load import Asked, Logs, load, without_useless
from pipeline.logs.log import Log
from pipeline.logs.mapping import load_mapping
from pipeline.machine.machine import MachineModel
from pipeline.simulation import on_legs
from pipeline.simulation.machine import Machine
from pipeline.simulation.on_legs import is_on_legs, with_known_motion
from pipeline.simulation.predict import Prediction, Simulator

if TYPE_CHECKING:
    from pandas import DataFrame


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

    def with_logs(self, logs: Sequence[Log]) -> Compared:
        """The same with other logs, such as with other noise."""
        return replace(self, loaded=replace(self.loaded, logs=tuple(logs)))

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
        base=options.base,
        supply=options.step == "power",
        motors=all(a.motor is not None for a in given.model.actuators[:1]),
        cutoff=options.cutoff,
        prove_last=options.prove_last,
        thinned=options.step != "power",
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
        return on_legs.motion_noise(model, log)
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
    found += wrong_columns(given.bare_model, logs, first, expected_of(given).ratio)
    for k, m, prediction in zip(kept, logs, predictions, strict=True):
        found += [*left[k], *against_model(m, prediction)]
    loaded = replace(loaded, logs=tuple(logs), fitted=fitted, findings=tuple(found))
    return Compared(loaded, predictions, where(logs, predictions, _legs(given)))


def _legs(given: Machine) -> dict[str, int]:
    """Joint to its leg's column; empty without legs on the ground."""
    legs = given.robot.spec.legs if given.robot.floating else ()
    return {joint: k for k, leg in enumerate(legs) for joint in leg.joints}
