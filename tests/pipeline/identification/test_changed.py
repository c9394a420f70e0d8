"""What has changed since a model file was written: a thing mounted, friction, or nothing."""

import numpy as np
import pytest

from actuators.loading.build import load_catalog
from pipeline.effects.base import EFFECTS, effect_named
from pipeline.effects.model_file import Edit, apply_edits
from pipeline.identification.answer import identify
from pipeline.identification.workflow.changed import changes
from pipeline.identification.workflow.written import edits_of
from pipeline.machine.machine import MachineModel, drivetrains_of
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import load_robot_file
from tests.pipeline.identification import bench_leg as leg

TIBIA, SHARE = "rm_tibia_link", 0.02


def edit(effect: str, place: str, values: dict[str, float]) -> Edit:
    """As a first log would have shown it, known to two per cent."""
    units = {p.name: p.unit for p in EFFECTS[effect].parameters}
    rows = {
        name: {
            "value": x,
            "unit": units[name],
            "interval": (x - SHARE * abs(x) - 1e-6, x + SHARE * abs(x) + 1e-6),
        }
        for name, x in values.items()
    }
    return Edit.model_validate({"effect": effect, "place": (place,), "parameters": rows})


@pytest.fixture(scope="module")
def first_day() -> tuple[MachineModel, tuple[Edit, ...]]:
    """A leg whose friction and shin a first log has shown."""
    bare = leg.leg_model()
    friction = [edit("coulomb_friction", j, {"torque": 0.5}) for j in bare.joints]
    friction += [edit("viscous_friction", j, {"coefficient": 0.5}) for j in bare.joints]
    body = bare.rigid.inertias[bare.rigid.getJointId(bare.carrier(TIBIA))]
    names = [p.name for p in EFFECTS["rigid_body_parameters"].parameters]
    ten = dict(zip(names, body.toDynamicParameters().tolist(), strict=True))
    edits = (*friction, edit("rigid_body_parameters", TIBIA, ten))
    return apply_edits(bare, edits), edits


def test_a_log_tells_how_well_bodies_and_friction_are_known(first_day) -> None:  # type: ignore[no-untyped-def]
    known = first_day[0].known
    assert set(known) == {*first_day[0].joints, TIBIA}
    assert max(known[j] for j in first_day[0].joints) == pytest.approx(SHARE / 1.96, rel=1e-3)
    assert 0.2 * SHARE < known[TIBIA] < 2.0 * SHARE


def test_what_is_mounted_and_friction_that_rose_are_told_as_that(first_day) -> None:  # type: ignore[no-untyped-def]
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


def test_a_gear_of_another_efficiency_than_assumed_is_told() -> None:
    """Its friction by the load alone, at all joints: the rest of what the files state stays."""
    robot = load_robot(load_robot_file(leg.ROOT / "urdf" / "leg.toml"))
    model = MachineModel(robot, drivetrains_of(load_catalog().chain("reversible"), robot.joints))
    truth = effect_named("gear_loss_factor").apply(model, ("*",), {"factor": 0.2})
    found = identify(model, [leg.measured(truth, leg.leg_motion(duration=8.0))]).found
    first = found[0]
    assert ("gear_loss_factor", ("*",)) in {(first.effect, first.place), *first.rivals}
    assert first.values["factor"] == pytest.approx(0.2, abs=0.05)


def test_nothing_has_changed_where_nothing_has(first_day) -> None:  # type: ignore[no-untyped-def]
    model, _ = first_day
    log = leg.measured(model, leg.leg_motion(3, 8.0), seed=7)
    assert identify(model, [log]).found == ()
