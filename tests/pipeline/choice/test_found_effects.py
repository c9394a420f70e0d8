"""What a model file says of the robot is drawn from its intervals."""

from __future__ import annotations

import numpy as np
import pytest

import pipeline as lw
from actuators.loading.parts import load_parts
from pipeline.choice.doubt import doubt, drawn, drawn_machines
from pipeline.choice.loads import loads_of
from pipeline.choice.missions.mission import Mode
from pipeline.choice.parts.shelf import Shelf
from pipeline.choice.search import Demanded, Feedback
from pipeline.choice.track import Account
from pipeline.simulation.machine import Machine

STAND = Mode("stand", 6.0, True, None, {}, "motor", True, "standing")
DESIGNS = [("maxon_607930", "maxon_gp_62_a_100", ""), ("maxon_353297", "hd_csg_25_100", "")]


@pytest.fixture(scope="module")
def machine() -> Machine:
    """A payload on the base with an interval, and friction of a drive with one."""
    out = lw.load("urdf/hexapod.toml").with_effect("link_mass", "base_link", {"mass": 3.0})
    out = out.with_effect("coulomb_friction", "lf_joint_2", {"torque": 0.2})
    file = out.model_file
    assert file is not None
    edits = []
    for edit in file.edits:
        (one, *rest) = edit.parameters
        own = one.model_copy(update={"interval": (0.5 * one.value, 1.5 * one.value)})
        edits.append(edit.model_copy(update={"parameters": (own, *rest)}))
    return out.with_model(file.model_copy(update={"edits": tuple(edits)}))


def test_power_in_a_draw_is_that_of_the_robot_with_the_drawn_value(machine: Machine) -> None:
    parts = load_parts()
    shelf = Shelf.of({name: parts[name] for design in DESIGNS for name in design if name})
    effects, own = drawn_machines(machine)
    assert [(part, entry) for part, entry, _ in effects] == [("link_mass of base_link", "mass")]
    assert (effects[0][2].low, effects[0][2].high) == (1.5, 4.5)
    joints = [j for j in machine.robot.joints if j.endswith("_2")]

    def asked(one: Machine) -> Demanded:
        return Demanded.of("2", joints, loads_of(one, [STAND]))

    days = [(x, asked(m)) for x, m in own]
    sheets = drawn(shelf, DESIGNS, 64)
    whole = (asked(machine), shelf, DESIGNS, Account(), Feedback(), sheets)
    found = doubt(*whole, effects=effects, found=days)
    names = [(part, entry) for part, entry, _ in found.unknowns]
    k = names.index(("link_mass of base_link", "mass"))
    for s in (0, 5, 37):
        bare = lw.load("urdf/hexapod.toml")
        again = bare.with_effect("link_mass", "base_link", {"mass": found.values[s, k]})
        sheet = dict(zip(names, found.values[s].tolist(), strict=True))
        power = asked(again).power(shelf.designs(DESIGNS, sheet), Account())
        assert np.allclose(found.power[s], power, rtol=1e-9)
    assert found.moves()[k] > 0.0
    assert drawn_machines(lw.load("urdf/hexapod.toml")) == ((), [])
