"""Blocks and names on small regressions with known answers; senses of friction; missing rows."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.effects.base import EFFECTS, effect_named
from pipeline.effects.model_file import Edit
from pipeline.identification import residual
from pipeline.identification.answer import Told, answered, identify
from pipeline.identification.design import make_data_sets, make_design
from pipeline.identification.fit import NOTHING, Fit, independent, settled, start_fit
from pipeline.identification.offered import block_terms, name_terms, reversals
from pipeline.identification.residual import floor_of, residuals, rows_left, shrunk
from pipeline.identification.results import Found
from pipeline.identification.search import about, searched
from pipeline.identification.tolerances import STRAINS, BodyStrain
from pipeline.identification.workflow.written import may_be_nothing
from pipeline.logs.log import TEST, TRAIN, VALIDATION, Log
from pipeline.logs.reduce import DRIVE_OFF, INSTEAD, NO_EFFORT
from pipeline.machine.machine import MachineModel
from pipeline.simulation.predict import Simulator
from tests.pipeline.identification import bench_leg as leg

J1 = ("rm_joint_1",)


def test_samples_with_memory_count_for_less():
    rng = np.random.default_rng(1)
    white = rng.standard_normal(20_000)
    assert independent(white) == pytest.approx(1.0, abs=0.1)
    slow = np.empty_like(white)
    slow[0] = white[0]
    for k in range(1, white.size):
        slow[k] = 0.9 * slow[k - 1] + white[k]
    # (1 - rho) / (1 + rho) of an autoregressive process of first order.
    assert independent(slow) == pytest.approx(0.1 / 1.9, rel=0.25)


@pytest.mark.parametrize(("share", "told"), [(0.05, False), (0.6, False), (0.8, True), (1.0, True)])
def test_a_law_is_told_where_most_of_a_log_shows_it(share, told):
    """What three fifths show may be of them alone: each is predicted from all others."""
    nominal, motion = leg.leg_model(), leg.leg_motion(duration=8.0)
    rubbing = effect_named("coulomb_friction").apply(nominal, J1, {"torque": 0.2})
    log, other = (leg.only(leg.measured(m, motion), ("current",)) for m in (nominal, rubbing))
    there = (log.time < share * 8.0) & (log.part != TEST)
    mixed = replace(log, effort=np.where(there[:, None, None], other.effort, log.effort))
    found = searched(nominal, make_data_sets([mixed]), floor_of([mixed]))
    assert [t.key for t in answered(found).told] == [("coulomb_friction", J1)] * told


def test_what_moves_with_a_nonlinear_parameter_comes_and_goes_with_its_name():
    nominal, payload = leg.leg_model(), {"mass": 0.4, "x": 0.15, "y": 0.05, "z": 0.02}
    truth = effect_named("link_mass").apply(nominal, ("rm_tibia_link",), payload)
    log = leg.only(leg.measured(truth, leg.leg_motion(duration=8.0)), ("current",))
    answer = identify(nominal, [log]).answer
    (told,), fit, d = answer.told, answer.fit, answer.fit.design
    (k,), less = told.terms, replace(fit, names=())
    moved = {c[0] for t, c in zip(d.terms, d.columns, strict=True) if t.effect.name == "slope"}
    assert len(moved & set(fit.active)) == 3
    assert moved.isdisjoint(less.active)
    assert (
        d.cost[k] == d.name_cost
    )  # their own columns pay for them, and nothing where none is seen
    assert d.terms[-1].moves == d.terms[k].key
    assert replace(d, terms=d.terms[:-1]).cost[k] == d.name_cost
    assert told.share == pytest.approx(fit.sure(less, d.touched(k))[1], rel=1e-3)


def test_a_law_that_has_another_in_it_stands_in_its_place():
    nominal = leg.leg_model()
    log = leg.only(leg.measured(nominal, leg.leg_motion(duration=4.0)), ("current",))
    sets = make_data_sets([log])
    known = (nominal, sets[0].simulator.measured)
    design = make_design(nominal, sets, block_terms(*known) + name_terms(*known))
    own = {t.key[0]: k for k, t in enumerate(design.terms) if t.place == J1}
    inside = {"direction_dependent_friction": {"coulomb_friction", "effort_offset"}}
    inside |= {"stribeck_friction": {"coulomb_friction"}, "quadratic_drag": set()}
    for name, laws in inside.items():
        within = [k for k in design.within(own[name]) if design.terms[k].block]
        assert {design.terms[k].key[0] for k in within} - {"friction_factor"} == laws
        gone = set(design.standing(())) - set(design.standing((own[name],)))
        assert gone == set(design.of(within))


def test_what_a_law_that_is_nothing_would_add_is_the_difference_of_evidences():
    nominal = leg.leg_model()
    log = leg.only(leg.measured(nominal, leg.leg_motion(duration=4.0)), ("current",))
    sets = make_data_sets([log])
    design = make_design(nominal, sets, block_terms(nominal, sets[0].simulator.measured))
    fit = settled(start_fit(design, np.array([e.level(log.noise) for e in design.equations])))
    silent = [b for b in design.blocks if fit.scale(b) <= NOTHING]
    rises = []
    for block in silent:
        ids = fit.offered[design.block_of[fit.offered] == design.blocks.index(block)]
        assert not fit.x[ids].any()
        there = replace(fit, scales={**fit.scales, block: 0.1})
        if (there.x[ids] >= 0.0)[~design.signed[ids]].all():  # else its sign keeps it out
            rises.append(there.evidence - fit.evidence)
            unit = design.unit[ids]
            assert fit.with_prior(ids, 0.1 * unit) == pytest.approx(rises[-1], rel=1e-6, abs=1e-5)
            back = there.with_prior(ids, NOTHING * unit)  # hardly anything, which is not nothing
            assert back == pytest.approx(-rises[-1], rel=1e-2, abs=1e-2)
    assert rises


@pytest.mark.parametrize("agree", [True, False])
def test_a_body_is_worth_what_the_directions_of_a_base_agree_on(agree):
    nominal = leg.leg_model()
    log = leg.only(leg.measured(nominal, leg.leg_motion(duration=4.0)), ("current",))
    sets = make_data_sets([log])
    every = block_terms(nominal, sets[0].simulator.measured)
    design = make_design(nominal, sets, [t for t in every if isinstance(t.effect, BodyStrain)])
    mass = int(design.columns[-1][list(STRAINS).index("mass")])  # seen by all joints
    rng, equations = np.random.default_rng(0), []
    for e, sign in zip(design.equations, (1.0, 1.0 if agree else -1.0, 1.0), strict=True):
        r = sign * e.X[e.ids == mass][0]
        noise = 0.3 * np.std(r) * rng.standard_normal(r.size)
        equations.append(replace(e, joint=e.joint + 3, r=r + noise))
    design = replace(design, equations=tuple(equations))
    tied = settled(start_fit(design, np.array([1e-9] * 3)))
    loose = settled(replace(tied, loose=frozenset([design.terms[-1].block])))
    assert loose.evidence > tied.evidence
    assert (loose.worth > tied.worth) == (loose.rise(tied) > 0.0) == agree
    assert tied.rise(loose) < 0.0  # by the evidence, whatever the directions say
    fixed = replace(design, equations=tuple(replace(e, joint=e.joint - 3) for e in equations))
    assert replace(loose, design=fixed).worth == loose.evidence


@pytest.mark.parametrize(
    "lacks", [{"against_nothing": -0.1}, {"sure": 1.9}, {"share": 0.009}, {"certain": False}]
)
def test_a_name_is_told_where_evidence_and_chunks_and_rest_and_interval_all_want_it(lacks):
    whole = Told(("coulomb_friction", J1), (0,), 0.1, 2.1, 0.011, certain=True, priced=True)
    assert whole.stands
    assert not replace(whole, **lacks).stands


@pytest.mark.parametrize(
    ("effect", "parameter", "ends", "nothing"),
    [
        ("effort_offset", "offset", (-0.005, 0.12), True),
        ("effort_offset", "offset", (0.005, 0.12), False),
        ("effort_gain", "gain", (0.97, 1.2), True),
        ("effort_gain", "gain", (0.01, 0.2), False),
    ],
)
def test_a_name_whose_interval_holds_no_effect_is_not_written(effect, parameter, ends, nothing):
    number = {"value": 0.5 * sum(ends), "unit": EFFECTS[effect].unit(parameter, "torque")}
    parameters = {parameter: {**number, "interval": ends}}
    made = {"effect": effect, "place": ("joint",), "parameters": parameters}
    found = Found(1, (Edit.model_validate(made),))
    assert may_be_nothing(found) == nothing


@pytest.mark.parametrize(("torque", "floors"), [(0.5, 1.6), (0.0, 3.0)])
def test_what_is_left_counts_from_so_many_floors_fewer_where_it_depends_on_something(
    torque, floors, monkeypatch
):
    nominal, motion = leg.leg_model(), leg.leg_motion(duration=8.0)
    rubbing = effect_named("coulomb_friction").apply(nominal, J1, {"torque": torque})
    log = leg.only(leg.measured(rubbing, motion), ("current",))
    predicted = [Simulator(log).predict(nominal)]
    told = residuals([log], predicted)
    size = {part: np.array([[r.error] for r in told]) for part in ((TEST,), (TRAIN, VALIDATION))}
    for near, counts in ((0.97, False), (1.03, True)):
        floor = {part: size[part] / (near * floors) for part in size}
        monkeypatch.setattr(residual, "floor_of", lambda _, *part, at=floor: at[part])
        first = residuals([log], predicted)[0]
        assert (first.significant, bool(first.description)) == (counts, counts)


J2 = "rm_joint_2"


@pytest.mark.parametrize("law", [{"rise": 0.05}, {"travel": 3e-3}])
def test_a_slow_change_is_no_break_away(law):
    nominal, motion = leg.leg_model(), leg.leg_motion(duration=8.0)
    motion = replace(motion, mask=np.ones_like(motion.mask))
    rubbing = effect_named("coulomb_friction").apply(nominal, (J2,), {"torque": 0.4, **law})
    log = leg.only(leg.measured(rubbing, motion), ("current",))
    found = reversals(nominal, make_data_sets([log]))
    assert list(found) == [J2]
    ((name, value),) = found[J2].items()
    assert {name} == set(law)
    assert value == pytest.approx(law[name], rel=0.3)
    told = {(f.effect, f.place) for f in identify(nominal, [log]).found if f.kept}
    assert told == {("coulomb_friction", (J2,))}


def test_a_jump_is_kept():
    nominal, motion = leg.leg_model(), leg.leg_motion(duration=8.0)
    log = leg.only(leg.measured(nominal, motion), ("current",))
    assert reversals(nominal, make_data_sets([log])) == {}


@pytest.mark.parametrize("seen", [False, True], ids=["no column reaches it", "no reversals"])
def test_a_joint_that_tells_nothing_of_dry_friction_is_passed_over(seen):
    nominal, motion = leg.leg_model(), leg.leg_motion(duration=8.0)
    still = (np.arange(3) != 1).astype(float)  # the second joint stands
    motion = replace(motion, q=motion.q * still, v=motion.v * still, a=motion.a * still)
    rubbing = effect_named("coulomb_friction").apply(nominal, J1, {"torque": 0.4, "rise": 0.05})
    log = leg.only(leg.measured(rubbing, motion), ("current",))
    log = replace(log, mask=log.mask & (seen | (still > 0.0)))
    assert list(reversals(nominal, make_data_sets([log]))) == [*J1]
    (one,) = [f for f in identify(nominal, [log]).found if f.kept]
    assert (one.effect, one.place) == ("coulomb_friction", J1)
    # Told to less than a thousandth: 95 % of the per cent to which laws hold is what is left.
    (rise,) = [p for p in one.edits[0].parameters if p.name == "rise"]
    assert np.ptp(rise.interval) == pytest.approx(2 * 0.0196 * rise.value, rel=0.05)


def measured(mask: np.ndarray) -> Log:
    n, joints = mask.shape
    zero, one = np.zeros((n, joints)), np.ones(joints)
    return Log(
        "made", np.arange(n) / 100, tuple("ab"[:joints]), zero, zero, zero, ("torque",),
        zero[..., None], one[:, None], mask, np.zeros(n, np.int8),
        (slice(0, n),), removed=((DRIVE_OFF, 0.7 * one), (NO_EFFORT, 0.3 * one)),
    )  # fmt: skip


def test_a_joint_without_rows_is_left_out_and_a_log_without_is_refused():
    mask = np.zeros((400, 2), dtype=np.bool_)
    mask[:100, 0] = True
    whole, joint = rows_left(measured(mask))
    assert (whole.verdict, joint.column, joint.verdict) == ("ok", "b__torque_Nm", "warning")
    assert "70 % the drive is off" in whole.detail
    (seen,) = rows_left(measured(np.zeros((400, 2), dtype=np.bool_)))
    assert seen.verdict == "refused"
    assert seen.detail == f"near zero rows left (0 of 800); 70 % {DRIVE_OFF}: {INSTEAD[DRIVE_OFF]}"


def test_noise_of_accelerations_is_told_where_it_shrinks_masses_beyond_what_is_known():
    """By more than a law holds to at best, and by two standard errors of the coefficient."""
    nominal, motion = leg.leg_model(), leg.only(leg.leg_motion(duration=8.0), ("current",))
    motion = replace(motion, sign=np.sign(motion.v), bandwidth=leg.RATE / 2.0)
    base = Simulator(motion).predict(nominal)
    noise = leg.CURRENT * np.random.default_rng(4).standard_normal(base.effort.shape)

    def told(size: float, times: float = 1.0) -> dict[str, float]:
        draw = size * np.std(motion.a, axis=0) * np.resize([1.0, -1.0], (len(motion), 1))
        one = replace(motion, effort=base.effort + times * noise, a_noise=draw)
        return {f.column: f.value for f in shrunk(one, base)}

    still = Simulator(replace(motion, a=0.0 * motion.a)).predict(nominal).effort[..., 0]
    for j, (column, share) in enumerate(told(1.0).items()):
        size, rows = np.sqrt(0.01 / share), motion.mask[:, j] & motion.has_say
        assert column not in told(0.99 * size)
        assert column in told(1.01 * size)
        x = np.stack([base.effort[:, j, 0], still[:, j], motion.sign[:, j], motion.v[:, j]], axis=1)
        covariance = np.linalg.pinv(np.cov(x[rows], rowvar=False)) / rows.sum()
        most = 0.04 / 2.0 / (leg.CURRENT * np.sqrt(covariance[0, 0]))
        assert column in told(2.0 * size, 0.95 * most)
        assert column not in told(2.0 * size, 1.05 * most)
    assert j == 2


def test_bodies_about_one_motion_ask_for_what_inverse_dynamics_says():
    """From the third time on by one regressor, which a tilt or a zero does not leave in use."""
    nominal, motion = leg.leg_model(), leg.only(leg.leg_motion(duration=2.0), ("current",))
    link = list(nominal.robot.links)[1]
    heavier = EFFECTS["link_mass"].edit(
        nominal, (link,), {"mass": 0.4, "x": 0.1}, {"inertia": 0.01}
    )
    tilted = EFFECTS["base_tilt"].edit(heavier, ("ground",), {"roll": 0.2, "pitch": 0.1}, {})
    shifted = EFFECTS["position_offset"].edit(heavier, J1, {"angle": 0.05}, {})
    one = Simulator(motion)
    for model in [nominal, nominal, heavier, tilted, heavier, shifted, heavier, tilted, tilted]:
        expected = Simulator(motion).predict(model).torque
        np.testing.assert_allclose(one.predict(model).torque, expected, rtol=1e-11, atol=1e-12)


SHIN = "rm_tibia_link"


def strained_leg(strain: dict[str, float]) -> tuple[MachineModel, Log]:
    """The leg of the files, and a log of one whose shin is another."""
    nominal = leg.leg_model()
    truth = BodyStrain().edit(nominal, (SHIN,), dict.fromkeys(STRAINS, 0.0) | strain, {})
    return nominal, leg.only(leg.measured(truth, leg.leg_motion(duration=8.0)), ("current",))


def test_a_body_off_by_more_than_its_tolerance_is_let_go_and_nothing_told_in_its_place():
    nominal, log = strained_leg({"mass": 0.03})
    fit = searched(nominal, make_data_sets([log]), floor_of([log]))
    assert fit.loose == {f"body {SHIN}"}
    assert not answered(fit).told


def loosened(strain: dict[str, float]) -> tuple[Fit, np.ndarray]:
    """A fit to its log in which its body is let go; and the noise of the equations."""
    nominal, log = strained_leg(strain)
    known = nominal, Simulator(log).measured
    design = make_design(nominal, make_data_sets([log]), block_terms(*known) + name_terms(*known))
    noise = np.array([e.level(floor_of([log])) for e in design.equations])
    return settled(replace(start_fit(design, noise), loose=frozenset({f"body {SHIN}"}))), noise


@pytest.mark.parametrize("strain", [{"mass": 0.5}, {"mass": 0.6, "xx": 0.2, "y": 0.2}])
def test_columns_are_made_anew_where_a_heavier_body_is(strain):
    """There noise is left; a linear law of its strain would leave up to 3.6 times that."""
    fit, noise = loosened(strain)
    anew = about(fit, alone=True).design
    left = np.array([e.left(anew.x0)[e.chunk >= 0].std() for e in anew.equations])
    assert (left < 1.1 * noise).all()
    # Of fewer terms each name is still one of as many.
    assert len(anew.terms) < len(fit.design.terms)
    assert anew.name_cost == fit.design.name_cost


def test_a_body_far_off_is_approached_from_this_side():
    """A linear law of e^1.2 times the mass asks for about twice that strain."""
    fit, _ = loosened({"mass": 1.2})
    (k,) = (k for k, t in enumerate(fit.design.terms) if t.block in fit.loose)
    mass = list(STRAINS).index("mass")
    assert fit.x[fit.design.columns[k]][mass] > 2.0
    first = about(fit, alone=True)
    (k,) = (k for k, t in enumerate(first.design.terms) if t.block in first.loose)
    reached = first.design.x0[first.design.columns[k]][mass]
    assert 0.4 < reached < 1.2
    again = about(settled(first), alone=True).design
    assert again.x0[again.columns[k]][mass] == pytest.approx(1.2, rel=0.05)
