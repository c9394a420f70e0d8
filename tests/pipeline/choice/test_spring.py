"""A spring beside the actuators, and what is on the base: against closed forms and full chains."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import pipeline as lw
from actuators.errors import LegwattError
from actuators.loading.parts import load_parts
from pipeline.choice.evaluate import Account, Demand, Held, evaluate
from pipeline.choice.loads import loads_of, with_masses
from pipeline.choice.mission import Mode
from pipeline.choice.options import springs_of
from pipeline.choice.shelf import Shelf
from tests.pipeline.choice.brute import chain_of

STAND = Mode("stand", 6.0, True, None, {}, "motor", True, "standing")
WALK = Mode("walk", 6.0, False, None, {}, "motor", True, "walking")
DESIGN = ("maxon_148867", "maxon_gp_42_c_126", "mitsubishi_hc_mf_053b_13b")


@pytest.fixture(scope="module")
def shelf() -> Shelf:
    parts = load_parts()
    return Shelf.of({name: parts[name] for name in DESIGN})


def test_power_beside_a_spring_is_that_of_chains_that_hold_the_spring(shelf: Shelf) -> None:
    """The spring as an element of the chain, against demand that includes its torque."""
    machine = lw.load("urdf/hexapod.toml")
    joints = machine.robot.joints
    spring = springs_of(joints, ["*joint_2=3 N*m/rad@-20 deg", "l*_joint_3=2 N*m/rad@0.3 rad"])
    assert spring is not None
    bare = loads_of(machine, [STAND, WALK])
    shifted = loads_of(machine, [STAND, WALK], spring=spring)
    designs = shelf.designs([DESIGN])
    for before, after in zip(bare, shifted, strict=True):
        chain = chain_of(designs, 0, closed=False)
        held = replace(chain, elements=(replace(spring, name="beside"), *chain.elements))
        full = held.inverse(before.series)
        demand = Demand.of({"all": joints}, np.zeros(1), [after], (), 0.1).groups["all"][:1]
        held = Held(place=0.0)
        found = evaluate(demand, designs, Account(), np.zeros(1), held, detail=True)
        torque = found.torque[0][0]
        moving = before.series.direction != 0.0
        own = full.current * designs.torque_constant
        assert np.allclose(torque[moving], own[moving], atol=1e-9)
        if before.mode.stands:  # the brake is open: the motor holds
            assert np.allclose(torque, own, atol=1e-9)


def test_a_driver_adds_its_mass_and_one_without_has_the_range_of_its_class() -> None:
    parts = load_parts()
    motor = {DESIGN[0]: parts[DESIGN[0]]}
    stated, other = (Shelf.of(motor, parts[name]) for name in ("moteus_x1", "odrive_s1"))
    own = stated.designs([(DESIGN[0], "", "")]).mass - parts[DESIGN[0]].printed["mass"].value
    assert own == pytest.approx(0.0238)
    mass = other.numbers["odrive_s1"]["mass"]
    assert (mass.low, mass.high) == (0.0089, 0.0238)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("*_2=3 N*m/rad", "expected 'PATTERN=STIFFNESS@ANGLE'"),
        ("*_2=3 N*m@4 deg", "N\\*m"),
        ("*_2=-3 N*m/rad@4 deg", "above 0"),
        ("*_knee=3 N*m/rad@4 deg", "no joint '\\*_knee'"),
    ],
)
def test_springs_that_cannot_be_are_one_line(text: str, says: str) -> None:
    with pytest.raises(LegwattError, match=says) as caught:
        springs_of(["lf_1", "lf_2"], [text])
    assert "\n" not in str(caught.value)


def test_an_actuator_sits_on_the_link_before_its_joint_and_a_battery_on_the_base() -> None:
    machine = lw.load("urdf/solo12.toml")
    model, (hip, *_) = machine.robot.model, machine.robot.spec.legs[0].joints
    (own,) = loads_of(machine, [STAND], {model.names[1]: 0.7})
    (payload,) = loads_of(machine, [replace(STAND, changes={"gait.payload_mass": "0.7 kg"})])
    assert np.allclose(own.series.torque, payload.series.torque, atol=1e-9)
    heavier = with_masses(machine, {hip: 0.5}).robot.model.inertias
    more = [a.mass - b.mass for a, b in zip(heavier, model.inertias, strict=True)]
    assert np.flatnonzero(more).tolist() == [model.parents[model.getJointId(hip)]]
