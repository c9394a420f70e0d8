"""What has changed since a model file was written, what a file knows, and what is written."""

from dataclasses import replace

import numpy as np
import pytest

from actuators.loading.build import load_catalog
from pipeline.effects.base import EFFECTS, effect_named
from pipeline.effects.model_file import Edit, apply_edits, assumed
from pipeline.identification.answer import identify
from pipeline.identification.offered import block_terms
from pipeline.identification.results import APPROXIMATE, CONFIRMED, SUSPECTED, Found, Residual
from pipeline.identification.workflow.changed import changes
from pipeline.identification.workflow.outcome import without_factors
from pipeline.identification.workflow.written import Held, chosen, edits_of, held_against
from pipeline.identification.wrong_columns import SIZE
from pipeline.logs.log import Finding, Log
from pipeline.machine.machine import MachineModel, drivetrains_of
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import load_robot_file
from pipeline.simulation.predict import Simulator
from tests.command_line import edit_of
from tests.pipeline.identification import bench_leg as leg

TIBIA, SHARE = "rm_tibia_link", 0.02


@pytest.fixture(scope="module")
def first_day() -> tuple[MachineModel, tuple[Edit, ...]]:
    """A leg whose friction and shin a first log has shown."""
    bare = leg.leg_model()
    friction = [edit_of("coulomb_friction", j, within=SHARE, torque=0.5) for j in bare.joints]
    friction += [edit_of("viscous_friction", j, within=SHARE, coefficient=0.5) for j in bare.joints]
    body = bare.rigid.inertias[bare.rigid.getJointId(bare.carrier(TIBIA))]
    names = [p.name for p in EFFECTS["rigid_body_parameters"].parameters]
    ten = dict(zip(names, body.toDynamicParameters().tolist(), strict=True))
    edits = (*friction, edit_of("rigid_body_parameters", TIBIA, within=SHARE, **ten))
    return apply_edits(bare, edits), edits


def test_a_log_tells_how_well_bodies_and_friction_are_known(first_day):
    known = first_day[0].known
    assert set(known) == {*first_day[0].joints, TIBIA}
    assert max(known[j] for j in first_day[0].joints) == pytest.approx(SHARE / 1.96, rel=1e-3)
    assert 0.2 * SHARE < known[TIBIA] < 2.0 * SHARE


def test_what_is_mounted_and_friction_that_rose_are_told_as_that(first_day):
    model, old = first_day
    place = {"mass": 0.4, "x": 0.0, "y": 0.0, "z": -0.1}
    truth = effect_named("link_mass").apply(model, (TIBIA,), place)
    truth = effect_named("friction_factor").apply(truth, ("*",), {"factor": 1.12})
    found = identify(model, [leg.measured(truth, leg.leg_motion(duration=8.0))]).found
    rows = changes(model, old, edits_of(found, "second day")).set_index(["what", "quantity"])
    mass = rows.loc[("body", "mass")]
    assert mass["ci_low"] <= 0.4 <= mass["ci_high"]
    assert rows.loc["body", "place"].unique().tolist() == [TIBIA]
    told = [rows.loc[("body", f"first moment {axis}"), "value"] for axis in "xyz"]
    assert np.linalg.norm(np.array(told) - [0.0, 0.0, -0.04]) < 0.1 * 0.04
    factor = rows.loc[("friction_factor", "factor")]
    assert factor["place"] == "all joints"
    assert factor["ci_low"] <= 1.12 <= factor["ci_high"]
    assert set(rows.index.get_level_values(0)) == {"body", "friction_factor"}


def test_a_gear_of_another_efficiency_than_assumed_is_told():
    """Its friction by the load alone, at all joints: the rest of what the files state stays."""
    robot = load_robot(load_robot_file(leg.ROOT / "urdf" / "leg.toml"))
    model = MachineModel(robot, drivetrains_of(load_catalog().chain("reversible"), robot.joints))
    truth = effect_named("gear_loss_factor").apply(model, ("*",), {"factor": 0.2})
    found = identify(model, [leg.measured(truth, leg.leg_motion(duration=8.0))]).found
    first = found[0]
    assert ("gear_loss_factor", ("*",)) in {(first.effect, first.place), *first.rivals}
    assert first.values["factor"] == pytest.approx(0.2, abs=0.05)


def test_nothing_has_changed_where_nothing_has(first_day):
    model, _ = first_day
    log = leg.measured(model, leg.leg_motion(3, 8.0), seed=7)
    assert identify(model, [log]).found == ()


J2 = "rm_joint_2"


def with_motor(model: MachineModel, **changes: float) -> MachineModel:
    actuator = model.actuator(J2)
    return model.with_actuator(replace(actuator, motor=replace(actuator.motor, **changes)))


def test_the_files_interval_is_the_tolerance():
    model = with_motor(leg.leg_model(), torque_constant_spread=0.2, resistance_spread=0.3)
    terms = block_terms(model, Simulator(leg.leg_motion(duration=8.0)).measured)
    sigma = {(t.effect.name, *t.place): t.unit for t in terms}
    assert sigma["torque_constant_error", J2] == (0.2,)
    assert sigma["resistance", J2] == (0.3,)
    # No specimen is better than a data sheet's two per cent.
    assert sigma["torque_constant_error", "rm_joint_1"] == (0.02,)


@pytest.mark.slow
def test_load_friction_keeps_its_name_beside_an_unknown_torque_constant():
    stated = leg.leg_model()
    constant = float(np.asarray(stated.actuator(J2).motor.torque_constant))
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


def test_heating_is_named_from_the_housings_sensor():
    nominal, motion = leg.leg_model(), leg.leg_motion(duration=8.0)
    sensor = np.full(motion.q.shape, 25.0)
    sensor[:, 1] += np.linspace(0.0, 12.0, len(motion))
    warm = replace(motion, temperature=sensor)
    values = {"rise": 0.0, "thermal_resistance": 0.0, "time_constant": 4.0, "sensor_gain": 4.0}
    truth = effect_named("winding_heating").apply(nominal, (J2,), values)
    (found,) = identify(nominal, [leg.measured(truth, warm)]).found
    assert (found.effect, found.place) == ("winding_heating", (J2,))
    assert found.values["sensor_gain"] == pytest.approx(4.0, abs=0.75)


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
def test_a_written_effect_explains_the_log(log, level):
    name = found("coulomb_friction", "torque", FRICTION, level)
    result = held(log, name)
    assert not any(r.significant for r in result.left)
    assert result.found[0].written
    assert result.found[0].gap_after < 1.2 * result.found[0].noise_floor
    assert edits_of(result.found, "log")[0].level == level


def test_a_suspected_name_is_left_out_and_so_is_what_it_would_close(log):
    result = held(log, found("coulomb_friction", "torque", FRICTION, SUSPECTED))
    assert any(r.significant for r in result.left)
    (one,) = result.found
    assert not one.written
    assert one.gap_after < 0.2 * one.gap_before  # beside the file
    assert len(result.stages) == 1  # the machine as it was: what is quoted
    # A value is simulated, whatever naming thought of it.
    assert any(r.significant for r in held(log, found("coulomb_friction", "torque", 0.2)).left)


def test_a_name_with_which_the_simulation_is_worse_is_suspected(log):
    (one,) = held(log, found("viscous_friction", "coefficient", 9.0)).found
    assert one.level == SUSPECTED
    assert "validation" in one.reason
    assert not one.written


def test_what_is_written_is_estimated_without_what_is_left_out():
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


@pytest.mark.parametrize(
    ("leaves", "gain", "check", "verdict"),
    [
        (False, False, SIZE, "ok"),  # a payload at the wrist, say
        (True, False, SIZE, "suspected"),
        (False, True, SIZE, "suspected"),  # the factor itself is what was found
        (False, False, "columns", "suspected"),  # another gear, a sign: no body
    ],
)
def test_a_factor_is_suspected_no_longer_where_what_is_found_leaves_noise(
    leaves, gain, check, verdict
):
    column = f"{JOINT}__torque_Nm"
    left = [Residual(j, "torque", 1.0, 1.0, "N*m", j == JOINT and leaves, "") for j in (JOINT, J2)]
    edits = (assumed("effort_gain", (column,), {"gain": 1.2}, ""),) if gain else ()
    names = tuple(Found(1, (e,), written=True) for e in edits)
    finding = Finding("log", column, check, 7.0, "1", "suspected", "7 times what it should be")
    (one,) = without_factors([finding], Held(names, (), (), tuple(left)))
    assert one.verdict == verdict
