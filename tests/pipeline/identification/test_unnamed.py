"""What has no name is a table in the model file that predicts, and is absent in a clean log."""

from dataclasses import replace

import numpy as np
import pytest

from actuators.chain import Chain
from actuators.elements.position_torque import TorqueTable, played
from actuators.errors import LegwattError
from pipeline.effects.base import EFFECTS
from pipeline.effects.model_file import apply_edits
from pipeline.identification.design import Term, make_data_sets, make_design
from pipeline.identification.fit import settled, start_fit
from pipeline.identification.general import unnamed
from pipeline.identification.offered import block_terms
from pipeline.identification.search import near
from pipeline.identification.tolerances import BodyStrain
from pipeline.logs.log import TEST, Log
from pipeline.machine.machine import MachineModel, drivetrains_of
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import load_robot_file
from pipeline.simulation.predict import Simulator
from tests.pipeline.identification import bench_leg as leg

NOISE = 0.02  # [N*m]
JOINT = "rm_joint_2"


@pytest.fixture(scope="module")
def model() -> MachineModel:
    """The leg by torques at its joints."""
    robot = load_robot(load_robot_file(leg.ROOT / "urdf" / "leg.toml"))
    return MachineModel(robot, drivetrains_of(Chain(""), robot.joints))


def log_of(model: MachineModel, more=lambda m: 0.0) -> Log:
    """A torque log with a torque more at one joint."""
    m = leg.leg_motion()
    m = replace(m, channels=("torque",), effort=m.effort[..., :1], noise=np.full((3, 1), NOISE))
    effort = Simulator(m).predict(model).effort
    effort = effort + NOISE * np.random.default_rng(4).standard_normal(effort.shape)
    effort[:, model.index(JOINT), 0] += more(m)
    return replace(m, effort=effort)


def tables(model: MachineModel, log: Log):
    return unnamed(model, make_data_sets([log]), log.noise, "log")


def test_a_clean_log_has_none(model):
    edits, rest = tables(model, log_of(model))
    assert edits == ()
    assert rest.empty


@pytest.mark.parametrize(
    ("kind", "law"),
    [
        ("angle", lambda m, q: 0.8 * np.sin(4.0 * q)),
        ("memory", lambda m, q: 0.5 * played(m.time, q, 0.1)),
    ],
)
def test_a_table_is_written_that_predicts_rows_without_a_say(model, kind, law):
    log = log_of(model, lambda m: law(m, m.q[:, model.index(JOINT)]))
    edits, rest = tables(model, log)
    rows = rest.set_index(["joint", "kind"])["share"]
    assert set(rest["joint"]) == {JOINT}
    assert rows[JOINT, kind] > 0.8
    better = Simulator(log).predict(apply_edits(model, edits)).effort
    test = (log.part == TEST) & log.mask[:, model.index(JOINT)]
    left = (log.effort - better)[test, model.index(JOINT), 0]
    assert np.sqrt(np.mean(left**2)) < 1.6 * NOISE


@pytest.mark.parametrize(("size", "told"), [(1.3, False), (3.0, True)])
def test_what_stays_within_what_is_called_noise_has_no_table(model, size, told):
    wave = size * NOISE
    log = log_of(model, lambda m: wave * np.sin(4.0 * m.q[:, model.index(JOINT)]))
    assert bool(tables(model, log)[0]) == told


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (lambda m, q: 0.2 * np.exp(-m.time / 3.0) * np.sign(m.v[:, 1]), "time, as friction does"),
        (lambda m, q: 0.2 * q * (m.part != TEST), "position"),
        (lambda m, q: 0.0 * q, ""),
    ],
)
def test_what_a_model_leaves_anywhere_is_told_by_what_it_depends_on(model, law, words):
    log = log_of(model, lambda m: law(m, m.q[:, model.index(JOINT)]))
    left = {r.joint: r.description for r in leg.left_by(model, [log])}
    assert f"depends on the {words}" in left[JOINT] if words else left[JOINT] == ""


def test_bodies_that_are_the_files_again_do_not_hold_a_payload_back(model):
    link, at = "rm_tibia_link", {"x": 0.1, "y": 0.05, "z": -0.1}
    mass = EFFECTS["link_mass"]
    log = log_of(mass.edit(model, (link,), {"mass": 0.5}, at))
    every = block_terms(model, Simulator(log).measured)
    terms = [t for t in every if isinstance(t.effect, BodyStrain)]
    design = make_design(model, make_data_sets([log]), [*terms, Term(mass, (link,), at)])
    loose = frozenset({f"body {link}"})
    first = replace(start_fit(design, np.full(3, NOISE)), loose=loose)
    found = near(settled(first), turns=3)
    (payload,) = [k for k, t in enumerate(found.design.terms) if not t.block]
    tied = settled(replace(found, names=(payload,), loose=frozenset(), negative=None))
    again = near(tied, turns=3)
    (k,) = again.names
    assert again.x[again.design.columns[k][0]] == pytest.approx(0.5, rel=0.02)


def test_a_play_is_pushed_as_far_as_it_goes_and_forgets_over_a_gap():
    q = np.array([0.0, 0.05, 0.2, 0.15, 0.0, 0.0])
    got = played(np.array([0.0, 0.1, 0.2, 0.3, 0.4, 9.0]), q, 0.1)
    np.testing.assert_allclose(got, [0.0, 0.5, 1.0, 0.5, -1.0, 0.0], atol=1e-12)


def test_at_rest_the_angle_shifts_what_holds_and_friction_widens_it():
    table = TorqueTable("t", angle=(0.0, 1.0), level=(0.0, 2.0), friction=(0.5, 0.5))
    zero = np.zeros(1)
    low, high = table.holding(zero, zero, np.array([0.5]))
    assert (low[0], high[0]) == (0.5, 1.5)


@pytest.mark.parametrize(
    ("lists", "words"),
    [
        ({"angle": (0.0, 0.0), "level": (1.0, 1.0)}, "angle must ascend"),
        ({"speed": (0.0, 1.0), "drag": (1.0,)}, "with one drag at each"),
        ({"radius": (0.0,), "memory": (1.0,)}, "radius must be positive"),
    ],
)
def test_lists_that_are_no_table_are_refused(lists, words):
    with pytest.raises(LegwattError, match=words):
        TorqueTable("t", **lists)
