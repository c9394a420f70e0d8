"""Rates, classes and scores of blind trials on made-up answers."""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from pathlib import Path

import pytest
from scipy.stats import norm

from pipeline.blind.answer import Answer, Named
from pipeline.blind.identifiable import THRESHOLD, Identifiability, Rival
from pipeline.blind.rates import Rate, wilson
from pipeline.blind.score import score
from pipeline.blind.summary import by_effect, rates, read_rows
from pipeline.blind.truth import HiddenTruth

JOINT = ("rm_joint_2",)


def hidden(effect: str, place: tuple[str, ...] = JOINT, **values: float) -> HiddenTruth:
    return HiddenTruth(effect, place, values, values, in_catalogue=True, strength=10.0)


def named(
    effect: str,
    place: tuple[str, ...] = JOINT,
    rivals: str = "",
    doubt: str = "",
    gap: tuple[float, float, float] = (1.0, 0.1, 0.1),
    **intervals: tuple[float, float, float],
) -> Named:
    return Named(effect, place, rivals, doubt, intervals, *gap)


def answer(*names: Named, code: int = 0) -> Answer:
    return Answer(code, 1.0, names)


def clear(*rivals: Rival) -> Identifiability:
    return Identifiability(50.0, rivals)


@pytest.mark.parametrize(
    ("hits", "trials", "low", "high"),
    # Newcombe, Statistics in Medicine 17, 1998, Table I, method 3.
    [
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_wilson_against_published_intervals(
    hits: int, trials: int, low: float, high: float
) -> None:
    assert wilson(hits, trials) == pytest.approx((low, high), abs=5e-5)


def test_wilson_at_the_ends() -> None:
    assert wilson(0, 0) == (0.0, 1.0)
    assert wilson(7, 7)[1] == 1.0
    assert wilson(0, 7)[0] == 0.0
    assert Rate("r", "m", 0, 0, (0.95, 1.0)).reached is False


@pytest.mark.parametrize(
    ("hits", "trials", "aim", "words"),
    [
        (6, 6, (0.9, 0.99), "above it by no more than chance, which is no miss"),
        (600, 600, (0.9, 0.99), "missed"),
        (1, 2, (0.9, 0.99), "missed, though a share inside it is not excluded by 2 trials"),
        (95, 100, (0.9, 0.99), "reached"),
        (1, 91, (0.0, 0.01), "missed, though a share inside it is not excluded by 91 trials"),
        (3, 3, (0.98, 1.0), "reached"),
    ],
)
def test_a_verdict_does_not_contradict_its_figure(
    hits: int, trials: int, aim: tuple[float, float], words: str
) -> None:
    rate = Rate("r", "what is counted", hits, trials, aim)
    said = str(rate)
    assert said.startswith(f"r (what is counted): {hits} of {trials} = {hits / trials:.1%}, ")
    assert said.endswith(f"%: {words}")
    assert rate.reached == ("missed" not in words)


def test_right_name_and_place() -> None:
    truth = hidden("coulomb_friction", torque=1.0)
    s = score(0, [truth], [clear()], answer(named("coulomb_friction", torque=(1.1, 0.9, 1.2))))
    assert (s.outcome, s.wrong, s.intervals, s.covered) == ("right", (), 1, 1)
    assert s.alone


def test_an_interval_beside_the_truth_does_not_cover() -> None:
    truth = hidden("coulomb_friction", torque=2.0)
    s = score(0, [truth], [clear()], answer(named("coulomb_friction", torque=(1.1, 0.9, 1.2))))
    assert (s.intervals, s.covered) == (1, 0)


def test_right_name_at_another_joint_is_wrong() -> None:
    s = score(
        0,
        [hidden("coulomb_friction")],
        [clear()],
        answer(named("coulomb_friction", ("rm_joint_1",))),
    )
    assert s.outcome == "wrong place"
    assert s.wrong == (("coulomb_friction", ("rm_joint_1",)),)


def test_a_member_of_the_class_is_right_and_a_far_rival_is_not() -> None:
    judged = clear(Rival("viscous_friction", JOINT, 5.9), Rival("parallel_spring", JOINT, 6.1))
    assert not judged.alone
    truth = [hidden("coulomb_friction")]
    assert score(0, truth, [judged], answer(named("viscous_friction"))).outcome == "right"
    assert score(0, truth, [judged], answer(named("parallel_spring"))).outcome == "wrong name"


def test_what_hardly_shows_has_no_class_of_everything() -> None:
    judged = Identifiability(5.0, (Rival("viscous_friction", JOINT, 4.8),))
    assert not judged.visible
    s = score(0, [hidden("coulomb_friction")], [judged], answer(named("viscous_friction")))
    assert s.wrong


def test_a_name_that_offers_the_truth_beside_it_is_no_confident_wrong_name() -> None:
    said = named("parallel_spring", rivals="coulomb_friction at rm_joint_2")
    s = score(0, [hidden("coulomb_friction")], [clear()], answer(said))
    assert s.outcome == "right"
    assert not s.wrong


def test_halves_of_a_directional_friction_name_it_only_together() -> None:
    truth = [hidden("direction_dependent_friction")]
    both = answer(named("effort_offset"), named("coulomb_friction"))
    assert not score(0, truth, [clear()], both).wrong
    assert score(0, truth, [clear()], answer(named("effort_offset"))).wrong


def test_empty_log() -> None:
    assert score(0, [], [], answer()).outcome == "nothing"
    assert score(0, [], [], answer(code=1)).outcome == "unexplained"
    assert score(0, [], [], answer(code=2)).outcome == "failed"
    assert score(0, [], [], answer(named("backlash"))).wrong == (("backlash", JOINT),)


def test_both_of_a_pair() -> None:
    truths = [hidden("coulomb_friction"), hidden("backlash", ("rm_joint_3",))]
    names = answer(named("backlash", ("rm_joint_3",)), named("coulomb_friction"))
    s = score(0, truths, [clear(), clear()], names)
    assert len(s.right) == 2
    assert s.outcome == "right"


def test_gap_closed_above_the_floor_in_squares() -> None:
    s = score(0, [], [], answer(named("backlash", gap=(1.0, 0.5, 0.0))))
    assert s.closed == pytest.approx(0.75)
    twice = answer(
        named("coulomb_friction", gap=(1.0, 0.5, 0.0)), named("backlash", gap=(0.5, 0.0, 0.0))
    )
    assert score(0, [], [], twice).closed == pytest.approx(1.0)
    assert math.isnan(score(0, [], [], answer()).closed)


def test_identifiable_means_neither_chance_nor_noise_hides_the_truth() -> None:
    """Beyond what the best of 400 candidates reaches by chance in 1 of 100 logs (two-sided), by as
    much as lets the truth be seen in 95 of 100; and hardly more, or rivals would be excuses.
    """
    needed = norm.isf(0.01 / 400 / 2) + norm.isf(0.05)
    assert needed <= THRESHOLD <= needed + 0.5
    near, far = (Rival("x", (), z) for z in (needed - 0.2, needed + 0.7))
    assert Identifiability(50.0, (near, far)).like == (near,)


def test_a_right_name_that_is_left_out_of_the_file_is_right_and_not_written() -> None:
    truth = [hidden("coulomb_friction", torque=1.0)]
    doubted = replace(named("coulomb_friction", doubt="its law is not"), written=False)
    s = score(0, truth, [clear()], answer(doubted, code=1))
    assert (s.outcome, s.right_and_written, s.written) == ("right", False, ())
    assert s.right == (("coulomb_friction", JOINT),)
    s = score(0, truth, [clear()], answer(named("coulomb_friction")))
    assert s.right_and_written
    assert s.written == s.right


def test_doubted_names_that_are_not_right_are_as_good_as_none() -> None:
    truth = [hidden("coulomb_friction")]
    for code, outcome in ((0, "nothing"), (1, "unexplained")):
        said = answer(named("backlash", doubt="its law is not"), code=code)
        assert score(0, truth, [clear()], said).outcome == outcome


EXAMPLE = Path(__file__).parents[3] / "reports" / "example"


def test_stored_rates_follow_from_the_stored_trials_alone() -> None:
    rows = read_rows(EXAMPLE / "blind_trials.csv")
    with (EXAMPLE / "blind_rates.csv").open(encoding="utf-8", newline="") as file:
        stored = {r["rate"]: (int(r["hits"]), int(r["trials"])) for r in csv.DictReader(file)}
    assert {r.name: (r.hits, r.trials) for r in rates(rows)} == stored
    with (EXAMPLE / "blind_by_effect.csv").open(encoding="utf-8", newline="") as file:
        effects = [dict(r) for r in csv.DictReader(file)]
    anew = [
        {k: str(v).lower() if k == "in_catalogue" else str(v) for k, v in r.items()}
        for r in by_effect(rows)
    ]
    assert anew == effects
    alone = [r for r in effects if r["in_catalogue"] == "true"]
    for key, rate in (("visible", "right_and_written"), ("trials", "right_and_written_of_all")):
        assert stored[rate] == (sum(int(r[rate]) for r in alone), sum(int(r[key]) for r in alone))


def test_wrong_names_count_where_the_catalogue_has_no_name_too() -> None:
    row = {"hidden": "cable_loom", "in_catalogue": False, "visible": True, "tellable": True}
    row |= {"exit_code": 0, "named": "parallel_spring", "wrong_names": "parallel_spring at a"}
    row |= {"outcome": "wrong name", "right_and_written": False, "right_names": ""}
    row |= {"written_names": "", "intervals": 0, "intervals_that_cover": 0, "gap_closed": None}
    found = {r.name: r for r in rates([row])}
    assert (found["wrong_name"].hits, found["wrong_name"].trials) == (1, 1)
    assert found["wrong_name_of_known"].trials == 0
    assert found["right_and_written"].trials == 0


def test_a_law_that_is_the_sum_of_named_terms_names_each_of_them() -> None:
    law = replace(named("joint_friction"), amounts_to=("coulomb_friction", "viscous_friction"))
    for effect, outcome in (("coulomb_friction", "right"), ("rotor_inertia", "wrong name")):
        one = score(1, [hidden(effect)], [clear()], answer(law))
        assert one.outcome == outcome
        assert bool(one.wrong) == (outcome != "right")
