"""Fixed-base machines of the standard matrix: what is simulated obeys laws known from elsewhere."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from pipeline.blind.twin.errors import TwinError
from pipeline.blind.twin.fixed.hidden import EFFECTS, UNKNOWN
from pipeline.blind.twin.fixed.machines import MACHINES, draw_machine, true_bodies, with_payload
from pipeline.blind.twin.fixed.matrix import standard_matrix
from pipeline.blind.twin.fixed.motions import sines, strokes
from pipeline.blind.twin.fixed.simulate import rigid_truth, simulate
from pipeline.blind.twin.fixed.trial import OFF, FixedTrial, make_fixed_trial
from pipeline.blind.twin.setup import stream

DT = 2e-3


@pytest.mark.parametrize("kind", [sines, strokes])
def test_speeds_and_accelerations_are_the_derivatives_of_positions(kind: object) -> None:
    course = kind(stream(3, "motion"), 3, 6.0, DT)  # type: ignore[operator]
    inside = slice(2, -2)
    v, a = (np.gradient(x, DT, axis=0) for x in (course.q, course.v))
    assert np.abs(v - course.v)[inside].max() < 5e-3
    # A stroke's acceleration starts with a kink.
    assert np.quantile(np.abs(a - course.a)[inside], 0.99) < 5e-2


def test_a_pendulum_without_friction_gives_back_what_it_took() -> None:
    machine = draw_machine(stream(1, "machine"), "pendulum")
    course = strokes(stream(1, "motion"), 1, 8.0, DT)
    torque = simulate(rigid_truth(machine.model), course).torque
    work = np.trapezoid(torque[:, 0] * course.v[:, 0], course.time)
    body = machine.model.inertias[1]
    height = -body.lever[2] * np.cos(course.q[:, 0]) + body.lever[0] * np.sin(course.q[:, 0])
    swing = body.mass * (body.lever[0] ** 2 + body.lever[2] ** 2) + body.inertia[1, 1]
    energy = 0.5 * swing * course.v[:, 0] ** 2 - body.mass * 9.81 * height
    assert work == pytest.approx(energy[-1] - energy[0], abs=1e-3 * np.ptp(energy))


def test_dry_friction_costs_its_level_times_the_way() -> None:
    machine = draw_machine(stream(1, "machine"), "pendulum")
    course = sines(stream(1, "motion"), 1, 8.0, DT)
    truth = rigid_truth(machine.model)
    rubbing = truth.with_friction(0, coulomb=0.5, stiffness=2.5e4)
    loss = (simulate(rubbing, course).torque - simulate(truth, course).torque)[:, 0]
    way = np.trapezoid(np.abs(course.v[:, 0]), course.time)
    assert np.trapezoid(loss * course.v[:, 0], course.time) == pytest.approx(0.5 * way, rel=0.01)


def test_a_gear_winds_up_with_its_torque_and_plays_by_its_width() -> None:
    machine = draw_machine(stream(2, "machine"), "leg")
    course = sines(stream(2, "motion"), 3, 6.0, DT)
    truth = rigid_truth(machine.model)
    soft = simulate(replace(truth, compliance=np.array([0.0, 1e-3, 0.0])), course)
    assert np.allclose((soft.motor - course.q)[:, 1], 1e-3 * soft.torque[:, 1])
    loose = simulate(replace(truth, play=np.array([0.0, 0.01, 0.0])), course)
    ahead = (loose.motor - course.q)[:, 1]
    assert np.ptp(ahead) == pytest.approx(0.01, rel=0.02)


def test_a_payload_adds_its_weight_away_from_the_centre() -> None:
    machine = draw_machine(stream(4, "machine"), "pendulum")
    at = np.array([0.03, 0.0, -0.5])
    loaded = with_payload(machine.model, "joint_1", 0.7, at)
    before, after = machine.model.inertias[1], loaded.inertias[1]
    assert after.mass == pytest.approx(before.mass + 0.7)
    moment = after.mass * after.lever - before.mass * before.lever
    assert np.allclose(moment, 0.7 * at)


def test_bodies_are_off_by_ten_to_twenty_per_cent() -> None:
    machine = draw_machine(stream(5, "machine"), "arm")
    _, drawn = true_bodies(machine, stream(5, "bodies"), OFF["machine"])
    factors = np.array([values[0] for values in drawn.values()])
    assert np.all((np.abs(factors - 1) >= 0.1) & (np.abs(factors - 1) <= 0.2))


@pytest.fixture(scope="module")
def trial() -> FixedTrial:
    return make_fixed_trial(7, "pendulum", ("torque_ripple",), "machine")


def test_a_trial_holds_two_logs_a_urdf_and_what_was_drawn(trial: FixedTrial) -> None:
    assert set(trial.log) == set(trial.test)
    assert trial.log["time_s"].size > trial.test["time_s"].size
    assert trial.truth["hidden"][0]["effect"] == "torque_ripple"
    assert "gear_ratio" in trial.mapping


def test_the_same_seed_gives_the_same_trial(trial: FixedTrial) -> None:
    again = make_fixed_trial(7, "pendulum", ("torque_ripple",), "machine")
    assert all(np.array_equal(trial.log[k], again.log[k]) for k in trial.log)
    assert again.truth == trial.truth


def test_what_an_effect_adds_shows_and_a_vanishing_one_does_not() -> None:
    hidden = make_fixed_trial(11, "pendulum", ("parallel_spring",), "machine").truth["hidden"]
    assert hidden[0]["misfit"] > 0
    both = make_fixed_trial(11, "leg", ("backlash",), "machine").truth
    assert both["sides"] == "both"
    assert both["hidden"][0]["misfit"] > 6


@pytest.mark.parametrize("effect", [*EFFECTS, *UNKNOWN])
def test_every_effect_changes_the_log(effect: str) -> None:
    name = "leg" if effect == "transmission_coupling" else "pendulum"
    background = "weighed" if effect == "link_mass" else "machine"
    with_it = make_fixed_trial(23, name, (effect,), background)
    without = make_fixed_trial(23, name, (), background)
    column = [c for c in with_it.log if c.endswith("torque_Nm")]
    changed = [not np.array_equal(with_it.log[c], without.log[c]) for c in column]
    sides = set(with_it.log) != set(without.log)
    assert any(changed) or sides or effect in ("joint_elasticity", "position_offset")
    assert with_it.truth["hidden"][0]["in_catalogue"] == (effect in EFFECTS)


def test_what_cannot_be_hidden_is_refused() -> None:
    with pytest.raises(TwinError, match="winding_heating"):
        make_fixed_trial(1, "leg", ("winding_heating",), "machine")
    with pytest.raises(TwinError, match="background"):
        make_fixed_trial(1, "leg", (), "perfect")


def test_the_matrix_has_the_trials_it_promises() -> None:
    specs = standard_matrix(1)
    kinds = Counter(
        "empty" if not s.effects else "unknown" if s.effects[0] in UNKNOWN else "hidden"
        for s in specs
    )
    assert kinds["hidden"] >= 400
    assert kinds["empty"] >= 150
    assert kinds["unknown"] >= 60
    assert {s.machine for s in specs[:40]} == set(MACHINES)
    assert [s.seed for s in specs] == [s.seed for s in standard_matrix(1)]
    assert {len(s.effects) for s in specs} == {0, 1, 2, 3}
