"""What is quoted is the gap of the model file as written, on rows that had no say."""

import pytest

from pipeline.effects.base import effect_named
from pipeline.effects.model_file import assumed
from pipeline.identification.answer import identify
from pipeline.identification.results import APPROXIMATE, CONFIRMED, SUSPECTED, Found
from pipeline.identification.workflow.written import Held, chosen, edits_of, held_against
from pipeline.logs.log import Log
from tests.pipeline.identification import bench_leg as leg

JOINT = "rm_joint_1"
FRICTION = 0.5  # [N*m]
VISCOUS = {"coefficient": 0.8}  # [N*m*s/rad]


def found(effect: str, parameter: str, value: float, level: str = CONFIRMED) -> Found:
    return Found(1, (assumed(effect, (JOINT,), {parameter: value}, ""),), level=level)


@pytest.fixture(scope="module")
def log() -> Log:
    truth = effect_named("coulomb_friction").apply(leg.leg_model(), (JOINT,), {"torque": FRICTION})
    return leg.measured(truth, leg.leg_motion())


def held(log: Log, *names: Found) -> Held:
    model = leg.leg_model()
    return held_against(model, [log], chosen(model, [log], names, lambda found: found))


@pytest.mark.parametrize("level", [CONFIRMED, APPROXIMATE])
def test_a_written_effect_explains_the_log(log: Log, level: str) -> None:
    name = found("coulomb_friction", "torque", FRICTION, level)
    result = held(log, name)
    assert not any(r.significant for r in result.left)
    assert result.found[0].written
    assert result.found[0].gap_after < 1.2 * result.found[0].noise_floor
    assert edits_of(result.found, "log")[0].level == level


def test_a_suspected_name_is_left_out_and_so_is_what_it_would_close(log: Log) -> None:
    result = held(log, found("coulomb_friction", "torque", FRICTION, SUSPECTED))
    assert any(r.significant for r in result.left)
    (one,) = result.found
    assert not one.written
    # Listed with what it would close beside the file ...
    assert one.gap_after < 0.2 * one.gap_before
    # ... which is not in the number that is quoted.
    assert len(result.stages) == 1  # the machine as it was


def test_a_wrong_value_in_the_file_is_not_called_explained(log: Log) -> None:
    # What naming thought of it does not matter: the file is simulated.
    result = held(log, found("coulomb_friction", "torque", 0.2))
    assert any(r.significant for r in result.left)


def test_a_name_with_which_the_simulation_is_worse_is_suspected(log: Log) -> None:
    (one,) = held(log, found("viscous_friction", "coefficient", 9.0)).found
    assert one.level == SUSPECTED
    assert "validation" in one.reason
    assert not one.written


def test_what_is_written_is_estimated_without_what_is_left_out() -> None:
    truth = leg.leg_model()
    for effect, values in (("coulomb_friction", {"torque": 0.5}), ("viscous_friction", VISCOUS)):
        truth = effect_named(effect).apply(truth, (JOINT,), values)
    both = leg.measured(truth, leg.leg_motion(duration=8.0))
    named = identify(leg.leg_model(), [both])
    assert {f.effect for f in named.found} == {"coulomb_friction", "viscous_friction"}
    (dry,) = [f for f in named.found if f.effect == "coulomb_friction"]
    (alone,) = named.alone([dry])
    # Without the viscous part dry friction has to carry it.
    assert alone.values["torque"] > dry.edits[0].parameters[0].interval[1]
    assert named.alone(named.found) == named.found
