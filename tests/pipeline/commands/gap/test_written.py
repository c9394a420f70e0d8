"""What is quoted is the gap of the model file as written, on rows that had no say."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import pytest

from pipeline.effects.base import effect_named
from pipeline.effects.model_file import Edit, edits_in, model_text, new_model_file
from pipeline.identification.answer import identify
from pipeline.identification.results import (
    APPROXIMATE,
    CONFIRMED,
    SUSPECTED,
    Estimate,
    Found,
)
from pipeline.identification.workflow.written import Validated, edits_of, validate_found
from tests.pipeline.identification import bench_leg as leg

JOINT = "rm_joint_1"
FRICTION = 0.5  # [N*m]
VISCOUS = {"coefficient": 0.8}  # [N*m*s/rad]


def found(effect: str, parameter: str, value: float, unit: str, level: str = CONFIRMED) -> Found:
    return Found(
        order=1,
        effect=effect,
        place=(JOINT,),
        parameters=(Estimate(parameter, value, value, value, unit),),
        rivals=(),
        valid_before=1.0,
        valid_after=0.1,
        unit="A",
        noise_floor=0.004,
        level=level,
        reason="" if level == CONFIRMED else "its law is not the machine's",
    )


@pytest.fixture(scope="module")
def where() -> Any:
    truth = effect_named("coulomb_friction").apply(leg.leg_model(), (JOINT,), {"torque": FRICTION})
    log = leg.measured(truth, leg.leg_motion())
    return SimpleNamespace(logs=(log,))


def validated(where: Any, *names: Found) -> Validated:
    def written(
        among: Sequence[Found], tables: Sequence[Edit]
    ) -> tuple[Sequence[Found], str, list[Edit]]:
        edits = (*edits_of(among, "log"), *tables)
        robot = new_model_file(leg.ROOT / "urdf" / "leg.toml", "rotor")
        text = model_text(robot.with_edits(edits), leg.ROOT)
        return among, text, list(edits_in(text))

    return validate_found(leg.leg_model(), where, names, written)


RIGHT = found("coulomb_friction", "torque", FRICTION, "N*m")
NEAR = found("coulomb_friction", "torque", FRICTION, "N*m", APPROXIMATE)
SUSPECT = found("coulomb_friction", "torque", FRICTION, "N*m", SUSPECTED)


def test_a_written_effect_explains_the_log(where: Any) -> None:
    result = validated(where, RIGHT)
    assert not result.unexplained
    assert result.found[0].written
    assert result.found[0].gap_after < 1.2 * result.found[0].noise_floor
    assert 'effect = "coulomb_friction"' in result.text


def test_a_suspected_name_is_left_out_and_so_is_what_it_would_close(where: Any) -> None:
    result = validated(where, SUSPECT)
    assert result.unexplained
    (one,) = result.found
    assert not one.written
    # Listed with what it would close beside the file ...
    assert one.gap_after < 0.2 * one.gap_before
    # ... which is not in the number that is quoted.
    assert len(result.stages) == 1  # the machine as it was


def test_an_approximate_name_is_written_and_counts(where: Any) -> None:
    result = validated(where, NEAR)
    assert not result.unexplained
    assert result.found[0].written
    assert 'level = "approximate"' in result.text


def test_a_wrong_value_in_the_file_is_not_called_explained(where: Any) -> None:
    # What naming thought of it does not matter: the file is simulated.
    assert validated(where, found("coulomb_friction", "torque", 0.2, "N*m")).unexplained


def test_a_name_with_which_the_simulation_is_worse_is_suspected(where: Any) -> None:
    result = validated(where, found("viscous_friction", "coefficient", 9.0, "N*m*s/rad"))
    (one,) = result.found
    assert one.level == SUSPECTED
    assert "validation" in one.reason
    assert not one.written
    assert "viscous_friction" not in result.text


def test_what_is_written_is_estimated_without_what_is_left_out() -> None:
    truth = leg.leg_model()
    for effect, values in (("coulomb_friction", {"torque": 0.5}), ("viscous_friction", VISCOUS)):
        truth = effect_named(effect).apply(truth, (JOINT,), values)
    both = leg.measured(truth, leg.leg_motion(duration=8.0))
    named = identify(leg.leg_model(), [both])
    assert {f.effect for f in named.naming.found} == {"coulomb_friction", "viscous_friction"}
    (dry,) = [f for f in named.naming.found if f.effect == "coulomb_friction"]
    (alone,) = named.alone([dry])
    # Without the viscous part dry friction has to carry it.
    assert alone.values["torque"] > dry.parameters[0].high
    assert named.alone(named.naming.found) == named.naming.found
