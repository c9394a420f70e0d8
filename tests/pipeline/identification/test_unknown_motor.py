"""A motor whose constants are stated with a wide interval, and one whose housing is measured."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.effects.base import effect_named
from pipeline.identification.answer import identify
from pipeline.identification.offered import block_terms
from pipeline.machine.machine import MachineModel
from tests.pipeline.identification import bench_leg as leg

J2 = "rm_joint_2"


def with_motor(model: MachineModel, **changes: float) -> MachineModel:
    actuator = model.actuator(J2)
    assert actuator.motor is not None
    return model.with_actuator(replace(actuator, motor=replace(actuator.motor, **changes)))


def test_the_files_interval_is_the_tolerance() -> None:
    model = with_motor(leg.leg_model(), torque_constant_spread=0.2, resistance_spread=0.3)
    terms = block_terms(model, leg.leg_motion(duration=8.0))
    sigma = {(t.effect.name, *t.place): t.unit for t in terms}
    assert sigma["torque_constant_error", J2] == (0.2,)
    assert sigma["resistance", J2] == (0.3,)
    # No specimen is better than a data sheet's two per cent.
    assert sigma["torque_constant_error", "rm_joint_1"] == (0.02,)


@pytest.mark.slow
def test_load_friction_keeps_its_name_beside_an_unknown_torque_constant() -> None:
    stated = leg.leg_model()
    constant = float(np.asarray(stated.actuator(J2).motor.torque_constant))  # type: ignore[union-attr]
    truth = with_motor(stated, torque_constant=0.8 * constant)
    truth = effect_named("load_dependent_friction").apply(truth, (J2,), {"share": 0.12})
    log = leg.measured(truth, leg.leg_motion(duration=8.0))
    open_ = identify(with_motor(stated, torque_constant_spread=0.15), [log])
    assert [(f.effect, f.place) for f in open_.found] == [("load_dependent_friction", (J2,))]
    assert open_.found[0].values["share"] == pytest.approx(0.12, abs=0.01)
    assert leg.stays(open_, "torque_constant_error", J2) == pytest.approx(1 / 0.8 - 1, abs=0.01)
    # Where the file leaves two per cent, the same log says that the constant is wrong.
    sure = identify(stated, [log])
    assert ("torque_constant_error", (J2,)) in {(f.effect, f.place) for f in sure.found}


def test_heating_is_named_from_the_housings_sensor() -> None:
    nominal, motion = leg.leg_model(), leg.leg_motion(duration=8.0)
    sensor = np.full(motion.q.shape, 25.0)
    sensor[:, 1] += np.linspace(0.0, 12.0, len(motion))
    warm = replace(motion, temperature=sensor)
    values = {"rise": 0.0, "thermal_resistance": 0.0, "time_constant": 4.0, "sensor_gain": 4.0}
    truth = effect_named("winding_heating").apply(nominal, (J2,), values)
    (found,) = identify(nominal, [leg.measured(truth, warm)]).found
    assert (found.effect, found.place) == ("winding_heating", (J2,))
    assert found.values["sensor_gain"] == pytest.approx(4.0, abs=0.75)
