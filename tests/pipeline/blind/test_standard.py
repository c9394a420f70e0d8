"""Straight scoring of the standard matrix: what counts, what is right, what is wrong."""

from __future__ import annotations

from typing import Any

import pytest

from pipeline.blind.answer import Answer, Named
from pipeline.blind.standard.rows import by_effect, rates, read_rows, reliability, trial_row
from pipeline.blind.standard.score import StandardScore, score_straight
from pipeline.blind.twin.fixed.hidden import LAWS_OF_FRICTION
from pipeline.blind.twin.fixed.matrix import StandardSpec, standard_matrix
from reports.tables.blind import StandardTrialRow, blind_table
from reports.writer import write_table

NAN = float("nan")


def truth(*hidden: tuple[str, str, dict[str, float]], **more: Any) -> dict[str, Any]:
    return {
        "friction": ["joint_1", "joint_2"],
        "uneven": [],
        "delays_s": [0.0, 0.0],
        "sides": "joint",
        "hidden": [
            {"effect": e, "place": [p], "values": v, "in_catalogue": e != "detent", "misfit": 20.0}
            for e, p, v in hidden
        ],
    } | more


def named(effect: str, place: str, **more: Any) -> Named:
    values: dict[str, Any] = {"written": True, "level": "confirmed", "intervals": {}} | more
    intervals = values.pop("intervals")
    return Named(effect, (place,), "", "", intervals, NAN, NAN, NAN, **values)


def judged(sealed: dict[str, Any], *names: Named, code: int = 0) -> StandardScore:
    return score_straight(sealed, Answer(code, 1.0, names))


SPRING = ("parallel_spring", "joint_2", {"stiffness": 3.0})


def test_friction_and_bodies_of_the_machine_are_neither_right_nor_wrong() -> None:
    score = judged(
        truth(SPRING),
        named("coulomb_friction", "joint_1"),
        named("rigid_body_parameters", "base"),
        named("parallel_spring", "joint_2"),
    )
    assert score.first
    assert score.right == ("parallel_spring",)
    assert not score.wrong


def law(place: str, *terms: str) -> Named:
    return named("joint_friction", place, amounts_to=terms)


def test_a_law_of_several_terms_is_right_by_the_term_that_is_hidden_and_wrong_by_any_other() -> (
    None
):
    hidden = truth(("viscous_friction", "joint_1", {"coefficient": 0.2}))
    score = judged(hidden, law("joint_1", "viscous_friction"))
    assert score.first
    assert not score.wrong
    score = judged(hidden, law("joint_1", "coulomb_friction", "viscous_friction"))
    assert score.right == ("viscous_friction",)
    assert [n.effect for n in score.wrong] == ["joint_friction"]
    rising = truth(("stribeck_friction", "joint_1", {"coulomb": 0.2}))
    assert not judged(rising, law("joint_1", "coulomb_friction", "stribeck_friction")).wrong


def test_an_offset_where_friction_is_uneven_is_the_machines_own() -> None:
    offset = named("effort_offset", "joint_1")
    assert judged(truth(SPRING), offset).wrong
    assert not judged(truth(SPRING, uneven=["joint_1"]), offset).wrong
    ripple = ("torque_ripple", "joint_1", {"amplitude": 0.2})
    assert not judged(truth(ripple, uneven=["joint_1"]), offset).wrong
    # A hidden law of friction takes the place of what was uneven.
    law = ("stribeck_friction", "joint_1", {"coulomb": 0.2})
    assert judged(truth(law, uneven=["joint_1"]), offset).wrong


def test_friction_named_on_a_machine_without_any_is_wrong() -> None:
    score = judged(truth(friction=[]), named("coulomb_friction", "joint_1"))
    assert [n.effect for n in score.wrong] == ["coulomb_friction"]


@pytest.mark.parametrize("written", [True, False])
def test_right_means_first_and_written(written: bool) -> None:
    score = judged(truth(SPRING), named("parallel_spring", "joint_2", written=written))
    assert score.first == written
    late = judged(
        truth(SPRING), named("effort_offset", "joint_2"), named("parallel_spring", "joint_2")
    )
    assert not late.first
    assert late.right == ("parallel_spring",)


def test_the_right_name_at_another_place_is_wrong() -> None:
    score = judged(truth(SPRING), named("parallel_spring", "joint_1"))
    assert not score.first
    assert [n.place for n in score.wrong] == [("joint_1",)]


def test_a_written_wrong_name_is_wrong_whatever_its_level() -> None:
    score = judged(truth(SPRING), named("time_delay", "effort channels", level="approximate"))
    assert len(score.wrong) == 1
    unwritten = judged(truth(SPRING), named("time_delay", "effort channels", written=False))
    assert not unwritten.wrong


def test_where_friction_is_hidden_its_law_has_to_be_right() -> None:
    hidden = truth(("stribeck_friction", "joint_2", {"coulomb": 1.0}))
    assert judged(hidden, named("coulomb_friction", "joint_2")).wrong
    assert judged(hidden, named("stribeck_friction", "joint_2")).first
    assert not judged(hidden, named("coulomb_friction", "joint_1")).wrong


def test_two_halves_at_one_joint_name_the_whole() -> None:
    hidden = truth(("direction_dependent_friction", "joint_1", {}))
    score = judged(hidden, named("coulomb_friction", "joint_1"), named("effort_offset", "joint_1"))
    assert score.first
    assert not score.wrong


def test_delays_of_joints_excuse_a_delay_and_no_delays_do_not() -> None:
    delay = named("time_delay", "effort channels")
    assert judged(truth(), delay).wrong
    assert not judged(truth(delays_s=[1e-3, 0.0]), delay).wrong


def test_intervals_count_where_the_right_name_is_written() -> None:
    inside = named("parallel_spring", "joint_2", intervals={"stiffness": (3.1, 2.5, 3.5)})
    outside = named("parallel_spring", "joint_2", intervals={"stiffness": (4.0, 3.5, 4.5)})
    assert (judged(truth(SPRING), inside).intervals, judged(truth(SPRING), inside).covered) == (
        1,
        1,
    )
    assert judged(truth(SPRING), outside).covered == 0


def rows() -> list[dict[str, Any]]:
    spec = StandardSpec(0, 1, "leg", (), "machine")
    payload = truth(("link_mass", "link_3", {"mass": 1.0}))
    scores = [
        judged(truth(SPRING), named("parallel_spring", "joint_2", share=0.97)),
        judged(truth(SPRING), named("effort_offset", "joint_2", share=0.6), code=1),
        judged(truth()),
        judged(truth(), named("backlash", "joint_1", level="approximate", share=0.6)),
        judged(truth(("detent", "joint_1", {})), code=1),
        judged(payload, named("link_mass", "link_3", intervals={"mass": (1.04, 0.99, 1.02)})),
    ]
    return [trial_row(spec, score, "") for score in scores]


def test_rates_follow_from_the_rows() -> None:
    found = {r.name: (r.hits, r.trials) for r in rates(rows())}
    assert found["right_and_written"] == (2, 3)
    assert found["wrong_and_written"] == (2, 6)
    assert found["wrong_and_confirmed"] == (1, 6)
    assert found["empty_silent_and_explained"] == (1, 2)
    assert found["unknown_not_confirmed"] == (1, 1)
    assert found["payload_mass"] == (1, 1)
    assert found["answered"] == (6, 6)
    shares = {r["effect"]: r for r in by_effect(rows())}
    assert shares["parallel_spring"]["right_and_written"] == 1
    assert shares["parallel_spring"]["trials"] == 2


def test_stated_shares_stand_beside_actual_ones() -> None:
    bands = {(r["stated_as"], r["band"]): r for r in reliability(rows())}
    assert bands["share", "0.5 to 0.8"]["actual"] == 0.0
    assert bands["share", "0.95 to 1"]["actual"] == 1.0
    assert bands["level", "confirmed"]["names"] == 3


def test_a_run_that_is_read_back_gives_the_same_rates(tmp_path: Any) -> None:
    write_table(blind_table(StandardTrialRow, rows()), tmp_path, meta={})
    again = read_rows(tmp_path / "blind_standard_trials.csv")
    assert [(r.hits, r.trials) for r in rates(again)] == [(r.hits, r.trials) for r in rates(rows())]


def test_a_delay_is_held_where_the_joints_delays_are() -> None:
    late = ("time_delay", "effort channels", {"delay": 0.02})
    hidden = truth(late, delays_s=[0.021, 0.023])
    near = named("time_delay", "effort channels", intervals={"delay": (0.022, 0.0215, 0.0225)})
    low = named("time_delay", "effort channels", intervals={"delay": (0.02, 0.0195, 0.0205)})
    assert judged(hidden, near).covered == 1
    assert judged(hidden, low).covered == 0


def test_no_trial_hides_two_laws_of_friction() -> None:
    several = [s for s in standard_matrix(5) if len(s.effects) > 1]
    assert len(several) > 30
    assert all(len(LAWS_OF_FRICTION.intersection(s.effects)) < 2 for s in several)
    assert any(LAWS_OF_FRICTION.intersection(s.effects) for s in several)


def test_joints_late_by_themselves_beside_a_hidden_delay_are_the_machines_own() -> None:
    late = ("time_delay", "effort channels", {"delay": 0.02})
    every, one = named("time_delay", "effort channels"), named("time_delay", "joint_1")
    assert not judged(truth(late, delays_s=[0.021, 0.023]), every, one).wrong
    assert judged(truth(late, delays_s=[0.02, 0.02]), every, one).wrong
    assert judged(truth(late, delays_s=[0.021, 0.023]), every, one).first
