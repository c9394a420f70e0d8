"""Rows with the drive off: what flows there is known, and tells the motor from its friction."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from actuators.loading.build import load_catalog
from pipeline.effects.base import effect_named
from pipeline.identification.answer import identify
from pipeline.logs.load import Asked, accepted
from pipeline.logs.log import Log
from pipeline.logs.log_format import expected_of_model
from pipeline.logs.recording import Recording
from pipeline.machine.machine import MachineModel, machine_of_urdf
from pipeline.simulation.forward import ForwardSimulator, ServoInput
from tests.pipeline.identification import bench_leg as leg

FILES = Path(__file__).parents[1] / "data_files"
JOINT = "pendulum_joint"
VISCOUS, SHARE = 0.03, 0.25


def stated() -> MachineModel:
    chain = load_catalog(FILES / "xl330_actuators").chain("servo")
    return machine_of_urdf(FILES / "xl330.urdf", actuators=chain)


def truth() -> MachineModel:
    """A motor of another constant than the file's, with friction."""
    model = stated()
    actuator = model.actuator(JOINT)
    assert actuator.motor is not None
    model = model.with_actuator(
        replace(actuator, motor=replace(actuator.motor, torque_constant=0.34, resistance=4.4))
    )
    model = effect_named("load_dependent_friction").apply(model, (JOINT,), {"share": SHARE})
    return effect_named("viscous_friction").apply(model, (JOINT,), {"coefficient": VISCOUS})


def driven(seed: int, open_bridge: bool) -> Recording:
    """Driven by sines, and without a drive every second second; of the bridge nothing is told."""
    rng = np.random.default_rng(seed)
    time = np.arange(1600) / 200
    w = rng.uniform(1.5, 6.0, 3)
    goal = sum(s * np.sin(f * time + p) for s, f, p in zip((0.9, 0.6, 0.4), w, w, strict=True))
    off = ((time % 4.0) > 2.2)[:, None]
    servo = ServoInput(
        time=time,
        goal=np.asarray(goal)[:, None],
        supply=np.full(time.size, 7.3),
        gain=1.5,
        off=off,
        open_bridge=open_bridge,
        position=np.zeros(1),
        velocity=np.zeros(1),
    )
    run = ForwardSimulator(truth()).run(servo)
    voltage = np.where(off, np.nan, run.voltage + rng.normal(0.0, 0.01, run.voltage.shape))
    position = run.position + rng.normal(0.0, 2e-5, run.position.shape)
    at = slice(100, None)  # not the jump to the first goal, which no filter's derivatives follow
    columns = {
        "time_s": time,
        f"{JOINT}__position_rad": position[:, 0],
        f"{JOINT}__voltage_V": voltage[:, 0],
        f"{JOINT}__torque_off": off[:, 0],
    }
    return Recording("made", pd.DataFrame(columns)[at], (JOINT,), "voltage")


def measurements(bridge: str) -> tuple[Log, ...]:
    """Two training logs and one for the test."""
    model = stated()
    runs = [driven(k, bridge != "shorted") for k in (1, 2, 3)]
    logs = [replace(run, torque_off_bridge=bridge) for run in runs]
    expected = expected_of_model(model.rigid, model.name, joints=model.joints)
    asked = Asked(expected, cutoff=12.0)
    return accepted(dict(enumerate(logs)), [log.name for log in logs], 2, asked, {}).logs


@pytest.mark.slow
@pytest.mark.parametrize("bridge", ["open", "shorted"])
def test_free_rows_tell_the_torque_constant_from_viscous_friction(bridge: str) -> None:
    result = identify(stated(), measurements(bridge))
    found = {f.effect: f.values for f in result.found}
    # With a share of its own for power back, the law says the same.
    loss = found.get("load_dependent_friction") or found["backdrive_loss"]
    assert list(loss.values()) == pytest.approx([SHARE] * len(loss), abs=0.03)
    assert found["viscous_friction"]["coefficient"] == pytest.approx(VISCOUS, rel=0.15)
    constant = 0.39 / (1 + leg.stays(result, "torque_constant_error", JOINT))
    assert constant == pytest.approx(0.34, rel=0.05)
