"""Ground truth is recovered for every effect, and nothing is found where nothing is missing."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.effects.base import effect_named
from pipeline.identification import answer, search
from pipeline.identification.answer import Beside, answered, identify
from pipeline.identification.design import Term, make_data_sets, make_design
from pipeline.identification.fit import settled, start_fit
from pipeline.identification.offered import block_terms
from pipeline.identification.results import APPROXIMATE, CONFIRMED
from pipeline.identification.search import about, is_far, keys_of, polished
from pipeline.logs.log import TEST
from pipeline.simulation.machine import read_machine
from pipeline.simulation.predict import Simulator
from tests.pipeline.identification import bench_leg as leg

PENDULUM, NOISE = leg.ROOT / "tests/pipeline/data_files/xl330.urdf", 1e-3  # [N*m]
J2 = ("rm_joint_2",)
HIDDEN = {
    "coulomb_friction": (J2, {"torque": 0.4}),
    "viscous_friction": (J2, {"coefficient": 0.8}),
    "quadratic_drag": (J2, {"quadratic": 0.5}),
    "stribeck_friction": (J2, {"coulomb": 0.3, "excess": 0.6, "velocity": 0.06}),
    "load_dependent_friction": (J2, {"share": 0.12}),
    "direction_dependent_friction": (J2, {"positive": 0.9, "negative": 0.2}),
    "backdrive_loss": (J2, {"driving": 0.25, "driven": 0.05}),
    "rotor_inertia": (("rm_joint_1",), {"added": 5e-6}),
    "link_mass": (("rm_tibia_link",), {"mass": 0.4}),
    "center_of_mass_offset": (("rm_tibia_link",), {"x": 0.0, "y": 0.03, "z": 0.0}),
    "base_tilt": (("ground",), {"roll": 0.03, "pitch": -0.06}),
    "joint_elasticity": (("rm_joint_3",), {"stiffness": 2000.0}),
    "backlash": (("rm_joint_3",), {"width": 0.01, "stiffness": 1e5, "crossing": 0.1}),
    "torque_ripple": (("rm_joint_1",), {"amplitude": 0.3, "order": 60.0, "phase": 0.7}),
    "transmission_coupling": (
        ("rm_joint_3", "rm_joint_2"),
        {"ratio": 0.2, "inertia": 0.0, "viscous": 0.0, "coulomb": 0.0},
    ),
    "parallel_spring": (("rm_joint_1",), {"stiffness": 2.0, "rest": 0.1}),
    "torque_constant_error": (J2, {"relative": -0.12}),
    "winding_heating": (J2, {"rise": 40.0, "thermal_resistance": 6.0, "time_constant": 4.0}),
    "warming_friction": (J2, {"coulomb": 0.02, "viscous": 0.03, "reference": 308.15}),
    "effort_offset": (J2, {"offset": 0.05}),
    "effort_gain": (("rm_joint_2__current_A",), {"gain": 1.3}),
    "position_offset": (J2, {"angle": 0.08}),
    "time_delay": (("effort channels",), {"delay": 0.008}),
}
#: Of kinds of place that no other fast test tries.
QUICK = ("link_mass", "effort_gain", "time_delay", "parallel_spring")


@pytest.fixture(scope="module")
def motion():
    return leg.leg_motion(duration=8.0)


@pytest.mark.parametrize(
    "name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in HIDDEN]
)
def test_hidden_effect_is_named_with_its_values(name, motion):
    place, values = HIDDEN[name]
    nominal = leg.leg_model()
    if name == "warming_friction":
        motion = leg.warmed(motion)
    truth = effect_named(name).apply(nominal, place, values)
    result = identify(nominal, [leg.measured(truth, motion)])
    assert result.found, "nothing was found"
    first = result.found[0]
    assert (name, place) in {first.key, *first.rivals}
    if first.effect != name:
        return
    for p in first.edits[0].parameters:
        if p.name in ("phase", "rest", "thermal_resistance"):
            continue
        low, high = p.interval
        true = values.get(p.name, 0.0)  # what it does not have is zero
        slack = 0.6 * (high - low) + 0.02 * abs(true)
        assert low - slack <= true <= high + slack, p


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in range(1, 6))]
)
def test_nothing_is_found_where_nothing_is_missing(seed):
    nominal = leg.leg_model()
    log = leg.measured(nominal, leg.leg_motion(seed, 8.0), seed=100 + seed)
    result = identify(nominal, [log])
    assert result.found == ()
    left = leg.left_by(nominal, [log])
    assert not any(r.significant for r in left)
    assert np.allclose([r.error / r.noise_floor for r in left], 1.0, atol=0.1)


def test_a_temperature_that_varies_names_nothing_where_friction_stays(motion):
    nominal = leg.leg_model()
    truth = effect_named("coulomb_friction").apply(nominal, J2, {"torque": 0.5})
    found = identify(nominal, [leg.measured(truth, leg.warmed(motion))]).found
    assert [(f.effect, f.place) for f in found] == [("coulomb_friction", J2)]


def test_a_friction_that_the_log_shows_clearly_has_no_rivals(motion, monkeypatch):
    """What fits worse by odds of more than 150 is no member of its class."""
    nominal, law = leg.leg_model(), effect_named("coulomb_friction")
    truth = law.apply(nominal, J2, {"torque": 0.5})
    told = identify(nominal, [leg.only(leg.measured(truth, motion), ("current",))])
    assert [(f.key, f.level, f.rivals) for f in told.found] == [((law.name, J2), CONFIRMED, ())]
    # An estimate that the effect does not take is not written.
    monkeypatch.setattr(law, "parameters", [replace(p, high=0.3) for p in law.parameters])
    assert not answered(told.answer.found).told


def test_a_motors_current_that_reads_a_multiple_is_named_and_nothing_else(motion):
    """A sensor of one joint's current and that motor's constant cannot be told apart."""
    log = leg.only(leg.measured(leg.leg_model(), motion), ("current",))
    log.effort[:, 1] *= 5.0
    scaled = replace(log, noise=log.noise * [[1.0], [5.0], [1.0]])
    (f,) = (f for f in identify(leg.leg_model(), [scaled]).found if f.kept)
    assert f.key == ("torque_constant_error", J2)
    assert 1.0 / (1.0 + f.values["relative"]) == pytest.approx(5.0, rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scaled", "factor", "joints", "place"),
    [
        ("current", 5.0, slice(0, 3), "*__current_A"),
        ("voltage", 2.0, slice(0, 3), "*__voltage_V"),
        ("current", 2.0, slice(1, 2), "rm_joint_2__current_A"),
    ],
)
def test_a_column_beside_another_that_reads_a_multiple_is_named(
    motion, scaled, factor, joints, place
):
    log = leg.measured(leg.leg_model(), motion)
    column, noise = log.channels.index(scaled), log.noise.copy()
    log.effort[:, joints, column] *= factor
    noise[joints, column] *= factor
    (f,) = (f for f in identify(leg.leg_model(), [replace(log, noise=noise)]).found if f.kept)
    assert ("effort_gain", (place,)) in {f.key, *f.rivals}
    if f.effect == "effort_gain":
        assert f.values["gain"] == pytest.approx(factor, rel=0.05)


def test_what_only_proves_has_no_say(motion):
    nominal = leg.leg_model()
    truth = effect_named("coulomb_friction").apply(nominal, ("rm_joint_1",), {"torque": 0.5})
    log = leg.only(leg.measured(truth, motion), ("current",))
    garbage = log.effort.copy()
    garbage[log.part == TEST] *= -7.0
    first, second = (identify(nominal, [x]) for x in (log, replace(log, effort=garbage)))
    # What a current has warmed before is an input of the thermal law, which is among what
    # everything together leaves, so that the noise differs by next to nothing.
    for one, other in zip(first.found, second.found, strict=True):
        assert (one.key, one.level, one.rivals) == (other.key, other.level, other.rivals)
        assert one.values == pytest.approx(other.values, rel=1e-4)


def test_what_a_law_without_a_name_leaves_of_one_is_the_law_within(motion, monkeypatch):
    nominal, law = leg.leg_model(), ("stribeck_friction", J2)
    values = {"coulomb": 0.6, "excess": 0.2, "velocity": 0.06}
    truth = effect_named(law[0]).apply(nominal, J2, values)
    unnamed = Beside(frozenset(), frozenset({law}), frozenset())
    monkeypatch.setattr(answer, "_beside_general", lambda _: unnamed)
    found = identify(nominal, [leg.only(leg.measured(truth, motion), ("current",))]).found
    assert ("coulomb_friction", J2) in {f.key for f in found if f.kept}
    assert law in {f.key for f in found if not f.kept}


def swinging(motion, folder, name, place, values):
    """A pendulum, and its log with an effect hidden in it."""
    urdf = folder / "pendulum.urdf"
    urdf.write_text(PENDULUM.read_text().replace("1e-6", "1e-3"))
    nominal = read_machine(urdf).model
    one = {key: getattr(motion, key)[:, :1] for key in ("q", "v", "a", "mask")}
    one |= {"rest_speed": motion.rest_speed[:1], "noise": np.full((1, 1), NOISE)}
    log = replace(motion, joints=nominal.joints, channels=("torque",), **one)
    truth = effect_named(name).apply(nominal, (place,), values)
    noise = NOISE * np.random.default_rng(3).standard_normal((len(log), 1, 1))
    return nominal, replace(log, effort=Simulator(log).predict(truth).effort + noise)


@pytest.mark.parametrize(
    ("name", "place", "values"),
    [
        ("effort_gain", "pendulum_joint__torque_Nm", {"gain": 1.2}),
        ("rotor_inertia", "pendulum_joint", {"added": 1.5e-3}),
        ("position_offset", "pendulum_joint", {"angle": 0.1}),
        # Where along its axis, and how far it turns about itself, a pendulum does not show.
        ("link_mass", "pendulum_link", {"mass": 0.05, "x": 0.02, "y": 0.01, "z": -0.06}),
    ],
)
def test_what_only_a_product_shows_is_one_class_at_one_level(motion, tmp_path, name, place, values):
    nominal, log = swinging(motion, tmp_path, name, place, values)
    (first,) = (f for f in identify(nominal, [log]).found if f.kept)
    assert first.level == APPROXIMATE
    told = {first.effect, *(effect for effect, _ in first.rivals)}
    assert {name, "rigid_body_parameters"} <= told


def test_a_payload_goes_where_a_log_shows_it_and_nowhere_else(motion, tmp_path, monkeypatch):
    """Its columns of a pendulum hold what it would change along the link, about the files."""
    place, at = "pendulum_link", {"mass": 0.05, "x": 0.02, "y": 0.01, "z": -0.06}
    nominal, log = swinging(motion, tmp_path, "link_mass", place, at)
    sets, start = make_data_sets([log]), {"x": 0.0, "y": 0.0, "z": -0.1}
    payload = Term(effect_named("link_mass"), (place,), start)
    design = make_design(
        nominal, sets, [*block_terms(nominal, sets[0].simulator.measured), payload]
    )
    fit = settled(replace(start_fit(design, log.noise[0]), names=(len(design.terms) - 1,)))
    fit = settled(about(fit))
    assert is_far(fit)
    for _ in range(4):
        fit = settled(about(fit))
    assert not is_far(fit)
    # What steps make of it stands where it is likelier on columns of its own.
    monkeypatch.setattr(search, "climbed", lambda other: settled(replace(other, names=())))
    assert keys_of(polished(fit)) == {payload.key}
    (k,) = fit.names
    mass, there = fit.x[fit.design.columns[k]][0], fit.design.terms[k].shape
    moments = [mass * there[axis] for axis in "xyz"]
    assert moments == pytest.approx([0.05 * 0.02, 0.0, 0.05 * -0.06], rel=0.02, abs=1e-5)
