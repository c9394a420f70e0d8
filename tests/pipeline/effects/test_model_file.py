"""Model files: what naming finds is read back as the machine that was found, or refused."""

import dataclasses
import itertools
import re
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from actuators.errors import LegwattError
from actuators.shaft import ShaftSeries
from pipeline.effects.base import COMPETING, EFFECTS, Place
from pipeline.effects.drivetrain import BareCoupling
from pipeline.effects.model_file import (
    Edit,
    ModelFile,
    apply_edits,
    model_text,
    new_model_file,
    read_model_file,
)
from pipeline.machine.machine import MachineModel
from tests.command_line import base_model, edit_of

#: Places of the leg, by kind.
PLACES: Mapping[str, Place] = {
    "joint": ("rm_joint_2",),
    "joint pair": ("rm_joint_2", "rm_joint_3"),
    "link": ("rm_femur_link",),
    "ground": ("ground",),
    "effort channels": ("effort channels",),
    "effort column": ("rm_joint_2__current_A",),
}
#: Nonlinear parameters, which `shapes` would take from a log.
SHAPES: Mapping[str, Mapping[str, float]] = {
    "stribeck_friction": {"velocity": 0.05},
    "backlash": {"crossing": 0.7},
    "torque_ripple": {"order": 100.0},
    "winding_heating": {"time_constant": 4.0},
    "warming_friction": {"reference": 300.0},
    "transmission_coupling": {"ratio": -1.0},
    "link_mass": {"x": 0.1, "y": -0.02, "z": 0.3},
}
NUMBER = re.compile(r"(?<!\w)(-?\d+\.?\d*(?:e[-+]?\d+)?)")


@pytest.fixture
def leg(root: Path) -> ModelFile:
    return new_model_file(root / "urdf" / "leg.toml", "rotor")


def written(folder: Path, file: ModelFile, *edits: Edit) -> Path:
    path = folder / "model.toml"
    path.write_text(model_text(file.with_edits(edits), folder), encoding="utf-8")
    return path


def same(one: MachineModel, other: MachineModel) -> bool:
    """Whether two machines are made of the same parts with the same numbers."""
    with np.printoptions(precision=17, threshold=sys.maxsize):
        texts = [NUMBER.split(repr((m.bodies, m.actuators))) for m in (one, other)]
    words, numbers = ([x[k::2] for x in texts] for k in (0, 1))
    return words[0] == words[1] and np.allclose(*np.array(numbers, dtype=float), rtol=1e-9, atol=0)


@pytest.mark.parametrize(("size", "channel"), [(7.0, "current"), (-7.0, "voltage")])
@pytest.mark.parametrize("effect", COMPETING, ids=lambda effect: effect.name)
def test_what_is_found_is_read_back_as_the_same_machine(tmp_path, root, effect, channel, size):
    bare = isinstance(effect, BareCoupling)
    geared = effect.name == "gear_loss_factor"  # of which a rotor alone has none
    alternative = "" if bare else "reversible" if geared else "rotor"
    file = new_model_file(root / "urdf" / "leg.toml", alternative)
    base, shape = base_model(file), dict(SHAPES.get(effect.name, {}))
    x = {
        c.name: (1.0 if c.signed or size > 0 else -1.0) * size * (k + 1) * c.step
        for k, c in enumerate(effect.coordinates)
    }
    shape = {n: v for n, v in shape.items() if n not in x}
    before = base.actuators
    place = PLACES[effect.place_kind]
    found = effect.edit(base, place, x, shape)
    assert not same(found, base)
    assert base.actuators is before
    edit = edit_of(effect.name, *place, unit=channel, **effect.physical(x, shape))
    path = written(tmp_path, file, edit)
    back = read_model_file(path)
    assert (back.edits, back.alternative, back.changed) == ((edit,), file.alternative, ())
    assert same(apply_edits(base_model(back), back.edits), found)
    # Written once more it is the same file: a model that is added to keeps what it had.
    assert model_text(back, tmp_path) == path.read_text(encoding="utf-8")


def test_friction_of_a_joint_is_the_same_in_whatever_order_it_was_found(leg):
    """Friction by the load is a share of the joint's torque, and not of other friction."""
    values = {
        "coulomb_friction": {"torque": 0.4},
        "load_dependent_friction": {"share": 0.2},
        "viscous_friction": {"coefficient": 0.3},
    }
    edits = [edit_of(name, "rm_joint_2", **own) for name, own in values.items()]
    still, v = np.zeros((2, 1)), np.full((2, 1), 2.0)
    joint = ShaftSeries.at_joint(["rm_joint_2"], [0.0, 0.1], 0.1 * v, v, still, 2.5 * v)
    for order in itertools.permutations(edits):
        side, chain = joint, apply_edits(base_model(leg), order).actuator("rm_joint_2")
        for law in chain.elements[: len(edits)]:
            side = dataclasses.replace(side, torque=side.torque + law.added(side))
        assert side.torque == pytest.approx(5.0 + 0.4 + 0.2 * 5.0 + 0.3 * 2.0, rel=1e-12)


@pytest.mark.parametrize(
    ("velocity", "excess", "plausible"),
    [(0.1, 0.2, True), (0.09, 0.2, False), (0.1, 0.31, False), (0.6, 0.2, False)],
)
def test_a_break_away_beyond_the_reversal_is_stribeck_friction(leg, velocity, excess, plausible):
    """Dry friction that has changed its sense to 95 %, erf(2 / sqrt 2), at .1 rad/s."""
    x, shape = {"coulomb": 0.1, "excess": excess}, {"velocity": velocity, "rise": 0.049}
    said = EFFECTS["stribeck_friction"].plausible(base_model(leg), ("rm_joint_2",), x, shape)
    assert said == plausible


@pytest.mark.parametrize("end", ["low", "high"])
def test_estimates_at_their_bounds_are_read_back(tmp_path, leg, end):
    """Whatever is plausible lies in the reader's bounds, the bounds themselves among it."""
    edits = [
        edit_of(e.name, *PLACES[e.place_kind], **{p.name: getattr(p, end) for p in e.parameters})
        for e in EFFECTS.values()
    ]
    assert list(read_model_file(written(tmp_path, leg, *edits)).edits) == edits


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("coulomb_friction", "coulomb_fricton", "did you mean 'coulomb_friction'"),
        ('unit = "N*m"', 'unit = "mm"', "expected 'N*m'"),
        ("value = 0.4", "value = 9.0", "outside its interval"),
        ("value = 0.4", "value = nan", "finite"),
        ("schema = 1", "schema = 2", "'schema': 2: known: 1"),
        ("parameters.torque", "parameters.torqe", "did you mean 'torque'"),
        ('level = "confirmed"', 'level = "doubtful"', "'edit.1.level': 'doubtful'"),
        ("rm_joint_2", "rm_join_2", "did you mean 'rm_joint_2'"),
        ("value = 0.4", "value = -0.4\ninterval = [-1, 1] #", "-0.4 lies outside 0"),
        ("parameters.torque", "parameters.rise", "needs the parameter 'torque'"),
    ],
)
def test_errors_are_one_clear_line(tmp_path, leg, old, new, said):
    edit = edit_of("coulomb_friction", "rm_joint_2", torque=0.4)
    text = (path := written(tmp_path, leg, edit)).read_text(encoding="utf-8")
    assert old in text
    if "interval" in new:
        text = "".join(x for x in text.splitlines(True) if "interval" not in x)
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(LegwattError) as error:
        apply_edits(base_model(leg), read_model_file(path).edits)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_what_may_be_left_out_is_and_changed_sources_are_told(tmp_path, leg):
    edit = edit_of("winding_heating", "rm_joint_2", rise=3.0, time_constant=4.0)
    path = written(tmp_path, leg, edit)
    assert read_model_file(path).edits == (edit,)
    text = path.read_text(encoding="utf-8").replace(leg.named.sha256, "0" * 64)
    path.write_text(text, encoding="utf-8")
    assert "other SHA-256" in read_model_file(path).changed[0]
    path.write_text(text.replace('file = "', 'file = "nowhere/'), encoding="utf-8")
    with pytest.raises(LegwattError, match=r"robot.file 'nowhere/.* is not there; name the robot"):
        read_model_file(path)
    assert read_model_file(path, robot=leg.robot).edits == (edit,)
