"""A payload as a finding: with the bodies beside it, the machine that the regression fitted."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.identification.whole.findings import bodies, payload
from pipeline.machine.machine import MachineModel, machine_of_urdf
from pipeline.regression.laws.bodies import parameters, with_parameters
from pipeline.regression.laws.payload import Payload
from tests.pipeline.identification.whole.test_beside import SEEN, dynamics, effort
from tests.pipeline.identification.whole.test_whole_machine import urdf


@pytest.fixture(scope="module")
def machine(tmp_path_factory: pytest.TempPathFactory) -> MachineModel:
    robot = tmp_path_factory.mktemp("arm") / "arm.urdf"
    robot.write_text(urdf(), encoding="utf-8")
    return machine_of_urdf(Path(robot))


def fitted(machine: MachineModel, weight: Payload) -> SimpleNamespace:
    """Bodies one per cent heavier than the URDF's, the last of which carries something."""
    ten = 1.01 * parameters(machine.rigid)
    ten[10 * weight.body : 10 * weight.body + 10] += weight.parameters
    return SimpleNamespace(
        refit=True,
        model=machine.rigid,
        bodies=ten,
        bodies_half=0.1 * np.abs(ten),
        refit_share=1.0,
        loaded=weight,
    )


def test_bodies_and_payload_together_are_the_machine_that_was_fitted(machine) -> None:
    weight = Payload(2, 0.7, np.array([0.03, -0.02, 0.2]), 0.02, np.full(3, 0.01))
    result = fitted(machine, weight)
    told = [*bodies(result, machine, {}), *payload(result, machine)]
    assert [t.effect for t in told] == ["rigid_body_parameters", "link_mass"]
    (member,) = told[1].members
    assert member.values["mass"] == pytest.approx(0.7)
    assert (member.values["x"], member.values["z"]) == (pytest.approx(0.03), pytest.approx(0.2))
    own = told[0].members[2].values["mass"]
    assert own == pytest.approx(1.01 * float(machine.rigid.inertias[3].mass))
    whole = with_parameters(machine.rigid, result.bodies)
    expected = dynamics(SimpleNamespace(rigid=whole), SEEN.q, SEEN.v, SEEN.a)  # type: ignore[arg-type]
    np.testing.assert_allclose(effort(machine, told), expected, atol=1e-8)


def test_a_payload_without_which_the_link_would_be_no_body_stays_in_the_body(machine) -> None:
    weight = Payload(2, 0.7, np.array([0.03, -0.02, 0.2]), 0.02, np.full(3, 0.01))
    result = fitted(machine, weight)
    result.bodies[20:30] = 1.01 * parameters(machine.rigid)[20:30] + 0.5 * weight.parameters
    result.loaded = Payload(2, 40.0, weight.place, 0.02, np.full(3, 0.01))
    told = bodies(result, machine, {})
    assert payload(result, machine) == []
    assert told[0].members[2].values["mass"] == pytest.approx(result.bodies[20])
