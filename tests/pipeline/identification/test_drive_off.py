"""Rows with the drive off: what flows there is known, and tells the motor from its friction."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from actuators.loading.build import load_catalog
from pipeline.effects.base import effect_named
from pipeline.identification.design import make_data_sets, make_design
from pipeline.identification.fit import settled, start_fit
from pipeline.identification.offered import block_terms
from pipeline.identification.residual import floor_of
from pipeline.identification.search import near
from pipeline.logs.load import Asked, load
from pipeline.logs.log import Log, expected_of_robot
from pipeline.logs.mapping import parse_mapping
from pipeline.machine.machine import MachineModel
from pipeline.simulation.forward import ForwardSimulator, ServoInput
from pipeline.simulation.machine import read_machine
from pipeline.simulation.predict import Simulator

FILES = Path(__file__).parents[1] / "data_files"
MACHINE = read_machine(FILES / "xl330.urdf")
JOINT = "pendulum_joint"
LAWS = {"viscous_friction": {"coefficient": 0.03}, "load_dependent_friction": {"share": 0.25}}
CONSTANT, RESISTANCE = 0.34, 4.4


@pytest.fixture(scope="module")
def stated() -> MachineModel:
    chain = load_catalog(FILES / "xl330_actuators").chain("servo")
    return MACHINE.model.with_actuator(replace(chain, name=JOINT))


@pytest.fixture(scope="module")
def logs(stated: MachineModel, tmp_path_factory: pytest.TempPathFactory) -> tuple[Log, ...]:
    """With an open winding at times."""
    return driven(stated, tmp_path_factory.mktemp("log"), "open")


def driven(stated: MachineModel, folder: Path, bridge: str) -> tuple[Log, ...]:
    """Driven by sines, the drive off at times; motor and friction others."""
    a = stated.actuator(JOINT)
    motor = replace(a.driven, torque_constant=CONSTANT, resistance=RESISTANCE)
    truth = stated.with_actuator(replace(a, motor=motor))
    for name, values in LAWS.items():
        truth = effect_named(name).apply(truth, (JOINT,), values)
    time, rng = np.arange(1600) / 200, np.random.default_rng(1)
    off = ((time % 4.0) > 2.2)[:, None]
    goal = sum(s * np.sin(f * time + f) for s, f in ((0.9, 3.8), (0.6, 5.8), (0.4, 2.1)))
    rest, supply = np.zeros(1), np.full(time.size, 7.3)
    servo = ServoInput(
        time, np.asarray(goal)[:, None], supply, 1.5, off, bridge == "open", rest, rest
    )
    run = ForwardSimulator(truth).run(servo)
    columns = {
        "time_s": time,
        f"{JOINT}__position_rad": run.position[:, 0] + rng.normal(0.0, 2e-5, time.size),
        f"{JOINT}__voltage_V": run.voltage[:, 0] + rng.normal(0.0, 0.01, time.size),
        "on": ~off[:, 0],
    }
    frame = pd.DataFrame(columns)[100:]  # not the jump to the first goal
    frame.loc[~frame["on"], f"{JOINT}__voltage_V"] = np.nan if bridge == "open" else 0.0
    frame.to_parquet(path := folder / "made.parquet")
    table = {"torque_enabled": {JOINT: "on"}, "controller": {"torque_off_bridge": bridge}}
    asked = Asked(expected_of_robot(MACHINE.robot), parse_mapping(table, "mapping"), cutoff=12.0)
    return load([path], 1, asked).logs


def fitted(stated: MachineModel, logs: tuple[Log, ...]) -> dict[str, float]:
    """What the logs tell of everything that a joint and its motor may have."""
    sets = make_data_sets(logs)
    design = make_design(stated, sets, block_terms(stated, Simulator(logs[0]).measured, {}))
    level = np.array([e.level(floor_of(logs)) for e in design.equations])
    fit = near(settled(start_fit(design, level)), turns=5)
    pairs = zip(design.terms, design.columns, strict=True)
    return {t.effect.name: float(fit.x[c[0]]) for t, c in pairs}


def test_free_rows_tell_the_motor_from_its_friction(stated, logs):
    found = fitted(stated, logs)
    assert found["viscous_friction"] == pytest.approx(0.03, rel=0.05)
    assert found["load_dependent_friction"] == pytest.approx(0.25, abs=0.01)
    a = stated.actuator(JOINT).driven
    constant = a.torque_constant / (1.0 + found["torque_constant_error"])
    assert constant == pytest.approx(CONSTANT, rel=0.02)
    assert a.resistance * (1.0 + found["resistance"]) == pytest.approx(RESISTANCE, rel=0.03)


def test_rows_of_a_shorted_bridge_do_not_count_and_make_no_gain(stated, tmp_path):
    """The motor brakes in them; the others tell friction, and resistance over torque constant."""
    (log,) = driven(stated, tmp_path, "shorted")
    assert log.off.mean() > 0.4
    assert not log.mask[log.off].any()
    found, a = fitted(stated, (log,)), stated.actuator(JOINT).driven
    assert found["load_dependent_friction"] == pytest.approx(0.25, abs=0.01)
    per_constant = (1.0 + found["resistance"]) * (1.0 + found["torque_constant_error"])
    truth = (RESISTANCE / CONSTANT) / (a.resistance / a.torque_constant)
    assert per_constant == pytest.approx(truth, rel=0.02)
