"""Equations of motion along logs of robots that walk in another engine, and what models leave."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.dynamics.residual import EquationsOfMotion, body_columns
from pipeline.effects.base import EFFECTS
from pipeline.identification.design import Term, make_data_sets, make_design
from pipeline.logs.filters import LowPass
from pipeline.logs.log import Log
from pipeline.machine.machine import MachineModel
from pipeline.robot.robot import Robot
from pipeline.simulation import equations as module
from pipeline.simulation.equations import equations_of
from pipeline.simulation.predict import Simulator
from tests.pipeline.dynamics.walking_engine import EVERY, STEP, TORQUE_NOISE, walked
from tests.pipeline.identification.legs import KINDS, ROBOTS, log_of, robot_of

LOAD = (3.0, (0.12, 0.05, 0.0))
Logs = dict[str, tuple[MachineModel, Log]]


@pytest.fixture(scope="session")
def loaded(hexapod: Robot, tmp_path_factory: pytest.TempPathFactory) -> Logs:
    """The hexapod with a payload, by the kind of log."""
    walk = walked(hexapod, periods=(3.0, 3.4, 4.2, 2.6), payload=LOAD)
    folder = tmp_path_factory.mktemp("walks")
    return {kind: log_of("hexapod", hexapod, walk, kind, folder) for kind in KINDS}


def rows_of(model: MachineModel, m: Log) -> EquationsOfMotion:
    """Some samples at which the motion is known."""
    equations = equations_of(model, m)
    return equations.at(np.flatnonzero(equations.known)[::5])


def left_over(equations: EquationsOfMotion, load: tuple = (0.0, (0.0, 0.0, 0.0))) -> float:
    """Variance of the whitened residual with the payload put in, per independent equation."""
    mass, place = load
    truth = body_columns(equations.model, equations.motion)[..., :4]
    left = equations.whitened(equations.residual - truth @ [mass, *(mass * np.array(place))])
    W, feet, none = equations.whitening, equations.feet, equations.feet.precision == 0.0
    variance = np.where(none, 0.0, 1.0 / np.where(none, 1.0, feet.precision))
    covariance = equations.noise + np.einsum("nfi,nf,nfj->nij", feet.rows, variance, feet.rows)
    freedom = np.einsum("nij,njk,nik->", W, covariance, W, optimize=True)
    return float(np.sum(left**2) / freedom)


@pytest.mark.parametrize("kind", KINDS)
def test_payload_of_a_hexapod_that_walks(loaded, kind):
    """Its mass and place by least squares; force plates are taken to be coarser than they are."""
    equations = rows_of(*loaded[kind])
    X = equations.whitened(body_columns(equations.model, equations.motion)[..., :3])
    y = equations.whitened(equations.residual)
    mass, *moment = np.linalg.lstsq(X.reshape(-1, 3), y.ravel())[0]
    share, near = (0.05, 0.01) if kind != "neither" else (0.15, 0.03)
    assert mass == pytest.approx(3.0, rel=share)
    assert np.abs(moment / mass - [0.12, 0.05]).max() < near
    assert 0.6 < left_over(equations, LOAD) < 1.5


@pytest.mark.slow
@pytest.mark.parametrize("name", ["solo12", "anymal_c"])
def test_quadrupeds_that_walk(name, tmp_path):
    robot, (kp, size, periods) = robot_of(name), ROBOTS[name]
    walk = walked(robot, periods=periods[:3], kp=kp, noise=0.15 * size)
    for kind in KINDS:
        assert 0.45 < left_over(rows_of(*log_of(name, robot, walk, kind, tmp_path))) < 1.5


def test_two_feet_need_what_the_base_turns_by(loaded):
    model, m = loaded["flags"]
    standing = np.array(m.standing) & (np.arange(6) < 2)
    m = replace(m, standing=standing, base_roll=None, base_pitch=None)
    assert not equations_of(model, m).known.any()
    known = equations_of(model, replace(m, base_rate=np.zeros((len(m), 3)))).known
    assert known.any()
    assert not known[[0, -1]].any()  # beyond its ends no filter sees


@pytest.mark.parametrize(
    ("name", "value", "kind"),
    [("REACH", 0.1, "flags"), ("SOLE", 1e-6, "forces"), ("LEVEL", 1e-5, "neither")],
)
def test_thresholds_matter(loaded, name, value, kind, monkeypatch):
    """Each covers something that real feet and ground do."""
    own = left_over(rows_of(*loaded[kind]), LOAD)
    monkeypatch.setattr(module, name, value)
    assert left_over(rows_of(*loaded[kind]), LOAD) > 1.15 * own


def test_a_joint_without_torque_leaves_the_others(loaded):
    model, m = loaded["flags"]
    known = np.array(m.mask if m.known is None else m.known)
    known[:, 4] = False
    effort = m.effort.copy()
    effort[:, 4] = np.nan
    rows = rows_of(model, replace(m, known=known, effort=effort))
    assert 0.7 < left_over(rows, LOAD) < 1.5


def test_jumps_of_the_ground_s_forces_and_motion_are_no_noise(loaded):
    """A cut-off below what the motion reaches, and every other row sees a change of stance."""
    m = loaded["flags"][1]
    known = TORQUE_NOISE * LowPass(1.0 / (STEP * EVERY), m.bandwidth).gains[0]
    assert np.median(m.noise) == pytest.approx(known, rel=0.3)


PLACE = dict(zip("xyz", LOAD[1], strict=True))


@pytest.mark.parametrize("kind", KINDS)
def test_the_truth_leaves_noise_and_the_file_does_not(loaded, kind):
    model, m = loaded[kind]
    true = EFFECTS["link_mass"].edit(model, ("base_link",), {"mass": LOAD[0]}, PLACE)
    e = equations_of(model, m)
    noise = float(np.sqrt(np.diagonal(e.noise, axis1=1, axis2=2)[:, e.joints][m.mask].mean()))
    left = [
        float(np.sqrt(np.mean(Simulator(m).predict(one).rest[m.mask] ** 2)))
        for one in (true, model)
    ]
    assert left[0] < noise  # forces that fit best take some of it
    assert left[1] > 1.2 * left[0]  # forces within their noise take the most


@pytest.mark.parametrize("kind", KINDS)
def test_columns_are_changes_of_the_rows(loaded, kind):
    """A payload is found by least squares on a search's rows, its mass to some per cent."""
    model, m = loaded[kind]
    payload = Term(EFFECTS["link_mass"], ("base_link",), PLACE)
    design = make_design(model, make_data_sets([m]), [payload])
    base = design.equations[-6:]
    assert [e.joint - len(model.joints) for e in base] == list(range(6))
    X, r = np.concatenate([e.X[0] for e in base]), np.concatenate([e.r for e in base])
    assert X @ r / (X @ X) == pytest.approx(LOAD[0], rel=0.05 if kind != "neither" else 0.15)
    # Rows are in the joints' noise where they are whitened.
    assert np.std(r - X * LOAD[0]) < 2.0 * float(np.mean(m.noise))


def test_a_joint_s_law_is_a_column_at_its_leg_and_the_base(loaded):
    model, m = loaded["flags"]
    m = replace(m, sign=np.tanh(m.v / 0.05))
    place = (model.joints[1],)
    friction = Term(EFFECTS["coulomb_friction"], place)
    design = make_design(model, make_data_sets([m]), [friction])
    touched = [design.equations[k].joint for k in design.touched(0)]
    own = set(model.robot.chains.of(model.robot.chains.leg_of[1]).tolist())
    base = {len(model.joints) + k for k in range(6)}
    assert set(touched) <= own | base
    assert base & set(touched)


def test_what_is_left_is_in_the_sensor_s_unit(loaded):
    """A log that reads twice the torque, and a machine whose sensors do, leave twice as much."""
    model, m = loaded["flags"]
    joints = tuple(replace(a, gains={"torque": 2.0}) for a in model.actuators)
    drives = replace(model.drivetrains, joints=joints)
    doubled = replace(m, effort=2.0 * m.effort)
    left = []
    for machine, log in ((model, replace(m)), (replace(model, drivetrains=drives), doubled)):
        (data,) = make_data_sets([log])
        data.simulator.predict(machine)
        left.append(np.concatenate([rows.left for rows in data.left_by(machine)]))
    assert np.std(left[1]) == pytest.approx(2.0 * np.std(left[0]), rel=1e-6)


def test_masses_are_the_scale_where_no_force_is_measured(loaded):
    """All torques and all masses scaled alike leave the same: no gain of all columns competes."""
    gain, every = EFFECTS["effort_gain"], ("*__torque_Nm",)
    places = {k: gain.places(loaded[k][0], Simulator(loaded[k][1]).measured) for k in KINDS}
    assert {k: every in own for k, own in places.items()} == {
        "forces": True,
        "flags": False,
        "neither": False,
    }
