"""What models leave along logs of a robot on legs, the ground's forces unknown or measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.effects.base import EFFECTS
from pipeline.identification.design import Term, make_data_sets, make_design
from pipeline.simulation.equations import equations_of
from pipeline.simulation.predict import Simulator
from tests.pipeline.identification.legs import KINDS
from tests.pipeline.simulation.test_equations import LOAD, Logs, loaded

__all__ = ["loaded"]

PLACE = dict(zip("xyz", LOAD[1], strict=True))


@pytest.mark.parametrize("kind", KINDS)
def test_the_truth_leaves_noise_and_the_file_does_not(loaded: Logs, kind: str) -> None:
    model, m = loaded[kind]
    true = EFFECTS["link_mass"].edit(model, ("base_link",), {"mass": LOAD[0]}, PLACE)
    e = equations_of(model, m)
    noise = float(np.sqrt(np.diagonal(e.noise, axis1=1, axis2=2)[:, e.joints][m.mask].mean()))
    left = [
        float(np.sqrt(np.mean(Simulator(m).predict(one).rest[m.mask] ** 2)))  # type: ignore[index]
        for one in (true, model)
    ]
    assert left[0] < noise  # forces that fit best take some of it
    assert left[1] > (1.3 if kind == "neither" else 1.6) * left[0]


@pytest.mark.parametrize("kind", KINDS)
def test_columns_are_changes_of_the_rows(loaded: Logs, kind: str) -> None:
    """A payload is found by least squares on a search's rows, its mass to some per cent."""
    model, m = loaded[kind]
    payload = Term(EFFECTS["link_mass"], ("base_link",), PLACE)
    design = make_design(model, make_data_sets([m]), [payload])
    base = design.equations[-1]
    assert base.joint == len(model.joints)
    X, r = base.X[0], base.r
    assert X @ r / (X @ X) == pytest.approx(LOAD[0], rel=0.05 if kind != "neither" else 0.15)
    # Rows are in the joints' noise where they are whitened.
    assert np.std(r - X * LOAD[0]) < 2.0 * float(np.mean(m.noise))


def test_a_joint_s_law_is_a_column_at_its_leg_and_the_base(loaded: Logs) -> None:
    model, m = loaded["flags"]
    m = replace(m, sign=np.tanh(m.v / 0.05))
    place = (model.joints[1],)
    friction = Term(EFFECTS["coulomb_friction"], place)
    design = make_design(model, make_data_sets([m]), [friction])
    touched = [design.equations[k].joint for k in design.touched(0)]
    own = set(model.robot.chains.of(model.robot.chains.leg_of[1]).tolist())
    assert set(touched) <= own | {len(model.joints)}
    assert len(model.joints) in touched


def test_what_is_left_is_in_the_sensor_s_unit(loaded: Logs) -> None:
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


def test_masses_are_the_scale_where_no_force_is_measured(loaded: Logs) -> None:
    """All torques and all masses scaled alike leave the same: no gain of all columns competes."""
    places = {k: EFFECTS["effort_gain"].places(*loaded[k]) for k in KINDS}
    every = ("*__torque_Nm",)
    assert {k: every in own for k, own in places.items()} == {
        "forces": True,
        "flags": False,
        "neither": False,
    }
