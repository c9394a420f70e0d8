"""The judge: what is right, what is wrong, what asks for the class; rates and their intervals."""

import math
from typing import Any

import pytest

from pipeline.blind.answer import Answer, Name, read_answer
from pipeline.blind.rates import RateRow, blind_rows, name_rows, wilson
from pipeline.blind.score import score


def truth(*hidden: dict[str, Any], **changed: Any) -> dict[str, Any]:
    base = {
        "source": "own",
        "seed": 1,
        "trial": 0,
        "kind": "single" if hidden else "empty",
        "machine": "leg",
        "joints": ["joint_1", "joint_2", "joint_3"],
        "off": 0.0,
        "background": [],
        "motions": ["sines", "rests"],
        "rate_Hz": 500.0,
        "bits": 16,
        "sides": "joint",
        "hidden": list(hidden),
        "friction": {},
        "rotors": [],
    }
    return base | changed


def hidden(effect: str, place: str, joint: int = 0, **values: Any) -> dict[str, Any]:
    alike = values.pop("alike", [])
    return {
        "effect": effect,
        "place": [place],
        "joint": joint,
        "values": values,
        "in_catalogue": True,
        "z": 50.0,
        "visible": True,
        "alike": alike,
    }


def name(effect: str, *place: str, rivals: tuple[str, ...] = (), **values: float) -> Name:
    return Name(
        effect, place, "confirmed", {k: (v, v - 0.1, v + 0.1) for k, v in values.items()}, rivals
    )


def verdicts(known: dict[str, Any], *names: Name) -> tuple[list[str], tuple[bool, ...]]:
    s = score(known, Answer(0, 1.0, names))
    return [v.verdict for v in s.names], s.found


COULOMB = truth(
    hidden("coulomb_friction", "joint_1", torque=0.5), friction={"joint_1": ["coulomb"]}
)
SCALE = truth(
    hidden("effort_gain", "joint_1__torque_Nm", gain=1.2), machine="pendulum", joints=["joint_1"]
)
ALIKE = truth(hidden("base_tilt", "ground", alike=["position_offset"], roll=0.1, pitch=0.1))
UNEVEN = truth(
    hidden("direction_dependent_friction", "joint_1", positive=1.0, negative=0.5),
    friction={"joint_1": ["coulomb", "asymmetry"]},
)
LOAD = truth(
    hidden("load_dependent_friction", "joint_1", share=0.2, driving=0.25, driven=0.167),
    friction={"joint_1": ["driving", "driven"]},
)


@pytest.mark.parametrize(
    ("known", "names", "expected", "found"),
    [
        (COULOMB, [name("coulomb_friction", "joint_1", torque=0.5)], ["right"], True),
        (COULOMB, [name("joint_friction", "joint_1", coulomb=0.5, rise=0.01)], ["right"], True),
        (COULOMB, [name("coulomb_friction", "joint_2", torque=0.5)], ["wrong"], False),
        (
            COULOMB,
            [name("joint_friction", "joint_1", coulomb=0.5, viscous=0.1)],
            ["wrong"],
            False,
        ),
        (COULOMB, [name("friction_curve", "joint_1", level_1=0.5)], ["flexible"], False),
        (COULOMB, [name("friction_curve", "joint_2", level_1=0.5)], ["wrong"], False),
        (truth(), [name("rigid_body_parameters", "link_1", mass=1.0)], ["wrong"], None),
        (truth(off=0.03), [name("rigid_body_parameters", "link_1", mass=1.0)], ["right"], None),
        (truth(rotors=["joint_1"]), [name("rotor_inertia", "joint_1", added=1.0)], ["right"], None),
        (truth(), [name("rotor_inertia", "joint_1", added=1.0)], ["wrong"], None),
        (UNEVEN, [name("direction_dependent_friction", "joint_1", positive=1.0)], ["right"], True),
        (
            UNEVEN,
            [
                name("coulomb_friction", "joint_1", torque=0.75),
                name("effort_offset", "joint_1", offset=0.25),
            ],
            ["right", "right"],
            True,
        ),
        (UNEVEN, [name("coulomb_friction", "joint_1", torque=0.75)], ["right"], False),
        (LOAD, [name("backdrive_loss", "joint_1", driving=0.25, driven=0.17)], ["right"], True),
        (SCALE, [name("effort_gain", "joint_1__torque_Nm", gain=1.2)], ["wrong"], False),
        (SCALE, [name("link_mass", "link_1", mass=1.2)], ["wrong"], False),
        (SCALE, [name("link_mass", "link_1", rivals=("effort_gain",), mass=1.0)], ["class"], True),
        (ALIKE, [name("position_offset", "joint_1", angle=0.1)], ["wrong"], False),
        (
            ALIKE,
            [name("position_offset", "joint_1", rivals=("base_tilt",), angle=0.1)],
            ["class"],
            True,
        ),
    ],
)
def test_names_are_judged_straight(
    known: dict[str, Any], names: list[Name], expected: list[str], found: bool | None
) -> None:
    got, seen = verdicts(known, *names)
    assert got == expected
    assert seen == (() if found is None else (found,))


def test_an_interval_covers_what_it_holds_and_one_of_no_width_nothing() -> None:
    wide = name("coulomb_friction", "joint_1", torque=0.45)
    thin = Name("coulomb_friction", ("joint_1",), "confirmed", {"torque": (0.4, 0.4, 0.4)})
    for one, covered in ((wide, 1), (thin, 0)):
        (v,) = score(COULOMB, Answer(0, 1.0, (one,))).names
        assert (v.intervals, v.covered) == (1, covered)
    # Load friction per torque of the motor lies between its shares of the load.
    law = name("joint_friction", "joint_1", driving=0.3, driven=0.1)
    assert score(LOAD, Answer(0, 1.0, (law,))).names[0].covered == 2


def test_a_payload_is_told_in_kilograms() -> None:
    known = truth(hidden("link_mass", "link_3", 2, mass=2.0))
    s = score(known, Answer(0, 1.0, (name("link_mass", "link_3", mass=2.05),)))
    (row,) = name_rows(s)
    assert row.mass_ratio == pytest.approx(1.025)
    assert row.mass_inside


def test_model_file_and_classes_are_read() -> None:
    model = """
schema = 1
[[edit]]
effect = "effort_gain"
place = ["joint_1__torque_Nm"]
level = "approximate"
[edit.parameters.gain]
value = 1.2
unit = "1"
interval = [1.1, 1.3]
"""
    candidates = (
        "effect,joint,place,verdict\n"
        "effort_gain,joint_1,joint_1__torque_Nm,accepted\n"
        "link_mass,joint_1,link_1,indistinguishable from effort_gain at joint_1__torque_Nm\n"
    )
    run = {"code": 0, "seconds": 1.0, "message": ""}
    (named,) = read_answer({"model.toml": model, "candidates.csv": candidates}, run).names
    assert named.rivals == ("link_mass",)
    assert named.values == {"gain": (1.2, 1.1, 1.3)}
    assert read_answer({}, {**run, "code": 2}).names == ()
    # Where nothing is found there is no model file, and an answer all the same.
    assert read_answer({"candidates.csv": candidates}, run).given


def test_rates_count_what_they_say() -> None:
    right = score(COULOMB, Answer(0, 1.0, (name("coulomb_friction", "joint_1", torque=0.5),)))
    wrong = score(COULOMB, Answer(1, 1.0, (name("viscous_friction", "joint_2", coefficient=1.0),)))
    silent, loud = score(truth(), Answer(0, 1.0, ())), score(truth(), Answer(1, 1.0, ()))
    outside = truth(hidden("detents", "joint_1"), kind="outside", source="mujoco")
    missed = score(outside, Answer(0, 1.0, (name("torque_ripple", "joint_1", amplitude=1.0),)))
    every = [right, wrong, silent, loud, missed]
    rates = {(r.source, r.rate): (r.hits, r.count) for r in blind_rows(every)[RateRow]}
    assert rates["own", "single_right"] == (1, 2)
    assert rates["own", "wrong_confirmed"] == (1, 4)
    assert rates["own", "empty_silent_and_explained"] == (1, 2)
    assert rates["mujoco", "outside_not_confirmed"] == (0, 1)
    assert rates["mujoco", "outside_unexplained"] == (0, 1)
    assert rates["all", "wrong_names"] == (2, 3)
    assert rates["all", "confirmed_right"] == (1, 3)
    assert rates["all", "intervals_cover"] == (1, 1)


def test_wilson_is_the_published_interval() -> None:
    # Newcombe, Statistics in Medicine 17 (1998), Table I, method 3: 81 of 263, 15 of 148, 0 of 20.
    for hits, count, low, high in ((81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605)):
        assert wilson(hits, count) == pytest.approx((low, high), abs=5e-5)
    assert wilson(0, 20) == pytest.approx((0.0, 0.1611), abs=5e-5)
    assert math.isclose(wilson(0, 0)[1], 1.0)
